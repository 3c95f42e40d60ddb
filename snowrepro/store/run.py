"""A run in its store.

A finished one is a folder ``<id>``, published whole by one rename:

``run.nc``, ``run.log`` and ``manifest.json`` (see ``manifest``).  Beside them is kept what was derived: its row of
numbers, ``summary.json``, and what its bonds saw, ``analysis.nc``.

An unfinished one is a folder ``.work/<id>``: who works on it (see ``lease``), ``progress.json``, ``run.log``,
``checkpoint.npz`` with what it takes to go on, and ``outcome.json`` with how the last attempt ended.
"""

import shutil
import uuid
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ..errors import StoreError
from ..settings.case import MODEL_VERSION, Case
from ..settings.config import Config
from ..text import make_printable
from . import lease, manifest
from .files import flush, read_json, write_json, writing
from .identity import run_id
from .provenance import provenance

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

RESULT = "run.nc"
LOG = "run.log"
CHECKPOINT = "checkpoint.npz"
SUMMARY = "summary.json"
ANALYSIS = "analysis.nc"
CONFIG = "config.json"
OUTCOME = "outcome.json"
PROGRESS = "progress.json"
WORK = ".work"
TRASH = ".trash"


@dataclass(frozen=True, eq=False)
class Run:
    """One run: what it is, and what its store holds of it."""

    config: Config

    @property
    def case(self) -> Case:
        """What is simulated."""
        return self.config.case

    @cached_property
    def id(self) -> str:
        """Name of the run, the same for any spelling of its case."""
        return run_id(self.case)

    @property
    def store(self) -> Path:
        """The folder of all runs."""
        return Path(self.config.execution.store)

    @property
    def folder(self) -> Path:
        """Where its result is, or will be."""
        return self.store / self.id

    @property
    def work(self) -> Path:
        """Where it is worked on."""
        return self.store / WORK / self.id

    @property
    def result(self) -> Path:
        """The file of its result."""
        return self.folder / RESULT

    def manifest(self) -> dict[str, Any]:
        """What stands beside the result; empty if there is none."""
        return manifest.read(self.folder)

    def is_done(self) -> bool:
        """Whether a whole result is there: it is what its manifest says."""
        return self.folder.is_dir() and manifest.flaw(self.folder, self.manifest(), self.id) is None

    def is_current(self) -> bool:
        """Whether a whole result is there and not stale by what ``execution.rerun`` selects."""
        if not self.is_done():
            return False
        rerun = self.config.execution.rerun
        stale = manifest.stale(self.manifest(), self.config.execution) if rerun else {}
        return not any(kind in stale for kind in rerun)

    def open(self) -> "xr.Dataset":
        """The result, as ``simulate`` gave it.  Raises StoreError if it is not there or cannot be read."""
        return open_run(self.result)

    def save(self, dataset: "xr.Dataset", facts: Mapping[str, Any] | None = None, **seconds: float) -> Path:
        """Publish a result, whole or not at all, and forget the work on it; returns its file.

        ``seconds``: what it took, by name, kept as attributes; ``facts``: what else the manifest says.
        """
        rounded = {name: float(f"{value:.4g}") for name, value in seconds.items()}
        origin = provenance()
        dataset = dataset.assign_attrs(run_id=self.id, seed=self.case.seed, **rounded, **origin)
        content = {"run_id": self.id, "model_version": MODEL_VERSION, **origin, **rounded, **(facts or {})}
        content["kind"] = asdict(_arrays().kind_of(self.case))
        content["config"] = self.config.record()
        folder = self.work / f"result.{uuid.uuid4().hex[:8]}"
        try:
            with writing(self.result):
                self._write_result(folder, dataset, content)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        publish(folder, self.folder)
        with suppress(OSError):  # not empty where a lease is held
            self.work.rmdir()
        return self.result

    def _write_result(self, folder: Path, dataset: "xr.Dataset", content: dict[str, Any]) -> None:
        """Write result, log and manifest into a folder that is to be published."""
        folder.mkdir(parents=True)
        _arrays().write_result(folder / RESULT, dataset)
        if (self.work / LOG).exists():
            shutil.copyfile(self.work / LOG, folder / LOG)
        content["arrays"] = _arrays().digests(dataset)
        manifest.write(folder, [name for name in (RESULT, LOG) if (folder / name).exists()], content)

    def adopt(self) -> bool:
        """Publish the whole result of a process that died just before it could; whether there was one."""
        for folder in self.work.glob("result.*"):
            if manifest.flaw(folder, manifest.read(folder), self.id, thorough=True) is None:
                publish(folder, self.folder)
                return True
            shutil.rmtree(folder, ignore_errors=True)
        return False

    def outcome(self) -> dict[str, Any]:
        """How the last attempt without a result ended, as ``save_outcome`` wrote it; empty if there was none."""
        return read_json(self.work / OUTCOME)

    def save_outcome(self, state: str, message: str, final: bool = False) -> None:
        """Record how an attempt ended without a result.

        ``state``: failed, timed out or interrupted; ``final``: another attempt with this code would end likewise.
        """
        ended = {"state": state, "message": message, "final": final}
        write_json(self.work / OUTCOME, {**ended, "made_by": manifest.code_digest(), **provenance()})

    def record_loss(self, state: str, message: str) -> None:
        """Record how an attempt ended that could not say so itself, as its process was killed."""
        taken = lease.take(self.work)
        if taken:  # else somebody else goes on with the run
            with suppress(StoreError):  # a full disk: the run counts as interrupted
                self.save_outcome(state, message)
            taken.release()

    def forget_outcome(self) -> None:
        """Let the run be tried again."""
        (self.work / OUTCOME).unlink(missing_ok=True)

    def checkpoint(self) -> "dict[str, np.ndarray] | None":
        """What ``save_checkpoint`` kept; None if there is none, it is broken, or other code or versions made it."""
        return _arrays().read_checkpoint(self.work / CHECKPOINT, manifest.code_digest())

    def save_checkpoint(self, arrays: "Mapping[str, np.ndarray]") -> None:
        """Keep what it takes to go on with the run; it replaces the one before."""
        _arrays().write_checkpoint(self.work / CHECKPOINT, arrays, manifest.code_digest())

    def save_config(self) -> None:
        """Write down what is worked on, in the work folder."""
        write_json(self.work / CONFIG, self.config.record(), durable=False)

    def save_progress(self, frame: int, frames: int, substeps: int) -> None:
        """Write down how far the run is, for whoever watches."""
        write_json(self.work / PROGRESS, {"frame": frame, "frames": frames, "substeps": substeps}, durable=False)

    def forget_progress(self) -> None:
        """The run is no longer under way."""
        (self.work / PROGRESS).unlink(missing_ok=True)

    def row(self, key: str) -> dict[str, Any] | None:
        """The row of numbers that was kept for this result under the key of the analysis; None if there is none."""
        path = self.folder / SUMMARY
        if not self._is_derived(path):
            return None
        content = read_json(path)
        return content.get("row") if content.get("key") == key else None

    def save_row(self, key: str, row: Mapping[str, Any]) -> None:
        """Keep the row of numbers beside the result, under the key of the analysis that made it."""
        write_json(self.folder / SUMMARY, {"key": key, "row": row}, durable=False)

    def analysis(self, key: str) -> "xr.Dataset | None":
        """What ``save_analysis`` kept for this result under a key, read whole; None if there is none."""
        path = self.folder / ANALYSIS
        return _arrays().read_derived(path, key) if self._is_derived(path) else None

    def save_analysis(self, key: str, dataset: "xr.Dataset") -> None:
        """Keep what the bonds saw beside the result, under the key of the analysis."""
        _arrays().write_derived(self.folder / ANALYSIS, dataset, key)

    def _is_derived(self, path: Path) -> bool:
        """Whether a file that was derived from the result is there and not older than it."""
        return path.exists() and path.stat().st_mtime_ns >= self.result.stat().st_mtime_ns


def open_run(id_or_path: str | Path, store: str | Path = "runs") -> "xr.Dataset":
    """Open a run by its id in ``store`` or by the path of its file or folder, as ``simulate`` gave it.

    Another code's file is opened as it is.  Raises StoreError if there is no such file or it cannot be read.
    """
    return _arrays().read_result(find_result(id_or_path, store))


def open_particles(id_or_path: str | Path, store: str | Path = "runs", group: str | None = None) -> "xr.Dataset":
    """Open a run as ``open_run`` does, or the particles of another code in a file or in a ``group`` of it."""
    return _arrays().read_result(find_result(id_or_path, store), group)


def find_result(id_or_path: str | Path, store: str | Path) -> Path:
    """Find the file of a run by its id in ``store``, or by the path of its file or folder.

    It may be no regular file; only its reader can say so.  Raises StoreError if there is nothing.
    """
    for candidate in (Path(id_or_path), Path(store) / id_or_path):
        with suppress(OSError, ValueError):  # a name too long, a folder that may not be entered, a name with a zero
            path = candidate / RESULT if candidate.is_dir() else candidate
            if path.exists():
                return path
    name = make_printable(id_or_path)
    raise StoreError(f"there is no run '{name}': neither a file nor an id in the folder '{make_printable(store)}'")


def _arrays() -> ModuleType:
    """What reads and writes arrays: a plan or a status of many runs needs none, and loads none of it."""
    from . import arrays

    return arrays


def publish(folder: Path, place: Path) -> None:
    """Move a whole folder to its place by one rename; what was there before goes to the trash first."""
    with writing(place):
        flush(folder)
        if place.exists():
            discard(place)
        folder.rename(place)
        flush(place.parent)


def discard(folder: Path) -> None:
    """Take a folder out of the store, by one rename; its files are then removed."""
    store = folder.parent.parent if folder.parent.name == WORK else folder.parent
    trash = store / TRASH / f"{folder.name}.{uuid.uuid4().hex[:8]}"
    trash.parent.mkdir(exist_ok=True)
    folder.rename(trash)
    shutil.rmtree(trash, ignore_errors=True)


def has_failed_for_good(outcome: Mapping[str, Any]) -> bool:
    """Whether an outcome is one that this code and these versions would come to again."""
    return bool(outcome.get("final")) and outcome.get("made_by") == manifest.code_digest()


def read_progress(work: Path) -> dict[str, int]:
    """How far the run of a work folder is, as ``save_progress`` wrote it; empty if it is not under way."""
    return read_json(work / PROGRESS)
