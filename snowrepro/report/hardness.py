"""Hardness beside lumps: what an indenter needs, how the same snow falls, and whether lumps follow hardness."""

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from scipy.stats import rankdata

from ..analysis import hardness
from ..config import Config
from .document import NOTHING, Findings, Heading, Picture, Table
from .drawing import SINTERED, UNSINTERED, save
from .evidence import Evidence, in_paper_order, opened

ARMS = {"paper": ("with sintering", SINTERED, "o"), "none": ("without sintering", UNSINTERED, "s")}
KEYS = ["sintering", "pressure", "seed"]
MEASURES = {
    "hardness": "hardness [unit of E]",
    "flattening_most": "flattening at most [1]",
    "flattening_end": "flattening at the end [1]",
    "rebound": "rebound [1]",
    "lump_fraction": "mass in lumps [1]",
}
OTHERS = {
    "indentation_work": "work of indentation",
    "factor_at_release": "hardening factor at release",
    "density_at_release": "density at release",
}
DEPTHS = (0.25, 0.5, 1.0)  # parts of the test's depth at which its hardness is read
APART = 0.1  # lumps by which snows of equal hardness must differ to speak against hardness
LEVEL = 0.05  # of the test of a rank correlation
SHUFFLES = 9999  # of the pairs, by which chance is judged
DIGITS = 3  # in which snows are told apart: those that pressing did not change are one and the same
LEAST = 4  # pairs, below which there is none


@dataclass(frozen=True)
class Follows:
    """Spearman's rank correlation of lumps with a measure: ``rho``, and its chance ``p`` if there were none."""

    rho: float
    p: float
    count: int

    @property
    def holds(self) -> bool:
        """Whether lumps rise with the measure, beyond chance."""
        return self.rho > 0 and self.p <= LEVEL

    def __str__(self) -> str:
        return f"{self.rho:+.2f} (p = {self.p:.1g}, {self.count} snows)" if np.isfinite(self.rho) else "none"


def report(evidence: Evidence) -> Findings:
    """Curves of the indenter, all measures over pressure, lumps over hardness, and the verdict."""
    if evidence.table.empty:
        return NOTHING
    indented = [c for c in in_paper_order(evidence.configs) if c.indenter and evidence.is_done(c)]
    pairs = paired(evidence.table)
    depths = _by_depth(indented)
    pairs = pairs.join(depths)
    _draw_curves(indented, evidence)
    _draw_measures(pairs, evidence)
    _draw_scatter(pairs, evidence)
    verdict = sentence(pairs)
    shown = pairs.reset_index()[[*KEYS, *MEASURES, "indentation_work"]]
    blocks = [
        "The rule: lumps follow hardness if Spearman's rank correlation is above zero with p at most "
        f"{LEVEL:g} (permutations, two-sided) among the sintered snows and among all together, and if no unsintered "
        f"snow differs by more than {APART:g} from the lumps of sintered snow as hard; only in part if not all three "
        "hold, but one of the correlations. Unsintered snow that pressing left as it was is one snow at several "
        "pressures, and counts once. The correlations were asked for when four of the hardness tests and the lumps of "
        "most falls were known; the third condition, and pressure 16000 that puts it to a test, when coarse runs had "
        "shown unsintered snow as hard.",
        Picture(
            "scatter.png",
            "Mass in lumps over hardness, a point for each snow, with and without sintering.",
            _equal_hardness(pairs),
            data="summary.csv",
        ),
        Heading("The indenter"),
        *_method(indented),
        Picture(
            "curves.png",
            "Force on the indenter over its depth, a line for each pressure, with and without sintering.",
            "Force at unit depth out of the plane over the depth below first touch. It begins before the touch, "
            "because the grid carries contact about half a spacing ahead of the particles, and steps where the disc "
            "reaches the next row of nodes.",
            data="curves.csv",
        ),
        Heading("Fall and hardness over pressure"),
        Picture(
            "measures.png",
            "Four panels over pressure: hardness, flattening, rebound and mass in lumps, with and without sintering.",
            "Flattening: height lost since release, of the middle nine tenths of the mass, at most and at the end. "
            "Rebound: largest upward speed of the centre of mass after the impact, over the speed of the impact.",
            data="summary.csv",
        ),
        Table(shown.rename(columns={**MEASURES, "indentation_work": "work of indentation"})),
        Heading("Rank correlation of lumps with each measure"),
        Table(_correlations(pairs)),
        "Within an arm every measure may rise with pressure alone; the column of all runs is the harder test. One seed "
        "a pressure: neighbouring pressures may change places by chance.",
    ]
    return Findings(blocks, verdict)


def paired(table: pd.DataFrame) -> pd.DataFrame:
    """A row for each snow (sintering, pressure, seed): what its fall and its test gave, NaN where one lacks."""
    columns = [*MEASURES, *OTHERS]
    return table.reindex(columns=[*KEYS, *columns]).groupby(KEYS, sort=False)[columns].first().astype(float)


def follows(lumps: pd.Series, measure: pd.Series) -> Follows:
    """Rank correlation over the different snows that have both; none where one of them never changes."""
    both = pd.concat([lumps, measure], axis=1).dropna().map(_rounded).drop_duplicates()
    if len(both) < LEAST or (both.nunique() < 2).any():
        return Follows(float("nan"), float("nan"), len(both))
    ranks = rankdata(both, axis=0)
    one, other = ((ranks - ranks.mean(axis=0)) / ranks.std(axis=0)).T
    rho = float((one * other).mean())
    shuffled = np.random.default_rng(0).permuted(np.tile(other, (SHUFFLES, 1)), axis=1) @ one / len(one)
    as_far = int((np.abs(shuffled) >= abs(rho) - 1e-9).sum())
    return Follows(rho, (1 + as_far) / (1 + SHUFFLES), len(both))


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def arm(pairs: pd.DataFrame, name: str) -> pd.DataFrame:
    """The rows of one arm, by pressure; empty if it was not run."""
    rows = pairs[pairs.index.get_level_values("sintering") == name]
    return rows.droplevel("sintering").sort_index()


def sentence(pairs: pd.DataFrame) -> str:
    """Whether lumps follow hardness, in words."""
    sintered = arm(pairs, "paper")
    own = follows(sintered["lump_fraction"], sintered["hardness"])
    every = follows(pairs["lump_fraction"], pairs["hardness"])
    if not (np.isfinite(own.rho) and np.isfinite(every.rho)):
        return "Too few runs have a fall and a hardness test to say whether lumps follow hardness."
    alike = at_equal_hardness(pairs)
    apart = alike[(alike["unsintered"] - alike["sintered"]).abs() > APART]
    word = "Lumps do not follow hardness"
    if own.holds or every.holds:
        word = "Lumps follow hardness only in part"
    if own.holds and every.holds and apart.empty:
        word = "Lumps follow hardness"
    text = f"{word}: Spearman's rank correlation is {own} with sintering and {every} in all."
    if len(apart):
        text += f" Hardness alone does not make them: {_listed(apart)}."
    return f"{text} {_ranges(pairs)}"


def _ranges(pairs: pd.DataFrame) -> str:
    """How hard the snow of each arm is at the ends of the ladder, and how many lumps it gives."""
    parts = []
    for name, (label, *_) in ARMS.items():
        rows = arm(pairs, name).dropna(subset=["hardness", "lump_fraction"])
        if len(rows) > 1:
            (low, *_), (high, *_) = rows.index[0], rows.index[-1]
            first, last = rows.iloc[0], rows.iloc[-1]
            parts.append(
                f"{label} hardness goes from {_rounded(first['hardness']):,.0f} to "
                f"{_rounded(last['hardness']):,.0f} and lumps from "
                f"{first['lump_fraction']:.2f} to {last['lump_fraction']:.2f} between pressures {low:g} and {high:g}"
            )
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def at_equal_hardness(pairs: pd.DataFrame) -> pd.DataFrame:
    """Unsintered snows as hard as some of the sintered: ``pressure``, ``hardness``, lumps ``unsintered``, and
    ``sintered`` between the neighbours in hardness, over its logarithm."""
    sintered, loose = (arm(pairs, name).dropna(subset=["hardness", "lump_fraction"]) for name in ARMS)
    sintered, loose = sintered.sort_values("hardness"), loose.reset_index()
    inside = loose[loose["hardness"].between(sintered["hardness"].min(), sintered["hardness"].max())]
    logs = np.log(sintered["hardness"].to_numpy())
    beside = np.interp(np.log(inside["hardness"]), logs, sintered["lump_fraction"]) if len(inside) else []
    found = inside[["pressure", "hardness", "lump_fraction"]].rename(columns={"lump_fraction": "unsintered"})
    return found.assign(sintered=beside)


def _listed(alike: pd.DataFrame) -> str:
    """Snows of equal hardness, in words."""
    return "; ".join(
        f"unsintered snow of pressure {row.pressure:g} and hardness {_rounded(row.hardness):,.0f} has "
        f"{row.unsintered:.2f} of its mass in lumps, sintered snow as hard {row.sintered:.2f}"
        for row in alike.itertuples()
    )


def _equal_hardness(pairs: pd.DataFrame) -> str:
    """What unsintered snow gives beside sintered snow of the same hardness."""
    alike = at_equal_hardness(pairs)
    if alike.empty:
        return "No unsintered snow is as hard as any sintered: at equal hardness the two cannot be compared."
    return f"At equal hardness (sintered: between neighbours, over log hardness): {_listed(alike)}."


def _correlations(pairs: pd.DataFrame) -> pd.DataFrame:
    """Spearman's rho of lumps with each measure: sintered, unsintered, all."""
    names = {**MEASURES, **{name: f"hardness at {name}" for name in pairs if name not in MEASURES}, **OTHERS}
    rows = []
    for name, label in names.items():
        if name == "lump_fraction":
            continue
        parts = {label: arm(pairs, key) for key, (label, *_) in ARMS.items()} | {"all": pairs}
        found = {part: str(follows(rows_of["lump_fraction"], rows_of[name])) for part, rows_of in parts.items()}
        rows.append({"measure": label, **found})
    return pd.DataFrame(rows)


def _by_depth(configs: Sequence[Config]) -> pd.DataFrame:
    """Hardness at parts of the whole depth, a row for each snow: does the order hang on the depth?"""
    rows = []
    for config in configs:
        test = config.indenter
        assert test is not None
        with opened(config) as dataset:
            found = {
                f"{part * test.depth:g} cells": hardness.mean_pressure(dataset, part * test.depth)
                for part in DEPTHS[:-1]
            }
        rows.append({**dict(zip(KEYS, (config.sintering.name, config.pressure, config.seed), strict=True)), **found})
    return pd.DataFrame(rows, columns=None if rows else KEYS).set_index(KEYS)


def _method(configs: Sequence[Config]) -> list[str]:
    """The test in words and numbers."""
    if not configs or configs[0].indenter is None:
        return []
    test = configs[0].indenter
    return [
        f"A run of its own for each snow. At release gravity stays away, the snow rests for {test.rest_frames} frames "
        f"(damping {test.rest_damping:g}/s), then its lower half is held and a rigid disc of radius {test.radius:g} "
        f"cells, friction {test.friction:g}, goes down over its centroid at {test.speed:g} cells/s, {test.depth:g} "
        "cells from first touch. Force is the disc's impulse on nodes and particles over the frame's time. Hardness is "
        "force over the disc's chord in the last tenth of the depth; work is force over the whole way. The chord is "
        "the disc's own: what the snow sinks or piles up beside it is not seen. Half the speed gives the same "
        "hardness within 5 % (tests/validation/test_indenter.py).",
    ]


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(4.2 * count, 3.8), layout="constrained")
    return figure, list(figure.subplots(1, count, squeeze=False)[0])


def _draw_curves(configs: Sequence[Config], evidence: Evidence) -> None:
    """Force over depth: a panel an arm, a colour a pressure."""
    figure, axes = _panels(2)
    pressures = sorted({config.pressure for config in evidence.configs})
    shade = LogNorm(pressures[0] * 0.999, pressures[-1] * 1.3)
    drawn: list[pd.DataFrame] = []
    for ax, (name, (label, *_)) in zip(axes, ARMS.items(), strict=True):
        for config in (c for c in configs if c.sintering.name == name):
            with opened(config) as dataset:
                depth, force = hardness.curve(dataset)
                unit = dataset["indenter_force"].attrs["units"]
            colour = matplotlib.colormaps["viridis_r"](shade(config.pressure))
            shown = force > 0
            drawn.append(pd.DataFrame({"sintering": name, "pressure": config.pressure, "depth": depth, "force": force}))
            ax.plot(depth[shown], force[shown], lw=1.1, color=colour, label=f"{config.pressure:g}")
            axes[0].set_ylabel(f"force [{unit}]")
        ax.axvline(0, color="0.8", lw=0.8, zorder=0)
        ax.set(yscale="log", xlabel="depth below first touch [cells]", title=label)
        if ax.lines[1:]:
            ax.legend(title="pressure", fontsize=8, title_fontsize=8, frameon=False, ncols=2)
    if drawn:
        table = pd.concat(drawn)
        table.to_csv(evidence.folder / "curves.csv", index=False, float_format="%.5g", lineterminator="\n")
        highest, last = table["force"].max(), table["depth"].max()
        for ax in axes:
            ax.set(xlim=(-0.4 * last, 1.03 * last), ylim=(1e-4 * highest, 2 * highest))
    save(figure, evidence.folder / "curves.png")


def _draw_measures(pairs: pd.DataFrame, evidence: Evidence) -> None:
    """All measures over pressure, both arms."""
    figure = Figure(figsize=(12.5, 3.4), layout="constrained")
    axes = figure.subplots(1, 4)
    pressures = sorted({config.pressure for config in evidence.configs})
    panels = (["hardness"], ["flattening_most", "flattening_end"], ["rebound"], ["lump_fraction"])
    for ax, names in zip(axes, panels, strict=True):
        for key, (label, colour, mark) in ARMS.items():
            rows = arm(pairs, key).groupby("pressure").mean()
            for name, style in zip(names, ("-", "--"), strict=False):
                end = ", at the end" if style == "--" else ""
                ax.plot(rows.index, rows[name], mark + style, color=colour, ms=4, lw=1.2, label=label + end)
        ax.set(xscale="log", xlabel="nominal pressure [unit of E]")
        ax.set_ylabel(MEASURES[names[0]].replace(" at most", ""))
        ax.set_xticks(pressures, [f"{p:g}" for p in pressures], rotation=60, fontsize=8)
        ax.minorticks_off()
        if names[0] == "hardness":
            ax.set_yscale("log")
        else:
            ax.set_ylim(bottom=min(0.0, *ax.get_ylim()))
    axes[1].legend(fontsize=7, frameon=False)
    axes[0].legend(fontsize=7, frameon=False)
    save(figure, evidence.folder / "measures.png")


def _labels(rows: pd.DataFrame) -> list[tuple[tuple[float, float], str]]:
    """Where to write which pressures: those whose points lie on each other share a label."""
    near = [np.log10(rows["hardness"]).round(1), (25.0 * rows["lump_fraction"]).round()]
    return [
        (tuple(part[["hardness", "lump_fraction"]].max()), _span([p for p, _ in part.index]))
        for _, part in rows.groupby(near, sort=False)
    ]


def _span(pressures: Sequence[float]) -> str:
    low, high = f"{min(pressures):g}", f"{max(pressures):g}"
    return low if low == high else f"{low} to {high}"


def _draw_scatter(pairs: pd.DataFrame, evidence: Evidence) -> None:
    """Lumps over hardness, each point with its pressure."""
    figure = Figure(figsize=(6.6, 4.2), layout="constrained")
    ax = figure.subplots()
    for key, (label, colour, mark) in ARMS.items():
        rows = arm(pairs, key).dropna(subset=["hardness", "lump_fraction"])
        ax.plot(rows["hardness"], rows["lump_fraction"], mark, color=colour, label=label)
        for k, (place, text) in enumerate(_labels(rows)):
            above = 5 if key == "paper" else -12 - 8 * (k % 2)  # where one would lie on the next
            ax.annotate(text, place, (0, above), textcoords="offset points", fontsize=7, color=colour, ha="center")
    ax.axhline(0.5, color="0.85", lw=0.8, zorder=0)
    ax.margins(x=0.1)
    ax.set(xscale="log", ylim=(-0.1, 1.05), xlabel=MEASURES["hardness"], ylabel=MEASURES["lump_fraction"])
    ax.legend(frameon=False, fontsize=8)
    save(figure, evidence.folder / "scatter.png")
