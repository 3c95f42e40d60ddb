"""The report on the whole paper: its figures and tables in their order, then what they rest on."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..config import Config
from ..store import runs
from ..sweep.plan import make_plan
from ..sweep.record import asked, name_of, with_asked_seeds
from . import choices
from .document import Section, code, plain
from .evidence import redo
from .page import Part, draw, write_page, write_page_of

TITLE = "Snow Simulation Considering Pressure Sintering: a reproduction"
# The paper's own in its order, then studies of what they rest on.
EXPERIMENTS = (
    "fig2", "fig3", "fig4", "table1", "table2", "fig5", "fig6", "grid",
    "laws", "calibration", "readings", "convergence", "energy", "hardness",
)  # fmt: skip


@dataclass(frozen=True)
class Asked:
    """An experiment of the report: its runs, as far as they were asked for."""

    overrides: tuple[str, ...]
    configs: Sequence[Config]

    @property
    def is_drawn(self) -> bool:
        """Whether there is something to show: a study that nobody asked for is only named."""
        config = self.configs[0]
        needed = config.experiment is not None and config.experiment.needs_runs
        return not needed or bool(asked(self.overrides, config.store)) or all(map(runs.is_done, self.configs))


def write_paper(overrides: Sequence[str], store: str) -> Path:
    """Report on all of the paper's experiments from the store alone; returns the page.

    ``overrides`` hold for each of them.  Raises ConfigError, StoreError.
    """
    found = [_asked([f"experiment={name}", *overrides], store) for name in EXPERIMENTS]
    parts = [draw(a.configs, a.overrides) if a.is_drawn else _named(a) for a in found]
    register = choices.section(overrides, store)
    for part in parts:
        if isinstance(part, Part):
            write_page_of(part, [register] if part.evidence.experiment.is_judged else ())
    folder = Path(found[0].configs[0].reports) / name_of(["experiment=paper", *overrides])
    return write_page(TITLE, parts, folder, [register])


def _asked(overrides: Sequence[str], store: str) -> Asked:
    seeded = with_asked_seeds(overrides, store)
    return Asked(tuple(seeded), make_plan(seeded, multirun=False).configs)


def _named(found: Asked) -> Section:
    """An experiment that was not run."""
    experiment = found.configs[0].experiment
    assert experiment is not None
    text = f"**Not run.** {code(redo(found.overrides))} makes its {len(found.configs)} runs and fills this section."
    return Section(experiment.name, plain(experiment.title), [text], plain(experiment.says))
