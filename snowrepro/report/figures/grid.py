"""The grid of all scenes: where the numbers agree with which claims, lumps over pressure, and final states."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from ...evidence.claims import ARMS, JudgedScene, ShapeCount, Verdict, select_arm
from ...evidence.gather import Evidence
from ...settings.question import Claims
from ...summary.row import ARM
from ...text import make_cells
from ..document import Block, FigureContent, Heading, Picture, Table, escape
from ..drawing.common import choose_font, save_figure
from ..drawing.ends import draw_ends, read_end
from ..sections import claims as claims_section
from ..sections.response import list_disagreements
from .kinds import FigureKind

PANEL = 1.75  # width of a panel [inches]
HEAT = "cividis"


def report(evidence: Evidence) -> FigureContent:
    """Draw heat map, contact sheets and curves of all scenes, and count the claims over scenes."""
    claims, over_scenes = evidence.runs[0].config.question.claims, evidence.over_scenes
    calibrated = evidence.experiment.calibrated_on
    chosen_on = f"The pressures were chosen on {' on '.join(calibrated)}, which is not counted. " if calibrated else ""
    rows = _tabulate_scenes(evidence.scenes)
    make_cells(rows).to_csv(evidence.folder / "scenes.csv", index=False, lineterminator="\n")
    blocks: list[Block] = [
        draw_heatmap(evidence),
        *(block for verdict in over_scenes for block in _describe_counts(claims, verdict)),
        (
            f"{chosen_on}Numbers agree or not by their means over the seeds. Margins are those of the means to the "
            "threshold, negative where they disagree. Scenes of one shape are no independent trials: they are counted "
            "by shape, without a p."
        ),
        *_draw_sheets(evidence),
        *claims_section.make_blocks(evidence),
        Heading("Scenes"),
        Table(rows.map(escape), f"Mass in lumps by arm and pressure [{evidence.pressure_unit}].", "scenes.csv"),
    ]
    return FigureContent(blocks, _summarise(over_scenes))


def _summarise(over_scenes: Sequence[Verdict]) -> str:
    """Say with which claims the numbers agree, and what the claims over scenes come to."""
    parts = [
        f"By other scenes the numbers agree with {verdict.measured}; {verdict.claim}: {verdict.word}."
        for verdict in over_scenes
    ]
    return " ".join(parts) or "No claim is made over scenes."


def _describe_counts(claims: Claims, verdict: Verdict) -> list[Block]:
    """Describe what a claim over scenes rests on: a row for each claim that it counts, a column for each shape."""
    statements = {claim.name: claim.statement for claim in claims.list}
    rows = [
        {
            "claim": count.claim,
            "statement": escape(statements[count.claim]),
            **{escape(shape.shape): _format_shape(shape) for shape in count.by_shape},
            "holds on": f"{count.holds} of {len(count.by_shape)} shapes" if count.by_shape else "not run",
            "they disagree on": _format_names(count.against),
        }
        for count in verdict.counts
    ]
    line = f"**{escape(verdict.claim)}: {verdict.word}.** {escape(verdict.statement)} {escape(verdict.note)}".rstrip()
    table = Table(pd.DataFrame(rows), "Scenes that agree, and the margins from least to most.", data="claims.csv")
    return [line, table]


def _format_shape(shape: ShapeCount) -> str:
    """Format in how many scenes of a shape the numbers agree, and by which margins."""
    return f"{shape.agree} of {shape.scenes} ({shape.least:+.2f} to {shape.most:+.2f})"


def _format_names(scenes: Sequence[str]) -> str:
    """Format the names of scenes."""
    return escape(", ".join(scenes)) or "none"


def _tabulate_scenes(scenes: Sequence[JudgedScene]) -> pd.DataFrame:
    """Tabulate the mass in lumps of each scene by arm and pressure, and the claims that its numbers disagree with."""
    rows = []
    for scene in scenes:
        row: dict[str, Any] = {"shape": scene.shape, "floor": scene.floor}
        for arm in ARMS:
            of_arm = scene.table[scene.table[ARM] == arm] if len(scene.table) else scene.table
            for pressure, part in of_arm.groupby("pressure") if len(of_arm) else ():
                row[f"{arm}, {pressure:g}"] = f"{part['lump_fraction'].mean():.2f}"
        row["unsettled"] = str(int((~scene.table["settled"]).sum())) if len(scene.table) else None
        row["disagrees with"] = _describe_disagreements(scene)
        rows.append(row)
    return pd.DataFrame(rows).fillna("missing")


def _describe_disagreements(scene: JudgedScene) -> str:
    """Say with which claims a scene's numbers disagree, and which were not judged."""
    unjudged = " ".join(verdict.claim for verdict in scene.verdicts if verdict.agrees is None)
    against = list_disagreements(scene)
    return "; ".join(filter(None, (against, unjudged and f"not judged: {unjudged}"))) or "none"


def _draw_sheets(evidence: Evidence) -> list[Picture]:
    """Draw a contact sheet of final states for the lowest and highest pressure of each arm."""
    pressures = sorted({run.case.pressure for run in evidence.runs})
    pictures = []
    for arm in ARMS:
        for pressure in dict.fromkeys((pressures[0], pressures[-1])):
            chosen = [run for run in evidence.first_seed_runs if (run.case.arm, run.case.pressure) == (arm, pressure)]
            if not chosen:
                continue
            name = f"{arm}-{pressure:g}.png"
            ends = {(run.case.shape.name, run.case.floor.name): read_end(run, evidence.is_done(run)) for run in chosen}
            draw_ends(ends, *_list_shapes_and_floors(evidence), PANEL, evidence.folder / name)
            picture = Picture(
                name,
                f"Last frame of every {arm} scene at pressure {pressure:g}: a row a shape, a column a floor.",
                f"Last frame, {arm}, pressure {pressure:g} {evidence.pressure_unit}, seed {evidence.seeds[0]}: "
                "each lump in a colour, crushed snow dark, loose snow the colour of sand.",
                data="summary.csv",
            )
            pictures.append(picture)
    return pictures


def _list_shapes_and_floors(evidence: Evidence) -> tuple[list[str], list[str]]:
    """List shapes and floors in the order in which they were asked for."""
    shapes = list(dict.fromkeys(run.case.shape.name for run in evidence.runs))
    return shapes, list(dict.fromkeys(run.case.floor.name for run in evidence.runs))


def draw_heatmap(evidence: Evidence) -> Picture:
    """Draw the mass in lumps of every scene; returns the picture.

    There is a panel for each pressure with sintering, and one for the most of any pressure without.
    """
    shapes, floors = _list_shapes_and_floors(evidence)
    panels = _list_panels(evidence.scenes) or {"no run has a result": {}}
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    size = ((0.62 * len(floors) + 0.6) * columns + 0.9, (0.42 * len(shapes) + 0.75) * rows + 0.3)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for ax, (title, lumps) in zip(axes.flat, panels.items(), strict=False):
        grid = np.array([[lumps.get((shape, floor), np.nan) for floor in floors] for shape in shapes])
        image = _draw_heatmap_panel(ax, grid, shapes, floors, choose_font(size[0], 8.0))
        ax.set_title(title, fontsize=choose_font(size[0]))
    for ax in axes.flat[len(panels) :]:
        ax.set_axis_off()
    figure.colorbar(image, ax=axes, label="mass in lumps", shrink=0.8)
    save_figure(figure, evidence.folder / "heatmap.png")
    return Picture(
        "heatmap.png",
        f"Heat map of the mass in lumps of {len(evidence.scenes)} scenes: a row a shape, a column a floor, a panel a "
        "pressure with sintering, and one without.",
        f"Mass in lumps by scene, mean over seeds; pressures in {evidence.pressure_unit}. With sintering the "
        "cells should go from below to above one half; "
        "without they should stay below. A dash: a run is missing.",
        data="scenes.csv",
    )


def _draw_heatmap_panel(ax: Axes, grid: np.ndarray, shapes: list[str], floors: list[str], letters: float) -> AxesImage:
    """Draw the mass in lumps by shape and floor, ``grid`` (shapes, floors); ``letters``: their points."""
    image = ax.imshow(grid, cmap=HEAT, vmin=0, vmax=1, aspect="auto")
    _write_cells(ax, grid, letters)
    ax.set_xticks(range(len(floors)), floors, fontsize=letters, rotation=30, ha="right")
    ax.set_yticks(range(len(shapes)), shapes, fontsize=letters)
    ax.tick_params(length=0)
    return image


def _list_panels(scenes: Sequence[JudgedScene]) -> dict[str, dict[tuple[str, str], float]]:
    """List the panels of the heat map by title: the mass in lumps by shape and floor.

    Where a run is missing there is NaN or no entry.
    """
    means = {
        (scene.shape, scene.floor): {arm: select_arm(scene.table, arm, "lump_fraction").mean() for arm in ARMS}
        for scene in scenes
    }
    missing = {(scene.shape, scene.floor): scene.missing for scene in scenes}
    sintered, unsintered = ARMS
    panels = {}
    for pressure in sorted({pressure for by_arm in means.values() for pressure in by_arm[sintered].index}):
        panels[f"with sintering, pressure {pressure:g}"] = {
            place: by_arm[sintered].get(pressure, np.nan)
            for place, by_arm in means.items()
            if (sintered, pressure) not in missing[place]
        }
    most = {
        place: by_arm[unsintered].max()
        for place, by_arm in means.items()
        if len(by_arm[unsintered]) and not any(arm == unsintered for arm, _ in missing[place])
    }
    return panels | ({"without sintering, the most of any pressure": most} if most else {})


def _write_cells(ax: Axes, grid: np.ndarray, letters: float) -> None:
    """Write the number into each cell, dark on bright and bright on dark."""
    for (row, column), value in np.ndenumerate(grid):
        text = "-" if np.isnan(value) else f"{value:.2f}"
        ax.text(
            column, row, text, ha="center", va="center", fontsize=letters, color="white" if value < 0.55 else "black"
        )


FIGURE = FigureKind(report, is_judged=True)
