"""The picture of the sizes of fragments, for the runs of any sweep."""

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...evidence.gather import Evidence
from ...store import states
from ...summary.row import read_bonds
from ...text import make_cells
from ..document import Block, Heading, Picture
from ..drawing.columns import choose_colour, escape_label, label_column, list_steered, read_values
from ..drawing.common import save_figure
from ..drawing.plot import ALONE, choose_colours

LEAST = 1e-4  # mass of a fragment, as part of the body, from which on the curves are drawn
MOST_PANELS = 6
MOST_NAMED = 12  # values in the legend
PICTURE = Picture(
    "sizes.png",
    "Mass in fragments of at least a given mass, a curve for each run that fell.",
    "How much of the snow is in fragments of at least a given mass, at the end: a curve for each run. High on the "
    "right: the snow is in heavy pieces. High on the left only: it is crushed or loose. The upright line is the "
    "least mass of a lump; where a curve meets it, it shows the mass in lumps.",
    data="sizes.csv",
)


def make_blocks(evidence: Evidence) -> list[Block]:
    """Draw the sizes of the fragments of all finished runs that fell; nothing if there are none."""
    curves = _read_curves(evidence)
    if not curves:
        return []
    _draw_curves(curves, evidence)
    _write_curves(curves, evidence)
    return [Heading("Sizes of the fragments"), PICTURE]


def _write_curves(curves: dict[int, pd.DataFrame], evidence: Evidence) -> None:
    """Write the curves as drawn, a row for each mass that fragments of a run have."""
    run_ids = evidence.sweep.table["run_id"]
    table = pd.concat([curve.assign(run_id=run_ids.iloc[row]) for row, curve in curves.items()])
    steps = table[table["mass"] >= LEAST].map(lambda cell: f"{cell:.4g}" if isinstance(cell, float) else cell)
    steps = steps.drop_duplicates(["run_id", "mass"], keep="last")[["run_id", "mass", "at_least"]]
    make_cells(steps).to_csv(evidence.folder / PICTURE.data, index=False, lineterminator="\n")


def _read_curves(evidence: Evidence) -> dict[int, pd.DataFrame]:
    """Read of each finished run that fell, by its row, the ``mass`` of each fragment, and that ``at_least`` as heavy.

    Both are parts of the body; heavy fragments come first.  The attribute "lump" is the least mass of a lump.
    """
    curves = {}
    for row, run in enumerate(evidence.sweep.runs):
        if run.case.indenter or evidence.sweep.table["state"].iloc[row] != states.DONE:
            continue
        bonds = read_bonds(run)
        body = float(bonds["mass"].sum())
        mass = bonds["fragment_mass"].values / body
        curves[row] = pd.DataFrame({"mass": mass, "at_least": np.cumsum(mass)})
        curves[row].attrs["lump"] = float(bonds.attrs["least_lump"]) / body
    return curves


def _draw_curves(curves: dict[int, pd.DataFrame], evidence: Evidence) -> None:
    """Draw the curves: colours for the setting that results are drawn over, panels for another that varies."""
    sweep = evidence.sweep
    by = list_steered(sweep)[0]
    values, other = read_values(sweep, by), choose_colour(sweep, by)
    colours = choose_colours(values)
    panel_of_row = read_values(sweep, other) if other else values * 0
    panels = list(panel_of_row.unique())
    if not 1 < len(panels) <= MOST_PANELS:
        panel_of_row, panels = panel_of_row.map(lambda _: ""), [""]
    figure, axes = _make_panels(len(panels))
    for ax, panel in zip(axes, panels, strict=True):
        title = f"{sweep.key_of(other)} {escape_label(panel)}" if len(panels) > 1 else ""
        ax.set_title(title, fontsize=10)
    for row, curve in curves.items():
        ax = axes[panels.index(panel_of_row.iloc[row])]
        mass, at_least = [1.0, *curve["mass"], LEAST / 10], [0.0, *curve["at_least"], 1.0]
        ax.step(mass, at_least, where="post", lw=1.2, color=colours.get(values.iloc[row], ALONE))
        ax.axvline(curve.attrs["lump"], color="0.6", lw=0.8)
    if len(colours) > 1:
        _add_legend(figure, colours, label_column(sweep, by))
    save_figure(figure, evidence.folder / PICTURE.file)


def _make_panels(count: int) -> tuple[Figure, list[Axes]]:
    """Make a figure with ``count`` panels for curves."""
    columns = min(count, 2)
    rows = -(-count // columns)
    size = (6.4, 4.2) if count == 1 else (3.5 * columns, 2.7 * rows + 1.0)
    figure = Figure(figsize=size, layout="constrained")
    axes = list(figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).flat)
    for ax in axes:
        ax.set(xscale="log", xlim=(LEAST, 1.2), ylim=(-0.02, 1.02))
        ax.grid(color="0.92", lw=0.6)
        ax.tick_params(labelsize=9)
    for ax in axes[count:]:
        ax.set_visible(False)
    for ax in axes[max(count - columns, 0) : count]:
        ax.set_xlabel("mass of a fragment, part of the body", fontsize=9)
        ax.tick_params(labelbottom=True)
    figure.supylabel("mass in fragments at least as heavy", fontsize=9)
    return figure, axes[:count]


def _add_legend(figure: Figure, colours: Mapping[Hashable, Any], title: str) -> None:
    """Add a legend of colours; of many values only every so many."""
    named = list(colours.items())[:: -(-len(colours) // MOST_NAMED)]
    lines = [Line2D([], [], color=colour, label=escape_label(value)) for value, colour in named]
    figure.legend(
        handles=lines, title=title, loc="outside upper left", ncols=6, frameon=False, fontsize=9, title_fontsize=9
    )
