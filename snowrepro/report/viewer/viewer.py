"""The interactive part of a page; here the data is prepared that the scripts in templates/viewer draw.

It shows runs as particles over time, with the lumps under settings of the reader's choice, and which claims hold.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_hex

from ...analysis.eye import COVER
from ...evidence.claims import list_calibrated_claims
from ...evidence.gather import describe_run
from ...evidence.sensitivity import CORES, SIGNS
from ...quantities import PRESSURE, format_powers, format_unit
from ...scene.outline import polylines
from ...settings.analysis import Analysis
from ...settings.question import Claim
from ...store.run import Run
from ..drawing.common import FLOOR, SKY, SNOW, get_panel_size
from ..drawing.states import LOOSE, LUMPS
from .embedded import FIELDS, EmbeddedRun, ViewerSettings, embed
from .packing import pack, round_to_levels, take_differences

STRAINS = np.round(np.geomspace(0.02, 1.5, 80), 3)  # steps of the break strain, beside the report's own
LUMP_MASSES = np.round(np.geomspace(0.005, 0.3, 40), 4)  # least mass of a lump, likewise [part of the body]
FRAMES = 36  # beside those of the figure
PER_CELL = 16  # to which part of a cell places are rounded
LEVELS = 64  # of a field
WITHIN = (1, 99)  # percentiles that a field's colours span
SHADES = 32
THINNINGS = (1, 2, 3, 4, 6, 8)  # of how many particles one is drawn
REPORTED = ("break_strain", "break_by", "core_fraction", "lump_mass")  # that the viewer can change
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
    fewer particles are drawn, and then the last runs are left out.  None if no run is left, or if lumps are not found
    by bonds.
    """
    alike = [run for run in runs if _is_alike(run, runs[0])]
    if not alike or alike[0].config.question.analysis.definition != "bonds":
        return None
    settings, frames = make_viewer_settings(alike[0].config.question.analysis), choose_frames(alike[0])
    embedded_runs: list[EmbeddedRun] = []
    bytes_of_bonds = 0
    for run in alike:
        embedded = embed(run, frames, settings)
        bytes_of_bonds += sum(len(str(text)) for text in embedded.bonds.values())
        if bytes_of_bonds > budget:
            break
        embedded_runs.append(embedded)
    return _fit_into_budget(embedded_runs, runs, frames, settings, budget)


def _fit_into_budget(
    embedded_runs: Sequence[EmbeddedRun],
    runs: Sequence[Run],
    frames: Sequence[int],
    settings: ViewerSettings,
    budget: int,
) -> Viewer | None:
    """Embed as many of the runs as fit, with all their particles drawn if possible."""
    for count in range(len(embedded_runs), 0, -1):
        for thinning in THINNINGS:
            data = dump_safe_json(_make_content(embedded_runs[:count], runs, frames, settings, thinning))
            if len(data) <= budget:
                sentences = describe_embedding(embedded_runs[:count], runs, frames, settings, thinning)
                return Viewer(data, sentences, format_powers(PRESSURE, [runs[0].case.reading.length_unit]))
    return None


def make_viewer_settings(analysis: Analysis) -> ViewerSettings:
    """Make the choices that the viewer offers; the report's own settings are among them."""
    ladder = np.union1d(STRAINS, [analysis.break_strain])
    return ViewerSettings(tuple(ladder.tolist()), SIGNS, tuple(sorted({*CORES, analysis.core_fraction})))


def list_lump_masses(analysis: Analysis) -> list[float]:
    """List the steps of the least mass of a lump [part of the body]."""
    return np.union1d(LUMP_MASSES, [analysis.lump_mass]).tolist()


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
    of_figure = run.config.question.experiment.frames if run.config.question.experiment else ()
    return sorted({int(stored[0]), run.case.loading.press_frames, int(stored[-1]), *of_figure, *even.tolist()})


def dump_safe_json(content: dict[str, Any]) -> str:
    """Format content as JSON that is safe inside HTML, whatever names runs have."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))  # ASCII alone
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def describe_embedding(
    embedded_runs: Sequence[EmbeddedRun],
    runs: Sequence[Run],
    frames: Sequence[int],
    settings: ViewerSettings,
    thinning: int,
) -> tuple[str, ...]:
    """Describe what is embedded, how exact it is, and what was left out, in sentences."""
    first = embedded_runs[0].run
    analysis = first.config.question.analysis
    with first.open() as dataset:
        stored = dataset.sizes["snapshot"]
    missing = [describe_run(run) for run in runs if all(run is not embedded.run for embedded in embedded_runs)]
    sentences = [
        (
            f"Embedded: {len(embedded_runs)} of {len(runs)} runs, {len(frames)} of {stored} stored frames. Between "
            "them, places are interpolated along straight lines, and bonds are as at the frame before."
        ),
        f"Places are rounded to 1/{PER_CELL} cell, density and J_P to {LEVELS} levels.",
        (
            f"Lumps are not rounded: at each embedded frame they are those that snowrepro.classify finds with the same "
            f"settings. The break strain has {len(settings.ladder)} steps for that reason."
        ),
        (
            f"Bonds are no longer than {analysis.link_length:g} grid spacings at the release; a lump has at least "
            f"the mass of {analysis.lump_cells:g} cells of unpressed snow, whatever the slider says."
        ),
    ]
    if thinning > 1:
        sentences.append(f"For lack of room one particle in {thinning} is drawn; lumps count all of them.")
    if missing:
        sentences.append(f"Left out, for lack of room or as they are not comparable: {'; '.join(missing)}.")
    return (*sentences, *_describe_calibration(first))


def _describe_calibration(run: Run) -> list[str]:
    """Say that the pressures were chosen by these very runs, if they were."""
    experiment = run.config.question.experiment
    if experiment is None or experiment.calibrated_on != (run.case.shape.name, run.case.floor.name):
        return []
    claims = run.config.question.claims
    by_calibration = list_calibrated_claims(claims)
    names = ", ".join(claim.name for claim in claims.list if _is_about_lumps(claim) and claim.name in by_calibration)
    return [
        (
            "The pressures were chosen by the sintered runs of this scene with the report's settings: that these agree "
            f"with {names} there is no test."
        )
    ]


def _is_alike(run: Run, first: Run) -> bool:
    """Whether two runs can be shown in step and are classified by the same settings."""
    same = all(getattr(run.case, name) == getattr(first.case, name) for name in ("loading", "output", "indenter"))
    classified_alike = run.config.question.analysis == first.config.question.analysis
    return same and classified_alike and run.case.indenter is None


def _make_content(
    embedded_runs: Sequence[EmbeddedRun],
    runs: Sequence[Run],
    frames: Sequence[int],
    settings: ViewerSettings,
    thinning: int,
) -> dict[str, Any]:
    """Make all data for the browser; templates/viewer/main.js reads it."""
    first = embedded_runs[0].run
    analysis = first.config.question.analysis
    spans = {name: _find_span([run.fields[name] for run in embedded_runs]) for name in FIELDS}
    return {
        "frames": list(frames),
        "seconds": [frame * first.case.loading.frame_time for frame in frames],
        "release": list(frames).index(first.case.loading.press_frames),
        "ladder": settings.ladder,
        "signs": settings.signs,
        "cores": settings.cores,
        "lump_masses": list_lump_masses(analysis),
        "report": {name: getattr(analysis, name) for name in REPORTED},
        "lump_cells": analysis.lump_cells,
        "colours": _list_colours(),
        "fields": [_make_field(name, spans[name], embedded_runs[0].units[name]) for name in FIELDS],
        "levels": LEVELS,
        "thinning": thinning,
        "claims": [_make_claim(claim) for claim in first.config.question.claims.list if _is_about_lumps(claim)],
        "incomplete": sorted({_name_scene(run) for run in runs} - _find_whole_scenes(embedded_runs, runs)),
        "runs": [
            _make_run_content(run, label, spans, thinning)
            for run, label in zip(embedded_runs, _make_labels(embedded_runs), strict=True)
        ],
    }


def _make_run_content(
    embedded: EmbeddedRun, label: str, spans: dict[str, tuple[float, float]], thinning: int
) -> dict[str, Any]:
    """Make the data of one run: what it is, its stage, its particles and bonds."""
    run = embedded.run
    width, height = get_panel_size(run)
    return {
        "label": label,
        "scene": _name_scene(run),
        "arm": run.case.arm,
        "pressure": run.case.pressure,
        "width": width,
        "height": height,
        "floor": [(corners * run.case.reading.cell).tolist() for corners in polylines(run.case.floor.outline)],
        "diameter": run.case.dx / np.sqrt(run.case.fidelity.particles_per_cell / thinning) * COVER,
        "least": embedded.least,
        "lump_fraction": embedded.lump_fraction,
        "bonds": embedded.bonds,
        **_make_particles(embedded, spans, thinning),
    }


def _make_particles(embedded: EmbeddedRun, spans: dict[str, tuple[float, float]], thinning: int) -> dict[str, Any]:
    """Make masses of all particles, and places and fields of those that are drawn, as differences in time."""
    quantum = embedded.run.case.reading.cell / PER_CELL
    places = np.rint(embedded.places[:, ::thinning] / quantum).astype(int).transpose(0, 2, 1)
    fields = {
        name: round_to_levels(values[:, ::thinning], *spans[name], LEVELS) for name, values in embedded.fields.items()
    }
    return {
        "particles": len(embedded.mass),
        "mass": embedded.mass[:1].tolist() if (embedded.mass == embedded.mass[0]).all() else embedded.mass.tolist(),
        "total": float(embedded.mass.sum()),
        "gone": pack(embedded.gone) if (embedded.gone < len(embedded.places)).any() else None,
        "quantum": quantum,
        "places": pack(take_differences(places)),
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
    return {"sky": SKY, "floor": FLOOR, "snow": SNOW, "lumps": LUMPS, "powder": LOOSE, "shades": shades}


def _is_about_lumps(claim: Claim) -> bool:
    """Whether a claim is about what the viewer counts, in one scene."""
    return claim.test != "scenes" and claim.measure == "lump_fraction"


def _make_claim(claim: Claim) -> dict[str, Any]:
    """Make the data of a claim."""
    return {name: getattr(claim, name) for name in ("name", "statement", "of", "at", "test", "threshold")}


def _name_scene(run: Run) -> str:
    """Name the scene of a run."""
    return f"{run.case.shape.name} on {run.case.floor.name}"


def _find_whole_scenes(embedded_runs: Sequence[EmbeddedRun], runs: Sequence[Run]) -> set[str]:
    """Find the scenes of which every run is embedded: only for these the viewer judges claims."""
    ids = {embedded.run.id for embedded in embedded_runs}
    return {_name_scene(run) for run in runs} - {_name_scene(run) for run in runs if run.id not in ids}


def _make_labels(embedded_runs: Sequence[EmbeddedRun]) -> list[str]:
    """Make a label for each run, as short as possible."""
    runs = [embedded.run for embedded in embedded_runs]
    short = [f"{run.case.pressure:g}, {run.case.arm}" for run in runs]
    return short if len(set(short)) == len(short) else [describe_run(run) for run in runs]
