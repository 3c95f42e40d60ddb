"""What the paper leaves open: nothing forgotten, and the right words for what other choices did."""

from functools import cache, reduce
from pathlib import Path

import pandas as pd
import pytest

from snowrepro.composition.compose import compose
from snowrepro.evidence import claims
from snowrepro.evidence.gather import Evidence
from snowrepro.evidence.variants import Comparison, Variant, compare_variants
from snowrepro.report.document import Table
from snowrepro.report.sections import register
from snowrepro.report.sections.variants import describe_change
from snowrepro.settings.case import ARMS, Reading
from snowrepro.store.run import Run
from snowrepro.summary.row import ARM
from snowrepro.sweep.plan import make_plan

BASE = Run(compose())
PRESSURES = (340.0, 530.0, 3300.0)


def variant(changes, lumps=(), loose=0.01, others=()):
    """Three runs with sintering and three without; ``lumps`` are those with, None where there is no result."""
    rows = [(arm, p, value) for arm, values in zip(ARMS, (lumps, [loose] * len(lumps)), strict=True)
            for p, value in zip(PRESSURES, values, strict=False)]  # fmt: skip
    table = pd.DataFrame(rows, columns=[ARM, "pressure", "lump_fraction"]).assign(seed=0)
    table["loose_fraction"] = 1 - table["lump_fraction"]
    done = table.dropna()
    missing = [(row.arm, row.pressure) for row in table[table["lump_fraction"].isna()].itertuples()]
    return Variant(
        changes, PRESSURES, done, claims.judge_claims(BASE.config.question.claims, done, missing=missing), others
    )


SEEDS = (variant({}, (0.20, 0.50, 0.80)), variant({"seed": 1}, (0.25, 0.55, 0.90)))


def row_of(choice, *variants):
    """The register's row of a choice, by what the variants gave."""
    table = register.make_blocks(Comparison([*SEEDS, *variants]), BASE)[1]
    assert isinstance(table, Table)
    return table.frame.set_index("choice").loc[choice]


def test_every_switch_of_the_reading_is_registered_and_no_other_key():
    keys = [key for entry in register.read_entries() for key in entry.keys]
    assert len(keys) == len(set(keys))
    for key in keys:
        reduce(getattr, key.split("."), BASE.case)
    switches = {key.removeprefix("reading.") for key in keys if key.startswith("reading.")}
    assert switches == set(Reading.model_fields) - {"name"}


@cache
def compare_unrun(study: str) -> tuple[Run, Comparison]:
    """The base of a study, and its variants, of which nothing was run yet; planned once, as it takes long."""
    plan = make_plan([f"experiment={study}", "pressure=340", "sintering=paper", "store=nowhere"], False)
    missing = frozenset(run.id for run in plan.runs)
    return plan.runs[0], compare_variants(
        Evidence(plan.experiment, plan.runs, pd.DataFrame(), Path("nowhere"), missing)
    )


def test_every_switch_is_tried_otherwise_by_the_experiment():
    """Each in at least one variant, and each variant tests an entry; nothing was run yet."""
    base, comparison = compare_unrun("readings")
    assert comparison.base.name == "base"
    changed = [set(v.changes) for v in comparison.changed_variants]
    assert {f"reading.{name}" for name in Reading.model_fields} - {"reading.name"} <= set.union(*changed)
    keys = {key for entry in register.read_entries() for key in entry.keys}
    assert all(keys & names for names in changed)
    sentence, table = register.make_blocks(comparison, base)
    assert sentence.startswith("**Not tried here**") and "moves a claim" not in sentence
    assert (table.frame["what they do to Figure 5"] == "-").all()


@pytest.mark.parametrize(
    ("lumps", "loose", "others", "told"),
    [
        ((0.22, 0.52, 0.85), 0.0, (), "keeps all; lumps as among the seeds"),
        ((0.20, 0.50, 0.80), 0.0, (), "keeps all; the very same lumps"),
        ((0.22, 0.52, 0.97), 0.0, (), "keeps all; lumps +0.07 beyond the seeds at 3300"),
        ((0.22, 0.16, 0.45), 0.0, (), "**loses C1 C3 C5**; lumps -0.35 beyond the seeds at 3300"),
        ((0.22, 0.52, 0.85), 0.6, (), "**loses C4 C4-loose**; lumps as among the seeds"),
        (
            (0.22, 0.52, None), 0.0, ("timed out",),
            "keeps C2 C2-loose C4 C4-loose; C1 C3 C5 not judged, as runs are missing (1 timed out); "
            "lumps as among the seeds",
        ),
        ((), 0.0, ("failed",) * 6, "C1 C2 C2-loose C3 C4 C4-loose C5 not judged, as runs are missing (6 failed)"),
        ((), 0.0, ("pending",) * 6, "-"),
    ],
)  # fmt: skip
def test_what_another_choice_does_is_told(lumps, loose, others, told):
    """Kept, lost, failed, never run."""
    row = row_of("Gravity", variant({"reading.gravity": 20.0}, lumps, loose, others))
    assert row["what they do to Figure 5"] == told
    assert row["alternatives tried"] == ("not tried" if told == "-" else "`reading.gravity=20.0`")
    assert row["here"].startswith("`reading.gravity=10.0`: Legacy Taichi")


def test_several_alternatives_are_told_apart_and_the_untried_named():
    """Each under its value; what runs elsewhere is not called untried; a key of two entries counts in both."""
    shell = variant({"reading.press": "shell"}, (0.6, 0.7, 0.8))
    sides = variant({"reading.press": "two_sides"}, (0.2, 0.52, 0.8))
    often = variant({"reading.cadence": "substep", "reading.hardening_growth": "per_time"}, (0.2, 0.52, 0.8))
    row = row_of("How the snow is pressed", shell, sides)
    assert row["alternatives tried"] == "`reading.press=shell`, `reading.press=two_sides`"
    assert row["what they do to Figure 5"].startswith(
        "`shell`: **loses C2 C2-loose**; lumps +0.35 beyond the seeds at 340. `two"
    )
    assert row_of("Bound of density", shell)["alternatives tried"] == "not tried"
    assert row_of("Definition of a lump", shell)["alternatives tried"].startswith("five rules")
    for choice in ("How often the laws act", "Eq. 9 has no time step"):
        assert row_of(choice, often)["what they do to Figure 5"].startswith("keeps")
    sentence = register.make_blocks(Comparison([*SEEDS, shell, sides, often]), BASE)[0]
    assert "3 were also made otherwise on Figure 5; a claim is moved by How the snow is pressed." in sentence


def test_a_base_that_lacks_a_claim_can_gain_it():
    base = variant({}, (0.6, 0.7, 0.8))
    better = variant({"reading.friction": 0.3}, (0.2, 0.7, 0.8))
    assert register.describe_effect(better, Comparison([base, better])).startswith("**gains C2 C2-loose**")


def test_without_the_figure_itself_other_choices_say_nothing():
    """Neither that lumps are as among the seeds, nor that no claim is moved."""
    tried = variant({"reading.friction": 0.3}, (0.2, 0.5, 0.8))
    comparison = Comparison([variant({}, others=("pending",) * 6), tried])
    assert register.describe_effect(tried, comparison).endswith("nothing to compare with")
    assert register.make_blocks(comparison, BASE)[0].startswith("**Not tried here**")


def test_texts_fit_into_a_table():
    assert not [e.name for e in register.read_entries() if "|" in e.paper + e.here + e.elsewhere]


@pytest.mark.parametrize("study", ["readings", "convergence"])
def test_every_variant_of_a_study_has_words(study):
    """So that no page shows raw settings."""
    found = compare_unrun(study)[1].changed_variants
    assert [variant.name for variant in found if describe_change(variant.changes) == variant.name] == []
