"""The map: lump, crushed and loose snow over impact number and press number, and where the paper's claims hold."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from contourpy import contour_generator
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...evidence.calibration import HALF
from ...evidence.choices import BY_BOTH, BY_LUMPS, count_holding, judge_choices, list_judged
from ...evidence.gather import Evidence
from ...evidence.map import (
    IMPACT,
    LUMPS,
    PLACE,
    PRESS,
    READINGS,
    STATES,
    ImpactMap,
    has_failed,
    place_readings,
    share_choices,
    sum_core_hours,
    tabulate_failures,
    tabulate_map,
)
from ...settings.case import ARMS
from ...settings.question import Claim
from ...store import states
from ...sweep.plan import make_plan
from ...text import make_cells
from ..document import NO_RESULT, Block, FigureContent, Fold, Heading, Picture, Table, escape, join_names
from ..drawing.common import choose_font, save_figure
from ..sections.claims import format_bracket
from .kinds import FigureKind

MAP, REGION = "map.png", "region.png"
CSV, CHOICES = "map.csv", "choices.csv"
PRESSED = "fig5"  # the experiment whose pressures the readings are marked at
TITLES = dict(zip(STATES, ("in lumps", "crushed", "loose"), strict=True))
ARM_WORDS = dict(zip(ARMS, ("with sintering", "without sintering"), strict=True))
SHADES, SHARES = "viridis", "Blues"  # of parts of the mass, and of choices
NONE, UNKNOWN = "#f3e3d3", "white"  # of no choice, and of choices that are not known
HATCHED: dict[str, Any] = {"edgecolor": "0.45", "linewidth": 0.0}
FAILED, MISSING = {**HATCHED, "facecolor": "#f4c7c3", "hatch": "xxx"}, {**HATCHED, "facecolor": "white", "hatch": "..."}
MARKERS = ("o", "s", "^", "v", "D")  # of the readings
MARK: dict[str, Any] = {"color": "black", "mfc": "white", "mew": 0.9, "lw": 0.8, "ms": 4.5}
HALF_LINE: dict[str, Any] = {"color": "#D55E00", "linewidth": 2.2}


def report(evidence: Evidence) -> FigureContent:
    """Draw the map and where the claims hold, and tabulate both, failures and costs."""
    if evidence.table.empty:
        return NO_RESULT
    claims = evidence.runs[0].config.question.claims
    mapped = tabulate_map(evidence.sweep)
    choices = judge_choices(claims, mapped.table, PLACE)
    for table, name in ((mapped.table, CSV), (choices, CHOICES)):
        make_cells(table).to_csv(evidence.folder / name, index=False, float_format="%.6g", lineterminator="\n")
    pressures = find_figure_pressures()
    readings = place_readings(pressures)
    draw_map(mapped, readings, evidence.folder / MAP)
    draw_region(mapped, choices, readings, evidence.folder / REGION)
    marked = f"{', '.join(f'{pressure:g}' for pressure in pressures)} {evidence.pressure_unit}"
    blocks: list[Block] = [
        describe_runs(mapped.table),
        _describe_map(marked),
        *_show_failures(mapped.table),
        Heading("Where the claims hold"),
        _describe_region(list_judged(claims)),
        Table(tabulate_rows(mapped, choices, list_judged(claims)), _explain_rows(evidence), CHOICES),
    ]
    return FigureContent(blocks, write_verdict(mapped, choices, float(readings[IMPACT].iloc[0])))


def find_figure_pressures() -> list[float]:
    """Find the pressures of Figure 5, at which readings are marked on the map."""
    return sorted({run.case.pressure for run in make_plan([f"experiment={PRESSED}"], multirun=True).runs})


def describe_runs(table: pd.DataFrame) -> str:
    """Say how many runs have a result, failed or were not run, how many still changed at their end, and their cost."""
    done, failed = int((table["state"] == states.DONE).sum()), int(has_failed(table).sum())
    unsettled = int((table["settled"].dropna().astype(float) == 0).sum())
    rest = len(table) - done - failed
    return (
        f"{len(table)} runs: {done} with a result, {failed} failed, {rest} not run yet. {unsettled} still changed when "
        f"they ended. Those with a result took {sum_core_hours(table):.3g} core-hours."
    )


def write_verdict(mapped: ImpactMap, choices: pd.DataFrame, default: float) -> str:
    """Say on each floor at which impact numbers all claims can hold.  ``default``: that of the default reading."""
    done = int((mapped.table["state"] == states.DONE).sum())
    parts = []
    for name in (BY_LUMPS, BY_BOTH):
        shares = share_choices(mapped, choices, name)
        holds = (shares > 0).any(axis=1)[shares.notna().any(axis=1)]  # where any choice is known
        on_floors = [
            f"on {floor} at {_format_impacts(holds[holds.index.get_level_values(0) == floor].droplevel(0), default)}"
            for floor in mapped.floors
        ]
        parts.append(f"{name} {join_names(on_floors, 'and')}")
    return (
        f"With three pressures chosen at each impact number, all claims can hold {'; '.join(parts)}. "
        f"{done} of {len(mapped.table)} runs have a result."
    )


def _format_impacts(holds: pd.Series, default: float) -> str:
    """Format at which of the known impact numbers something holds, and whether the default reading's is among them."""
    if holds.empty:
        return "no impact number, as no choice is known"
    found, where = holds.index[holds], np.flatnonzero(holds)
    if found.empty:
        return f"none of {len(holds)} impact numbers"
    numbers = [f"{impact:.2g}" for impact in found]
    is_range = len(found) > 2 and bool((np.diff(where) == 1).all())
    listed = f"{numbers[0]} to {numbers[-1]}" if is_range else join_names(numbers, "and")
    own = holds[np.isclose(holds.index, default)]
    default_words = f", {'with' if own.any() else 'without'} the default's" if len(own) else ""
    return f"{len(found)} of {len(holds)} ({listed}{default_words})"


def tabulate_rows(mapped: ImpactMap, choices: pd.DataFrame, claims: Sequence[Claim]) -> pd.DataFrame:
    """Tabulate for each floor and impact number P50 and how many choices of pressures agree with the claims."""
    rows = []
    for (floor, impact), own in choices.groupby(list(PLACE), sort=False):
        halves = {ARM_WORDS[arm]: mapped.bracket_half(str(floor), arm, float(impact)) for arm in ARMS}
        never = [claim.name for claim in claims if own[claim.name].eq(False).fillna(False).all()]
        rows.append(
            {
                "floor": escape(floor), "impact number": f"{impact:.2g}",
                **{f"P50 {words}": half.note or format_bracket(half) for words, half in halves.items()},
                **{f"choices {name}": count_holding(own[name]) for name in (BY_LUMPS, BY_BOTH)},
                "held by no choice": escape(", ".join(never)) or "-",
            }
        )  # fmt: skip
    return pd.DataFrame(rows)


def _show_failures(table: pd.DataFrame) -> list[Block]:
    """Show which runs failed, by cause, and where; nothing if none did."""
    failures = tabulate_failures(table)
    if failures.empty:
        return []
    caption = "Runs that failed, by cause, with the range of the numbers at which they did."
    return [
        Fold(
            f"{int(failures['runs'].sum())} runs failed",
            [Table(failures.map(escape).rename(columns=lambda name: name.replace("_", " ")), caption, CSV)],
        )
    ]


def _describe_map(marked: str) -> Picture:
    """Describe the picture of the three states.  ``marked``: the pressures at which readings are marked."""
    return Picture(
        MAP,
        "Three columns of panels, mass in lumps, crushed and loose, over press number and impact number, with a row "
        "for each floor and arm; a curve where half is in lumps; marks where readings lie.",
        "A cell is a run: the part of the mass in each state at the end. Press number P / E0, impact number ρ g H / "
        "E0, both logarithmic. The curve is where half is in lumps, found between runs by the logarithms of both "
        "numbers; a piece of it shorter than a cell is not drawn. Crossed: the run failed, which is an outcome; "
        "dotted: not run. Marks: readings of the "
        f"paper at the pressures of Figure 5, {marked}: the default, which has legacy Taichi's default gravity; SI "
        "units; and what legacy Taichi's early examples and scripts make likely. A mark of another height of fall or "
        "of SI units lies where its two numbers are; the drop in body sizes, or the time that waves take through the "
        "body, is then not that of the runs around it.",
        data=CSV,
    )


def _describe_region(claims: Sequence[Claim]) -> Picture:
    """Describe the picture of where the claims hold."""
    return Picture(
        REGION,
        "For each floor, over press number and impact number, which part of the choices of three pressures agrees with "
        "all claims, by lumps and by loose snow too.",
        f"Of all three of the pressures run at an impact number, a cell's own among them: the part that agrees with "
        f"{join_names([claim.name for claim in claims if claim.measure == LUMPS], 'and')} (left), and with "
        f"{join_names([claim.name for claim in claims if claim.measure != LUMPS], 'and')} too (right). So the "
        "pressures are chosen anew at each impact number, in favour of the paper. Choices with a run that has no "
        "result are left out. The curve is P50 of sintered snow. The numbers of one seed agree or disagree; they prove "
        "nothing.",
        data=CHOICES,
    )


def _explain_rows(evidence: Evidence) -> str:
    """Explain the table of impact numbers."""
    return (
        f"P50: between which pressures run [{evidence.pressure_unit}] half of the mass is in lumps. Choices: of three "
        "pressures of those run, how many agree with all claims, of those whose runs are there. Held by no choice: "
        "claims that the numbers of every three pressures disagree with."
    )


def draw_map(mapped: ImpactMap, readings: pd.DataFrame, path: Path) -> None:
    """Draw a row of panels for each floor and arm, a panel for each state."""
    rows = [(floor, arm) for floor in mapped.floors for arm in ARMS]
    size = (9.6, 2.5 * len(rows) + 1.3)
    letters = choose_font(size[0])
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(rows), len(STATES), squeeze=False, sharex=True, sharey=True)
    for axes, (floor, arm) in zip(grid, rows, strict=True):
        for ax, state in zip(axes, STATES, strict=True):
            shown = _draw_cells(ax, mapped.spread(floor, arm, state), SHADES)
            _finish_panel(ax, mapped, (floor, arm), readings, letters)
        axes[0].set_ylabel(f"{floor}, {ARM_WORDS[arm]}", fontsize=letters)
    for ax, state in zip(grid[0], STATES, strict=True):
        ax.set_title(TITLES[state], fontsize=letters + 1)
    _add_scale(figure, grid, shown, "part of the mass", letters)
    _name_axes(figure, grid, letters)
    _add_legend(figure, [*_list_marks(), *_list_outcomes(mapped)], letters)
    save_figure(figure, path)


def draw_region(mapped: ImpactMap, choices: pd.DataFrame, readings: pd.DataFrame, path: Path) -> None:
    """Draw a row of panels for each floor: the part of the choices that agree, by lumps and by loose snow too."""
    size = (9.6, 2.9 * len(mapped.floors) + 1.5)
    letters = choose_font(size[0])
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(mapped.floors), 2, squeeze=False, sharex=True, sharey=True)
    shades = mpl.colormaps[SHARES].with_extremes(under=NONE)
    for axes, floor in zip(grid, mapped.floors, strict=True):
        lumps = mapped.spread(floor, ARMS[0], LUMPS)
        for ax, name in zip(axes, (BY_LUMPS, BY_BOTH), strict=True):
            shares = share_choices(mapped, choices, name).loc[floor].set_axis(lumps.columns, axis=1)
            shown = _draw_cells(ax, shares.where(shares != 0, -1.0), shades)
            _finish_panel(ax, mapped, (floor, ARMS[0]), readings, letters)
            ax.set_title(f"ball on {floor}: {name}", fontsize=letters + 1)
    _add_scale(figure, grid, shown, "part of the choices", letters)
    _name_axes(figure, grid, letters)
    patches = [
        Patch(facecolor=colour, edgecolor="0.5", lw=0.5, label=label)
        for colour, label in ((NONE, "no choice"), (UNKNOWN, "not known"))
    ]
    sintered = ImpactMap(mapped.table[mapped.table["arm"] == ARMS[0]])
    _add_legend(figure, [*patches, *_list_marks(), *_list_outcomes(sintered)], letters)
    save_figure(figure, path)


def _finish_panel(ax: Axes, mapped: ImpactMap, place: tuple[str, str], readings: pd.DataFrame, letters: float) -> None:
    """Draw what all panels of a floor and arm have: cells without a result, P50 and the readings."""
    _hatch(ax, mapped, *place)
    _draw_half(ax, mapped.spread(*place, LUMPS))
    for marker, (_, own) in zip(MARKERS, readings.groupby("reading", sort=False), strict=True):
        ax.plot(own[PRESS], own[IMPACT], color="white", lw=3 * MARK["lw"])
        ax.plot(own[PRESS], own[IMPACT], marker=marker, **MARK)
    ax.tick_params(labelsize=letters)


def _draw_cells(ax: Axes, values: pd.DataFrame, shades: str | Colormap) -> QuadMesh:
    """Draw values (impact number, press number) from 0 to 1 as cells on logarithmic axes."""
    edges = [_find_edges(axis.to_numpy(float)) for axis in (values.columns, values.index)]
    ax.set(xscale="log", yscale="log", facecolor="white")
    ax.minorticks_off()  # which take most of the time of drawing
    return ax.pcolormesh(*edges, np.ma.masked_invalid(values), cmap=shades, vmin=0, vmax=1, lw=0.3, edgecolor="w")


def _find_edges(centres: np.ndarray) -> np.ndarray:
    """Find the edges of cells around rising centres, half way on a logarithmic axis; of one, a factor of 2 wide."""
    logs = np.log(centres)
    if len(logs) == 1:
        return np.exp(logs[0] + np.array([-0.5, 0.5]) * np.log(2.0))
    middle = (logs[1:] + logs[:-1]) / 2
    return np.exp([2 * logs[0] - middle[0], *middle, 2 * logs[-1] - middle[-1]])


def _hatch(ax: Axes, mapped: ImpactMap, floor: str, arm: str) -> None:
    """Hatch the cells without a result: differently where the run failed, and where it was not run."""
    values, failed = mapped.spread(floor, arm, LUMPS), mapped.spread_failures(floor, arm).to_numpy()
    x, y = (_find_edges(axis.to_numpy(float)) for axis in (values.columns, values.index))
    for row, column in np.argwhere(values.isna().to_numpy()):
        style = FAILED if failed[row, column] else MISSING
        corners = x[[column, column + 1]], y[row], y[row + 1]
        ax.fill_between(*corners, **style)


def _draw_half(ax: Axes, lumps: pd.DataFrame) -> None:
    """Draw the curve on which half of the mass is in lumps, if there is one; a runs' gap is a gap in it.

    What is shorter than a cell is left out: a corner that is half in lumps within a few hundredths.
    """
    values = lumps.to_numpy(float)
    if min(lumps.shape) < 2 or not (lumps.min().min() < HALF < lumps.max().max()):
        return
    columns, rows = np.log(lumps.columns.to_numpy(float)), np.log(lumps.index.to_numpy(float))
    cell = np.ptp(columns) / (len(columns) - 1), np.ptp(rows) / (len(rows) - 1)
    lines: list[Any] = list(contour_generator(columns, rows, np.ma.masked_invalid(values)).lines(HALF))
    for curve in (line for line in lines if (np.ptp(line, axis=0) >= cell).any()):
        ax.plot(*np.exp(curve.T), color="white", linewidth=2.0 * HALF_LINE["linewidth"])
        ax.plot(*np.exp(curve.T), **HALF_LINE)


def _list_marks() -> list[Line2D | Patch]:
    """List what stands for the curve of P50 and for each reading in a legend."""
    marks = [Line2D([], [], marker=marker, label=name, **MARK) for name, marker in zip(READINGS, MARKERS, strict=True)]
    return [Line2D([], [], label="half in lumps (P50)", **HALF_LINE), *marks]


def _list_outcomes(mapped: ImpactMap) -> list[Patch]:
    """List what stands in a legend for runs without a result, as far as there are any."""
    failed = has_failed(mapped.table)
    missing = (mapped.table["state"] != states.DONE) & ~failed
    shown = [(failed, FAILED, "failed"), (missing, MISSING, "not run")]
    return [Patch(label=label, **style) for these, style, label in shown if these.any()]


def _add_scale(figure: Figure, grid: np.ndarray, shown: QuadMesh, label: str, letters: float) -> None:
    """Add the scale of the cells to the right of all panels."""
    bar = figure.colorbar(shown, ax=grid, location="right", shrink=0.5, aspect=30)
    bar.set_label(label, fontsize=letters)
    bar.ax.tick_params(labelsize=letters)


def _name_axes(figure: Figure, grid: np.ndarray, letters: float) -> None:
    """Name the axes of all panels."""
    for ax in grid[-1]:
        ax.set_xlabel("press number, P / E0", fontsize=letters)
    figure.supylabel("impact number, ρ g H / E0", fontsize=letters)


def _add_legend(figure: Figure, handles: Sequence[Line2D | Patch], letters: float) -> None:
    """Add a legend below all panels."""
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False, fontsize=letters)


FIGURE = FigureKind(report)
