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
from . import claims as verdicts
from .document import Findings, Picture, plain
from .drawing import SNOW, column_title, crop, draw_snow, draw_stage, fragment_colours, save
from .evidence import Evidence, in_paper_order, opened

PANEL = 2.3  # width of a panel [inches]


@dataclass(frozen=True)
class Row:
    """One row of a strip: its label, and by frame its particles' places (n, 2), colours by fragment (n,) and lumps."""

    label: str
    places: dict[int, np.ndarray]  # empty if the run is missing
    colours: dict[int, np.ndarray]  # by fragment, from release on
    measures: dict[int, dict[str, float]]  # likewise


def report(evidence: Evidence) -> Findings:
    """The paper's figure, the same by fragment, the claims, and whether they hang on the definition of a lump."""
    experiment, first = evidence.experiment, evidence.configs[0]
    rows = [_row(config, evidence) for config in in_paper_order(evidence.of_first_seed)]
    draw_strip(rows, experiment.frames, first, evidence.folder / "strip.png", by_fragment=False)
    draw_strip(rows, experiment.frames, first, evidence.folder / "fragments.png", by_fragment=True)
    _write_panels(rows, evidence.folder / "strip.csv")
    scenes = ", ".join(plain(scene.name) for scene in evidence.scenes)
    times = ", ".join(str(frame) for frame in experiment.frames)
    strip = Picture(
        "strip.png",
        f"Snow in rows of runs over frames {times}: pressure rises downwards, first with and then without sintering.",
        f"The runs in the paper's order and colours: {scenes}, seed {evidence.seeds[0]}. Pressure rises downwards, "
        "first with sintering, then without.",
        experiment.figure,
        "strip.csv",
    )
    fragments = Picture(
        "fragments.png",
        "The same, coloured by fragment: lumps in colours, powder in grey.",
        "The same by fragment, from release on: each lump has a colour and keeps it, powder is grey.",
        data="strip.csv",
    )
    blocks = [
        strip,
        fragments,
        *verdicts.section(evidence),
        *broken.section(evidence),
        *sensitivity.section(evidence),
    ]
    return Findings(blocks, " ".join(claims.sentence(scene.table, scene.verdicts) for scene in evidence.scenes))


def _write_panels(rows: Sequence[Row], path: Path) -> None:
    """What each panel shows in numbers: a row a panel."""
    cells = [
        {"row": row.label.replace("\n", ", "), "frame": frame, **row.measures.get(frame, {})}
        | {"x": places[:, 0].mean(), "y": places[:, 1].mean(), "width": np.ptp(places[:, 0])}
        | {"height": np.ptp(places[:, 1])}
        for row in rows
        for frame, places in row.places.items()
    ]
    pd.DataFrame(cells).to_csv(path, index=False, float_format="%.5g", lineterminator="\n")


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
        return Row(label, {}, {}, {})
    frames = evidence.experiment.frames
    later = [frame for frame in frames if frame >= config.loading.press_frames]
    with opened(config) as dataset:
        fragments = classify(dataset, config.analysis, frames=later).fragments if later else []
        places = {frame: dataset["position"].sel(snapshot=frame).values for frame in frames}
    painted = zip(fragments, fragment_colours(fragments), strict=True)
    measures = {found.frame: {"mass_in_lumps": found.lump_fraction, "lumps": found.lumps} for found in fragments}
    return Row(label, places, {found.frame: colours for found, colours in painted}, measures)
