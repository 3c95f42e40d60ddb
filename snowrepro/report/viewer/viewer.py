"""The interactive part of a page; here the data is prepared that the scripts in templates/viewer draw.

It shows runs as particles over time, coloured by what became of the snow, with the shares of each frame.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_hex

from ...analysis.eye import COVER
from ...analysis.lumps import find_frame_before
from ...analysis.states import STATES
from ...evidence.gather import describe_run
from ...quantities import PRESSURE, format_powers, format_unit
from ...scene.outline import polylines
from ...store.run import Run
from ..drawing.colouring import PALETTE
from ..drawing.common import FLOOR, SKY, SNOW, get_panel_size
from ..drawing.states import CRUSHED, LOOSE, LUMPS
from .embedded import FIELDS, EmbeddedRun, embed
from .packing import pack, round_to_levels, take_differences

FRAMES = 36  # beside those of the figure
PER_CELL = 16  # to which part of a cell places are rounded
LEVELS = 64  # of a field
WITHIN = (1, 99)  # percentiles that a field's colours span
SHADES = 32
THINNINGS = (1, 2, 3, 4, 6, 8)  # of how many particles one is drawn
NAMES = {"density": "density", "J_P": "plastic volume ratio J_P"}


@dataclass(frozen=True)
class Viewer:
    """What a page needs for the viewer.

    ``data``: JSON for an element <script type="application/json">; ``sentences``: what it contains; ``unit``: of the
    runs' pressures, for people.
    """

    data: str
    sentences: tuple[str, ...]
    unit: str


def embed_runs(runs: Sequence[Run], budget: int) -> Viewer | None:
    """Prepare the viewer for finished runs, in the paper's order, in at most ``budget`` bytes.

    Runs that differ from the first in loading, storing or classification are left out.  If there is not enough room,
    fewer particles are drawn, and then the last runs are left out.  None if no run is left.
    """
    alike = [run for run in runs if _is_alike(run, runs[0])]
    if not alike:
        return None
    frames = choose_frames(max(alike, key=_find_end))
    embedded_runs = [embed(run, frames) for run in alike]
    for count in range(len(embedded_runs), 0, -1):
        for thinning in THINNINGS:
            data = dump_safe_json(_make_content(embedded_runs[:count], frames, thinning))
            if len(data) <= budget:
                sentences = describe_embedding(embedded_runs[:count], runs, frames, thinning)
                return Viewer(data, sentences, format_powers(PRESSURE, [runs[0].case.reading.length_unit]))
    return None


def choose_frames(run: Run) -> list[int]:
    """Choose the stored frames to embed: start, release, end, those of the figure, and FRAMES others.

    Half of the latter are even in time, half are where this run's particles accelerate most.
    """
    with run.open() as dataset:
        stored = dataset["snapshot"].values
        acceleration = np.diff(dataset["position"].values.astype(float), n=2, axis=0)
    restless = np.zeros(len(stored))
    restless[1:-1] = np.sqrt(np.nanmean(acceleration**2, axis=(1, 2)))
    share = 1.0 / len(stored) + restless / max(restless.sum(), np.finfo(float).tiny)
    cumulated = np.cumsum(share)
    places = np.searchsorted(cumulated, np.linspace(cumulated[0], cumulated[-1], FRAMES))
    even = stored[places.clip(max=len(stored) - 1)]
    wanted = run.config.question.experiment.frames if run.config.question.experiment else ()
    of_figure = [find_frame_before(stored, frame) for frame in wanted]
    return sorted({int(stored[0]), run.case.loading.press_frames, int(stored[-1]), *of_figure, *even.tolist()})


def dump_safe_json(content: dict[str, Any]) -> str:
    """Format content as JSON that is safe inside HTML, whatever names runs have."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))  # ASCII alone
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def describe_embedding(
    embedded_runs: Sequence[EmbeddedRun],
    runs: Sequence[Run],
    frames: Sequence[int],
    thinning: int,
) -> tuple[str, ...]:
    """Describe what is embedded, how exact it is, and what was left out, in sentences."""
    first = embedded_runs[0].run
    with first.open() as dataset:
        stored = dataset.sizes["snapshot"]
    missing = [describe_run(run) for run in runs if all(run is not embedded.run for embedded in embedded_runs)]
    sentences = [
        (
            f"Embedded: {len(embedded_runs)} of {len(runs)} runs, {len(frames)} of {stored} stored frames. Between "
            "them, places are interpolated along straight lines, and colours are as at the frame before. A run that "
            "ended at rest stays as it was then."
        ),
        f"Places are rounded to 1/{PER_CELL} cell, density and J_P to {LEVELS} levels.",
        (
            "The parts of the mass are not rounded: at each embedded frame they are those that snowrepro.classify "
            "finds with the report's settings. A particle has the colour of its largest part."
        ),
    ]
    if thinning > 1:
        sentences.append(f"For lack of room one particle in {thinning} is drawn; the parts count all of them.")
    if missing:
        sentences.append(f"Left out, for lack of room or as they are not comparable: {'; '.join(missing)}.")
    return tuple(sentences)


def _find_end(run: Run) -> int:
    """Find the frame in which a run ended."""
    with run.open() as dataset:
        return int(dataset["snapshot"][-1])


def _is_alike(run: Run, first: Run) -> bool:
    """Whether two runs can be shown in step and are classified by the same settings."""
    same = all(getattr(run.case, name) == getattr(first.case, name) for name in ("own_loading", "output", "indenter"))
    classified_alike = run.config.question.analysis == first.config.question.analysis
    return same and classified_alike and run.case.indenter is None


def _make_content(embedded_runs: Sequence[EmbeddedRun], frames: Sequence[int], thinning: int) -> dict[str, Any]:
    """Make all data for the browser; templates/viewer/main.js reads it."""
    first = embedded_runs[0].run
    spans = {name: _find_span([run.fields[name] for run in embedded_runs]) for name in FIELDS}
    return {
        "frames": list(frames),
        "seconds": [frame * first.case.loading.frame_time for frame in frames],
        "states": STATES,
        "colours": _list_colours(),
        "fields": [_make_field(name, spans[name], embedded_runs[0].units[name]) for name in FIELDS],
        "levels": LEVELS,
        "runs": [
            _make_run_content(run, label, spans, thinning)
            for run, label in zip(embedded_runs, _make_labels(embedded_runs), strict=True)
        ],
    }


def _make_run_content(
    embedded: EmbeddedRun, label: str, spans: dict[str, tuple[float, float]], thinning: int
) -> dict[str, Any]:
    """Make the data of one run: what it is, its stage, its particles and shares."""
    run = embedded.run
    width, height = get_panel_size(run)
    return {
        "label": label,
        "arm": run.case.arm,
        "width": width,
        "height": height,
        "floor": [(corners * run.case.reading.cell).tolist() for corners in polylines(run.case.floor.outline)],
        "diameter": run.case.dx / np.sqrt(run.case.fidelity.particles_per_cell / thinning) * COVER,
        "shares": embedded.shares,
        "lumps": embedded.lumps,
        **_make_particles(embedded, spans, thinning),
    }


def _make_particles(embedded: EmbeddedRun, spans: dict[str, tuple[float, float]], thinning: int) -> dict[str, Any]:
    """Make places, colours and fields of the particles that are drawn, as differences in time."""
    quantum = embedded.run.case.reading.cell / PER_CELL
    places = np.rint(embedded.places[:, ::thinning] / quantum).astype(int).transpose(0, 2, 1)
    fields = {
        name: round_to_levels(values[:, ::thinning], *spans[name], LEVELS) for name, values in embedded.fields.items()
    }
    return {
        "particles": len(embedded.gone),
        "gone": pack(embedded.gone) if (embedded.gone < len(embedded.places)).any() else None,
        "quantum": quantum,
        "places": pack(take_differences(places)),
        "colours": pack(take_differences(embedded.colours[:, ::thinning])),
        "fields": {name: pack(take_differences(numbers)) for name, numbers in fields.items()},
    }


def _find_span(values: Sequence[np.ndarray]) -> tuple[float, float]:
    """Find the values that the colours of a field span over several runs: all but the outermost percentiles."""
    ends = np.array([np.percentile(part, WITHIN) for part in values])
    return float(ends[:, 0].min()), float(ends[:, 1].max())


def _make_field(name: str, span: tuple[float, float], unit: str) -> dict[str, Any]:
    """Make the description of a field."""
    return {"key": name, "name": NAMES[name], "unit": format_unit(unit), "low": span[0], "high": span[1]}


def _list_colours() -> dict[str, Any]:
    """List the colours of the pictures, and a scale that colour-blind readers can tell apart."""
    shades = [to_hex(shade) for shade in mpl.colormaps["cividis"](np.linspace(0.0, 1.0, SHADES))]
    states = {"palette": PALETTE, "lumps": LUMPS, "crushed": CRUSHED, "loose": LOOSE, "snow": SNOW}
    return {"sky": SKY, "floor": FLOOR, "shades": shades, **states}


def _make_labels(embedded_runs: Sequence[EmbeddedRun]) -> list[str]:
    """Make a label for each run, as short as possible."""
    runs = [embedded.run for embedded in embedded_runs]
    short = [f"{run.case.pressure:g}, {run.case.arm}" for run in runs]
    return short if len(set(short)) == len(short) else [describe_run(run) for run in runs]
