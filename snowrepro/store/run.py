"""A run in its store.

A finished one is a folder ``<id>``, published whole by one rename:

``run.nc``, ``run.log`` and ``manifest.json`` (see ``manifest``).  Beside them is kept what was derived: its row of
numbers, ``summary.json``, and what its bonds saw, ``analysis.nc``.

An unfinished one is a folder ``.work/<id>``: who works on it (see ``lease``), ``progress.json``, ``run.log``,
``checkpoint.npz`` with what it takes to go on, and ``outcome.json`` with how the last attempt ended.
"""

import functools
import hashlib
import json
import os
import shutil
import uuid
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .. import foreign
from ..errors import StoreError
from ..foreign import Unreadable
from ..own_law import name_packages
from ..settings.case import MODEL_VERSION, Case
from ..settings.config import Config
from . import lease, manifest, models
from .files import flush, sha256, write_json, writing
from .folders import WORK, publish, require_own_folders
from .identity import run_id
from .provenance import provenance

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

RESULT = manifest.RESULT
LOG = "run.log"
CHECKPOINT = "checkpoint.npz"
SUMMARY = "summary.json"
ANALYSIS = "analysis.nc"
CONFIG = "config.json"
OUTCOME = "outcome.json"
PROGRESS = "progress.json"
# Arrays that every result has; and how many times the particles are at most that its area has room for.
ARRAYS = ("position", "velocity", "mass", "density", "J_P", "hardening", "young", "time", "frame", "snapshot")
MOST_PARTICLES = 4.0


# Results that this process found not to be what they looked like: by folder, which file that was, and why.
FOUND_BROKEN: dict[Path, tuple[tuple[int, int], str]] = {}


class BrokenResult(StoreError):
    """A result that looked whole by sizes and times, and is not."""


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
        return self.flaw() is None

    def flaw(self, thorough: bool = False) -> str | None:
        """What is wrong with the result that is there; None if nothing is, empty if there is none.

        ``thorough``: read every file, and not just its size and time.
        """
        return self.examine(thorough)[0]

    def examine(self, thorough: bool = False) -> tuple[str | None, dict[str, Any]]:
        """What is wrong with the result that is there, as ``flaw`` says it, and its manifest as far as it was read."""
        if not os.path.lexists(self.folder):
            return "", {}
        stamp, reason = FOUND_BROKEN.get(self.folder.absolute(), (None, ""))
        if stamp == self._stamp():
            return reason, {}
        if not foreign.is_own_folder(self.folder, self.store):
            return "its folder is a link, which is not followed, or no folder", {}
        written = self.manifest()
        if written and not manifest.is_of_this_version(written):
            return f"{manifest.MANIFEST} cannot be read as one of this version: it has no configuration of it", written
        return manifest.flaw(self.folder, written, self.id, thorough), written

    def require_own_folders(self) -> None:
        """Check that nothing is written through a link.  Raises StoreError that names it."""
        require_own_folders(self.store)
        foreign.refuse_links(self.work / LOG, self.store)

    def is_current(self) -> bool:
        """Whether a whole result is there and not stale by what ``execution.rerun`` selects."""
        if not self.is_done():
            return False
        rerun = self.config.execution.rerun
        stale = manifest.stale(self.manifest(), self.config.execution) if rerun else {}
        return not any(kind in stale for kind in rerun)

    def open(self) -> "xr.Dataset":
        """The result, as ``simulate`` gave it.

        Read as a whole once in a process, to see that it is what its manifest says.  Raises BrokenResult, which is
        then what ``states.standing`` finds as well, if it is not, or cannot be read; StoreError if it is not there.
        """
        if not os.path.lexists(self.result):
            raise StoreError(f"there is no result of the run '{self.id}' in the folder '{self.store}'")
        try:
            _verify(self.folder.absolute(), self.id, self._stamp())
            dataset = _arrays().read_result(self.result)
            self._require_arrays(dataset)
        except StoreError as error:
            raise self.broken(str(error)) from error
        return dataset

    def _require_arrays(self, dataset: "xr.Dataset") -> None:
        """Check that a result has the arrays of a run, no larger than they can be.  Raises StoreError."""
        particles = MOST_PARTICLES * _arrays().count_particles(self.case)
        if missing := [name for name in ARRAYS if name not in dataset.variables]:
            raise StoreError(f"{RESULT} has no {', '.join(missing)}")
        sizes = {name: dataset.sizes.get(name, 0) for name in ("frame", "snapshot", "particle")}
        if not 0 < sizes["snapshot"] <= sizes["frame"] <= self.case.frames + 1:
            raise StoreError(f"{RESULT} has {sizes['frame']:,} frames, and its run {self.case.frames + 1:,}")
        if not 0 < sizes["particle"] <= particles:
            raise StoreError(f"{RESULT} has {sizes['particle']:,} particles, and its scene at most {particles:,.0f}")

    def broken(self, reason: str) -> BrokenResult:
        """The error to raise for a result that looked whole and is not; from now on the run stands as broken."""
        FOUND_BROKEN[self.folder.absolute()] = (self._stamp(), reason)
        return BrokenResult(f"{self.id}: {reason}")

    def prepare_result(self) -> Path:
        """Make the folder in which a result is written before it is published.

        Who takes a run over removes those that others made.  So a process that was taken for dead, and wakes up, has
        no folder any more, and can publish nothing.
        """
        folder = self.work / f"result.{uuid.uuid4().hex[:8]}"
        with writing(folder):
            folder.mkdir(parents=True)
        return folder

    def save(
        self,
        dataset: "xr.Dataset",
        facts: Mapping[str, Any] | None = None,
        folder: Path | None = None,
        **seconds: float,
    ) -> Path:
        """Publish a result, whole or not at all, and forget the work on it; returns its file.

        ``seconds``: what it took, by name, kept as attributes; ``facts``: what else the manifest says; ``folder``: as
        ``prepare_result`` made it.  Raises StoreError, also where another process has removed that folder.
        """
        rounded = {name: float(f"{value:.4g}") for name, value in seconds.items()}
        origin = provenance()
        origin["versions"] = ", ".join([origin["versions"], *name_packages(self.case)])
        dataset = dataset.assign_attrs(run_id=self.id, seed=self.case.seed, **rounded, **origin)
        content = {"run_id": self.id, "model_version": MODEL_VERSION, **origin, **rounded, **(facts or {})}
        content["kind"] = asdict(_arrays().kind_of(self.case))
        content["frames"] = dataset.sizes.get("frame", 1) - 1
        content["config"] = self.config.record()
        self.require_own_folders()
        folder = folder or self.prepare_result()
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
        _arrays().write_result(folder / RESULT, dataset)
        if foreign.is_plain_file(self.work / LOG):
            foreign.copy_plain(self.work / LOG, folder / LOG)
            flush(folder / LOG)
        content["arrays"] = _arrays().digests(dataset)
        manifest.write(folder, [name for name in (RESULT, LOG) if (folder / name).exists()], content)

    def adopt(self) -> bool:
        """Publish the whole result of a process that died just before it could; whether there was one."""
        for folder in sorted(self.work.glob("result.*")):
            if folder.is_symlink() or not folder.is_dir():
                folder.unlink()
            elif manifest.flaw(folder, manifest.read(folder), self.id, thorough=True) is None:
                publish(folder, self.folder)
                return True
            shutil.rmtree(folder, ignore_errors=True)
        return False

    def outcome(self) -> models.Outcome | None:
        """How the last attempt without a result ended, as ``save_outcome`` wrote it; None if there was none.

        Raises Unreadable.
        """
        return read_outcome(self.work, self.store)

    def save_outcome(self, state: str, message: str, final: bool = False) -> None:
        """Record how an attempt ended without a result.

        ``state``: failed, timed out or interrupted; ``final``: another attempt with this code would end likewise.
        """
        ended = {"state": state, "message": message, "final": final}
        write_json(self.work / OUTCOME, {**ended, "made_by": manifest.code_digest(), **provenance()})

    def record_loss(self, state: str, message: str) -> None:
        """Record how an attempt ended that could not say so itself, as its process was killed."""
        self.require_own_folders()
        taken = lease.take(self.work)
        if taken:  # else somebody else goes on with the run
            with suppress(StoreError):  # a full disk: the run counts as interrupted
                self.save_outcome(state, message)
            taken.release()

    def forget_outcome(self) -> None:
        """Let the run be tried again."""
        self.require_own_folders()
        (self.work / OUTCOME).unlink(missing_ok=True)

    def checkpoint(self) -> "dict[str, np.ndarray] | None":
        """What ``save_checkpoint`` kept; None if there is none, or it is of no use: see ``load_checkpoint``."""
        try:
            return self.load_checkpoint()
        except Unreadable:
            return None

    def load_checkpoint(self) -> "dict[str, np.ndarray] | None":
        """What ``save_checkpoint`` kept; None if there is none.

        Raises Unreadable if it is broken, or is another run's, or other code or versions made it.
        """
        foreign.refuse_links(self.work / CHECKPOINT, self.store)
        try:
            return _arrays().read_checkpoint(self.work / CHECKPOINT, self.id, manifest.code_digest())
        except FileNotFoundError:
            return None

    def save_checkpoint(self, arrays: "Mapping[str, np.ndarray]") -> None:
        """Keep what it takes to go on with the run; it replaces the one before."""
        _arrays().write_checkpoint(self.work / CHECKPOINT, arrays, self.id, manifest.code_digest())

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
        """The row of numbers that was kept for this result under the key of the analysis.

        None if there is none, or it is not as it was written, or of another result.
        """
        kept = self._kept(key)
        return kept.row if kept else None

    def save_row(self, key: str, row: Mapping[str, Any]) -> None:
        """Keep the row of numbers beside the result, under the key of the analysis that made it.

        What its bonds saw is to be kept before.
        """
        foreign.refuse_links(self.folder, self.store)
        bonds = self.folder / ANALYSIS
        kept = sha256(bonds) if foreign.is_plain_file(bonds) else ""
        content = {"key": key, "run_id": self.id, "analysis": kept, "row": dict(row)}
        write_json(self.folder / SUMMARY, {**content, "checksum": _checksum(content)}, durable=False)

    def analysis(self, key: str) -> "xr.Dataset | None":
        """What ``save_analysis`` kept for this result under a key, read whole; None if there is none."""
        path, kept = self.folder / ANALYSIS, self._kept(key)
        if kept is None or not foreign.is_plain_file(path) or sha256(path) != kept.analysis:
            return None
        return _arrays().read_derived(path, key)

    def save_analysis(self, key: str, dataset: "xr.Dataset") -> None:
        """Keep what the bonds saw beside the result, under the key of the analysis."""
        foreign.refuse_links(self.folder, self.store)
        _arrays().write_derived(self.folder / ANALYSIS, dataset, key)

    def _kept(self, key: str) -> models.KeptRow | None:
        """What was derived from the result under a key; None if nothing was, or it is another's or not as written."""
        path = self.folder / SUMMARY
        kept = models.or_none(lambda: models.read_model(path, models.KeptRow, models.MOST_ROW, self.store))
        if kept is None or (kept.key, kept.run_id) != (key, self.id):
            return None
        is_whole = kept.checksum == _checksum(kept.model_dump(exclude={"checksum"}))
        return kept if is_whole and path.lstat().st_mtime_ns >= self._stamp()[1] else None

    def _stamp(self) -> tuple[int, int]:
        """What changes when the result is made anew; zeros where it is not there."""
        try:
            status = self.result.lstat()
        except OSError:
            return 0, 0
        return status.st_ino, status.st_mtime_ns


def _arrays() -> ModuleType:
    """What reads and writes arrays: a plan or a status of many runs needs none, and loads none of it."""
    from . import arrays

    return arrays


@functools.lru_cache(maxsize=4096)
def _verify(folder: Path, run_id: str, _stamp: tuple[int, int]) -> None:
    """Check once in a process that a folder holds the whole result of a run.  Raises Unreadable."""
    written = manifest.read(folder)
    reason = manifest.flaw(folder, written, run_id, thorough=True)
    if reason:
        raise Unreadable(RESULT, f"cannot be read: {reason}")


def _checksum(content: Mapping[str, Any]) -> str:
    """A checksum over what is kept of a result."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def has_failed_for_good(outcome: models.Outcome | None) -> bool:
    """Whether an outcome is one that this code and these versions would come to again."""
    return outcome is not None and outcome.final and outcome.made_by == manifest.code_digest()


def read_outcome(work: Path, store: Path) -> models.Outcome | None:
    """How the last attempt of a work folder ended; None if nothing says so.  Raises Unreadable."""
    return models.read_model(work / OUTCOME, models.Outcome, models.MOST_OUTCOME, store)


def read_progress(work: Path) -> models.Progress | None:
    """How far the run of a work folder is, as ``save_progress`` wrote it; None if it is not under way."""
    store = work.parent.parent
    read = functools.partial(models.read_model, work / PROGRESS, models.Progress, models.MOST_PROGRESS, store)
    return models.or_none(read)


def read_config(work: Path, store: Path) -> dict[str, Any]:
    """The configuration that is worked on in a work folder, as plain values; empty if there is none to be read."""
    foreign.refuse_links(work, store)
    try:
        return foreign.read_json(work / CONFIG, models.MOST_CONFIG)
    except (OSError, Unreadable):
        return {}
