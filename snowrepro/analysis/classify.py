"""Lumps and powder of any particles over time: bonds at release, what they saw, fragments at the frames asked for."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
import xarray as xr
from pydantic import ValidationError

from ..config import Analysis
from ..errors import ConfigError, DataError
from ..store import cf
from ..store.files import published
from .bonds import BondHistory, Bonds, Extremes, lay_bonds
from .definitions import DEFINITIONS
from .fragments import Fragments, fragments_of, table_of, with_ancestry
from .motion import Motion, motion_of, own_analysis, stored, usual_analysis


@dataclass(frozen=True)
class Classified:
    """Lumps and powder over time.

    ``fragments``: at the frames asked for, rising, the last of them what the measures below are of; ``broken``: part
    of the bonds broken by every stored frame, with columns both, stretch and crush; ``bonds`` and ``history``: what
    each bond has seen up to the last frame.
    """

    motion: Motion
    analysis: Analysis
    fragments: list[Fragments]
    broken: pd.DataFrame
    bonds: Bonds
    history: BondHistory

    @property
    def last(self) -> Fragments:
        """The fragments at the last frame asked for."""
        return self.fragments[-1]

    @property
    def lump_fraction(self) -> float:
        """Part of the mass that is in lumps at the last frame."""
        return self.last.lump_fraction

    @property
    def assumed(self) -> list[str]:
        """What the data did not say, in words."""
        return self.motion.assumed

    @property
    def settled(self) -> bool:
        """Whether hardly any bond breaks any more: see ``settled_change`` and ``settled_frames`` of the analysis."""
        broken = self.broken[self.analysis.break_by]
        before = broken[broken.index <= self.last.frame - self.analysis.settled_frames]
        start = before.iloc[-1] if len(before) else broken.iloc[0]
        return bool(broken[self.last.frame] - start < self.analysis.settled_change)

    def measures(self) -> dict[str, Any]:
        """The numbers of the last frame by name; masses are parts of the whole body."""
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
            "joined_chance": last.joined,
            "effective_number": last.effective_number,
            "second_moment": last.second_moment,
            "broken_bonds": last.broken,
            "settled": self.settled,
        }

    def table(self) -> pd.DataFrame:
        """A row for each fragment and frame: id, parent, mass, place, size, velocity, spin; see ``table_of``."""
        return pd.concat([table_of(fragments, self.motion) for fragments in self.fragments], ignore_index=True)

    def to_dataset(self) -> xr.Dataset:
        """Ids of the fragments by particle and frame, and the bonds with what they saw, ready to be written."""
        label = np.stack([fragments.id[fragments.label] for fragments in self.fragments])
        lump = np.stack([fragments.is_lump[fragments.label] for fragments in self.fragments])
        frames = [fragments.frame for fragments in self.fragments]
        about = {"long_name": "id of the fragment; the heaviest heir keeps it", "units": "1"}
        return xr.Dataset(
            {
                "fragment": (("snapshot", "particle"), label.astype(np.int32), about),
                "in_lump": (("snapshot", "particle"), lump.astype(np.int8), {"long_name": "1 in a lump", "units": "1"}),
                **bond_variables(self.bonds, self.history, self.motion.unit),
                **broken_variables(self.broken),
            },
            {
                "snapshot": ("snapshot", frames, {"long_name": "frame of these fragments", "units": "1"}),
                "state": ("state", self.broken.index.to_numpy(), {"long_name": "frame of a state", "units": "1"}),
            },
            {
                "title": "fragments of snow",
                "release_frame": self.motion.release,
                "analysis": self.analysis.model_dump_json(),
            },
        )


def classify(
    data: xr.Dataset | np.ndarray,
    analysis: Analysis | None = None,
    *,
    frames: Sequence[int] | Literal["all"] | None = None,
    mass: np.ndarray | float | None = None,
    release: int | None = None,
    grid_spacing: float | None = None,
    cell_mass: float | None = None,
    **settings: Any,
) -> Classified:
    """Lumps and powder of particles over time, ours or anyone's.

    ``data``: a Dataset (a run; or see ``motion_of`` for what it must hold) or positions (time, particle, axis).
    ``frames``: those whose fragments are wanted, "all" stored ones since release, or by default the last.
    ``mass`` (n,), ``release`` (a frame), ``grid_spacing`` and ``cell_mass`` win over what the data says.
    ``analysis`` and ``settings`` by name (``definition="proximity"``, ``break_strain=0.2``) define what a lump is; by
    default as the run itself was asked for, or as conf/analysis/bonds.yaml says.
    Raises DataError for data that cannot be classified and ConfigError for wrong settings.
    """
    if isinstance(data, xr.Dataset):
        data = cf.run_as_read(data)
    motion = motion_of(data, mass=mass, release=release, grid_spacing=grid_spacing, cell_mass=cell_mass)
    if analysis is None:
        analysis = own_analysis(data) if isinstance(data, xr.Dataset) else usual_analysis()
    analysis = with_settings(analysis, settings)
    if frames is None:
        frames = [int(motion.frames[-1])]
    return classify_motion(motion, analysis, motion.frames.tolist() if isinstance(frames, str) else list(frames))


def classify_motion(motion: Motion, analysis: Analysis, frames: Sequence[int]) -> Classified:
    """Fragments at ``frames``, which must be stored; see ``classify``."""
    wanted = stored(motion, frames)
    if not wanted:
        raise DataError("no frame was asked for")
    bonds = lay_bonds(motion.position[0].astype(float), analysis.link_length * motion.grid_spacing)
    extremes = Extremes(bonds)
    rule = DEFINITIONS[analysis.definition]
    least = motion.least_lump(analysis)
    broken, found = [], []
    history = extremes.history()
    for index in range(motion.index(wanted[-1]) + 1):
        extremes.extend(motion.position[index])
        broken.append(extremes.broken(analysis.break_strain))
        frame = int(motion.frames[index])
        if frame in wanted:
            history = extremes.history()
            component = rule(motion, index, bonds, history, analysis)
            found.append(fragments_of(frame, component, motion, least, broken[-1][analysis.break_by]))
    by_frame = pd.DataFrame(broken, index=motion.frames[: len(broken)])
    return Classified(motion, analysis, with_ancestry(found, motion.mass), by_frame, bonds, history)


def write(found: Classified, folder: Path) -> None:
    """Write measures.json, fragments.csv (a row a fragment) and fragments.nc (ids by particle, and the bonds).

    Raises StoreError where it cannot be written.
    """
    told = {**found.measures(), "assumed": found.assumed, "analysis": found.analysis.model_dump()}
    with published(folder / "measures.json") as partial:
        partial.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    with published(folder / "fragments.csv") as partial:
        found.table().to_csv(partial, index=False, float_format="%.6g", lineterminator="\n")
    with published(folder / "fragments.nc") as partial:
        cf.as_file(found.to_dataset(), "classified by snowrepro").to_netcdf(partial, engine="netcdf4")


def with_settings(analysis: Analysis, settings: dict[str, Any]) -> Analysis:
    """The same analysis with some settings changed.  Raises ConfigError naming a wrong one and the right ones."""
    names = list(Analysis.model_fields)
    for name in settings:
        if name not in names:
            raise ConfigError(f"there is no setting '{name}' of the analysis; there are: {', '.join(names)}")
    try:
        return Analysis.model_validate({**analysis.model_dump(), **settings})
    except ValidationError as error:
        wrong = "; ".join(f"{item['loc'][0]}: {item['msg']} (got {item['input']!r})" for item in error.errors())
        raise ConfigError(wrong) from error


def bond_variables(bonds: Bonds, history: BondHistory, unit: str) -> dict[str, tuple]:
    """Bonds and their extremes as variables of a Dataset, half a kilobyte a dozen; ``unit`` of the places, or empty."""
    length = {"long_name": "length at release", "units": unit or "unknown"}
    return {
        "pair": (("bond", "end"), bonds.pairs.astype(np.int32), {"long_name": "bonded particles", "units": "1"}),
        "length": ("bond", bonds.length.astype(np.float32), length),
        "stretch": ("bond", history.stretch.astype(np.float32), {"long_name": "largest log strain", "units": "1"}),
        "crush": ("bond", history.crush.astype(np.float32), {"long_name": "smallest log strain", "units": "1"}),
    }


def broken_variables(broken: pd.DataFrame) -> dict[str, tuple]:
    """The broken part of the bonds over time as variables of a Dataset."""
    words = {"both": "stretch or crushing", "stretch": "stretch", "crush": "crushing"}
    return {
        f"broken_{sign}": (
            "state",
            broken[sign].to_numpy(),
            {"long_name": f"part of the bonds broken by {how}", "units": "1"},
        )
        for sign, how in words.items()
    }
