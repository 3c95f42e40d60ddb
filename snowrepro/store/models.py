"""What the files of a store may say: their keys, types and bounds.

A key that is not ours is not looked at.  Everything else that differs makes the file unreadable, with the reason.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from .. import foreign
from ..foreign import KIB, MIB, Unreadable

# Bytes that a file may have: some ten times what the largest real ones do.
MOST_MANIFEST = MOST_CONFIG = 16 * MIB
MOST_RECORD = 64 * MIB
MOST_ROW = MOST_OUTCOME = 1 * MIB
MOST_LEASE = MOST_PROGRESS = 64 * KIB

Line = Annotated[str, Field(max_length=10_000)]
Message = Annotated[str, Field(max_length=500_000)]
Name = Annotated[str, Field(min_length=1, max_length=foreign.MOST_LETTERS, pattern=foreign.PLAIN_NAME)]
Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Count = Annotated[int, Field(ge=0, le=2**63)]
Model = TypeVar("Model", bound=BaseModel)


class Stored(BaseModel):
    """Base of what is read from a store: types are as they were written, and other keys are left out."""

    model_config = ConfigDict(frozen=True, extra="ignore", strict=True)


class FileFacts(Stored):
    """What a manifest says of a file."""

    bytes: Count
    mtime_ns: int
    sha256: Digest


class KindFacts(Stored):
    """What a manifest says of what the time of its run depends on: see ``store.cost.Kind``."""

    shape: Line
    floor: Line
    sintered: bool
    pressure: float = Field(ge=0, le=1e300, allow_inf_nan=False)
    fidelity: Line
    solver: Line
    indented: bool
    frames: int = Field(ge=1, le=10**12)
    work: float = Field(ge=1e-6, le=1e15, allow_inf_nan=False)


class Manifest(Stored):
    """What stands beside a result.  Older ones do not have all of it."""

    run_id: Name
    checksum: Digest
    files: dict[Name, FileFacts]
    config: dict[str, Any] | None = None
    model_version: int | None = None
    arrays: dict[Line, Digest] = {}
    code: dict[Line, Line] = {}
    environment: dict[Line, Line] = {}
    packages: dict[Line, Line] = {}
    kind: KindFacts | None = None
    created: Line = ""
    began: Line = ""
    command: Message = ""
    versions: Line = ""
    git_state: Line = ""
    machine: Line = ""
    device: Line = ""  # what Taichi computed on: x64, arm64 or cuda
    wall_seconds: float = 0.0
    seconds_per_frame: float = 0.0  # NaN of a run of few frames
    frames: int | None = Field(None, ge=0, le=10**12)  # that it took: it may have ended at rest
    peak_memory_mb: float = Field(0.0, ge=0, le=1e12)


class Outcome(Stored):
    """How the last attempt at a run ended that left no result."""

    state: Literal["failed", "timed out", "interrupted"]
    message: Message
    final: bool = False
    made_by: Line = ""
    created: Line = "unknown"
    versions: Line = "unknown"
    git_state: Line = "unknown"
    machine: Line = "unknown"


class Lease(Stored):
    """The process that holds a lease."""

    host: str = Field(max_length=300)
    place: str = Field(max_length=1000)
    pid: int = Field(ge=0, le=2**31 - 1)
    born: str = Field("", max_length=100)


class Progress(Stored):
    """How far a run is."""

    frame: int = Field(ge=0, le=10**12)
    frames: int = Field(ge=1, le=10**12)
    substeps: int = Field(ge=0, le=10**15)


class SweepRecord(Stored):
    """What is remembered of a sweep: its overrides, and the id of each run by its overrides."""

    overrides: list[Annotated[str, Field(max_length=20_000)]] = Field(max_length=1000)
    recorded: Annotated[str, Field(max_length=100)]
    cells: dict[Annotated[str, Field(max_length=100_000)], Name]


class KeptRow(Stored):
    """The row of numbers of a run.

    ``key``: of the analysis; ``run_id``: whose it is; ``analysis``: checksum of the file beside it, empty if there is
    none; ``checksum``: of all.
    """

    key: Line
    run_id: Name
    analysis: Line
    checksum: Digest
    row: dict[Line, float | int | bool | Line | None] = Field(max_length=200)


def read_model(path: Path, model: type[Model], most: int, store: Path) -> Model | None:
    """Read a file of a store; None where it is not there.

    ``most``: bytes that it may have.  Raises Unreadable with the file and the reason.
    """
    foreign.refuse_links(path, store)
    try:
        content = foreign.read_json(path, most)
    except (FileNotFoundError, NotADirectoryError):
        return None
    return check(path, model, content)


def check(path: Path, model: type[Model], content: dict[str, Any]) -> Model:
    """Check what a file says.  Raises Unreadable."""
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise Unreadable(path, f"cannot be read: {_explain(error)}") from error


def or_none(read: Callable[[], Model | None]) -> Model | None:
    """What a function reads; None also where it is unreadable."""
    try:
        return read()
    except Unreadable:
        return None


def _explain(error: ValidationError) -> str:
    """The first thing that is wrong, in words."""
    first = error.errors(include_url=False, include_input=False)[0]
    where = ".".join(str(part)[:60] for part in first["loc"])
    return f"{where}: {first['msg'][:1].lower()}{first['msg'][1:]}"
