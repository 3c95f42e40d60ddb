"""What particles are coloured by, state by state: the paper's colours, fragments, fields of a run, broken bonds."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgba_array

from ..analysis.bonds import Extremes
from ..analysis.classify import Classified, classify
from ..analysis.definitions import bonds_lost
from ..config import Config
from .drawing import LUMPS, POWDER, SNOW, fragment_colours

NAMED = (SNOW, POWDER, *LUMPS)  # what indices stand for
OUTLIERS = (1, 99)  # percentiles between which a field is told apart
PRESSED = "pressed"


@dataclass(frozen=True)
class Paint:
    """What the particles of one run are coloured by.

    ``values`` (state, particle): indices of NAMED, or the values of a ``field``, which is its name and unit;
    ``notes`` (state,): words for each state; ``limits``: between which the colours of a field run, if they are fixed.
    """

    values: np.ndarray
    notes: list[str]
    field: str = ""
    limits: tuple[float, float] | None = None


@dataclass(frozen=True)
class Scale:
    """The colours of a field: between which values they run, and its name and unit."""

    low: float
    high: float
    field: str

    @property
    def mappable(self) -> ScalarMappable:
        """For Matplotlib."""
        return ScalarMappable(Normalize(self.low, self.high), "plasma")


def scale_of(paints: Sequence[Paint]) -> Scale | None:
    """One scale for all runs that are painted by a field; None if they are not."""
    field, limits = paints[0].field, paints[0].limits
    if not field:
        return None
    low, high = limits or np.percentile(np.concatenate([paint.values.ravel() for paint in paints]), OUTLIERS)
    margin = 0.0 if high > low else 0.01 * abs(low)
    return Scale(float(low - margin), float(high + margin), field)


def colours_of(values: np.ndarray, scale: Scale | None) -> np.ndarray:
    """RGBA (n, 4) of the values of one state."""
    return scale.mappable.to_rgba(values) if scale else to_rgba_array(NAMED)[values]


def by_snow(dataset: xr.Dataset, config: Config, frames: Sequence[int]) -> Paint:
    """The paper's one colour."""
    return Paint(np.zeros((len(frames), dataset.sizes["particle"]), dtype=np.uint8), [""] * len(frames))


def by_fragment(dataset: xr.Dataset, config: Config, frames: Sequence[int]) -> Paint:
    """A colour for each lump, grey for powder; one colour until the release."""
    found = classify(dataset, config.analysis, frames="all")
    index_of = {colour: index for index, colour in enumerate(NAMED)}
    indices = {
        f.frame: np.array([index_of[colour] for colour in colours], dtype=np.uint8)
        for f, colours in zip(found.fragments, fragment_colours(found.fragments), strict=True)
    }
    snow = np.zeros(dataset.sizes["particle"], dtype=np.uint8)
    lumps = {f.frame: f"in lumps {f.lump_fraction:.2f}" for f in found.fragments}
    return Paint(
        np.stack([indices.get(frame, snow) for frame in frames]), [lumps.get(frame, PRESSED) for frame in frames]
    )


def by_density(dataset: xr.Dataset, config: Config, frames: Sequence[int]) -> Paint:
    """The density of Eq. 2."""
    return _field(dataset, "density", frames)


def by_J_P(dataset: xr.Dataset, config: Config, frames: Sequence[int]) -> Paint:
    """The plastic volume ratio."""
    return _field(dataset, "J_P", frames)


def by_damage(dataset: xr.Dataset, config: Config, frames: Sequence[int]) -> Paint:
    """The part of each particle's bonds that broke since the release, as the run's own analysis breaks them."""
    found = classify(dataset, config.analysis)
    damage = _damage(found)
    sound = np.zeros(dataset.sizes["particle"], dtype=np.float32)
    broken = found.broken[config.analysis.break_by]
    notes = [f"broken bonds {broken[frame]:.2f}" if frame in damage else PRESSED for frame in frames]
    values = np.stack([damage.get(frame, sound) for frame in frames])
    return Paint(values, notes, "damage: part of its bonds that broke [1]", (0.0, 1.0))


PAINTS: dict[str, Callable[[xr.Dataset, Config, Sequence[int]], Paint]] = {
    "snow": by_snow,
    "fragment": by_fragment,
    "density": by_density,
    "J_P": by_J_P,
    "damage": by_damage,
}


def _field(dataset: xr.Dataset, name: str, frames: Sequence[int]) -> Paint:
    about = dataset[name].attrs
    values = dataset[name].sel(snapshot=list(frames)).values
    return Paint(values, [""] * len(frames), f"{about['long_name']} [{about['units']}]")


def _damage(found: Classified) -> dict[int, np.ndarray]:
    """The broken part of each particle's bonds (n,) by frame."""
    extremes, damage = Extremes(found.bonds), {}
    for frame, places in zip(found.motion.frames.tolist(), found.motion.position, strict=True):
        extremes.extend(places)
        laid, lost = bonds_lost(found.bonds, extremes.history(), found.analysis, len(places))
        damage[frame] = (lost / np.maximum(laid, 1)).astype(np.float32)
    return damage
