"""The section on what the paper leaves open, from the runs that were made under other choices."""

from collections.abc import Sequence
from pathlib import Path

from ...composition import experiments
from ...evidence.gather import command_to_repeat, gather_evidence
from ...evidence.variants import Comparison, compare_variants
from ...sweep.plan import make_plan
from ...sweep.record import find_records
from ..document import Section, format_code
from . import register


def make_section(overrides: Sequence[str], store: str) -> Section:
    """Make the section with the register of choices.

    ``overrides`` hold for every experiment, except for those that name an experiment or seeds.
    """
    overrides = [o for o in overrides if not o.startswith(("experiment=", "seed="))]
    comparisons, text = [], []
    studies = experiments.studies()
    for name in studies:
        study = [f"experiment={name}", *overrides]
        if find_records(study, store):
            comparisons.append(_compare_study(study))
        else:
            text.append(f"Not run: {format_code(command_to_repeat(study))}.")
    base = [f"experiment={next(iter(studies.values()))}", *overrides]
    run = make_plan(base, multirun=True).runs[0]
    first = comparisons[0] if comparisons else _compare_study(base)
    others = [variant for comparison in comparisons[1:] for variant in comparison.changed_variants]
    blocks = [*register.make_blocks(Comparison([*first.variants, *others]), run), *text]
    return Section("choices", "What the paper leaves open", blocks)


def _compare_study(overrides: Sequence[str]) -> Comparison:
    """Compare the variants of a study."""
    plan = make_plan(overrides, multirun=True)
    return compare_variants(gather_evidence(plan.runs, Path(plan.runs[0].config.question.reports)))
