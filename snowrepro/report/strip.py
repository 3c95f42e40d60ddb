"""Figures 5 and 6: rows of runs over columns of frames, and the verdict on the claims."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ..analysis import claims
from ..analysis.classify import classify
from ..config import Config
from . import broken, sensitivity
from .drawing import SNOW, column_title, crop, draw_snow, draw_stage, fragment_colours, save
from .evidence import Evidence, Findings, in_paper_order, judged_scenes, markdown, opened

PANEL = 2.3  # width of a panel [inches]


@dataclass(frozen=True)
class Row:
    """One row of a strip: its label, and by frame its particles' places (n, 2) and colours by fragment (n,)."""

    label: str
    places: dict[int, np.ndarray]  # empty if the run is missing
    colours: dict[int, np.ndarray]  # by fragment, from release on


def report(evidence: Evidence) -> Findings:
    """The paper's figure, the same by fragment, the claims, and whether they hang on the definition of a lump."""
    experiment, first = evidence.experiment, evidence.configs[0]
    rows = [_row(config, evidence) for config in in_paper_order(evidence.configs)]
    draw_strip(rows, experiment.frames, first, evidence.folder / "strip.png", by_fragment=False)
    draw_strip(rows, experiment.frames, first, evidence.folder / "fragments.png", by_fragment=True)
    scenes = judged_scenes(evidence)
    verdict = " ".join(claims.sentence(scene.table, scene.verdicts) for scene in scenes)
    lines = [
        f"**Verdict.** {verdict}",
        "",
        '"More lumps than powder" is read as: more than half of the mass is in lumps. '
        "Means over seeds; the numbers are the mass fraction in lumps. conf/claims/paper.yaml says by which rule each "
        f"claim is decided. One seed decides nothing: `snowrepro claims experiment={experiment.name} seeds=3` does"
        + (": [what it found](claims/index.md)." if (evidence.folder / "claims" / "index.md").exists() else "."),
        "",
        *(line for scene in scenes for line in _verdict_table(scene)),
        f"![Snow at {len(experiment.frames)} times, a row for each pressure, first with and then without sintering]"
        "(strip.png)",
        "",
        "The runs in the paper's order and colours: pressure rises downwards, first with sintering, then without.",
        "",
        "![The same, coloured by fragment: lumps in colours, powder in grey](fragments.png)",
        "",
        "The same by fragment, from release on: each lump has a colour and keeps it, powder is grey.",
        "",
        *broken.section(evidence),
        *sensitivity.section(evidence),
    ]
    return Findings(lines, verdict)


def _verdict_table(scene: claims.Scene) -> list[str]:
    """A row a claim: what was measured, how it was decided, and what is against it."""
    heads = ["claim", "statement", "measured", "seeds", "verdict", "against it", "note"]
    rows = [
        [v.claim, v.statement, v.measured, v.seeds, v.shown, "; ".join(v.disagrees) or "-", v.note or "-"]
        for v in scene.verdicts
    ]
    return [f"Snow and floor: {scene.name}.", "", *markdown(pd.DataFrame(rows, columns=heads)), ""]


def draw_strip(rows: Sequence[Row], frames: Sequence[int], config: Config, path: Path, by_fragment: bool) -> None:
    """Draw rows of runs over columns of frames; coloured as the paper's figure, or by fragment."""
    width, height = crop(config)
    figure = Figure(figsize=(PANEL * len(frames) + 1.35, PANEL * height / width * len(rows) + 0.45))
    figure.set_facecolor("white")
    grid = figure.subplots(len(rows), len(frames), squeeze=False)
    figure.subplots_adjust(
        left=1.3 / figure.get_figwidth(),
        right=0.998,
        bottom=0.004,
        top=1 - 0.42 / figure.get_figheight(),
        wspace=0.02,
        hspace=0.03,
    )
    for row, axes in zip(rows, grid, strict=True):
        for frame, ax in zip(frames, axes, strict=True):
            draw_stage(ax, config)
            if not row.places:
                ax.text(0.5, 0.5, "missing", transform=ax.transAxes, ha="center", color="white")
                continue
            colour = row.colours.get(frame, SNOW) if by_fragment else SNOW
            draw_snow(ax, config, row.places[frame], PANEL * 72 / width, colour)
        axes[0].set_ylabel(row.label, rotation=0, ha="right", va="center", fontsize=9, labelpad=8)
    for frame, ax in zip(frames, grid[0], strict=True):
        ax.set_title(column_title(frame, config), fontsize=9)
    save(figure, path)


def _row(config: Config, evidence: Evidence) -> Row:
    arm = "sintering" if config.sintering.enabled else "no sintering"
    label = f"pressure {config.pressure:g}\n{arm}"
    if not evidence.is_done(config):
        return Row(label, {}, {})
    frames = evidence.experiment.frames
    later = [frame for frame in frames if frame >= config.loading.press_frames]
    with opened(config) as dataset:
        fragments = classify(dataset, config.analysis, frames=later).fragments if later else []
        places = {frame: dataset["position"].sel(snapshot=frame).values for frame in frames}
    painted = zip(fragments, fragment_colours(fragments), strict=True)
    return Row(label, places, {found.frame: colours for found, colours in painted})
