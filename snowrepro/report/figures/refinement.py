"""A figure on coarser and finer grids: each measure over the width of a cell, and the snow at the end."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...evidence.gather import Evidence, sort_as_in_paper
from ...evidence.refinement import MEASURES, PARTS, SHARES, Refinement, Trend, follow_setting
from ...evidence.variants import format_setting
from ...settings.case import ARMS
from ...store.run import Run
from ...text import make_cells
from ..document import NO_RESULT, Block, FigureContent, Picture, Table, escape
from ..drawing.common import save_figure
from ..drawing.ends import draw_ends, read_end
from ..sections.claims import format_half_pressure
from ..sections.variants import read_words
from .kinds import FigureKind

PANEL = 2.3  # width of a panel of snow [inches]
COLOURS = ("#56B4E9", "#E69F00", "#D55E00", "#009E73", "#CC79A7")  # of the pressures, rising
LINES = {"sintered": ("o", "-"), "unsintered": ("x", ":")}  # marker and line of an arm
WANTED = 0.05  # of a share, between the two finest grids: the aim


def report(evidence: Evidence) -> FigureContent:
    """Tabulate and draw what the measures do as the grid is refined, and show the snow on each grid."""
    if evidence.table.empty:
        return NO_RESULT
    choices = follow_setting(evidence)
    rows = [row for choice in choices for row in _make_rows(choice)]
    make_cells(pd.DataFrame(rows)).to_csv(
        evidence.folder / "refinement.csv", index=False, float_format="%.6g", lineterminator="\n"
    )
    draw_trends(choices[0], evidence)
    _draw_ends(evidence)
    shown = pd.DataFrame([_make_shown_row(choice, *key) for choice in choices for key in choice.trends])
    halves = pd.DataFrame([_make_half_row(choice) for choice in choices])
    blocks: list[Block] = [
        Picture(
            "refinement.png",
            "The parts of the mass in each state, and the height lost, over the width of a cell: a line for each "
            "pressure, with and without sintering.",
            "Over the width of a cell, finer to the right: the parts of the mass that are lump, crushed and loose, and "
            "the part of its height that the body lost. A colour for each pressure; dots and lines with sintering, "
            f"crosses and dotted lines without. Pressures in {evidence.pressure_unit}.",
            data="refinement.csv",
        ),
        _make_picture_of_ends(evidence),
        Table(
            shown,
            "Means over the seeds on each grid, by width of a cell, and what the last two steps say. With an order: "
            "the value extrapolated to no width, and its band, by Roache's rule for three grids.",
            "refinement.csv",
        ),
        Table(
            halves,
            f"Between which pressures [{evidence.pressure_unit}] half of the sintered snow is in lumps, by width of a "
            "cell.",
        ),
    ]
    return FigureContent(blocks, _summarise(choices))


def _list_shares(choice: Refinement) -> list[tuple[tuple[str, float, str], Trend]]:
    """List the trends of the shares of mass that were run on the two finest grids, by arm, pressure and measure."""
    return [
        (key, trend)
        for key, trend in choice.trends.items()
        if key[2] in SHARES and trend.steps and not math.isnan(trend.steps[-1])
    ]


def _summarise(choices: Sequence[Refinement]) -> str:
    """Say how far shares move between the two finest grids, and which of them do not converge."""
    parts = []
    for choice in choices:
        shares = _list_shares(choice)
        if not shares:
            continue
        (arm, pressure, measure), trend = max(shares, key=lambda item: abs(item[1].steps[-1]))
        far = sum(abs(its.steps[-1]) > WANTED for _, its in shares)
        open_ended = sum(its.outcome == "do not shrink" for _, its in shares)
        coarse, fine = trend.levels[-2:]
        parts.append(
            f"{describe_changes(choice.changes)}: from cells of {coarse:g} to {fine:g}, {far} of {len(shares)} shares "
            f"of the mass move by more than {WANTED:g}, most {MEASURES[measure]} at {pressure:g}, {arm} "
            f"({trend.steps[-1]:+.2f}); {open_ended} do not converge by their steps."
        )
    return " ".join(parts) or "No share was run on two grids."


def describe_changes(changes: Mapping[str, object]) -> str:
    """Describe changes of Figure 5, value by key, in words where there are some."""
    if not changes:
        return "As in Figure 5"
    name = ", ".join(f"{key}={format_setting(value)}" for key, value in changes.items())
    return read_words().get(name, name)


def _make_rows(choice: Refinement) -> Iterator[dict[str, Any]]:
    """Make the rows of a refinement's trends, in numbers."""
    for (arm, pressure, measure), trend in choice.trends.items():
        yield {
            "choices": describe_changes(choice.changes), "sintering": arm, "pressure": pressure, "measure": measure,
            **make_numbers(trend, "dx"),
        }  # fmt: skip


def make_numbers(trend: Trend, setting: str) -> dict[str, Any]:
    """Make the part of a row that has the numbers of a trend; ``setting``: the short name of what falls along it."""
    limit, band = trend.limit
    return {
        **{f"{setting}={level:g}": value for level, value in zip(trend.levels, trend.values, strict=True)},
        **{f"step to {level:g}": step for level, step in zip(trend.levels[1:], trend.steps, strict=True)},
        "seeds differ by": trend.spread, "order": trend.order, "limit": limit, "band": band, "words": trend.words,
    }  # fmt: skip


def format_values(trend: Trend, digits: str) -> list[str]:
    """Format the values of a trend, level by level."""
    return ["not run" if math.isnan(value) else f"{value:{digits}}" for value in trend.values]


def format_steps(trend: Trend, digits: str) -> str:
    """Format the steps of a trend."""
    return ", ".join("-" if math.isnan(step) else f"{step:+{digits}}" for step in trend.steps)


def _make_shown_row(choice: Refinement, arm: str, pressure: float, measure: str) -> dict[str, Any]:
    """Make the row of a trend as a page shows it."""
    trend = choice.trends[arm, pressure, measure]
    digits = ".2f" if measure in PARTS else ".4g"
    return {
        "choices": escape(describe_changes(choice.changes)),
        "sintering": "with" if arm == ARMS[0] else "without",
        "pressure": f"{pressure:g}",
        "measure": MEASURES[measure],
        **{f"{dx:g}": value for dx, value in zip(trend.levels, format_values(trend, digits), strict=True)},
        "seeds differ by": "one seed" if math.isnan(trend.spread) else f"{trend.spread:{digits}}",
        "steps": format_steps(trend, digits),
        "what they say": trend.words,
    }


def _make_half_row(choice: Refinement) -> dict[str, str]:
    """Make the row of where half is in lumps, by grid."""
    halves = {f"{dx:g}": escape(format_half_pressure(half)) for dx, half in choice.halves.items()}
    return {"choices": escape(describe_changes(choice.changes)), **halves}


def draw_trends(choice: Refinement, evidence: Evidence) -> None:
    """Draw each share and the height lost over the width of a cell, a panel each."""
    figure = Figure(figsize=(9.2, 3.0), layout="constrained")
    axes = figure.subplots(1, len(PARTS), sharey=True)
    pressures = sorted({pressure for _, pressure, _ in choice.trends})
    for ax, measure in zip(axes, PARTS, strict=True):
        for pressure, colour in zip(pressures, COLOURS, strict=False):
            for arm, (marker, line) in LINES.items():
                trend = choice.trends[arm, pressure, measure]
                label = f"{pressure:g}, {'with' if arm == ARMS[0] else 'without'}"
                ax.plot(trend.levels, trend.values, marker + line, color=colour, label=label, ms=4, lw=1)
        set_axis_of_spacing(ax, MEASURES[measure], trend.levels)
    axes[0].set(ylim=(-0.03, 1.03), ylabel="part of the mass, or of the height")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=8)
    save_figure(figure, evidence.folder / "refinement.png")


def set_axis_of_spacing(ax: Axes, title: str, spacings: Sequence[float]) -> None:
    """Set the title of a panel and its axis of spacings, finer to the right."""
    ax.set(title=title, xscale="log", xlabel="width of a cell [paper's cells]")
    ax.set_xticks(spacings, [f"{dx:g}" for dx in spacings])
    ax.minorticks_off()
    ax.invert_xaxis()


def _list_grids(evidence: Evidence) -> list[float]:
    """List the widths of a cell, from coarse to fine."""
    return sorted({run.case.fidelity.dx for run in evidence.runs}, reverse=True)


def _make_picture_of_ends(evidence: Evidence) -> Picture:
    """Make the picture of the snow at the end, which is drawn already."""
    grids = ", ".join(f"{dx:g}" for dx in _list_grids(evidence))
    return Picture(
        "ends.png",
        "The last frame of each run by what became of the snow: a row for each pressure, a column for each grid.",
        f"Last frame, seed {evidence.seeds[0]}; cells of {grids} of the paper's. Each lump in a colour, crushed snow "
        "dark, loose snow the colour of sand.",
        data="summary.csv",
    )


def _draw_ends(evidence: Evidence) -> None:
    """Draw the snow at the end of the runs without other choices: a row a pressure, a column a grid."""
    shown = {
        (f"{run.case.pressure:g}\n{run.case.arm}", _name_grid(run.case.fidelity.dx)): read_end(
            run, evidence.is_done(run)
        )
        for run in _choose_shown(evidence)
    }
    rows, columns = list(dict.fromkeys(row for row, _ in shown)), [_name_grid(dx) for dx in _list_grids(evidence)]
    draw_ends(shown, rows, columns, PANEL, evidence.folder / "ends.png")


def _name_grid(dx: float) -> str:
    """Name a grid by the width of its cells."""
    return f"cells of {dx:g}"


def _choose_shown(evidence: Evidence) -> list[Run]:
    """Choose the runs of the first seed whose choices, but for the grid, are those of the first run."""
    first = {key: value for key, value in evidence.runs[0].case if key != "fidelity"}
    alike = ("shape", "floor", "sintering", "pressure")
    return [
        run
        for run in sort_as_in_paper(evidence.first_seed_runs)
        if all(value == first[key] for key, value in run.case if key in first and key not in alike)
    ]


FIGURE = FigureKind(report)
