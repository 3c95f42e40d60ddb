"""The interactive part of a page: runs as particles over time, lumps anew under any setting, and what of the claims
then holds.  templates/viewer.js draws it; here its data is put together.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import to_hex

from ..analysis.claims import arm
from ..analysis.sensitivity import CORES, SIGNS
from ..config import Analysis, Claim, Config
from ..scene.outline import polyline
from ..store import runs
from .drawing import COVER, FLOOR, LUMPS, POWDER, SKY, SNOW, crop
from .embedded import FIELDS, Embedded, Settings, embed
from .evidence import name_of, opened
from .packing import differences, levels, packed

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
    """``data``: JSON for an element <script type="application/json">; ``told``: sentences on what it holds."""

    data: str
    told: tuple[str, ...]


def gathered(configs: Sequence[Config], budget: int) -> Viewer | None:
    """What the viewer shows of finished runs, in the paper's order, in at most ``budget`` bytes.

    Runs that were loaded, stored or are classified otherwise than the first are left out.  If room lacks, fewer
    particles are drawn; if it still does, the last runs are left out.  None if no run is left, and where lumps
    are not found by bonds.
    """
    alike = [config for config in configs if _alike(config, configs[0])]
    if not alike or alike[0].analysis.definition != "bonds":
        return None
    settings, frames = settings_of(alike[0].analysis), chosen_frames(alike[0])
    held: list[Embedded] = []
    taken = 0
    for config in alike:
        run = embed(config, frames, settings)
        taken += sum(len(str(text)) for text in run.bonds.values())
        if taken > budget:
            break
        held.append(run)
    return _fitting(held, configs, frames, settings, budget)


def _fitting(
    held: Sequence[Embedded], configs: Sequence[Config], frames: Sequence[int], settings: Settings, budget: int
) -> Viewer | None:
    """As many of the runs as there is room for, all their particles drawn if possible."""
    for count in range(len(held), 0, -1):
        for thinning in THINNINGS:
            data = safe(_content(held[:count], configs, frames, settings, thinning))
            if len(data) <= budget:
                return Viewer(data, told(held[:count], configs, frames, settings, thinning))
    return None


def settings_of(analysis: Analysis) -> Settings:
    """The ladder and the choices; what the report itself uses is among them."""
    ladder = np.union1d(STRAINS, [analysis.break_strain])
    return Settings(tuple(ladder.tolist()), SIGNS, tuple(sorted({*CORES, analysis.core_fraction})))


def lump_masses(analysis: Analysis) -> list[float]:
    """Steps of the least mass of a lump [part of the body]."""
    return np.union1d(LUMP_MASSES, [analysis.lump_mass]).tolist()


def chosen_frames(config: Config) -> list[int]:
    """Stored frames to embed: the start, the release, the end, those of the figure, and FRAMES others.

    The latter lie half evenly in time and half where this run's particles are accelerated most.
    """
    with opened(config) as dataset:
        stored = dataset["snapshot"].values
        bent = np.diff(dataset["position"].values.astype(float), n=2, axis=0)
    restless = np.zeros(len(stored))
    restless[1:-1] = np.sqrt(np.nanmean(bent**2, axis=(1, 2)))
    share = 1.0 / len(stored) + restless / max(restless.sum(), np.finfo(float).tiny)
    along = np.cumsum(share)
    even = stored[np.searchsorted(along, np.linspace(along[0], along[-1], FRAMES)).clip(max=len(stored) - 1)]
    figure = config.experiment.frames if config.experiment else ()
    return sorted({int(stored[0]), config.loading.press_frames, int(stored[-1]), *figure, *even.tolist()})


def safe(content: dict[str, Any]) -> str:
    """JSON of which no letter means anything in HTML, whatever names runs have."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))  # ASCII alone
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def told(
    held: Sequence[Embedded], configs: Sequence[Config], frames: Sequence[int], settings: Settings, thinning: int
) -> tuple[str, ...]:
    """What is embedded, how exact it is, and what was left out, in sentences."""
    first = held[0].config
    with opened(first) as dataset:
        stored = dataset.sizes["snapshot"]
    missing = [name_of(c) for c in configs if all(c is not run.config for run in held)]
    sentences = [
        f"Embedded: {len(held)} of {len(configs)} runs, {len(frames)} of {stored} stored frames. Between them, places "
        "are interpolated along straight lines, and bonds are as at the frame before.",
        f"Places are rounded to 1/{PER_CELL} cell, density and J_P to {LEVELS} levels.",
        f"Lumps are not rounded: at each embedded frame they are those that snowrepro.classify finds with the same "
        f"settings. The break strain has {len(settings.ladder)} steps for that reason.",
        f"Bonds are no longer than {first.analysis.link_length:g} grid spacings at the release; a lump has at least "
        f"the mass of {first.analysis.lump_cells:g} cells of unpressed snow, whatever the slider says.",
    ]
    if thinning > 1:
        sentences.append(f"For lack of room one particle in {thinning} is drawn; lumps count all of them.")
    if missing:
        sentences.append(f"Left out, for lack of room or as they are not comparable: {'; '.join(missing)}.")
    return (*sentences, *_on_calibration(first))


def _on_calibration(config: Config) -> list[str]:
    """That pressures were chosen by the very runs, if they were."""
    experiment = config.experiment
    if experiment is None or experiment.calibrated_on != (config.shape.name, config.floor.name):
        return []
    names = ", ".join(c.name for c in config.claims.list if _is_told_by_lumps(c) and c.of != "unsintered")
    return [
        "The pressures were chosen by the sintered runs of this scene with the report's settings: that these agree "
        f"with {names} there is no test."
    ]


def _alike(config: Config, first: Config) -> bool:
    """Whether two runs can be shown in step, by the same settings."""
    same = all(getattr(config, name) == getattr(first, name) for name in ("analysis", "loading", "output", "indenter"))
    return same and config.indenter is None


def _content(
    held: Sequence[Embedded], configs: Sequence[Config], frames: Sequence[int], settings: Settings, thinning: int
) -> dict[str, Any]:
    """All that the browser gets; templates/viewer.js reads it."""
    first = held[0].config
    spans = {name: _span([run.fields[name] for run in held]) for name in FIELDS}
    return {
        "frames": list(frames),
        "seconds": [frame * first.loading.frame_time for frame in frames],
        "release": list(frames).index(first.loading.press_frames),
        "ladder": settings.ladder,
        "signs": settings.signs,
        "cores": settings.cores,
        "lump_masses": lump_masses(first.analysis),
        "report": {name: getattr(first.analysis, name) for name in REPORTED},
        "lump_cells": first.analysis.lump_cells,
        "colours": _colours(),
        "fields": [_field(name, spans[name], held[0].units[name]) for name in FIELDS],
        "levels": LEVELS,
        "thinning": thinning,
        "claims": [_claim(claim) for claim in first.claims.list if _is_told_by_lumps(claim)],
        "incomplete": sorted({_scene(c) for c in configs} - _whole(held, configs)),
        "runs": [_run(run, label, spans, thinning) for run, label in zip(held, _labels(held), strict=True)],
    }


def _run(run: Embedded, label: str, spans: dict[str, tuple[float, float]], thinning: int) -> dict[str, Any]:
    """One run: what it is, its stage, its particles and bonds."""
    config = run.config
    width, height = crop(config)
    return {
        "label": label,
        "scene": _scene(config),
        "arm": arm(config),
        "pressure": config.pressure,
        "width": width,
        "height": height,
        "floor": (polyline(config.floor.outline) * config.reading.cell).tolist(),
        "diameter": config.dx / np.sqrt(config.fidelity.particles_per_cell / thinning) * COVER,
        "least": run.least,
        "lump_fraction": run.lump_fraction,
        "bonds": run.bonds,
        **_particles(run, spans, thinning),
    }


def _particles(run: Embedded, spans: dict[str, tuple[float, float]], thinning: int) -> dict[str, Any]:
    """Masses of all particles; places and fields of those that are drawn, as differences in time."""
    quantum = run.config.reading.cell / PER_CELL
    places = np.rint(run.places[:, ::thinning] / quantum).astype(int).transpose(0, 2, 1)
    fields = {name: levels(values[:, ::thinning], *spans[name], LEVELS) for name, values in run.fields.items()}
    return {
        "particles": len(run.mass),
        "mass": run.mass[:1].tolist() if (run.mass == run.mass[0]).all() else run.mass.tolist(),
        "total": float(run.mass.sum()),
        "gone": packed(run.gone) if (run.gone < len(run.places)).any() else None,
        "quantum": quantum,
        "places": packed(differences(places)),
        "fields": {name: packed(differences(numbers)) for name, numbers in fields.items()},
    }


def _span(values: Sequence[np.ndarray]) -> tuple[float, float]:
    """What the colours of a field span, over several runs: all but the outermost percentiles."""
    ends = np.array([np.percentile(part, WITHIN) for part in values])
    return float(ends[:, 0].min()), float(ends[:, 1].max())


def _field(name: str, span: tuple[float, float], unit: str) -> dict[str, Any]:
    return {"key": name, "name": NAMES[name], "unit": unit, "low": span[0], "high": span[1]}


def _colours() -> dict[str, Any]:
    """Those of the pictures, and a scale that also the colour-blind can read."""
    shades = [to_hex(shade) for shade in matplotlib.colormaps["cividis"](np.linspace(0.0, 1.0, SHADES))]
    return {"sky": SKY, "floor": FLOOR, "snow": SNOW, "lumps": LUMPS, "powder": POWDER, "shades": shades}


def _is_told_by_lumps(claim: Claim) -> bool:
    """Whether a claim is about what the viewer counts, in one scene."""
    return claim.test != "scenes" and claim.measure == "lump_fraction"


def _claim(claim: Claim) -> dict[str, Any]:
    return {name: getattr(claim, name) for name in ("name", "statement", "of", "at", "test", "threshold")}


def _scene(config: Config) -> str:
    return f"{config.shape.name} on {config.floor.name}"


def _whole(held: Sequence[Embedded], configs: Sequence[Config]) -> set[str]:
    """Scenes of which every run is embedded: only of those the claims are judged."""
    there = {runs.identify(run.config) for run in held}
    return {_scene(c) for c in configs} - {_scene(c) for c in configs if runs.identify(c) not in there}


def _labels(held: Sequence[Embedded]) -> list[str]:
    """A name for each run, as short as it can be."""
    configs = [run.config for run in held]
    short = [f"{config.pressure:g}, {arm(config)}" for config in configs]
    return short if len(set(short)) == len(short) else [name_of(config) for config in configs]
