"""Whether preview fidelity ranks runs, and what matters, as the paper's fidelity does.

    snowrepro run experiment=unprinted
    snowrepro run experiment=unprinted design.points=16 fidelity=paper 'fidelity.dx=log(0.7,1.4)'
    python benchmarks/fidelity.py [--store FOLDER] [--write]

Reads the first 16 points of experiment=unprinted at both fidelities, each with cells from 0.7 to 1.4 of its own, and
compares them by Spearman's rank correlation.  Runs nothing.  --write: also to benchmarks/fidelity.md.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import spearmanr
from tables import format_table

from snowrepro.evidence.collect import CollectedSweep, collect_sweep
from snowrepro.evidence.influence import FAILED, FIRST, measure_influence, read_measure
from snowrepro.evidence.margins import list_margins
from snowrepro.sweep.plan import make_plan

RESULTS = Path(__file__).with_name("fidelity.md")
POINTS = 16
COARSE = ["experiment=unprinted", f"design.points={POINTS}"]
FINE = [*COARSE, "fidelity=paper", "fidelity.dx=log(0.7,1.4)"]
MEASURES = ("lump_fraction", "crushed_fraction", "loose_fraction", FAILED)
LEAST = 6  # pairs of values that a rank correlation is given for


def main() -> None:
    """Compare the two fidelities, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--store", default="runs")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    coarse, fine = (
        collect_sweep(make_plan([*words, f"store={arguments.store}"], multirun=True)) for words in (COARSE, FINE)
    )
    measures = [*MEASURES, *list_margins(coarse)]
    head = ["measure", "pairs", "Spearman, values", "Spearman, first orders", "most at preview", "most at paper"]
    lines = format_table(head, [compare(coarse, fine, measure) for measure in measures])
    page = "\n".join([*describe(coarse, fine), "", *lines]) + "\n"
    print(page)
    if arguments.write:
        RESULTS.write_text(page, encoding="utf-8")


def describe(coarse: CollectedSweep, fine: CollectedSweep) -> list[str]:
    """Say what is compared, and how many runs have a result."""
    done = [int((sweep.table["state"] == "done").sum()) for sweep in (coarse, fine)]
    text = (
        f"`python benchmarks/fidelity.py`: the first {POINTS} points of `experiment=unprinted`, {len(coarse.table)} "
        f"runs at each. With a result: {done[0]} at preview, {done[1]} at the paper's. Values: of runs, or of the "
        "margins of claims at points, that both have. First orders: of the settings, from all values of each; with so "
        "few points they are hints."
    )
    return ["# Preview beside the paper's fidelity", "", text]


def compare(coarse: CollectedSweep, fine: CollectedSweep, measure: str) -> list[str]:
    """Make the row of a measure: pairs of values, rank correlations, and the setting that matters most at each."""
    pairs = pd.DataFrame({"coarse": read_measure(coarse, measure), "fine": read_measure(fine, measure)}).dropna()
    orders = [measure_influence(sweep, measure).table for sweep in (coarse, fine)]
    tops, settings = [], pd.DataFrame()
    for table in orders:
        first = table[table["index"] == FIRST].set_index("setting")["value"]
        tops.append(f"{first.idxmax()} ({first.max():.2f})" if len(first) else "-")
        settings = pd.concat([settings, first], axis=1)
    return [measure, str(len(pairs)), correlate(pairs), correlate(settings.dropna()), *tops]


def correlate(pairs: pd.DataFrame) -> str:
    """Format Spearman's correlation of two columns; a dash where there are too few, or nothing differs."""
    if pairs.shape[1] < 2 or len(pairs) < LEAST or (pairs.nunique() < 2).any():
        return "-"
    value = spearmanr(pairs.iloc[:, 0], pairs.iloc[:, 1]).statistic
    return "-" if np.isnan(value) else f"{value:.2f}"


if __name__ == "__main__":
    main()
