"""The scenes of the runs of a plan, each tried once before any run."""

from ..scene.build import build_scene, check_size
from ..settings.case import Case
from ..sweep.plan import Plan


def build_scenes(plan: Plan) -> None:
    """Build each different scene of a plan's runs once.  Raises ConfigError where one cannot be."""
    for case in _list_scenes(plan):
        build_scene(case)


def check_sizes(plan: Plan) -> None:
    """Count what each different scene of a plan's runs takes.  Raises ConfigError where that is too much."""
    for case in _list_scenes(plan):
        check_size(case)


def _list_scenes(plan: Plan) -> list[Case]:
    """A case of each different scene."""
    cases = [run.case for run in plan.runs]
    scenes = {(c.shape, c.floor, c.fidelity, c.reading, c.indenter, c.loading, c.output): c for c in cases}
    return list(scenes.values())
