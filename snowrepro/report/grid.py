"""The grid of all scenes: which claims hold where, lumps over pressure, and how the snow ends."""

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd
from matplotlib.figure import Figure

from ..analysis import claims
from ..analysis.classify import classify
from ..config import Config
from .drawing import crop, draw_snow, draw_stage, fragment_colours, save
from .evidence import Evidence, Findings, markdown, opened

SINTERED, UNSINTERED = "#D55E00", "#555555"
PANEL = 1.75  # width of a panel [inches]


@dataclass(frozen=True)
class Scene:
    """One shape on one floor: its runs' numbers and the verdicts on them."""

    shape: str
    floor: str
    table: pd.DataFrame
    verdicts: list[claims.Verdict]

    def holds(self, claim: str) -> bool:
        """Whether the claim was put to a test here and passed."""
        return any(v.claim == claim and v.word == claims.REPRODUCED for v in self.verdicts)

    def fails(self, claim: str) -> bool:
        """Whether it failed."""
        return any(v.claim == claim and v.word == claims.CONTRADICTED for v in self.verdicts)


def report(evidence: Evidence) -> Findings:
    """Counts of the claims over scenes, curves, contact sheets, and a row a scene."""
    scenes = _scenes(evidence)
    shapes = list(dict.fromkeys(scene.shape for scene in scenes))
    floors = list(dict.fromkeys(scene.floor for scene in scenes))
    _draw_curves(scenes, shapes, floors, evidence)
    sheets = _draw_sheets(shapes, floors, evidence)
    verdict = _sentence(scenes)
    calibrated = evidence.experiment.calibrated_on
    lines = [
        f"**Verdict.** {verdict}",
        "",
        *_counts(scenes),
        "",
        f"The pressures were chosen on {' on '.join(calibrated)}: what holds there by that choice is not counted."
        if calibrated
        else "",
        "One seed a scene: a difference between two pressures may be chance. Lumps are mass fractions.",
        "",
        "![Mass in lumps over pressure, a panel a scene](curves.png)",
        "",
        "Mass in lumps over pressure: with sintering (orange) and without (grey). In the corner: claims that fail.",
        "",
        *sheets,
        "## Scenes",
        "",
        *markdown(_by_scene(scenes)),
        "",
        *_cost(evidence),
    ]
    return Findings(lines, verdict)


def _scenes(evidence: Evidence) -> list[Scene]:
    """Every scene that was asked for, in order."""
    found = []
    for shape, floor in dict.fromkeys((c.shape.name, c.floor.name) for c in evidence.configs):
        table = evidence.table
        if len(table):
            table = table[(table["shape"] == shape) & (table["floor"] == floor)]
        calibrated = evidence.experiment.calibrated_on == (shape, floor)
        lost = evidence.lost(c for c in evidence.configs if (c.shape.name, c.floor.name) == (shape, floor))
        found.append(Scene(shape, floor, table, claims.judge(table, calibrated, lost)))
    return found


def _sentence(scenes: Sequence[Scene]) -> str:
    parts = []
    for verdict in scenes[0].verdicts:
        held, failed = (sum(test(scene, verdict.claim) for scene in scenes) for test in (Scene.holds, Scene.fails))
        parts.append(f"{verdict.claim} in {held} of {held + failed}")
    return f"Of the scenes where a claim was put to a test it holds: {', '.join(parts)}."


def _counts(scenes: Sequence[Scene]) -> list[str]:
    rows = []
    for verdict in scenes[0].verdicts:
        held = sum(scene.holds(verdict.claim) for scene in scenes)
        failing = [f"{scene.shape} on {scene.floor}" for scene in scenes if scene.fails(verdict.claim)]
        rows.append([verdict.claim, verdict.statement, held, len(failing), ", ".join(failing) or "none"])
    return markdown(pd.DataFrame(rows, columns=["claim", "statement", "holds in", "fails in", "fails on"]))


def _by_scene(scenes: Sequence[Scene]) -> pd.DataFrame:
    """Lump fractions of each scene by arm and pressure, and the claims that fail."""
    rows = []
    for scene in scenes:
        row = {"shape": scene.shape, "floor": scene.floor}
        for name, label in (("paper", "sintered"), ("none", "unsintered")):
            arm = scene.table[scene.table["sintering"] == name] if len(scene.table) else scene.table
            for pressure, part in arm.groupby("pressure") if len(arm) else ():
                row[f"{label}, {pressure:g}"] = f"{part['lump_fraction'].mean():.2f}"
        row["unsettled"] = int((~scene.table["settled"]).sum()) if len(scene.table) else 0
        row["fails"] = " ".join(v.claim for v in scene.verdicts if v.word == claims.CONTRADICTED) or "-"
        rows.append(row)
    return pd.DataFrame(rows).fillna("missing")


def _cost(evidence: Evidence) -> list[str]:
    if not len(evidence.table):
        return []
    seconds = evidence.table["seconds"]
    return [
        f"{len(seconds)} runs took {seconds.sum() / 3600:.2f} core-hours in all, the longest {seconds.max():.0f} s.",
        "",
    ]


def _draw_curves(scenes: Sequence[Scene], shapes: list[str], floors: list[str], evidence: Evidence) -> None:
    """Small multiples: a row a shape, a column a floor."""
    figure = Figure(figsize=(PANEL * len(floors) + 0.6, 1.5 * len(shapes) + 0.5), layout="constrained")
    grid = figure.subplots(len(shapes), len(floors), squeeze=False, sharex=True, sharey=True)
    pressures = sorted({c.pressure for c in evidence.configs})
    for scene in scenes:
        ax = grid[shapes.index(scene.shape), floors.index(scene.floor)]
        ax.axhline(0.5, color="0.85", lw=0.8, zorder=0)
        ax.set(xscale="log", ylim=(-0.05, 1.05))
        ax.set_xticks(pressures, [f"{pressure:g}" for pressure in pressures])
        ax.minorticks_off()
        ax.tick_params(labelsize=7)
        for name, colour in (("paper", SINTERED), ("none", UNSINTERED)) if len(scene.table) else ():
            arm = scene.table[scene.table["sintering"] == name].groupby("pressure")["lump_fraction"].mean()
            ax.plot(arm.index, arm, "o-", color=colour, ms=3, lw=1.2)
        failing = " ".join(v.claim for v in scene.verdicts if v.word == claims.CONTRADICTED)
        ax.text(0.04, 0.94, failing, transform=ax.transAxes, va="top", fontsize=7, color="0.3")
    for floor, ax in zip(floors, grid[0], strict=True):
        ax.set_title(floor, fontsize=9)
    for shape, ax in zip(shapes, grid[:, 0], strict=True):
        ax.set_ylabel(shape, fontsize=9)
    figure.supxlabel("nominal pressure [unit of E]", fontsize=9)
    figure.supylabel("mass in lumps [1]", fontsize=9)
    save(figure, evidence.folder / "curves.png")


def _draw_sheets(shapes: list[str], floors: list[str], evidence: Evidence) -> list[str]:
    """A contact sheet of final states for the lowest and highest pressure of each arm."""
    pressures = sorted({c.pressure for c in evidence.configs})
    lines = []
    for enabled, arm in ((True, "sintered"), (False, "unsintered")):
        for pressure in dict.fromkeys((pressures[0], pressures[-1])):
            chosen = [c for c in evidence.configs if c.sintering.enabled == enabled and c.pressure == pressure]
            if not chosen:
                continue
            name = f"{arm}-{pressure:g}.png"
            _draw_sheet(chosen, shapes, floors, evidence, name)
            lines += [
                f"![Last frame of every {arm} scene at pressure {pressure:g}]({name})",
                "",
                f"Last frame, {arm}, pressure {pressure:g}: lumps in colours, powder in grey.",
                "",
            ]
    return lines


def _draw_sheet(configs: Sequence[Config], shapes: list[str], floors: list[str], evidence: Evidence, name: str) -> None:
    """Last frames by fragment, a row a shape, a column a floor; the highest scene of a row sets its height."""
    heights = [max(crop(c)[1] / crop(c)[0] for c in configs if c.shape.name == shape) for shape in shapes]
    size = (PANEL * len(floors) + 0.4, PANEL * sum(heights) + 0.4)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(shapes), len(floors), squeeze=False, gridspec_kw={"height_ratios": heights})
    for config in configs:
        ax = grid[shapes.index(config.shape.name), floors.index(config.floor.name)]
        draw_stage(ax, config)
        ax.set_ylim(0, heights[shapes.index(config.shape.name)] * crop(config)[0])
        if not evidence.is_done(config):
            ax.text(0.5, 0.5, "missing", transform=ax.transAxes, ha="center", color="white")
            continue
        with opened(config) as dataset:
            colours = fragment_colours(classify(dataset, config.analysis).fragments)[0]
            places = dataset["position"][-1].values
        draw_snow(ax, config, places, PANEL * 72 / crop(config)[0], colours)
    for floor, ax in zip(floors, grid[0], strict=True):
        ax.set_title(floor, fontsize=9)
    for shape, ax in zip(shapes, grid[:, 0], strict=True):
        ax.set_ylabel(shape, fontsize=9)
    save(figure, evidence.folder / name)
