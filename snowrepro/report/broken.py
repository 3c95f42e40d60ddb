"""What broke: the mass in fragments of every size, and the bonds over time."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..analysis.summary import bonds_of
from ..config import Config
from .document import Block, Heading, Picture
from .drawing import save
from .evidence import Evidence

ARMS = ((True, "with sintering"), (False, "without sintering"))
LEAST = 1e-4  # mass of a fragment, as part of the body, from which on the curves are drawn


def section(evidence: Evidence) -> list[Block]:
    """Both pictures with what they show; nothing where no run is done."""
    done = [config for config in evidence.configs if evidence.is_done(config)]
    if not done:
        return []
    seen = [(config, bonds_of(config)) for config in done]
    draw_survival(seen, evidence)
    draw_bonds(seen, evidence)
    return [
        Heading("What broke"),
        Picture(
            "survival.png",
            "Survival curves: mass in fragments of at least a given mass, a curve a run, with and without sintering.",
            "Phi(m): the part of the mass that is in fragments of at least m at the end. Where a curve meets the "
            "upright line, the least mass of a lump, it shows the mass in lumps; wherever one would put that line, "
            "more lumps than powder is to meet it above one half. One curve a run.",
            data="survival.csv",
        ),
        Picture(
            "bonds.png",
            "Part of the bonds that are broken over time, a curve a run, with and without sintering.",
            "Bonds broken by stretch or crushing (solid) and by stretch alone (dashed), from the release on.",
            data="bonds.csv",
        ),
    ]


def draw_survival(seen_of: Sequence[tuple[Config, xr.Dataset]], evidence: Evidence) -> None:
    """Phi(m), a panel for each arm, a colour for each pressure."""
    figure, axes = _two_panels()
    colours = colours_of(evidence.configs)
    rows = []
    for config, seen in seen_of:
        mass = seen["fragment_mass"].values / seen["mass"].values.sum()
        ax = axes[0 if config.sintering.enabled else 1]
        size, held = np.array([1.0, *mass, LEAST / 10]), np.array([0.0, *np.cumsum(mass), 1.0])
        ax.step(size, held, where="post", color=colours[config.pressure], lw=1.2)
        lasting = mass >= LEAST
        rows.append(_labelled(config, mass=mass[lasting], at_least=np.cumsum(mass)[lasting]))
        lump = float(seen.attrs["least_lump"]) / float(seen["mass"].sum())
        ax.axvline(lump, color="0.6", lw=0.8)
    for ax in axes:
        ax.axhline(0.5, color="0.6", lw=0.8, ls=":")
        ax.set(xscale="log", xlim=(LEAST, 1.2), ylim=(-0.02, 1.02), xlabel="mass m of a fragment [part of the body]")
    axes[0].set_ylabel("mass in fragments of at least m [1]")
    _finish(figure, colours)
    save(figure, evidence.folder / "survival.png")
    _write(rows, evidence.folder / "survival.csv")


def draw_bonds(seen_of: Sequence[tuple[Config, xr.Dataset]], evidence: Evidence) -> None:
    """The broken part of the bonds over time, likewise."""
    figure, axes = _two_panels()
    colours = colours_of(evidence.configs)
    rows = []
    for config, seen in seen_of:
        time = seen["state"].values * config.loading.frame_time
        ax = axes[0 if config.sintering.enabled else 1]
        ax.plot(time, seen["broken_both"], color=colours[config.pressure], lw=1.2)
        ax.plot(time, seen["broken_stretch"], color=colours[config.pressure], lw=1.0, ls="--")
        rows.append(_labelled(config, time=time, broken=seen["broken_both"], by_stretch=seen["broken_stretch"]))
    for ax in axes:
        ax.set(ylim=(-0.02, 1.02), xlabel="time since pressing began [s]")
    axes[0].set_ylabel("broken part of the bonds [1]")
    _finish(figure, colours)
    save(figure, evidence.folder / "bonds.png")
    _write(rows, evidence.folder / "bonds.csv")


def _labelled(config: Config, **columns: np.ndarray) -> pd.DataFrame:
    """Columns with the run that they are of."""
    run = {"sintering": config.sintering.name, "pressure": config.pressure, "seed": config.seed}
    return pd.DataFrame({**run, **columns})


def _write(rows: Sequence[pd.DataFrame], path: Path) -> None:
    pd.concat(rows).to_csv(path, index=False, float_format="%.4g", lineterminator="\n")


def _two_panels() -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(8.2, 3.6), layout="constrained")
    axes = list(figure.subplots(1, 2, sharey=True))
    for ax, (_, title) in zip(axes, ARMS, strict=True):
        ax.set_title(title, fontsize=10)
    return figure, axes


def colours_of(configs: Sequence[Config]) -> dict[float, tuple]:
    """A colour for each pressure, from dark to bright as it rises."""
    pressures = sorted({config.pressure for config in configs})
    return {p: colormaps["plasma"](0.85 * i / max(len(pressures) - 1, 1)) for i, p in enumerate(pressures)}


def _finish(figure: Figure, colours: dict[float, tuple]) -> None:
    """The legend of pressures."""
    lines = [Line2D([], [], color=colour, label=f"pressure {pressure:g}") for pressure, colour in colours.items()]
    figure.legend(handles=lines, loc="outside lower center", ncols=min(len(lines), 6), frameon=False, fontsize=8)
