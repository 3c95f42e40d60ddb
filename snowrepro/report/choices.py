"""The section on what the paper leaves open, from whatever runs there are under other choices."""

from collections.abc import Sequence
from pathlib import Path

from ..sweep.plan import make_plan
from ..sweep.record import asked
from . import register
from .document import Section, code
from .evidence import gathered, redo
from .variants import Comparison, compared

# Experiments that change one choice of Figure 5 at a time, from the same base.
STUDIES = ("readings", "convergence")
BASE = "fig5"


def section(overrides: Sequence[str], store: str) -> Section:
    """The register of choices; ``overrides``, but for experiment and seeds, hold for every experiment."""
    overrides = [o for o in overrides if not o.startswith(("experiment=", "seed="))]
    comparisons, text = [], []
    for name in STUDIES:
        words = [f"experiment={name}", *overrides]
        if asked(words, store):
            comparisons.append(_compared(words))
        else:
            text.append(f"Not run: {code(redo(words))}.")
    config = make_plan([f"experiment={BASE}", *overrides], multirun=True).configs[0]
    first = comparisons[0] if comparisons else _compared([f"experiment={BASE}", *overrides])
    others = [variant for comparison in comparisons[1:] for variant in comparison.changed]
    blocks = [*register.section(Comparison([*first.variants, *others]), config), *text]
    return Section("choices", "What the paper leaves open", blocks)


def _compared(overrides: Sequence[str]) -> Comparison:
    plan = make_plan(overrides, multirun=True)
    return compared(gathered(plan.configs, Path(plan.configs[0].reports)))
