"""Which reading?  What becomes of the snow by reading and pressure, and how many sentences of the paper each keeps."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...evidence.choices import LUMPS
from ...evidence.fitted import DEFINITIONS, FittedReading, Fitting, fit_readings
from ...evidence.gather import Evidence
from ...evidence.variants import name_changes
from ...settings.case import ARMS
from ...store import states
from ...text import make_cells
from ..document import NO_RESULT, Block, FigureContent, Picture, Table, escape, format_code, join_names
from ..drawing.common import choose_font, save_figure
from ..sections.claims import format_bracket
from ..sections.variants import describe_change
from .kinds import FigureKind

PICTURE, CSV, RUNS = "fitted.png", "fitted.csv", "fitted-runs.csv"
SHADES = "viridis"
LOOSE = "loose_fraction"
MOST_NAMED = 4  # readings in a sentence


@dataclass(frozen=True)
class Panel:
    """A panel of the picture: a measure of an arm, and its title."""

    arm: str
    measure: str
    title: str


PANELS = (
    Panel(ARMS[0], LUMPS, "sintered: in lumps"),
    Panel(ARMS[0], LOOSE, "sintered: loose"),
    Panel(ARMS[1], LUMPS, "unsintered: in lumps"),
    Panel(ARMS[1], LOOSE, "unsintered: loose"),
)


def report(evidence: Evidence) -> FigureContent:
    """Show what each reading keeps of the paper with pressures of its own, and which one the rule chooses."""
    if evidence.table.empty:
        return NO_RESULT
    fitting = fit_readings(evidence)
    moves = fitting.measure_moves()
    rows = pd.DataFrame([_make_row(each, fitting) for each in fitting.readings]).assign(moves=moves)
    for table, name in ((rows, CSV), (fitting.table, RUNS)):
        make_cells(table).to_csv(evidence.folder / name, index=False, float_format="%.6g", lineterminator="\n")
    draw_readings(fitting, evidence.folder / PICTURE)
    pressures = f"{', '.join(f'{pressure:g}' for pressure in fitting.pressures)} {evidence.pressure_unit}"
    picture = Picture(
        PICTURE,
        "A row for each reading, a column for each pressure: mass in lumps and loose, with and without sintering.",
        "A cell is a run, or the mean of its seeds: the part of the mass in lumps, or loose, at the end. Pressures "
        f"rise to the right: {pressures}. White: no result. Right: how many of the paper's {fitting.sentences} "
        "sentences hold together at the best three of the pressures.",
        data=RUNS,
    )
    shown = pd.DataFrame(
        [_make_shown_row(each, fitting, move) for each, move in zip(fitting.readings, moves, strict=True)]
    )
    blocks: list[Block] = [picture, Table(shown, _explain_columns(fitting, evidence), CSV)]
    return FigureContent(blocks, write_verdict(fitting))


def write_verdict(fitting: Fitting) -> str:
    """Say how many sentences the best readings keep, and which one the rule chooses."""
    ranked, done = fitting.rank(), int((fitting.table["state"] == states.DONE).sum())
    runs = f"{done} of {len(fitting.table)} runs have a result."
    if not ranked:
        return f"No reading has three pressures with all runs, so none is chosen. {runs}"
    chosen, best = ranked[0], [each for each in fitting.readings if each.known and each.kept == ranked[0].kept]
    names = join_names([f"'{describe_change(each.changes)}'" for each in best], "and")
    if chosen.kept == fitting.sentences:
        first = f"{len(best)} of {len(ranked)} readings keep all {fitting.sentences} sentences of the paper: {names}"
    else:
        keep = f"{len(best)} of {len(ranked)} keep" if len(best) < len(ranked) else f"all {len(ranked)} keep"
        first = (
            f"No reading keeps all {fitting.sentences} sentences of the paper, with whichever three pressures; "
            f"{keep} {chosen.kept}{f': {names}' if len(best) <= MOST_NAMED else ''}"
        )
    same = not chosen.changes
    second = "The rule chooses the base" if same else f"The rule chooses '{describe_change(chosen.changes)}'"
    by = f", which keeps C1 to C5 by {len(chosen.definitions)} of {len(DEFINITIONS)} definitions of a lump"
    never = _list_never(ranked)
    lost = f" {join_names(never, 'and')} {'hold' if len(never) > 1 else 'holds'} under no reading." if never else ""
    return f"{first}. {second}{by}.{lost} {runs}"


def _list_never(readings: Sequence[FittedReading]) -> list[str]:
    """List the claims that hold under no reading at all."""
    return [name for name in readings[0].never if all(name in each.never for each in readings)]


def _make_row(reading: FittedReading, fitting: Fitting) -> dict[str, object]:
    """Make the row of a reading for a table of data."""
    ranked = fitting.rank()
    return {
        "reading": name_changes(reading.changes),
        "kept": reading.kept,
        "best": " ".join(f"{pressure:g}" for pressure in reading.best),
        "threes": reading.reach,
        "known": reading.known,
        "definitions": " ".join(reading.definitions),
        "P50 above": reading.half.low,
        "P50 below": reading.half.high,
        "never": " ".join(reading.never),
        "rank": ranked.index(reading) + 1 if reading in ranked else None,
    }


def _make_shown_row(reading: FittedReading, fitting: Fitting, move: float) -> dict[str, object]:
    """Make the row of a reading for a page.  ``move``: of ``Fitting.measure_moves``."""
    best = f"at {', '.join(f'{pressure:g}' for pressure in reading.best)}"
    kept = f"{reading.kept} of {fitting.sentences} {best}" if reading.known else "not known"
    return {
        "reading": escape(describe_change(reading.changes)),
        "sentences kept": kept,
        "threes": f"{reading.reach} of {reading.known}",
        "definitions": escape(", ".join(reading.definitions)) or "none",
        "P50": reading.half.note or format_bracket(reading.half),
        "moves lumps by": "-" if math.isnan(move) or not reading.changes else f"{move:.2f}",
        "held by no three": escape(", ".join(reading.never)) or "-",
        "setting": format_code(name_changes(reading.changes)) if reading.changes else "-",
    }


def _explain_columns(fitting: Fitting, evidence: Evidence) -> str:
    """Explain the table of readings."""
    return (
        f"Sentences kept: of the paper's {fitting.sentences}, how many hold together at the best three pressures, and "
        "the first three that do; powder has to come loose. Threes: how many keep as many, of those with all runs. "
        f"Definitions: of a lump, of {join_names(list(DEFINITIONS), 'and')}, those by which C1 to C5 hold at some "
        f"three. P50: between which pressures [{evidence.pressure_unit}] half of the mass is in lumps with sintering. "
        "Moves lumps by: the mean over the pressures, without sign, beside Figure 5; what moves them most a reader has "
        "to know first. Held by no three: claims that the numbers of every three disagree with. One seed agrees or "
        "disagrees; it proves nothing."
    )


def draw_readings(fitting: Fitting, path: Path) -> None:
    """Draw PANELS side by side: a row for each reading, a cell for each pressure."""
    count = len(fitting.readings)
    size = (10.5, 0.3 * count + 1.6)
    letters = choose_font(size[0], 9.0)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(1, len(PANELS), sharey=True, squeeze=False).ravel()
    shades = mpl.colormaps[SHADES].with_extremes(bad="white")
    for ax, panel in zip(axes, PANELS, strict=True):
        values = np.ma.masked_invalid(fitting.spread(panel.arm, panel.measure))
        shown = ax.pcolormesh(values, cmap=shades, vmin=0, vmax=1, edgecolor="w", lw=0.5)
        ax.set_title(panel.title, fontsize=letters)
        _name_pressures(ax, fitting.pressures, letters)
    axes[0].set_yticks(
        np.arange(count) + 0.5, [describe_change(each.changes) for each in fitting.readings], fontsize=letters
    )
    axes[0].invert_yaxis()
    axes[-1].text(len(fitting.pressures) + 0.2, -0.3, "kept", fontsize=letters)
    for row, reading in enumerate(fitting.readings):
        words = f"{reading.kept} of {fitting.sentences}" if reading.known else "-"
        axes[-1].text(len(fitting.pressures) + 0.2, row + 0.5, words, va="center", fontsize=letters)
    bar = figure.colorbar(shown, ax=axes, location="top", shrink=0.35, aspect=40)
    bar.set_label("part of the mass", fontsize=letters)
    bar.ax.tick_params(labelsize=letters)
    save_figure(figure, path)


def _name_pressures(ax: Axes, pressures: Sequence[float], letters: float) -> None:
    """Name the lowest and the highest pressure below a panel, and what they are between them."""
    ends = {"left": (0.0, pressures[0]), "right": (len(pressures), pressures[-1])}  # so that no two panels' meet
    names = ax.set_xticks([place for place, _ in ends.values()], [f"{value:g}" for _, value in ends.values()])
    for side, name in zip(ends, names, strict=True):
        name.label1.set(ha=side, fontsize=letters)
    ax.set_xlabel("pressure", fontsize=letters, labelpad=-letters)  # between the two
    ax.tick_params(length=0)


FIGURE = FigureKind(report)
