"""Laws left out: what is told of them, from tables whose answer is known."""

import numpy as np
import pandas as pd
import pytest

from snowrepro.evidence.ablation import MEASURES, Ablation, split_variants, tabulate_ablation
from snowrepro.evidence.collect import CollectedSweep
from snowrepro.report.figures.ablation import _describe, name_variant

LUMPS = {  # variant: mass in lumps of three seeds
    "base": (0.78, 0.80, 0.82),
    "no_C4": (0.0, 0.0, 0.01),
    "no_C2": (0.79, 0.81, 0.80),
    "no_C1": (0.60, 0.61, 0.62),
    "no_C5": (0.70, 0.71, 0.79),
    "only_C4": (0.90, 0.91, 0.92),
    "no_eq2": (np.nan, np.nan, np.nan),
}


@pytest.fixture
def ablation() -> Ablation:
    rows = [
        {"variant": variant, "pressure": 5900.0, "seed": seed, **dict.fromkeys(MEASURES, 0.1), "lump_fraction": lumps}
        for variant, values in LUMPS.items()
        for seed, lumps in enumerate(values)
    ]
    return tabulate_ablation(CollectedSweep("mine", (), pd.DataFrame(rows), (), {"variant": "variant"}, {}, "cell", {}))


def test_the_table_has_means_and_ranges(ablation):
    row = ablation.row("no_C1", 5900)
    assert row["lump_fraction"] == pytest.approx(0.61) and (row["least"], row["most"]) == (0.60, 0.62)
    assert (row["done"], row["asked"]) == (3, 3) and ablation.row("no_eq2", 5900)["done"] == 0
    assert ablation.variants == list(LUMPS) and ablation.whole == "base" and ablation.pressures == [5900]


def test_variants_are_split_by_what_they_do(ablation):
    """Seeds that lie among those of the whole are no change, and no result is not known."""
    split = split_variants(ablation, [name for name in LUMPS if name.startswith("no_")], 5900)
    assert split == {
        "halved": ["no_C4"],
        "less": ["no_C1"],
        "more": [],
        "same": ["no_C2", "no_C5"],
        "unknown": ["no_eq2"],
    }
    assert split_variants(ablation, ["only_C4"], 5900)["more"] == ["only_C4"]


def test_the_verdict_is_made_of_the_numbers(ablation):
    assert _describe(ablation, 5900) == (
        "At 5900 all laws leave 0.80 of the mass in lumps: without C₄ (0.00) half or more of it is gone; without C₁ "
        "(0.61) it is less; nothing changes without C₂ or C₅; not known without Eq. 2; alone, C₄ (0.91)."
    )
    assert name_variant("no_eq9") == "without Eq. 9 (hardening)" and name_variant("mine") == "mine"
