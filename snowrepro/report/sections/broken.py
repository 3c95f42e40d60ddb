"""The section on what became of the snow: mass in fragments of every size, and its three states over time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...analysis.states import STATES
from ...evidence.gather import Evidence
from ...quantities import add_unit
from ...store.run import Run
from ...summary.row import read_bonds
from ...text import make_cells
from ..document import Block, Heading, Picture
from ..drawing.common import save_figure

ARMS = ((True, "with sintering"), (False, "without sintering"))
LEAST = 1e-4  # mass of a fragment, as part of the body, from which on the curves are drawn
SURVIVAL = Picture(
    "survival.png",
    "Survival curves: mass in fragments of at least a given mass, a curve a run, with and without sintering.",
    "Φ(m): the part of the mass that is in fragments of at least m at the end. Where a curve meets the upright line, "
    "the least mass of a lump, it shows the mass in lumps; wherever one would put that line, a curve above one half "
    "there is more than half of the snow in lumps. One curve a run.",
    data="survival.csv",
)
COURSE = Picture(
    "states.png",
    "Part of the mass that is lump, crushed and loose over the time since the release, a curve a run.",
    "What became of the snow, from the release on: solid with sintering, dotted without. Measured on clusters of "
    "particles, a cell wide; single particles, which the numbers at the end count, may differ in the second digit. "
    "The file has the broken part of the bonds too.",
    data="states.csv",
)


def make_blocks(evidence: Evidence) -> list[Block]:
    """Draw both pictures and return them with their captions; nothing if no run is done."""
    done = [run for run in evidence.runs if evidence.is_done(run)]
    if not done:
        return []
    bonds = [(run, read_bonds(run)) for run in done]
    draw_survival(bonds, evidence)
    draw_course(bonds, evidence)
    return [Heading("What became of the snow"), COURSE, SURVIVAL]


def draw_survival(bonds_of_runs: Sequence[tuple[Run, xr.Dataset]], evidence: Evidence) -> None:
    """Draw Phi(m), the mass in fragments of at least m: a panel for each arm, a colour for each pressure."""
    figure, axes = _make_panels()
    colours = assign_colours(evidence.runs)
    rows = []
    for run, bonds in bonds_of_runs:
        mass = bonds["fragment_mass"].values / bonds["mass"].values.sum()
        ax = axes[0 if run.case.sintering.enabled else 1]
        size, mass_above = np.array([1.0, *mass, LEAST / 10]), np.array([0.0, *np.cumsum(mass), 1.0])
        ax.step(size, mass_above, where="post", color=colours[run.case.pressure], lw=1.2)
        is_drawn = mass >= LEAST
        rows.append(_label_rows(run, mass=mass[is_drawn], at_least=np.cumsum(mass)[is_drawn]))
        lump = float(bonds.attrs["least_lump"]) / float(bonds["mass"].sum())
        ax.axvline(lump, color="0.6", lw=0.8)
    for ax in axes:
        ax.axhline(0.5, color="0.6", lw=0.8, ls=":")
        ax.set(xscale="log", xlim=(LEAST, 1.2), ylim=(-0.02, 1.02), ylabel="mass in fragments\nof at least m")
    axes[-1].set_xlabel("mass m of a fragment [part of the body]")
    _add_legend(figure, colours, evidence.pressure_unit)
    save_figure(figure, evidence.folder / SURVIVAL.file)
    _write_rows(rows, evidence.folder / SURVIVAL.data)


def draw_course(bonds_of_runs: Sequence[tuple[Run, xr.Dataset]], evidence: Evidence) -> None:
    """Draw the part of the mass in each state over time: a panel for each state, a colour for each pressure."""
    figure = Figure(figsize=(5.2, 6.4), layout="constrained")  # so narrow that a phone shows all of it
    axes = list(figure.subplots(len(STATES), 1, sharex=True))
    colours = assign_colours(evidence.runs)
    rows = []
    for run, bonds in bonds_of_runs:
        loading, sintering = run.case.loading, run.case.sintering
        time = (bonds["state"].values - loading.press_frames) * loading.frame_time
        parts = {state: bonds[f"part_{state}"].values for state in STATES}
        for ax, part in zip(axes, parts.values(), strict=True):
            ax.plot(time, part, "-" if sintering.enabled else ":", color=colours[run.case.pressure], lw=1.3)
        broken = {"broken": bonds["broken_both"].values, "by_stretch": bonds["broken_stretch"].values}
        rows.append(_label_rows(run, time=time, **parts, **broken))
    for ax, state in zip(axes, STATES, strict=True):
        ax.set_ylabel(state)
        ax.set_ylim(-0.02, max(0.1, 1.05 * ax.dataLim.ymax))
    axes[-1].set_xlabel("time since the release [s]")
    figure.supylabel("part of the mass", fontsize=10)
    _add_legend(figure, colours, evidence.pressure_unit)
    save_figure(figure, evidence.folder / COURSE.file)
    _write_rows(rows, evidence.folder / COURSE.data)


def _label_rows(run: Run, **columns: np.ndarray) -> pd.DataFrame:
    """Make a table of ``columns`` (n,), with the run that they belong to in each row."""
    labels: dict[str, Any] = {
        "sintering": run.case.sintering.name,
        "pressure": run.case.pressure,
        "seed": run.case.seed,
    }
    return pd.DataFrame({**labels, **columns})


def _write_rows(rows: Sequence[pd.DataFrame], path: Path) -> None:
    """Write tables below one another as CSV."""
    make_cells(pd.concat(rows)).to_csv(path, index=False, float_format="%.4g", lineterminator="\n")


def _make_panels() -> tuple[Figure, list[Axes]]:
    """Make a figure with one panel for each arm."""
    figure = Figure(figsize=(5.2, 6.4), layout="constrained")  # so narrow that a phone shows all of it
    axes = list(figure.subplots(2, 1, sharex=True, sharey=True))
    for ax, (_, title) in zip(axes, ARMS, strict=True):
        ax.set_title(title, fontsize=10)
    return figure, axes


def assign_colours(runs: Sequence[Run]) -> dict[float, tuple]:
    """Assign a colour to each pressure, from dark to bright as the pressure rises."""
    pressures = sorted({run.case.pressure for run in runs})
    return {p: colormaps["plasma"](0.85 * i / max(len(pressures) - 1, 1)) for i, p in enumerate(pressures)}


def _add_legend(figure: Figure, colours: dict[float, tuple], unit: str) -> None:
    """Add the legend of pressures, with their unit."""
    lines = [Line2D([], [], color=colour, label=f"{pressure:g}") for pressure, colour in colours.items()]
    figure.legend(
        handles=lines, loc="outside lower center", ncols=min(len(lines), 6), frameon=False, fontsize=9,
        title=add_unit("pressure", unit), title_fontsize=9,
    )  # fmt: skip
