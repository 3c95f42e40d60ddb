"""Columns of a sweep's table drawn against each other: runs as points, and lines through the means over seeds."""

import math
import textwrap
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator, ScalarFormatter

from ...errors import ConfigError
from ...evidence.collect import CollectedSweep, collect_sweep
from ...store import states
from ...store.files import published
from ...sweep import record
from ...text import quote
from .columns import choose_colour, escape_label, find_column, is_number, label_column, list_steered, read_values
from .common import DPI, SINTERED, UNSINTERED, own_style

PALETTE = (SINTERED, UNSINTERED, "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7f4f24")
ALONE, NO_VALUE = "#307a78", "0.8"  # colours: where there is one for all, and of points without a value
ALPHA = 0.75  # of points, which may lie on each other
MOST_NAMED = 8  # values with a colour of their own in the legend; of more numbers there is a scale
MOST_PANELS = 24
COLUMNS = 3  # of panels
MOST_DECADES = 2.0  # of a logarithmic axis with ticks between powers of ten
LEAST_GAP = 0.13  # between ticks, part of the axis
FORMATS = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}  # and what is not written
# Same drawing, same bytes; text in a PDF stays text.
SAVED: dict[Any, Any] = {"svg.hashsalt": "snowrepro", "pdf.fonttype": 42}
# Columns that are parts of a whole, whose axis shows all of it.
PARTS = frozenset(
    ("lump_fraction", "crushed_fraction", "loose_fraction", "powder_fraction", "vanished", "largest_fragment",
     "median_mass", "joined_chance", "broken_bonds", "second_moment", "lumps_by_strain", "lumps_by_bonds",
     "lumps_by_proximity", "lumps_by_grid", "lumps_by_damage", "largest_seen")
)  # fmt: skip


@dataclass(frozen=True)
class Roles:
    """Which column of a sweep is drawn as what; an empty name: none.  ``log``: the axes with a logarithmic scale."""

    x: str
    y: str
    colour: str = ""
    panel: str = ""
    log: str = ""


def collect_remembered(name: str, store: str | Path, more: Sequence[str] = ()) -> CollectedSweep:
    """Collect the table of a remembered sweep.  ``more``: further overrides.  Raises ConfigError."""
    return collect_sweep(record.plan_remembered(name, store, more))


def assign_roles(
    sweep: CollectedSweep, x: str = "", y: str = "", colour: str = "", panel: str = "", log: str = ""
) -> Roles:
    """Assign the columns of given names, and usual ones where none is given.  Raises ConfigError."""
    x = find_column(sweep, x) if x else list_steered(sweep)[0]
    y = find_column(sweep, y) if y else ("lump_fraction" if "lump_fraction" in sweep.columns else "hardness")
    colour, panel = (find_column(sweep, name) if name else "" for name in (colour, panel))
    colour = colour or choose_colour(sweep, x, panel)
    wrong = sorted(set(log) - set("xy"))
    if wrong:
        raise ConfigError(f"log: should be x, y or xy (got {quote(log)})")
    return Roles(x, y, colour, panel, log)


@own_style()
def draw_columns(sweep: CollectedSweep, roles: Roles) -> Figure:
    """Draw the columns that ``roles`` name, and a note on runs without a value.  Raises ConfigError if none has one."""
    points = make_points(sweep, roles)
    _require_drawable(sweep, roles, points)
    colours = choose_colours(points["colour"])
    panels = list(points.groupby("panel", sort=points["panel"].dtype == float))
    if len(panels) > MOST_PANELS:
        raise ConfigError(f"panel: '{roles.panel}' has {len(panels)} values, and may have {MOST_PANELS}")
    figure, grid = _make_grid(len(panels), shared=True)
    for ax, (value, part) in zip(grid, panels, strict=True):
        draw_points(ax, part, colours, choose_mark(sweep, roles))
        set_scales(ax, sweep, roles)
        if roles.panel:
            ax.set_title(f"{sweep.key_of(roles.panel)} {escape_label(value)}", fontsize=10)
    figure.supylabel(textwrap.fill(label_column(sweep, roles.y), 45), fontsize=10)
    figure.supxlabel(f"{label_column(sweep, roles.x)}\n{describe_points(sweep, roles)}", fontsize=10)
    _add_key(figure, grid, colours, sweep, roles.colour)
    return figure


def draw_measures(sweep: CollectedSweep, x: str, measures: Sequence[str], colour: str) -> Figure:
    """Draw several measures over one setting, a panel for each; the setting's axis is logarithmic if it spans far."""
    figure, grid = _make_grid(len(measures), shared=False)
    colours: dict[Hashable, Any] = {}
    for ax, measure in zip(grid, measures, strict=True):
        roles = Roles(x, measure, colour, log="x" if spans_far(read_values(sweep, x)) else "")
        points = make_points(sweep, roles)
        colours = choose_colours(points["colour"])
        draw_points(ax, points, colours, choose_mark(sweep, roles))
        set_scales(ax, sweep, roles)
        ax.set_title(textwrap.fill(label_column(sweep, measure), 40), fontsize=10)
        ax.set_xlabel(label_column(sweep, x), fontsize=9)
    _add_key(figure, grid, colours, sweep, colour)
    return figure


def make_points(sweep: CollectedSweep, roles: Roles) -> pd.DataFrame:
    """Tabulate x, y, colour and panel of each run, and the number of its ``line``; NaN where there is no value.

    Names on the x axis are numbered in their order.  Runs on one line differ in x alone, and in their seed if nothing
    else is drawn by it.
    """
    table = pd.DataFrame({role: read_values(sweep, getattr(roles, role)) for role in ("x", "y")})
    for role in ("colour", "panel"):
        name = getattr(roles, role)
        table[role] = read_values(sweep, name) if name else ""
    if not is_number(sweep, roles.x):
        table["x"] = pd.factorize(table["x"])[0].astype(float)
        table.loc[table["x"] < 0, "x"] = np.nan
    others = [name for name in sweep.varied if name != roles.x and not (name == "seed" and _averages_seeds(roles))]
    return table.assign(line=sweep.table.groupby(others, sort=False).ngroup() if others else 0)


def _averages_seeds(roles: Roles) -> bool:
    """Whether means are over seeds: not where the seed itself is drawn as something."""
    return "seed" not in (roles.x, roles.colour, roles.panel)


def _count_averaged(sweep: CollectedSweep, roles: Roles) -> int:
    """Count the seeds that means are over."""
    return len(sweep.table["seed"].unique()) if _averages_seeds(roles) else 1


def choose_mark(sweep: CollectedSweep, roles: Roles) -> str:
    """Choose how means over seeds are drawn: as a line over numbers that were set, a dash at each name, or not."""
    if roles.x not in sweep.dims or roles.x in sweep.factors or (roles.colour and roles.colour not in sweep.dims):
        return ""
    if is_number(sweep, roles.x):
        return "-"
    return "_" if _count_averaged(sweep, roles) > 1 else ""


def draw_points(ax: Axes, points: pd.DataFrame, colours: Mapping[Hashable, Any], mark: str) -> None:
    """Draw a point for each run, and the means.  ``points``: of ``make_points``; ``mark``: of ``choose_mark``."""
    for _, part in points.dropna(subset=["x"]).groupby("line", sort=False):
        known = part.dropna(subset=["y"])
        each = [colours.get(value, NO_VALUE) for value in known["colour"]]
        if mark and each:
            means = part.groupby("x")["y"].mean()  # NaN where there is no result: no line goes over it
            ax.plot(means.index, means, mark, color=each[0], lw=1.3, ms=16, mew=1.6, zorder=2)
        ax.scatter(known["x"], known["y"], c=each, s=22, alpha=ALPHA, linewidths=0, zorder=3)
    ax.grid(color="0.92", lw=0.6)
    ax.tick_params(labelsize=9)


def set_scales(ax: Axes, sweep: CollectedSweep, roles: Roles) -> None:
    """Set limits, scales and ticks of a panel: names as they are, few values of a setting each with a tick."""
    for axis in roles.log:
        ax.set(**{f"{axis}scale": "log"})
        values = read_values(sweep, getattr(roles, axis))
        _set_log_ticks(getattr(ax, f"{axis}axis"), values)
    different = list(read_values(sweep, roles.x).dropna().unique())
    if not is_number(sweep, roles.x):
        names = [textwrap.shorten(escape_label(value), 24, placeholder="...") for value in different]
        ax.set_xticks(range(len(names)), names, rotation=30 if len("".join(names)) > 24 else 0)
        ax.set_xlim(-0.5, len(names) - 0.5)
    elif roles.x in sweep.dims and _lie_apart(different, "x" in roles.log):
        ax.set_xticks(different, [f"{value:g}" for value in different])
        ax.xaxis.set_minor_locator(NullLocator())
    if roles.y in PARTS and "y" not in roles.log:
        ax.set_ylim(-0.04, 1.04)


def _set_log_ticks(axis: Axis, values: pd.Series) -> None:
    """Set ticks of a logarithmic axis as plain numbers: 1, 2, 5, 10, of many decades powers of ten alone."""
    axis.set_minor_locator(NullLocator())
    if not spans_far(values):  # less than a decade: those would be too few
        axis.set_major_locator(MaxNLocator(5))
        axis.set_major_formatter(ScalarFormatter())
        return
    decades = math.log10(values.max() / values.min())
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades <= MOST_DECADES else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _lie_apart(values: Sequence[float], in_log: bool) -> bool:
    """Whether numbers are few, and lie so far apart on an axis that each can have a tick."""
    places = np.sort(np.log(values) if in_log else np.asarray(values, dtype=float))
    return len(places) <= 6 and bool((np.diff(places) >= LEAST_GAP * (places[-1] - places[0])).all())


def spans_far(values: pd.Series) -> bool:
    """Whether numbers are best seen on a logarithmic axis: all positive, the highest ten times the lowest or more."""
    return is_positive(values) and float(values.max()) >= 10 * float(values.min())


def is_positive(values: pd.Series) -> bool:
    """Whether all values that are there are numbers above zero."""
    return values.dtype == float and bool((values.dropna() > 0).all())


def choose_colours(values: pd.Series) -> dict[Hashable, Any]:
    """Choose a colour for each different value: of numbers from dark to bright as they rise, of names far apart."""
    different = list(values.dropna().unique())
    if values.dtype == float:
        ordered = sorted(different)
        places = _spread(ordered) if len(ordered) > MOST_NAMED else np.linspace(0.0, 0.88, max(len(ordered), 1))
        return {value: mpl.colormaps["viridis"](place) for value, place in zip(ordered, places, strict=False)}
    if len(different) <= 1:
        return dict.fromkeys(different, ALONE)
    if len(different) <= len(PALETTE):
        return dict(zip(different, PALETTE, strict=False))
    return {
        value: mpl.colormaps["turbo"](place)
        for place, value in zip(_spread(range(len(different))), different, strict=True)
    }


def _spread(ordered: Sequence[float]) -> np.ndarray:
    """Return where rising numbers lie between the first and the last, as 0 to 1."""
    numbers = np.asarray(ordered, dtype=float)
    return (numbers - numbers[0]) / max(numbers[-1] - numbers[0], 1e-300)


def describe_points(sweep: CollectedSweep, roles: Roles) -> str:
    """Say what points and lines are, and which runs are not among them, in a few words below a picture."""
    drawn_as = {"-": "lines", "_": "dashes", "": ""}[choose_mark(sweep, roles)]
    seeds = _count_averaged(sweep, roles)
    means = f"{drawn_as}: means over {seeds} seeds" if drawn_as and seeds > 1 else ""
    return "; ".join(filter(None, ["points: runs", means, describe_lacking(sweep, roles)]))


def describe_lacking(sweep: CollectedSweep, roles: Roles) -> str:
    """Say how many runs are not drawn, as they have no result or no value of a column; empty if all are drawn."""
    is_done = sweep.table["state"] == states.DONE
    counts = {"no result": int((~is_done).sum())}
    for name in dict.fromkeys((roles.x, roles.y)):
        counts[f"no '{name}'"] = int((is_done & sweep.table[name].isna()).sum())
    total = len(sweep.table)
    parts = [
        f"{count} of {total} runs {'has' if count == 1 else 'have'} {what}" for what, count in counts.items() if count
    ]
    return ", ".join(parts) if total else "there are no runs"


def save_plot(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, SVG or PDF by the ending of the path; the same drawing always gives the same bytes.

    Raises ConfigError for another ending, and StoreError where it cannot be written.
    """
    kind = read_format(path)
    with published(path) as partial, own_style(), mpl.rc_context(SAVED):
        figure.savefig(partial, format=kind, dpi=DPI, metadata=FORMATS[kind])


def read_format(path: Path) -> str:
    """Read from the ending of a path which of FORMATS it asks for.  Raises ConfigError if it asks for none."""
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise ConfigError(f"'{path}': a plot is a .png, .svg or .pdf file")
    return kind


def _require_drawable(sweep: CollectedSweep, roles: Roles, points: pd.DataFrame) -> None:
    """Raise ConfigError where a column cannot be drawn as it is asked for, or no run has a value of both."""
    if not is_number(sweep, roles.y):
        raise ConfigError(f"y: '{roles.y}' holds words, and the upright axis needs numbers")
    for axis in roles.log:
        name = getattr(roles, axis)
        if not is_positive(read_values(sweep, name)):
            raise ConfigError(f"log: '{name}' has values that are not above zero, which a logarithmic axis cannot show")
    if not points[["x", "y"]].notna().all(axis=1).any():
        raise ConfigError(f"there is nothing to draw: {describe_lacking(sweep, roles)}")


def _make_grid(count: int, shared: bool) -> tuple[Figure, list[Axes]]:
    """Make a figure with ``count`` panels.  ``shared``: whether all have the same axes."""
    columns = min(count, COLUMNS if shared and count != 4 else 2)
    rows = -(-count // columns)
    size = (6.4, 4.6) if count == 1 else (2.9 * columns + 0.8 if shared else 3.5 * columns, 2.7 * rows + 1.0)
    figure = Figure(figsize=size, layout="constrained")
    grid = list(figure.subplots(rows, columns, squeeze=False, sharex=shared, sharey=shared).flat)
    for ax in grid[count:]:
        ax.set_visible(False)
    for ax in grid[max(count - columns, 0) : count]:  # with nothing below
        ax.tick_params(labelbottom=True)
    return figure, grid[:count]


def _add_key(
    figure: Figure, grid: Sequence[Axes], colours: Mapping[Hashable, Any], sweep: CollectedSweep, name: str
) -> None:
    """Add what the colours mean: a legend, or a scale for many numbers; nothing if there is one colour for all."""
    if not name or not colours:
        return
    label = label_column(sweep, name)
    if is_number(sweep, name) and len(colours) > MOST_NAMED:
        values = [float(value) for value in colours]  # type: ignore[arg-type]  # numbers, as is_number says
        scale = ScalarMappable(Normalize(min(values), max(values)), "viridis")
        figure.colorbar(scale, ax=list(grid), label=textwrap.fill(label, 45), shrink=0.8)
        return
    line = "" if name in sweep.factors else "-"
    handles = [
        Line2D([], [], ls=line, color=colour, marker="o", ms=5, alpha=ALPHA, mew=0, label=escape_label(value))
        for value, colour in colours.items()
    ]
    figure.legend(
        handles=handles, title=label, loc="outside upper left", ncols=min(len(handles), 5), frameon=False, fontsize=9,
        title_fontsize=9,
    )  # fmt: skip
