"""How particles are coloured in each state: as in the paper, by fragment, by a field, by broken bonds."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgba_array

from ...analysis.bonds import Extremes
from ...analysis.definitions import count_bonds
from ...analysis.fragments import Fragments
from ...analysis.lumps import Classification
from ...quantities import add_unit, format_unit
from ...store.run import Run
from ...summary.classify import classify
from .common import SNOW
from .states import CRUSHED, LOOSE, LUMPS, colour_fragments

PALETTE = (SNOW, CRUSHED, LOOSE, *LUMPS)  # what indices stand for
OUTLIERS = (1, 99)  # percentiles between which a field is told apart
PRESSED = "pressed"


@dataclass(frozen=True)
class Colouring:
    """The colours of one run's particles, as numbers.

    ``values`` (state, particle): indices of PALETTE, or values of a field; ``notes`` (state,): words for each state;
    ``field``: name and unit of the field, empty without one; ``limits``: the values between which the field's colours
    run, if they are fixed; ``is_of_states``: whether colours tell lumps, crushed and loose snow apart.
    """

    values: np.ndarray
    notes: list[str]
    field: str = ""
    limits: tuple[float, float] | None = None
    is_of_states: bool = False


@dataclass(frozen=True)
class Scale:
    """The colour scale of a field: the values at its ends, and the field's name and unit."""

    low: float
    high: float
    field: str

    @property
    def mappable(self) -> ScalarMappable:
        """The scale as Matplotlib needs it."""
        return ScalarMappable(Normalize(self.low, self.high), "plasma")


def make_scale(colourings: Sequence[Colouring]) -> Scale | None:
    """Make one scale for runs that are coloured by a field; None if they are not."""
    field, limits = colourings[0].field, colourings[0].limits
    if not field:
        return None
    low, high = limits or np.percentile(
        np.concatenate([colouring.values.ravel() for colouring in colourings]), OUTLIERS
    )
    margin = 0.0 if high > low else 0.01 * abs(low)
    return Scale(float(low - margin), float(high + margin), field)


def convert_to_colours(values: np.ndarray, scale: Scale | None) -> np.ndarray:
    """Convert the ``values`` (n,) of one state to colours: RGBA (n, 4)."""
    return scale.mappable.to_rgba(values) if scale else to_rgba_array(PALETTE)[values]


def colour_as_snow(dataset: xr.Dataset, _run: Run, frames: Sequence[int]) -> Colouring:
    """Give all particles the paper's one colour."""
    return Colouring(np.zeros((len(frames), dataset.sizes["particle"]), dtype=np.uint8), [""] * len(frames))


def colour_by_fragment(dataset: xr.Dataset, run: Run, frames: Sequence[int]) -> Colouring:
    """Give each lump a colour, crushed and loose snow theirs; before the release all particles are snow."""
    classified = classify(dataset, run.config.question.analysis, frames="all")
    shares = {f.frame: describe_shares(f) for f in classified.fragments}
    notes = [shares.get(frame, PRESSED) for frame in frames]
    return Colouring(index_colours(classified, frames), notes, is_of_states=True)


def index_colours(classified: Classification, frames: Sequence[int]) -> np.ndarray:
    """Choose the colours of a run's particles as ``colour_fragments`` does: indices of PALETTE, (frames, n) uint8.

    In frames that are not classified, those before the release, all are snow.
    """
    index_of = {colour: index for index, colour in enumerate(PALETTE)}
    indices = {
        fragments.frame: np.array([index_of[colour] for colour in colours], dtype=np.uint8)
        for fragments, colours in zip(classified.fragments, colour_fragments(classified), strict=True)
    }
    snow = np.zeros(len(classified.last.label), dtype=np.uint8)
    return np.stack([indices.get(frame, snow) for frame in frames])


def describe_shares(fragments: Fragments) -> str:
    """Say which part of the mass is in each state, in a few words."""
    return ", ".join(f"{state} {share:.2f}" for state, share in fragments.shares.items())


def colour_by_density(dataset: xr.Dataset, _run: Run, frames: Sequence[int]) -> Colouring:
    """Colour particles by density, which Eq. 2 changes."""
    return _colour_by_field(dataset, "density", frames)


def colour_by_plastic_ratio(dataset: xr.Dataset, _run: Run, frames: Sequence[int]) -> Colouring:
    """Colour particles by their plastic volume ratio J_P."""
    return _colour_by_field(dataset, "J_P", frames)


def colour_by_damage(dataset: xr.Dataset, run: Run, frames: Sequence[int]) -> Colouring:
    """Colour particles by the part of their bonds that broke since the release.

    When a bond breaks is decided by the settings of the run's own analysis.
    """
    classified = classify(dataset, run.config.question.analysis, definition="damage")
    damage = _compute_damage(classified)
    sound = np.zeros(dataset.sizes["particle"], dtype=np.float32)
    broken = classified.broken[run.config.question.analysis.break_by]
    notes = [f"broken bonds {broken[frame]:.2f}" if frame in damage else PRESSED for frame in frames]
    values = np.stack([damage.get(frame, sound) for frame in frames])
    return Colouring(values, notes, "damage: part of its bonds that broke", (0.0, 1.0))


COLOURINGS: dict[str, Callable[[xr.Dataset, Run, Sequence[int]], Colouring]] = {
    "snow": colour_as_snow,
    "fragment": colour_by_fragment,
    "density": colour_by_density,
    "J_P": colour_by_plastic_ratio,
    "damage": colour_by_damage,
}


def _colour_by_field(dataset: xr.Dataset, name: str, frames: Sequence[int]) -> Colouring:
    """Colour particles by a stored field."""
    attributes = dataset[name].attrs
    values = dataset[name].sel(snapshot=list(frames)).values
    return Colouring(values, [""] * len(frames), add_unit(attributes["long_name"], format_unit(attributes["units"])))


def _compute_damage(classified: Classification) -> dict[int, np.ndarray]:
    """Compute the broken part of each particle's bonds, (n,) for each frame."""
    extremes, damage = Extremes(classified.state.bonds), {}
    for frame, places in zip(classified.motion.frames.tolist(), classified.motion.position, strict=True):
        extremes.extend(places)
        laid, lost = count_bonds(classified.state.bonds, extremes.to_history(), classified.analysis, len(places))
        damage[frame] = (lost / np.maximum(laid, 1)).astype(np.float32)
    return damage
