"""The energy ledger of runs: how much each cause gave to the snow over time, and what no cause explains."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...evidence.gather import Evidence, sort_as_in_paper
from ...mpm.ledger import CAUSES, WORKS
from ...quantities import add_unit, format_unit
from ...store.run import Run
from ...text import make_cells
from ..document import NO_RESULT, FigureContent, Picture, Table, escape
from ..drawing.common import save_figure
from .kinds import FigureKind

if TYPE_CHECKING:
    from matplotlib.artist import Artist

LABELS = {**{cause.name: cause.label for cause in CAUSES}, "unclosed_energy": "unclosed: stepping in time"}
CYCLE = ("#E69F00", "#009E73", "#CC79A7", "#0072B2", "#56B4E9", "#7f4f24", "#999999", "#8d99ae")
COLOURS = dict(zip(WORKS, itertools.cycle(CYCLE), strict=False))
UNCLOSED = "#d62728"
PICTURE = Picture(
    "energy.png",
    "Energy over time at the highest pressure, a row for each kind of snow: kinetic and elastic energy, and what each "
    "cause gave.",
    "The highest pressure; the table has all. Left while pressed, right from the release on; each panel has its own "
    "scale. Black: kinetic and elastic energy together. Colours: what each cause has given since the panel's start "
    "(losses are negative); they add up to the change of the black line but for the red one.",
    data="energy.csv",
)
TURNED_OVER = (
    "Turned over: the sum of all that causes gave or took, frame by frame, without sign. The other columns are parts "
    "of it; unclosed is summed frame by frame without sign, net with sign."
)


def report(evidence: Evidence) -> FigureContent:
    """Draw the stages of a run of each kind, and tabulate the total of each cause for all."""
    runs = [run for run in sort_as_in_paper(evidence.runs) if evidence.is_done(run)]
    ledgers = [_read_ledger(run) for run in runs]
    if not runs:
        return NO_RESULT
    drawn = _choose_drawn(runs)
    draw_ledgers([runs[number] for number in drawn], [ledgers[number] for number in drawn], evidence)
    rows = [row for run, ledger in zip(runs, ledgers, strict=True) for row in _make_rows(run, ledger)]
    table = pd.DataFrame(rows)
    make_cells(table).to_csv(evidence.folder / "energy.csv", index=False, float_format="%.6g", lineterminator="\n")
    worst = {stage: part["unclosed"].max() for stage, part in table.groupby("stage")}
    verdict = (
        f"Without a cause are at most {worst['pressed']:.1%} of the energy that is turned over while the snow is "
        f"pressed, and {worst['falling']:.1%} from the release on.{_describe_sintering(table, evidence.pressure_unit)}"
    )
    told = [
        _describe_stage(row, evidence.pressure_unit) for number in drawn for row in rows[2 * number : 2 * number + 2]
    ]
    picture = replace(PICTURE, caption=" ".join([PICTURE.caption, *told]))
    momentum = max(_find_unclosed_momentum(ledger) for ledger in ledgers)
    return FigureContent(
        [
            picture,
            TURNED_OVER,
            _format_shares(table, evidence.pressure_unit),
            _explain_ledger(momentum),
        ],
        verdict,
    )


def _choose_drawn(runs: Sequence[Run]) -> list[int]:
    """Choose the runs that are drawn, by their places in ``runs``: of each arm the first at the highest pressure."""
    places = range(len(runs) - 1, -1, -1)  # so that of equal pressures the first stays
    highest = {runs[place].case.arm: place for place in sorted(places, key=lambda place: runs[place].case.pressure)}
    return sorted(highest.values())


def _describe_stage(row: Mapping[str, Any], unit: str) -> str:
    """Describe one stage of a run in a sentence: which causes gave and took most.  ``row``: as of ``_make_rows``."""
    given = sorted(WORKS, key=lambda name: row[name])
    giver, taker = given[-1], given[0]
    gave = f"{LABELS[giver]} gave most ({100 * row[giver]:.0f} %)" if row[giver] > 0 else "nothing gave energy"
    took = f"{LABELS[taker]} took most ({-100 * row[taker]:.0f} %)" if row[taker] < 0 else "nothing took any"
    return (
        f"**{row['pressure']} {unit}, {escape(_name_kind(row['sintering']))}, {row['stage']}**: {gave}, {took}; of "
        f"what was turned over {100 * row['unclosed']:.1f} % is without a cause."
    )


def _name_kind(sintering: str) -> str:
    """Name a kind of snow by its option of sintering."""
    return {"paper": "with sintering", "none": "without sintering"}.get(sintering, f"sintering {sintering}")


def _format_shares(table: pd.DataFrame, unit: str) -> Table:
    """Format the table of the ledgers with shares in percent; without damping if there was none."""
    shares = table.copy()
    for name in ("unclosed", "unclosed_net", *WORKS):
        shares[name] = shares[name].map("{:+.1%}".format)
    shares = shares.drop(columns=["damping_work"]) if (table["damping_work"] == 0).all() else shares
    heads = {"pressure": add_unit("pressure", unit), "unclosed_net": "unclosed, net", "turned_over": "turned over"}
    return Table(shares.rename(columns={**LABELS, **heads}))


def _explain_ledger(momentum: float) -> str:
    """Explain how each cause is measured.  ``momentum``: the largest part of it that no cause explains."""
    return (
        "Each cause is measured where it acts, so the rest is not zero by construction: pressing as b times the way "
        "of each particle; plastic flow as stress times plastic strain; the floor and damping as impulse times the "
        "mean velocity on each node, and by particles that slide or are moved out; the transfer as kinetic energy "
        "that the grid does not get or give back. What is left is the error of stepping in time: it shrinks with "
        "the time step, but slower on nodes that the floor holds (tests/validation/test_step_energy.py). Momentum "
        f"closes to round-off: of its largest value no frame leaves more than {momentum:.0e}."
    )


def _describe_sintering(table: pd.DataFrame, unit: str) -> str:
    """Say how much energy sintering adds compared with pressing, in the run where it is most; empty if none."""
    pressed = table[(table["stage"] == "pressed") & (table["pressing_work"] > 0)]
    ratio = pressed["sintering_work"] / pressed["pressing_work"]
    if not (ratio > 0).any():
        return ""
    most = table.loc[ratio.idxmax()]
    return (
        f" At pressure {most['pressure']} {unit} sintering, by making strained snow stiffer, puts in "
        f"{ratio.max():.1f} times the energy that the pressing force does."
    )


def _read_ledger(run: Run) -> xr.Dataset:
    """Read the diagnostics of a run that the ledger needs."""
    names = [*LABELS, "kinetic_energy", "elastic_energy", "momentum_y", "unclosed_momentum_x", "unclosed_momentum_y"]
    with run.open() as dataset:
        return dataset[names].load()


def _find_unclosed_momentum(ledger: xr.Dataset) -> float:
    """Find the largest momentum of a frame that no cause explains, divided by the largest momentum."""
    unclosed = max(float(abs(ledger[f"unclosed_momentum_{axis}"]).max()) for axis in "xy")
    return unclosed / float(abs(ledger["momentum_y"]).max())


def _list_stages(run: Run, ledger: xr.Dataset) -> dict[str, tuple[int, int]]:
    """List the stages of a run with their first and last frame; ``ledger``: its diagnostics."""
    release, end = run.case.loading.press_frames, ledger.sizes["frame"] - 1
    return {"pressed": (0, release), "falling": (release, end)}


def _make_rows(run: Run, ledger: xr.Dataset) -> list[dict[str, Any]]:
    """Make one row for each stage: what each cause gave, as parts of the turnover."""
    rows = []
    for stage, (first, last) in _list_stages(run, ledger).items():
        part = ledger.isel(frame=slice(first + 1, last + 1))
        turned_over = float(sum(abs(part[name]).sum() for name in WORKS))
        shares = {name: float(part[name].sum()) / turned_over for name in WORKS}
        unclosed = part["unclosed_energy"]
        rows.append(
            {
                "sintering": run.case.sintering.name,
                "pressure": f"{run.case.pressure:g}",
                "stage": stage,
                "turned_over": turned_over,
                "unclosed": float(abs(unclosed).sum()) / turned_over,
                "unclosed_net": float(unclosed.sum()) / turned_over,
                **shares,
            }
        )
    return rows


def draw_ledgers(runs: Sequence[Run], ledgers: Sequence[xr.Dataset], evidence: Evidence) -> None:
    """Draw a row for each run: pressed on the left, falling on the right."""
    figure = Figure(figsize=(9.2, 2.6 * len(runs) + 0.9), layout="constrained")
    axes = figure.subplots(len(runs), 2, squeeze=False)
    for row, run, ledger in zip(axes, runs, ledgers, strict=True):
        for ax, (stage, (first, last)) in zip(row, _list_stages(run, ledger).items(), strict=True):
            _draw_panel(ax, ledger, first, last)
            sintered = "with sintering" if run.case.sintering.enabled else "without sintering"
            ax.set_title(f"{run.case.pressure:g} {evidence.pressure_unit}, {sintered}: {stage}", fontsize=9)
    for ax in axes[-1]:
        ax.set_xlabel("frame", fontsize=9)
    unit = format_unit(ledgers[0]["kinetic_energy"].attrs["units"])
    figure.supylabel(add_unit("energy", unit), fontsize=9)
    handles: dict[str, Artist] = {}
    for ax in axes.flat:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(list(handles.values()), list(handles), loc="outside upper center", ncols=5, frameon=False, fontsize=8)
    save_figure(figure, evidence.folder / "energy.png")


def _draw_panel(ax: Axes, ledger: xr.Dataset, first: int, last: int) -> None:
    """Draw the energy, and what each cause has given since the stage began."""
    frames = np.arange(first, last + 1)
    energy = ledger["kinetic_energy"].values + ledger["elastic_energy"].values
    ax.axhline(0, color="0.85", lw=0.6)
    for name in WORKS:
        total = np.concatenate([[0.0], np.cumsum(ledger[name].values[first + 1 : last + 1])])
        if total.any():
            ax.plot(frames, total, color=COLOURS[name], lw=1.2, label=LABELS[name])
    ax.plot(frames, energy[first : last + 1], color="black", lw=1.2, label="kinetic + elastic energy")
    unclosed = np.concatenate([[0.0], np.cumsum(ledger["unclosed_energy"].values[first + 1 : last + 1])])
    ax.plot(frames, unclosed, color=UNCLOSED, lw=1.2, ls="--", label=LABELS["unclosed_energy"])
    ax.tick_params(labelsize=8)
    ax.ticklabel_format(axis="y", scilimits=(0, 0))
    ax.yaxis.get_offset_text().set_fontsize(8)
    ax.margins(x=0.01)


FIGURE = FigureKind(report)
