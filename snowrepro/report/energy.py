"""The energy ledger of runs: what each cause gave to the snow over time, and what no cause explains."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..config import Config
from ..mpm.diagnostics import WORKS
from .document import NOTHING, Findings, Picture, Table
from .drawing import save
from .evidence import Evidence, in_paper_order, opened

LABELS = {
    "pressing_work": "pressing force b",
    "gravity_work": "gravity",
    "sintering_work": "sintering",
    "plastic_work": "plastic flow",
    "hardening_work": "hardening (Eq. 1)",
    "floor_work": "floor",
    "damping_work": "damping",
    "transfer_work": "particle-grid transfer",
    "unclosed_energy": "unclosed: stepping in time",
}
COLOURS = dict(
    zip(LABELS, ("#E69F00", "#009E73", "#CC79A7", "#0072B2", "#56B4E9", "#7f4f24", "#999999", "#8d99ae"), strict=False)
)
UNCLOSED = "#d62728"


def report(evidence: Evidence) -> Findings:
    """A panel for each run and stage, and what each cause comes to."""
    configs = [config for config in in_paper_order(evidence.configs) if evidence.is_done(config)]
    ledgers = [_ledger(config) for config in configs]
    if not configs:
        return NOTHING
    draw(configs, ledgers, evidence)
    table = pd.DataFrame([row for c, ledger in zip(configs, ledgers, strict=True) for row in _rows(c, ledger)])
    table.to_csv(evidence.folder / "energy.csv", index=False, float_format="%.6g", lineterminator="\n")
    worst = {stage: part["unclosed"].max() for stage, part in table.groupby("stage")}
    verdict = (
        f"Without a cause are at most {worst['pressed']:.1%} of the energy that is turned over while the snow is "
        f"pressed, and {worst['falling']:.1%} from the release on.{_about_sintering(table)}"
    )
    shown = table.copy()
    for name in ("unclosed", "unclosed_net", *WORKS):
        shown[name] = shown[name].map("{:+.1%}".format)
    shown = shown.drop(columns=["damping_work"]) if (table["damping_work"] == 0).all() else shown
    picture = Picture(
        "energy.png",
        "Energy over time, a row for each run: kinetic and elastic energy, and what each cause gave.",
        "Left while pressed, right from the release on; each panel has its own scale. Black: kinetic and elastic "
        "energy together. Colours: what each cause has given since the panel's start (losses are negative); they "
        "add up to the change of the black line but for the red one.",
        data="energy.csv",
    )
    blocks = [
        picture,
        "Turned over: the sum of all that causes gave or took, frame by frame, without sign. The other columns are "
        "parts of it; unclosed is summed frame by frame without sign, net with sign.",
        Table(shown.rename(columns={**LABELS, "unclosed_net": "unclosed, net", "turned_over": "turned over"})),
        "Each cause is measured where it acts, so the rest is not zero by construction: pressing as b times the way "
        "of each particle; plastic flow as stress times plastic strain; the floor and damping as impulse times the "
        "mean velocity on each node, and by particles that slide or are moved out; the transfer as kinetic energy "
        "that the grid does not get or give back. What is left is the error of stepping in time, in proportion to the "
        "time step (tests/validation/test_ledger.py). Momentum closes to round-off: of its largest value no frame "
        f"leaves more than {max(_momentum(ledger) for ledger in ledgers):.0e}.",
    ]
    return Findings(blocks, verdict)


def _about_sintering(table: pd.DataFrame) -> str:
    """How much energy sintering puts into the snow that pressing did not, where it is most."""
    pressed = table[(table["stage"] == "pressed") & (table["pressing_work"] > 0)]
    ratio = pressed["sintering_work"] / pressed["pressing_work"]
    if not (ratio > 0).any():
        return ""
    most = table.loc[ratio.idxmax()]
    return (
        f" At pressure {most['pressure']} sintering, by making strained snow stiffer, puts in {ratio.max():.1f} times "
        "the energy that the pressing force does."
    )


def _ledger(config: Config) -> xr.Dataset:
    """The diagnostics of a run that the ledger needs."""
    names = [*LABELS, "kinetic_energy", "elastic_energy", "momentum_y", "unclosed_momentum_x", "unclosed_momentum_y"]
    with opened(config) as dataset:
        return dataset[names].load()


def _momentum(ledger: xr.Dataset) -> float:
    """Largest momentum of a frame that no cause explains, over the largest momentum."""
    rest = max(float(abs(ledger[f"unclosed_momentum_{axis}"]).max()) for axis in "xy")
    return rest / float(abs(ledger["momentum_y"]).max())


def _stages(config: Config) -> dict[str, tuple[int, int]]:
    return {
        "pressed": (0, config.loading.press_frames),
        "falling": (config.loading.press_frames, config.loading.frames),
    }


def _rows(config: Config, ledger: xr.Dataset) -> list[dict[str, float | str]]:
    """One row a stage: what each cause gave, as parts of the turnover."""
    rows = []
    for stage, (first, last) in _stages(config).items():
        part = ledger.isel(frame=slice(first + 1, last + 1))
        turned_over = float(sum(abs(part[name]).sum() for name in WORKS))
        shares = {name: float(part[name].sum()) / turned_over for name in WORKS}
        rest = part["unclosed_energy"]
        rows.append(
            {
                "sintering": config.sintering.name,
                "pressure": f"{config.pressure:g}",
                "stage": stage,
                "turned_over": turned_over,
                "unclosed": float(abs(rest).sum()) / turned_over,
                "unclosed_net": float(rest.sum()) / turned_over,
                **shares,
            }
        )
    return rows


def draw(configs: Sequence[Config], ledgers: Sequence[xr.Dataset], evidence: Evidence) -> None:
    """A row for each run: pressed and falling."""
    figure = Figure(figsize=(10, 2.1 * len(configs) + 0.8), layout="constrained")
    axes = figure.subplots(len(configs), 2, squeeze=False)
    for row, config, ledger in zip(axes, configs, ledgers, strict=True):
        for ax, (stage, (first, last)) in zip(row, _stages(config).items(), strict=True):
            _panel(ax, ledger, first, last)
            sintered = "with sintering" if config.sintering.enabled else "without sintering"
            ax.set_title(f"pressure {config.pressure:g}, {sintered}: {stage}", fontsize=9)
    for ax in axes[-1]:
        ax.set_xlabel("frame", fontsize=9)
    unit = ledgers[0]["kinetic_energy"].attrs["units"]
    figure.supylabel(f"energy [{unit}]", fontsize=9)
    handles = {}
    for ax in axes.flat:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(handles.values(), handles.keys(), loc="outside upper center", ncols=5, frameon=False, fontsize=8)
    save(figure, evidence.folder / "energy.png")


def _panel(ax: Axes, ledger: xr.Dataset, first: int, last: int) -> None:
    """The energy and what each cause has given since the stage began."""
    frames = np.arange(first, last + 1)
    energy = ledger["kinetic_energy"].values + ledger["elastic_energy"].values
    ax.axhline(0, color="0.85", lw=0.6)
    for name in WORKS:
        given = np.concatenate([[0.0], np.cumsum(ledger[name].values[first + 1 : last + 1])])
        if given.any():
            ax.plot(frames, given, color=COLOURS[name], lw=1.2, label=LABELS[name])
    ax.plot(frames, energy[first : last + 1], color="black", lw=1.2, label="kinetic + elastic energy")
    rest = np.concatenate([[0.0], np.cumsum(ledger["unclosed_energy"].values[first + 1 : last + 1])])
    ax.plot(frames, rest, color=UNCLOSED, lw=1.2, ls="--", label=LABELS["unclosed_energy"])
    ax.tick_params(labelsize=8)
    ax.ticklabel_format(axis="y", scilimits=(0, 0))
    ax.yaxis.get_offset_text().set_fontsize(8)
    ax.margins(x=0.01)
