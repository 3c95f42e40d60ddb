"""How long runs will take, and how much memory, from what finished ones took."""

import math
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from ..settings.case import Case
from ..store import manifest
from ..store.cost import Kind, kind_of
from ..store.models import KindFacts
from ..store.provenance import environment

MOST_MEASURED = 1000  # the newest runs of a store: enough to find a like one
MOST_LIKE = 9
MOST_SECONDS = 1e9  # that a run can have taken
LAUNCH_SECONDS = 0.8  # of a run beyond its frames: its process, writing the result, its row of numbers
# Where a store has no run yet: preview fidelity on an AMD EPYC of 2024.
GUESS_STARTUP, GUESS_COST, GUESS_MEMORY_MB = 1.5, 4.5e-6, 400.0
# How unlike runs are that differ in this; a factor 2 of pressure is 1.
UNLIKE = {"shape": 1.0, "floor": 0.5, "sintered": 4.0, "fidelity": 3.0, "solver": 6.0, "indented": 8.0}


@dataclass(frozen=True)
class Measured:
    """What a finished run took: seconds before its frames, seconds of a frame per ``work``, memory [MB].

    ``part``: of its frames that it took, as it may have ended at rest.
    """

    kind: Kind
    startup: float
    cost: float
    memory_mb: float
    part: float


@dataclass(frozen=True)
class Estimate:
    """Of runs that are still to be done.  ``measured``: how many finished runs this rests on; 0: it is a guess."""

    seconds: float
    memory_mb: float
    measured: int


def estimate(cases: Iterable[Case], store: str | Path) -> Estimate:
    """What runs will take, all in all, and at most in memory."""
    kinds = Counter(map(kind_of, cases))
    measured = measured_in(store)
    seconds, memory_mb = 0.0, GUESS_MEMORY_MB
    for kind, count in kinds.items():
        like = _like(kind, measured)
        startup = median(m.startup for m in like) if like else GUESS_STARTUP
        cost = median(m.cost for m in like) if like else GUESS_COST
        part = median(m.part for m in like) if like else 1.0
        seconds += count * (startup + part * kind.frames * kind.work * cost + LAUNCH_SECONDS)
        memory_mb = max([memory_mb, *(m.memory_mb * max(1.0, kind.work / m.kind.work) for m in like)])
    return Estimate(seconds, memory_mb, len(measured))


def measured_in(store: str | Path) -> list[Measured]:
    """What the newest finished runs of a store took; on this kind of processor, if there are any such."""
    try:
        with os.scandir(store) as entries:
            runs = [entry for entry in entries if not entry.name.startswith(".") and not entry.is_symlink()]
            folders = [(entry.stat(follow_symlinks=False).st_mtime, entry.path) for entry in runs]
    except OSError:
        return []
    newest = sorted(folders, reverse=True)[:MOST_MEASURED]
    written = [content for _, path in newest if _tells_time(content := manifest.read(Path(path)))]
    here = [c for c in written if c.get("environment", {}).get("processor") == environment()["processor"]]
    return [_measured(content) for content in here or written]


def _tells_time(content: Mapping[str, Any]) -> bool:
    """Whether a manifest says how long its run took, frame by frame."""
    seconds = content.get("seconds_per_frame", 0.0), content.get("wall_seconds", 0.0)
    return bool(content.get("kind")) and seconds[0] > 0 and all(0 <= value < MOST_SECONDS for value in seconds)


def _measured(content: Mapping[str, Any]) -> Measured:
    """What a manifest says."""
    kind = Kind(**KindFacts.model_validate(content["kind"]).model_dump())
    frame, frames = content["seconds_per_frame"], min(kind.frames, content.get("frames") or kind.frames)
    startup = max(0.0, content["wall_seconds"] - frame * frames)
    memory_mb = content.get("peak_memory_mb", GUESS_MEMORY_MB)
    return Measured(kind, startup, frame / kind.work, memory_mb, frames / kind.frames)


def _like(kind: Kind, measured: Sequence[Measured]) -> list[Measured]:
    """The finished runs that are least unlike a kind; of equals, the newest."""
    distances = [(_unlike(kind, m.kind), index) for index, m in enumerate(measured)]
    nearest = sorted(distances)[:MOST_LIKE]
    return [measured[index] for distance, index in nearest if distance <= nearest[0][0] + 1e-9]


def _unlike(one: Kind, other: Kind) -> float:
    """How unlike two kinds are."""
    named = sum(weight for name, weight in UNLIKE.items() if getattr(one, name) != getattr(other, name))
    return named + abs(math.log2((one.pressure + 1.0) / (other.pressure + 1.0)))
