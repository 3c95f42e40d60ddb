"""What matters in a sample: indices of each setting with their intervals, and where runs fail."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...evidence.collect import CollectedSweep
from ...evidence.influence import (
    EFFECT,
    FAILED,
    FIRST,
    SPREAD,
    TOTAL,
    Influence,
    measure_influence,
    read_measure,
    tabulate_failures,
)
from ...evidence.margins import list_margins
from ...text import make_cells
from ..document import Block, Fold, Heading, Picture, Table, escape, format_code, join_names
from ..drawing.columns import escape_label, label_column, list_measures
from ..drawing.common import save_figure
from ..drawing.plot import PALETTE

MOST_ROWS = 8  # settings of a panel; of more, all measures are columns of one table that is drawn
PICTURE, CSV, FAILURES = "influence.png", "influence.csv", "failures.csv"
MEANINGS = {
    FIRST: "first order: the part of its variance that goes with this setting alone; near 0 and below: nothing seen",
    TOTAL: "total order: the part that would stay if only this setting varied further, alone or together with others",
    EFFECT: "mean effect: by how much a step over the whole range of the setting changes it, without sign, on average",
    SPREAD: "spread of effects: their standard deviation; large where the effect depends on other settings",
}


IN_PANELS = "Bars: intervals of 95 % by bootstrap."
IN_MATRIX = (
    "Numbers stand where the whole interval of 95 %, by bootstrap, is above 0. White: a setting is the same in all of "
    "these runs. The settings that matter most to the claims, or else to the measures, come first."
)


def make_blocks(sweep: CollectedSweep, folder: Path) -> list[Block]:
    """Measure the influence of what was sampled on the main measures, write it into a folder, and show it."""
    failed = [FAILED] if len(tabulate_failed(sweep)) else []
    measures = [*list_measures(sweep), *list_margins(sweep), *failed]
    return show_influences(sweep, [measure_influence(sweep, measure) for measure in measures], folder)


def tabulate_failed(sweep: CollectedSweep) -> pd.DataFrame:
    """Tabulate where runs fail; empty if none did."""
    table = tabulate_failures(sweep)
    return table if table["failed"].any() else table.iloc[:0]


def show_influences(sweep: CollectedSweep, influences: Sequence[Influence], folder: Path) -> list[Block]:
    """Write influence.csv, influence.png and failures.csv into a folder; returns what a report shows of them."""
    table = pd.concat([each.table for each in influences], ignore_index=True) if influences else pd.DataFrame()
    blocks: list[Block] = [Heading("What matters")]
    if len(table):
        make_cells(table).to_csv(folder / CSV, index=False, float_format="%.6g", lineterminator="\n")
        kinds = list(dict.fromkeys(table["index"]))
        is_long = kinds == [FIRST] and len(table["setting"].unique()) > MOST_ROWS
        draw = draw_matrix if is_long else draw_influences
        draw(sweep, [each for each in influences if len(each.table)], folder / PICTURE)
        caption = "; ".join(MEANINGS[kind] for kind in kinds)
        picture = f"{caption[0].upper()}{caption[1:]}. {IN_MATRIX if is_long else IN_PANELS}"
        names = join_names([describe_measure(sweep, each.measure) for each in influences if len(each.table)], "and")
        blocks += [
            Picture(PICTURE, f"Influence of each setting on {names}.", picture, data=CSV),
            Fold("The numbers", [Table(_format_rows(sweep, table), data=CSV)]),
        ]
    blocks += [f"{escape(line)}" for line in describe_gaps(sweep, influences)]
    return [*blocks, *_list_mixed(influences), *_show_failures(sweep, folder)]


def _list_mixed(influences: Sequence[Influence]) -> list[Block]:
    """List what the runs do not tell apart, folded away; nothing if they tell all."""
    others: dict[str, dict[str, None]] = {}
    for one, other in (pair for each in influences for pair in each.mixed):
        others.setdefault(one, {})[other] = None
    rows = [(format_code(one), ", ".join(map(format_code, found))) for one, found in others.items()]
    table = pd.DataFrame(rows, columns=["setting", "is not told from"])
    return [Fold("What the runs do not tell apart", [Table(table)])] if rows else []


def describe_measure(sweep: CollectedSweep, measure: str) -> str:
    """Describe a measure in few words."""
    if measure in list_margins(sweep):
        return f"margin of {measure}"
    return "whether a run fails" if measure == FAILED else label_column(sweep, measure)


def describe_gaps(sweep: CollectedSweep, influences: Sequence[Influence]) -> list[str]:
    """Say of which measures nothing is known and why, how many runs have no value, and how often claims hold."""
    lines = [f"Of {describe_measure(sweep, each.measure)}: {each.note}." for each in influences if each.note]
    margins = list_margins(sweep)
    measured = [each for each in influences if each.measure != FAILED and not each.note]
    counts = {each.used: each.runs for each in measured if each.measure not in margins}
    lines += [f"{runs - used} of {runs} runs have no value." for used, runs in counts.items() if used < runs]
    if mixed := {one for each in influences for one, _ in each.mixed}:
        lines.append(
            f"The runs with a value do not tell {join_names(sorted(mixed), 'and')} from all others, alone or in "
            "pairs: what is said to go with these may go with those. More points, or another design, would."
        )
    asked = [each.measure for each in influences]
    agreement = describe_agreement(sweep, [name for name in margins if name in asked])
    return [*lines, agreement] if agreement else lines


def describe_agreement(sweep: CollectedSweep, claims: Sequence[str]) -> str:
    """Say at how many points the numbers agree with claims; empty if no point has all runs that one needs."""
    held = {name: read_measure(sweep, name).dropna() > 0 for name in claims}
    counts = [f"{name} at {agree.sum()} of {len(agree)}" for name, agree in held.items() if len(agree)]
    return (
        f"The numbers agree with {join_names(counts, 'and')} points where all runs that it needs have a result."
        if counts
        else ""
    )


def describe_region(failures: pd.DataFrame) -> str:
    """Say where runs fail most often, in a sentence.  ``failures``: of ``tabulate_failures``, some of which failed."""
    worst = failures.loc[failures["share"].idxmax()]
    first = failures["setting"] == failures["setting"].iloc[0]  # the parts of one setting hold all runs
    runs, failed = int(failures.loc[first, "runs"].sum()), int(failures.loc[first, "failed"].sum())
    return (
        f"{failed} of {runs} runs failed; most often, {worst['failed']} of {worst['runs']}, where "
        f"{worst['setting']} is {worst['part']}."
    )


def draw_influences(sweep: CollectedSweep, influences: Sequence[Influence], path: Path) -> None:
    """Draw a panel for each measure and unit: a bar for each setting and index, the most influential setting first."""
    panels = [
        (each, kinds)
        for each in influences
        for kinds in ((FIRST, TOTAL), (EFFECT, SPREAD))
        if each.table["index"].isin(kinds).any()
    ]
    columns = min(len(panels), 2)
    rows = -(-len(panels) // columns)
    settings = max(len(each.table["setting"].unique()) for each, _ in panels)
    figure = Figure(figsize=(4.0 * columns, rows * (0.34 * settings + 1.1) + 0.4), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax in axes[len(panels) :]:
        ax.set_visible(False)
    for ax, (influence, kinds) in zip(axes, panels, strict=False):
        _draw_panel(ax, influence.table[influence.table["index"].isin(kinds)])
        title = describe_measure(sweep, influence.measure)
        ax.set_title(textwrap.fill(escape_label(title), 42), fontsize=10)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=2, frameon=False, fontsize=9)
    save_figure(figure, path)


def draw_matrix(sweep: CollectedSweep, influences: Sequence[Influence], path: Path) -> None:
    """Draw the first order of many settings as a table: a row for each setting, a column for each measure."""
    table = pd.concat([each.table for each in influences])
    values, lows = (table.pivot_table(index="setting", columns="measure", values=name) for name in ("value", "low"))
    names = [each.measure for each in influences]
    telling = [name for name in names if name in list_margins(sweep)] or names
    order = values[telling].clip(lower=0).mean(axis=1).sort_values(ascending=False).index
    values, lows = values.loc[order, names], lows.loc[order, names]
    figure = Figure(figsize=(0.62 * len(names) + 3.2, 0.3 * len(order) + 2.2), layout="constrained")
    ax = figure.subplots()
    shares = values.to_numpy()
    mesh = ax.pcolormesh(shares, vmin=0.0, vmax=1.0, cmap="Oranges", edgecolors="white", lw=1)
    for row, column in zip(*np.nonzero((lows > 0).to_numpy()), strict=True):
        share = shares[row, column]
        colour = "white" if share > 0.6 else "black"
        ax.text(column + 0.5, row + 0.5, f"{share:.2f}", ha="center", va="center", fontsize=9, color=colour)
    ax.set_yticks(np.arange(len(order)) + 0.5, [escape_label(name) for name in order], fontsize=9)
    titles = [textwrap.fill(escape_label(describe_measure(sweep, name)), 22) for name in names]
    ax.set_xticks(np.arange(len(names)) + 0.5, titles, fontsize=9, rotation=90)
    ax.xaxis.tick_top()
    ax.invert_yaxis()
    ax.tick_params(length=0)
    figure.colorbar(mesh, ax=ax, label="first order", shrink=0.6)
    save_figure(figure, path)


def _draw_panel(ax: Axes, table: pd.DataFrame) -> None:
    """Draw the indices of a measure, as dots with their intervals."""
    kinds = list(dict.fromkeys(table["index"]))
    order = table[table["index"] == kinds[-1]].sort_values("value")["setting"].tolist()
    for number, kind in enumerate(kinds):
        rows = table[table["index"] == kind].set_index("setting").loc[order]
        places = np.arange(len(order)) - 0.25 * (number - (len(kinds) - 1) / 2)
        ax.errorbar(
            rows["value"], places, xerr=[rows["value"] - rows["low"], rows["high"] - rows["value"]], fmt="o",
            color=PALETTE[2 * number], ms=5, lw=1.4, label=kind,
        )  # fmt: skip
    ax.axvline(0, color="0.5", lw=0.8)
    ax.set_yticks(range(len(order)), [escape_label(name) for name in order], fontsize=9)
    ax.tick_params(axis="x", labelsize=9)
    ax.grid(axis="x", color="0.92", lw=0.6)


def _format_rows(sweep: CollectedSweep, table: pd.DataFrame) -> pd.DataFrame:
    """Write the indices for a page: numbers in three digits, settings as one types them."""
    return pd.DataFrame(
        {
            "measure": [escape(describe_measure(sweep, measure)) for measure in table["measure"]],
            "setting": [format_code(setting) for setting in table["setting"]],
            "index": table["index"],
            "value": [f"{value:.3g}" for value in table["value"]],
            "95 %": [f"{low:.3g} to {high:.3g}" for low, high in table[["low", "high"]].to_numpy()],
        }
    )


def _show_failures(sweep: CollectedSweep, folder: Path) -> list[Block]:
    """Show where runs fail: a sentence, and a table; nothing if none did."""
    failures = tabulate_failed(sweep)
    if failures.empty:
        return []
    make_cells(failures).to_csv(folder / FAILURES, index=False, float_format="%.6g", lineterminator="\n")
    shown = failures.assign(
        setting=[format_code(setting) for setting in failures["setting"]],
        part=[escape(part) for part in failures["part"]],
        share=[f"{share:.2f}" for share in failures["share"]],
    )
    return [escape(describe_region(failures)), Fold("Where runs fail", [Table(shown, data=FAILURES)])]
