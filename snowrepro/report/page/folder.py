"""The folder of an experiment's report."""

from collections.abc import Sequence
from pathlib import Path

from ...store.run import Run
from ...sweep.record import name_without_seeds


def find_report_folder(run: Run, overrides: Sequence[str]) -> Path:
    """Find the folder of an experiment's report; it is named like the sweep, but without seeds.

    ``run``: any of the experiment's runs; ``overrides``: those of the sweep.
    """
    experiment = run.config.question.experiment
    assert experiment is not None, "only an experiment has a report"
    others = [override for override in overrides if not override.startswith("experiment=")]
    return Path(run.config.question.reports) / name_without_seeds([f"experiment={experiment.name}", *others])
