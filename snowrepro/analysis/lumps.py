"""Lumps and powder of particles over time: which hold together in each frame, and the strains of their bonds."""

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
from .definitions import DEFINITIONS
from .fragments import Fragments, make_fragments, tabulate_fragments, trace_ancestry
from .motion import Motion, require_frames


@dataclass(frozen=True, repr=False)
class Classification:
    """Lumps and powder of particles in chosen frames.

    ``fragments``: in the chosen frames, rising; the measures below are of the last of them; ``broken``: part of the
    bonds that broke by every stored frame, with columns both, stretch and crush; ``bonds`` and ``history``: each bond
    and its extreme strains up to the last chosen frame.
    """

    motion: Motion
    analysis: Analysis
    fragments: list[Fragments]
    broken: pd.DataFrame
    bonds: Bonds
    history: BondHistory

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
        """Whether hardly any bond breaks any more: see ``settled_change`` and ``settled_frames`` of the analysis."""
        broken = self.broken[self.analysis.break_by]
        before = broken[broken.index <= self.last.frame - self.analysis.settled_frames]
        start = before.iloc[-1] if len(before) else broken.iloc[0]
        return bool(broken[self.last.frame] - start < self.analysis.settled_change)

    def measures(self) -> dict[str, Any]:
        """Return the numbers of the last frame by name; masses are parts of the whole body."""
        last = self.last
        return {
            "definition": self.analysis.definition,
            "particles": len(last.label),
            "lump_fraction": last.lump_fraction,
            "powder_fraction": last.powder_fraction,
            "vanished": last.vanished,
            "lumps": last.lumps,
            "fragments": len(last.mass),
            "largest_fragment": last.largest,
            "median_mass": last.median_mass,
            "joined_chance": last.joined_chance,
            "effective_number": last.effective_number,
            "second_moment": last.second_moment,
            "broken_bonds": last.broken,
            "settled": self.settled,
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
        title = f"Lumps and powder in frame {self.last.frame}"
        fragments = tabulate_fragments(self.last, self.motion)
        fragments["mass"] /= self.motion.mass.sum()
        return view.make_html(title, self.measures(), fragments, self.motion.unit, self.assumed)

    def to_dataset(self) -> xr.Dataset:
        """Return fragment ids by particle and frame, and bonds with their extreme strains, as a Dataset for a file."""
        label = np.stack([fragments.id[fragments.label] for fragments in self.fragments])
        lump = np.stack([fragments.is_lump[fragments.label] for fragments in self.fragments])
        frames = [fragments.frame for fragments in self.fragments]
        about = {"long_name": "id of the fragment; the heaviest heir keeps it", "units": "1"}
        ids = self.motion.particle_id
        return xr.Dataset(
            {
                "fragment": (("snapshot", "particle"), label.astype(np.int32), about),
                "in_lump": (("snapshot", "particle"), lump.astype(np.int8), {"long_name": "1 in a lump", "units": "1"}),
                **make_bond_variables(self.bonds, self.history, self.motion.unit),
                **make_broken_variables(self.broken),
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


def classify_motion(motion: Motion, analysis: Analysis, frames: Sequence[int]) -> Classification:
    """Find the fragments of a motion in some frames, by the definition of a lump that ``analysis`` chooses.

    Raises DataError where there is no frame, or where one is not stored.
    """
    frames_to_classify = require_frames(motion, frames)
    if not frames_to_classify:
        raise DataError("no frame was asked for")
    bonds = lay_bonds(motion.position[0].astype(float), analysis.link_length * motion.grid_spacing)
    extremes = Extremes(bonds)
    rule = DEFINITIONS[analysis.definition]
    least = motion.least_lump(analysis)
    broken, fragments = [], []
    history = extremes.to_history()
    for index in range(motion.index(frames_to_classify[-1]) + 1):
        extremes.extend(motion.position[index])
        broken.append(extremes.measure_broken(analysis.break_strain))
        frame = int(motion.frames[index])
        if frame in frames_to_classify:
            history = extremes.to_history()
            component = rule(motion, index, bonds, history, analysis)
            fragments.append(make_fragments(frame, component, motion, least, broken[-1][analysis.break_by]))
    by_frame = pd.DataFrame(broken, index=motion.frames[: len(broken)])
    return Classification(motion, analysis, trace_ancestry(fragments, motion.mass), by_frame, bonds, history)


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
