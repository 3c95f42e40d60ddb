"""Figures 5 and 6: rows of runs over columns of frames, and the verdict on the claims."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from ...analysis.lumps import find_frame_before
from ...analysis.states import STATES
from ...evidence import claims
from ...evidence.gather import Evidence, sort_as_in_paper
from ...quantities import PRESSURE, format_powers
from ...store.run import Run
from ...summary.classify import classify
from ...text import make_cells
from ..document import FigureContent, Picture, escape
from ..drawing.common import (
    SNOW,
    choose_font,
    draw_background,
    draw_snow,
    format_column_title,
    get_panel_size,
    save_figure,
)
from ..drawing.ends import MISSING, End, draw_ends
from ..drawing.states import FOOT, add_state_legend, colour_fragments
from ..sections import broken, specification
from ..sections import claims as claims_section
from .kinds import FigureKind

PANEL = 2.3  # width of a panel [inches]
ARMS = {True: "sintering", False: "no sintering"}  # by whether snow sinters
# Of the picture for a narrow screen, which halves it [inches, points].
NARROW, NARROW_HEAD, NARROW_LETTERS = 6.6, 0.62, 15
MARGIN, HEAD = 1.6, 0.55  # beside the panels, for the names of rows, and above them [inches]
NAMED = "pressure "  # before the number of a row, in the file alone


@dataclass(frozen=True)
class Row:
    """One row of a strip, with dictionaries by frame.

    ``places``: of its particles (n, 2) [length units], empty if the run is missing; ``colours``: of each particle by
    its state and fragment (n,), from the release on; ``measures``: part of the mass in each state, and the number of
    lumps, likewise; ``end``: the frame in which the run ended, at rest; what is shown later is the snow of then.
    """

    label: str
    places: dict[int, np.ndarray]
    colours: dict[int, np.ndarray]
    measures: dict[int, dict[str, float]]
    end: int = 0


def report(evidence: Evidence) -> FigureContent:
    """Draw the paper's figure, once in its colours and once by what became of the snow.

    The section also has the verdicts on the claims, what broke, and whether verdicts depend on what a lump is.
    """
    experiment, first = evidence.experiment, evidence.runs[0]
    rows = [_make_row(run, evidence) for run in sort_as_in_paper(evidence.first_seed_runs)]
    draw_strip(rows, experiment.frames, first, evidence.folder / "strip.png", by_fragment=False)
    draw_strip(rows, experiment.frames, first, evidence.folder / "fragments.png", by_fragment=True)
    draw_narrow_strip(rows, experiment.frames[-1], first, evidence.folder / "strip-narrow.png")
    _draw_ends(rows, evidence)
    _write_panels(rows, evidence.folder / "strip.csv")
    blocks = [
        *_make_pictures(evidence),
        *claims_section.make_blocks(evidence),
        *broken.make_blocks(evidence),
        *specification.make_blocks(evidence),
    ]
    return FigureContent(
        blocks,
        " ".join(
            claims.write_sentence(scene.table, scene.verdicts, evidence.pressure_unit) for scene in evidence.scenes
        ),
    )


def _make_pictures(evidence: Evidence) -> list[Picture]:
    """Make the pictures of the strip, which are drawn already: in the paper's colours, and by fragment."""
    experiment = evidence.experiment
    scenes = ", ".join(escape(scene.name) for scene in evidence.scenes)
    times = ", ".join(str(frame) for frame in experiment.frames)
    strip = Picture(
        "strip.png",
        f"Snow in rows of runs over frames {times}: pressure rises downwards, first with and then without sintering.",
        f"The runs in the paper's order and colours: {scenes}, seed {evidence.seeds[0]}. Pressure rises downwards, "
        "first with sintering, then without.",
        experiment.figure,
        "strip.csv",
        "strip-narrow.png",
        is_end_first=True,
    )
    fragments = Picture(
        "fragments.png",
        "The same by what became of the snow: each lump in a colour, crushed snow dark, loose snow like sand.",
        "The same runs and frames by what became of the snow, from the release on: each lump has a colour and keeps "
        "it, crushed snow is dark, loose snow the colour of sand. A particle has the colour of its largest part.",
        data="strip.csv",
        is_end_first=True,
    )
    ends = Picture(
        "ends.png",
        "The last frame of each run by what became of the snow: a row with sintering, a row without, pressure rising "
        "to the right.",
        f"How it ends: frame {experiment.frames[-1]}, with the parts of the mass in lumps, crushed and loose.",
        data="strip.csv",
    )
    return [strip, fragments, ends]


def _draw_ends(rows: Sequence[Row], evidence: Evidence) -> None:
    """Draw the last frames alone: a row for each arm, a column for each pressure."""
    runs = sort_as_in_paper(evidence.first_seed_runs)
    unit = format_powers(PRESSURE, [runs[0].case.reading.length_unit])
    last = evidence.experiment.frames[-1]
    ends = {
        (ARMS[run.case.sintering.enabled], f"pressure {run.case.pressure:g}\n{unit}"): End(
            run,
            row.places.get(last, MISSING),
            row.colours.get(last, SNOW),
            _list_shares(row.measures.get(last, {}), "\n"),
        )
        for row, run in zip(rows, runs, strict=True)
    }
    arms, pressures = (list(dict.fromkeys(names)) for names in zip(*ends, strict=True))
    draw_ends(ends, arms, pressures, PANEL, evidence.folder / "ends.png")


def _list_shares(measures: Mapping[str, float], between: str) -> str:
    """List the parts of the mass in each state, as far as they are known."""
    return between.join(f"{state} {measures[state]:.2f}" for state in STATES if state in measures)


def _write_panels(rows: Sequence[Row], path: Path) -> None:
    """Write what each panel shows in numbers: one row for each panel."""
    cells = [
        {"row": row.label.replace("\n", ", "), "frame": frame, **row.measures.get(frame, {})}
        | {"x": places[:, 0].mean(), "y": places[:, 1].mean(), "width": np.ptp(places[:, 0])}
        | {"height": np.ptp(places[:, 1])}
        for row in rows
        for frame, places in row.places.items()
    ]
    make_cells(pd.DataFrame(cells)).to_csv(path, index=False, float_format="%.5g", lineterminator="\n")


def draw_strip(rows: Sequence[Row], frames: Sequence[int], run: Run, path: Path, by_fragment: bool) -> None:
    """Draw rows of runs over columns of frames.

    ``run``: any of the runs, which all have the same scene; ``by_fragment``: whether lumps, crushed and loose snow have
    colours, and a legend, or all snow the paper's.
    """
    width, height = get_panel_size(run)
    foot = FOOT * by_fragment
    figure = Figure(figsize=(PANEL * len(frames) + MARGIN, PANEL * height / width * len(rows) + HEAD + foot))
    figure.set_facecolor("white")
    letters = choose_font(figure.get_figwidth())
    grid = figure.subplots(len(rows), len(frames), squeeze=False)
    figure.subplots_adjust(
        left=MARGIN / figure.get_figwidth(),
        right=0.998,
        bottom=0.004 + foot / figure.get_figheight(),
        top=1 - HEAD / figure.get_figheight(),
        wspace=0.02,
        hspace=0.03,
    )
    unit = format_powers(PRESSURE, [run.case.reading.length_unit])
    figure.text(0.004, 0.998, f"pressure\n[{unit}]", ha="left", va="top", fontsize=letters)
    for row, axes in zip(rows, grid, strict=True):
        for frame, ax in zip(frames, axes, strict=True):
            draw_background(ax, run)
            if not row.places:
                ax.text(0.5, 0.5, "missing", transform=ax.transAxes, ha="center", color="white")
                continue
            colour = row.colours.get(frame, SNOW) if by_fragment else SNOW
            draw_snow(ax, run, row.places[frame], PANEL * 72 / width, colour)
            if frame > row.end:
                note = f"at rest since {row.end}"
                ax.text(0.03, 0.96, note, transform=ax.transAxes, va="top", color="white", fontsize=letters)
        axes[0].set_ylabel(
            row.label.removeprefix(NAMED), rotation=0, ha="right", va="center", fontsize=letters, labelpad=8
        )
    for frame, ax in zip(frames, grid[0], strict=True):
        ax.set_title(format_column_title(frame, run), fontsize=letters)
    if by_fragment:
        add_state_legend(figure, letters, loc="lower center")
    save_figure(figure, path)


def draw_narrow_strip(rows: Sequence[Row], frame: int, run: Run, path: Path) -> None:
    """Draw one frame of each run large, for a narrow screen: in the paper's colours, and beside it by state.

    ``run``: any of the runs, which all have the same scene.
    """
    width, height = get_panel_size(run)
    engine = ConstrainedLayoutEngine(w_pad=0.02, h_pad=0.02, wspace=0.0, hspace=0.0)
    figure = Figure(figsize=(NARROW, len(rows) * (NARROW / 2 * height / width + NARROW_HEAD) + FOOT), layout=engine)
    unit = format_powers(PRESSURE, [run.case.reading.length_unit])
    for row, axes in zip(rows, figure.subplots(len(rows), 2, squeeze=False), strict=True):
        for ax, colours in zip(axes, ({}, row.colours), strict=True):
            draw_background(ax, run)
            if row.places:
                draw_snow(ax, run, row.places[frame], NARROW / 2 * 72 / width, colours.get(frame, SNOW))
            else:
                ax.text(
                    0.5, 0.5, "missing", transform=ax.transAxes, ha="center", color="white", fontsize=NARROW_LETTERS
                )
        name = row.label.removeprefix(NAMED).replace("\n", f" {unit}, ")
        shares = _list_shares(row.measures.get(frame, {}), ", ")
        axes[0].set_title(f"{name}\n{shares}", fontsize=NARROW_LETTERS, loc="left")
    add_state_legend(figure, NARROW_LETTERS, loc="outside lower center")
    save_figure(figure, path)


def _make_row(run: Run, evidence: Evidence) -> Row:
    """Read the row of a run."""
    label = f"{NAMED}{run.case.pressure:g}\n{ARMS[run.case.sintering.enabled]}"
    if not evidence.is_done(run):
        return Row(label, {}, {}, {})
    frames = evidence.experiment.frames
    with run.open() as dataset:
        stored = dataset["snapshot"].values
        shown = {frame: find_frame_before(stored, frame) for frame in frames}
        falling = sorted({state for state in shown.values() if state >= run.case.loading.press_frames})
        classified = classify(dataset, run.config.question.analysis, frames=falling) if falling else None
        places = {frame: dataset["position"].sel(snapshot=state).values for frame, state in shown.items()}
    if not classified:
        return Row(label, places, {}, {}, int(stored[-1]))
    colours = dict(zip(falling, colour_fragments(classified), strict=True))
    measures = {now.frame: {**now.shares, "lumps": now.lumps} for now in classified.fragments}
    return Row(
        label,
        places,
        {frame: colours[state] for frame, state in shown.items() if state in colours},
        {frame: measures[state] for frame, state in shown.items() if state in measures},
        int(stored[-1]),
    )


FIGURE = FigureKind(report, is_judged=True, needs=("frames",))
