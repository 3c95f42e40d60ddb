"""The grid of all scenes: which claims the numbers agree with where, lumps over pressure, and how the snow ends."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis.claims import ARMS, Scene, Verdict, arm_of
from ..analysis.classify import classify
from ..config import Claims, Config
from . import claims as verdicts
from .document import Block, Findings, Heading, Picture, Table, plain
from .drawing import crop, draw_snow, draw_stage, fragment_colours, save
from .evidence import Evidence, opened
from .response import disagreed

PANEL = 1.75  # width of a panel [inches]
HEAT = "cividis"


def report(evidence: Evidence) -> Findings:
    """Counts of the claims over scenes, heat map, curves, contact sheets, and a row a scene."""
    claims, over = evidence.configs[0].claims, evidence.over_scenes
    calibrated = evidence.experiment.calibrated_on
    chosen_on = f"The pressures were chosen on {' on '.join(calibrated)}, which is not counted. " if calibrated else ""
    rows = _by_scene(evidence.scenes)
    rows.to_csv(evidence.folder / "scenes.csv", index=False, lineterminator="\n")
    blocks = [
        draw_heatmap(evidence),
        *(block for verdict in over for block in _counts(claims, verdict)),
        f"{chosen_on}Numbers agree or not by their means over the seeds; p is that of an exact binomial "
        "test for agreement in more scenes than not.",
        *_draw_sheets(evidence),
        *verdicts.section(evidence),
        Heading("Scenes"),
        Table(rows.map(plain), "Mass in lumps by arm and pressure.", "scenes.csv"),
    ]
    return Findings(blocks, _sentence(over))


def _sentence(over: Sequence[Verdict]) -> str:
    """What the numbers agree with, and the claims over scenes."""
    parts = [f"Scenes beside the calibrated one whose numbers agree: {v.measured}; {v.claim}: {v.word}." for v in over]
    return " ".join(parts) or "No claim is made over scenes."


def _counts(claims: Claims, verdict: Verdict) -> list[Block]:
    """What a claim over scenes rests on: a row for each claim that it counts."""
    statements = {claim.name: claim.statement for claim in claims.list}
    rows = [
        [c.claim, plain(statements[c.claim]), f"{c.holds} of {c.scenes}", f"{c.p:.2g}", _names(c.against)]
        for c in verdict.counts
    ]
    heads = ["claim", "statement", "numbers agree in", "p (Holm)", "they disagree on"]
    line = f"**{plain(verdict.claim)}: {verdict.word}.** {plain(verdict.statement)} {verdict.note}".rstrip()
    return [line, Table(pd.DataFrame(rows, columns=heads), data="claims.csv")]


def _names(scenes: Sequence[str]) -> str:
    return plain(", ".join(scenes)) or "none"


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
        row["disagrees with"] = disagreed(scene) or "-"
        rows.append(row)
    return pd.DataFrame(rows).fillna("missing")


def _draw_sheets(evidence: Evidence) -> list[Picture]:
    """A contact sheet of final states for the lowest and highest pressure of each arm."""
    pressures = sorted({c.pressure for c in evidence.configs})
    pictures = []
    for enabled, arm in ((True, "sintered"), (False, "unsintered")):
        for pressure in dict.fromkeys((pressures[0], pressures[-1])):
            chosen = [c for c in evidence.of_first_seed if (c.sintering.enabled, c.pressure) == (enabled, pressure)]
            if not chosen:
                continue
            name = f"{arm}-{pressure:g}.png"
            _draw_sheet(chosen, evidence, name)
            picture = Picture(
                name,
                f"Last frame of every {arm} scene at pressure {pressure:g}: a row a shape, a column a floor.",
                f"Last frame, {arm}, pressure {pressure:g}, seed {evidence.seeds[0]}: lumps in colours, powder in "
                "grey.",
                data="summary.csv",
            )
            pictures.append(picture)
    return pictures


def _draw_sheet(configs: Sequence[Config], evidence: Evidence, name: str) -> None:
    """Last frames by fragment, a row a shape, a column a floor; the highest scene of a row sets its height."""
    shapes, floors = _shapes_and_floors(evidence)
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


def _shapes_and_floors(evidence: Evidence) -> tuple[list[str], list[str]]:
    """In the order in which they were asked for."""
    shapes = list(dict.fromkeys(config.shape.name for config in evidence.configs))
    return shapes, list(dict.fromkeys(config.floor.name for config in evidence.configs))


def draw_heatmap(evidence: Evidence) -> Picture:
    """Mass in lumps of every scene: a panel a pressure with sintering, and one for the most without."""
    shapes, floors = _shapes_and_floors(evidence)
    panels = _panels(evidence.scenes) or {"no run has a result": {}}
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    size = ((0.62 * len(floors) + 0.6) * columns + 0.9, (0.42 * len(shapes) + 0.75) * rows + 0.3)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for ax, (title, lumps) in zip(axes.flat, panels.items(), strict=False):
        grid = np.array([[lumps.get((shape, floor), np.nan) for floor in floors] for shape in shapes])
        shown = ax.imshow(grid, cmap=HEAT, vmin=0, vmax=1, aspect="auto")
        _write_cells(ax, grid)
        ax.set_title(title, fontsize=9)
        ax.set_xticks(range(len(floors)), floors, fontsize=8, rotation=30, ha="right")
        ax.set_yticks(range(len(shapes)), shapes, fontsize=8)
        ax.tick_params(length=0)
    for ax in axes.flat[len(panels) :]:
        ax.set_axis_off()
    figure.colorbar(shown, ax=axes, label="mass in lumps [1]", shrink=0.8)
    save(figure, evidence.folder / "heatmap.png")
    return Picture(
        "heatmap.png",
        f"Heat map of the mass in lumps of {len(evidence.scenes)} scenes: a row a shape, a column a floor, a panel a "
        "pressure with sintering, and one without.",
        "Mass in lumps by scene, mean over seeds. With sintering the cells should go from below to above one half; "
        "without they should stay below. A dash: a run is missing.",
        data="scenes.csv",
    )


def _panels(scenes: Sequence[Scene]) -> dict[str, dict[tuple[str, str], float]]:
    """By title the lumps of each scene, by shape and floor; NaN where a run is missing."""
    means = {(s.shape, s.floor): {arm: arm_of(s.table, arm, "lump_fraction").mean() for arm in ARMS} for s in scenes}
    lost = {(s.shape, s.floor): s.missing for s in scenes}
    sintered, unsintered = ARMS
    panels = {}
    for pressure in sorted({p for by_arm in means.values() for p in by_arm[sintered].index}):
        panels[f"with sintering, pressure {pressure:g}"] = {
            at: by_arm[sintered].get(pressure, np.nan)
            for at, by_arm in means.items()
            if not any(name != "none" and p == pressure for name, p in lost[at])
        }
    most = {
        at: by_arm[unsintered].max()
        for at, by_arm in means.items()
        if len(by_arm[unsintered]) and not any(name == "none" for name, _ in lost[at])
    }
    return panels | ({"without sintering, the most of any pressure": most} if most else {})


def _write_cells(ax: Axes, grid: np.ndarray) -> None:
    """The number in each cell, dark on bright and bright on dark."""
    for (row, column), value in np.ndenumerate(grid):
        text = "-" if np.isnan(value) else f"{value:.2f}"
        ax.text(column, row, text, ha="center", va="center", fontsize=8, color="white" if value < 0.55 else "black")
