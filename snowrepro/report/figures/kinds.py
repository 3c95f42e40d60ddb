"""What a figure or study declares, and how it is found: by the name of its module, which an experiment's file gives.

Every module of this folder with a constant ``FIGURE`` is one; ``picture: strip`` in ``experiments/fig5.yaml`` means
``strip.py``.
"""

import importlib
import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...errors import ConfigError
from ...settings.case import Case
from ...settings.question import Experiment
from ...store.run import Run

if TYPE_CHECKING:  # whether a plan has anything to simulate is asked of this module, before any result is read
    from ...evidence.gather import Evidence
    from ..document import FigureContent


@dataclass(frozen=True)
class FigureKind:
    """One kind of figure.

    ``report``: the function that draws it into the evidence's folder and returns what its section shows.
    ``needs_runs``: whether it shows results, and not just what would be run.  ``is_judged``: whether the paper's claims
    are judged by its runs.  ``needs``: settings of the experiment that it requires.  ``frames``: how many it shows;
    None: any number.  ``takes_indenter``: whether its runs may be hardness tests.
    """

    report: Callable[["Evidence"], "FigureContent"]
    needs_runs: bool = True
    is_judged: bool = False
    needs: tuple[str, ...] = ()
    frames: int | None = None
    takes_indenter: bool = False


def list_figure_names() -> list[str]:
    """List the names that ``picture`` can have."""
    folder = importlib.import_module(__package__).__path__
    return sorted(module.name for module in pkgutil.iter_modules(folder) if module.name != "kinds")


def find_figure(experiment: Experiment) -> FigureKind:
    """Find the figure that an experiment draws.  Raises ConfigError if there is none of that name."""
    if experiment.picture not in list_figure_names():
        known = ", ".join(list_figure_names())
        raise ConfigError(f"experiment.picture: there is no '{experiment.picture}'; there are: {known}")
    return importlib.import_module(f".{experiment.picture}", __package__).FIGURE


def needs_runs(runs: Sequence[Run]) -> bool:
    """Whether anything is to be simulated for these runs; not for a figure that shows only what would be run."""
    experiment = runs[0].config.question.experiment if runs else None
    return bool(runs) and (experiment is None or find_figure(experiment).needs_runs)


def require_drawable(runs: Sequence[Run]) -> None:
    """Check that the runs' experiment can be drawn from them.  Raises ConfigError if not."""
    experiment = runs[0].config.question.experiment if runs else None
    if experiment is None:
        return
    figure, picture = find_figure(experiment), experiment.picture
    for name in figure.needs:
        if not getattr(experiment, name):
            raise ConfigError(f"experiment: a {picture} needs {name}")
    if figure.frames is not None and len(experiment.frames) != figure.frames:
        raise ConfigError(f"experiment.frames: a {picture} needs {figure.frames} (got {len(experiment.frames)})")
    if not figure.takes_indenter and any(run.case.indenter for run in runs):
        raise ConfigError(f"a {picture} shows snow that falls: it takes no indenter")
    for run in runs:
        _require_stored(run.case, experiment.frames)


def _require_stored(case: Case, frames: Sequence[int]) -> None:
    """Raises ConfigError if a run of ``case`` will not store one of the frames."""
    lost = [frame for frame in frames if not case.is_stored(frame)]
    if lost:
        raise ConfigError(
            f"experiment.frames {lost} are not stored: frames up to {case.frames} are that are multiples of "
            f"output.every ({case.output.every}), and the release in frame {case.loading.press_frames}"
        )
