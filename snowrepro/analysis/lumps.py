"""Lumps, crushed and loose snow over time: which particles hold together in each frame, and strains of bonds."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ..errors import DataError
from ..settings.analysis import Analysis
from . import view
from .bonds import BondHistory, Bonds, Extremes, lay_bonds
from .definitions import NEED_BONDS, State, find_fragments
from .fragments import Fragments, tabulate_fragments, trace_ancestry
from .gauge import Gauge
from .motion import Motion, require_frames
from .states import STATES


@dataclass(frozen=True, repr=False)
class Classification:
    """Lumps, crushed and loose snow in chosen frames.

    ``fragments``: in the chosen frames, rising; the measures below are of the last of them; ``broken``: part of the
    bonds that broke by every stored frame, with columns both, stretch and crush; ``course``: part of the mass of
    clusters in each of STATES in these frames, as far as they were followed; ``state``: what the last chosen frame
    was judged by; ``changed``: part of the mass that changed its state in the frames before it (``settled_frames``), or
    of the neighbours that parted then, whichever is more; ``strain``: mean since release, see ``Gauge.measure_strain``.
    """

    motion: Motion
    analysis: Analysis
    fragments: list[Fragments]
    broken: pd.DataFrame
    course: pd.DataFrame
    state: State
    changed: float
    strain: float

    @property
    def last(self) -> Fragments:
        """The fragments in the last of the chosen frames."""
        return self.fragments[-1]

    @property
    def lump_fraction(self) -> float:
        """Part of the mass that is in lumps in the last frame."""
        return self.last.lump_fraction

    @property
    def assumed(self) -> list[str]:
        """What had to be assumed because the data does not say it, in words."""
        return self.motion.assumed

    @property
    def settled(self) -> bool:
        """Whether hardly any snow comes apart or is crushed any more: see ``settled_change`` of the analysis."""
        return self.changed < self.analysis.settled_change

    def measures(self) -> dict[str, Any]:
        """Return the numbers of the last frame by name; masses are parts of the whole body."""
        last = self.last
        return {
            "definition": self.analysis.definition,
            "particles": len(last.label),
            "lump_fraction": last.lump_fraction,
            "crushed_fraction": last.crushed_fraction,
            "loose_fraction": last.loose_fraction,
            "powder_fraction": last.powder_fraction,
            "vanished": last.vanished,
            "lumps": last.lumps,
            "fragments": len(last.mass),
            "largest_fragment": last.largest,
            "median_mass": last.median_mass,
            "joined_chance": last.joined_chance,
            "effective_number": last.effective_number,
            "second_moment": last.second_moment,
            **({"broken_bonds": last.broken} if len(self.state.bonds.pairs) else {}),
            "settled": self.settled,
            "changed": self.changed,
        }

    def table(self) -> pd.DataFrame:
        """Tabulate the fragments of all chosen frames, a row each: see ``tabulate_fragments``."""
        return pd.concat(
            [tabulate_fragments(fragments, self.motion) for fragments in self.fragments], ignore_index=True
        )

    def __repr__(self) -> str:
        return f"<Classification of frame {self.last.frame}: {view.describe_lumps(self.measures())}>"

    def _repr_html_(self) -> str:
        """Return the fragments of the last chosen frame as HTML, for notebooks."""
        title = f"Lumps, crushed and loose snow in frame {self.last.frame}"
        fragments = tabulate_fragments(self.last, self.motion)
        fragments["mass"] /= self.motion.mass.sum()
        return view.make_html(title, self.measures(), fragments, self.motion.unit, self.assumed)

    def to_dataset(self) -> xr.Dataset:
        """Return fragment ids by particle and frame, and bonds with their extreme strains, as a Dataset for a file."""
        label = np.stack([fragments.id[fragments.label] for fragments in self.fragments])
        states = np.stack([fragments.states for fragments in self.fragments])
        frames = [fragments.frame for fragments in self.fragments]
        about = {"long_name": "id of the fragment; the heaviest heir keeps it", "units": "1"}
        ids = self.motion.particle_id
        return xr.Dataset(
            {
                "fragment": (("snapshot", "particle"), label.astype(np.int32), about),
                **make_state_variables(states),
                **self._make_bond_variables(),
            },
            {
                "snapshot": ("snapshot", frames, {"long_name": "frame of these fragments", "units": "1"}),
                "state": ("state", self.broken.index.to_numpy(), {"long_name": "frame of a state", "units": "1"}),
                **({} if ids is None else {"particle_id": ("particle", ids, {"long_name": "id in the data"})}),
            },
            {
                "title": "fragments of snow",
                "release_frame": self.motion.release,
                "analysis": self.analysis.model_dump_json(),
            },
        )

    def _make_bond_variables(self) -> dict[str, tuple]:
        """Make variables of a Dataset of the bonds that were followed, if any."""
        if not len(self.state.bonds.pairs):
            return {}
        bonds = make_bond_variables(self.state.bonds, self.state.history, self.motion.unit)
        return {**bonds, **make_broken_variables(self.broken)}


def classify_motion(
    motion: Motion, analysis: Analysis, frames: Sequence[int], follows_all: bool = False
) -> Classification:
    """Find the fragments of a motion in some frames, by the definition of a lump that ``analysis`` chooses.

    ``follows_all``: whether bonds are laid and followed even if that definition needs none, and the states of clusters
    in every stored frame.
    Raises DataError where there is no frame, or where one is not stored.
    """
    wanted = require_frames(motion, frames)
    if not wanted:
        raise DataError("no frame was asked for")
    extremes, gauge = Extremes(_lay_bonds(motion, analysis, follows_all)), Gauge(motion, analysis)
    compared = (find_frame_before(gauge.frames, wanted[-1] - analysis.settled_frames), wanted[-1])
    stored, broken, fragments, parts, course, joined = set(motion.frames.tolist()), {}, [], {}, {}, {}
    for frame, centre in gauge.follow(wanted[-1]):
        if frame in compared:
            parts[frame], joined[frame] = gauge.divide_clusters(centre), gauge.joined_part
        if frame in stored and follows_all:
            course[frame] = gauge.divide_clusters(centre).sum(axis=0)
        if frame in stored:
            index = motion.index(frame)
            extremes.extend(motion.position[index])
            broken[frame] = extremes.measure_broken(analysis.break_strain)
        if frame in wanted:
            state = State(motion, index, extremes.bonds, extremes.to_history(), gauge.judge_particles(centre, index))
            fragments.append(find_fragments(state, analysis, broken[frame][analysis.break_by]))
    before, last = compared
    change = max(float(np.abs(parts[last] - parts[before]).sum() / 2), float(joined[before] - joined[last]))
    broken_by = pd.DataFrame.from_dict(broken, orient="index")
    course_by = pd.DataFrame.from_dict(course, orient="index", columns=list(STATES))
    traced = trace_ancestry(fragments, motion.mass)
    return Classification(motion, analysis, traced, broken_by, course_by, state, change, gauge.measure_strain(centre))


def _lay_bonds(motion: Motion, analysis: Analysis, is_wanted: bool) -> Bonds:
    """Lay the bonds of a motion if they are wanted or needed; none otherwise."""
    if not is_wanted and analysis.definition not in NEED_BONDS:
        return Bonds(np.empty((0, 2), dtype=np.int32), np.empty(0))
    return lay_bonds(motion.position[0].astype(float), analysis.link_length * motion.grid_spacing)


def find_frame_before(frames: np.ndarray, frame: int) -> int:
    """Find the last of ``frames``, rising, that is not after ``frame``; the first where there is none."""
    return int(frames[max(int(np.searchsorted(frames, frame, side="right")) - 1, 0)])


def make_bond_variables(bonds: Bonds, history: BondHistory, unit: str) -> dict[str, tuple]:
    """Make variables of a Dataset from bonds and their extreme strains.

    ``unit``: of the positions, empty where it is not known.
    """
    length = {"long_name": "length at release", "units": unit or "unknown"}
    return {
        "pair": (("bond", "end"), bonds.pairs.astype(np.int32), {"long_name": "bonded particles", "units": "1"}),
        "length": ("bond", bonds.length.astype(np.float32), length),
        "stretch": ("bond", history.stretch.astype(np.float32), {"long_name": "largest log strain", "units": "1"}),
        "crush": ("bond", history.crush.astype(np.float32), {"long_name": "smallest log strain", "units": "1"}),
    }


def make_state_variables(states: np.ndarray) -> dict[str, tuple]:
    """Make variables of a Dataset from the ``states`` (snapshot, particle, 3): part of each particle in each state."""
    words = {"lump": "part in a lump", "crushed": "part crushed", "loose": "part loose"}
    return {
        name: (("snapshot", "particle"), states[:, :, place].astype(np.float32), {"long_name": text, "units": "1"})
        for place, (name, text) in enumerate(words.items())
    }


def make_course_variables(course: pd.DataFrame) -> dict[str, tuple]:
    """Make variables of a Dataset from the part of the mass that is lump, crushed and loose in each stored frame."""
    about = {"long_name": "part of the mass of clusters", "units": "1"}
    return {f"part_{name}": ("state", course[name].to_numpy(), about) for name in STATES}


def make_broken_variables(broken: pd.DataFrame) -> dict[str, tuple]:
    """Make variables of a Dataset from the part of the bonds that broke by each state."""
    words = {"both": "stretch or crushing", "stretch": "stretch", "crush": "crushing"}
    return {
        f"broken_{sign}": (
            "state",
            broken[sign].to_numpy(),
            {"long_name": f"part of the bonds broken by {cause}", "units": "1"},
        )
        for sign, cause in words.items()
    }
