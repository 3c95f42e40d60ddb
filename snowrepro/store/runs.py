"""Runs on disk.  A finished one is a folder ``<id>`` of the store, published whole by one rename:

``run.nc``, ``run.log`` and ``manifest.json`` (see ``manifest``).  Beside them is kept what was derived: its row of
numbers, ``summary.json``, and what its bonds saw, ``analysis.nc``.

An unfinished one is a folder ``.work/<id>``: who works on it (see ``lease``), ``progress.json``, ``run.log``,
``checkpoint.npz`` with what it takes to go on, and ``outcome.json`` with how the last attempt ended.
"""

import os
import shutil
import uuid
import zipfile
import zlib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..config import MODEL_VERSION, Config
from ..errors import StoreError
from . import cf, lease, manifest
from .bits import digests
from .cost import kind_of
from .files import flush, published, read_json, write_json, writing
from .identity import identify
from .provenance import provenance

RESULT = "run.nc"
LOG = "run.log"
CHECKPOINT = "checkpoint.npz"
SUMMARY = "summary.json"
ANALYSIS = "analysis.nc"
NOT_IN_MANIFEST = {"claims", "experiment", "reports", "rerun", "store"}  # of whoever asked, not of the result
CONFIG = "config.json"
OUTCOME = "outcome.json"
PROGRESS = "progress.json"
WORK = ".work"
TRASH = ".trash"


def plain(config: Config) -> dict[str, Any]:
    """A run's configuration as the store writes it down."""
    return config.model_dump(mode="json", exclude=NOT_IN_MANIFEST)


def run_dir(config: Config) -> Path:
    """The folder of the run's result."""
    return Path(config.store) / identify(config)


def work_dir(config: Config) -> Path:
    """The folder in which the run is worked on."""
    return Path(config.store) / WORK / identify(config)


def result_path(config: Config) -> Path:
    """Where the run's result is, or will be."""
    return run_dir(config) / RESULT


def is_done(config: Config) -> bool:
    """Whether a whole result is there: it is what its manifest says."""
    folder = run_dir(config)
    return folder.is_dir() and manifest.flaw(folder, manifest.read(folder), identify(config)) is None


def is_current(config: Config) -> bool:
    """Whether a whole result is there and not stale by what ``config.rerun`` selects."""
    if not is_done(config):
        return False
    found = manifest.stale(manifest.read(run_dir(config)), config) if config.rerun else {}
    return not any(kind in found for kind in config.rerun)


def open_run(id_or_path: str | Path, store: str | Path = "runs") -> xr.Dataset:
    """Open a run by its id in ``store`` or by the path of its file or folder, as ``simulate`` gave it.

    Another code's file is opened as it is.  Raises StoreError if there is no such file or it cannot be read.
    """
    for candidate in (Path(id_or_path), Path(store) / id_or_path):
        path = candidate / RESULT if candidate.is_dir() else candidate
        if path.is_file():
            try:
                return cf.run_as_read(xr.open_dataset(path))
            except (OSError, ValueError) as error:
                raise StoreError(f"{path} cannot be read as a run: {error}") from error
    raise StoreError(f"there is no run '{id_or_path}': neither a file nor an id in the folder '{store}'")


def save(dataset: xr.Dataset, config: Config, facts: Mapping[str, Any] | None = None, **seconds: float) -> Path:
    """Publish a run's result, whole or not at all, and forget its work.

    ``seconds``: what it took, by name, kept as attributes; ``facts``: what else the manifest says.
    """
    work = work_dir(config)
    folder = work / f"result.{uuid.uuid4().hex[:8]}"
    rounded = {name: float(f"{value:.4g}") for name, value in seconds.items()}
    origin = provenance()
    dataset = dataset.assign_attrs(run_id=identify(config), seed=config.seed, **rounded, **origin)
    packed = {"zlib": True, "complevel": 1, "shuffle": True}
    written = cf.run_as_file(dataset, f"{origin['created']} simulated by snowrepro")
    encoding = {name: packed for name in written.variables if {"snapshot", "particle"} <= {*written[name].dims}}
    try:
        with writing(run_dir(config) / RESULT):
            folder.mkdir(parents=True)
            written.to_netcdf(folder / RESULT, engine="netcdf4", encoding=encoding)
            flush(folder / RESULT)
            if (work / LOG).exists():
                shutil.copyfile(work / LOG, folder / LOG)
            content = {"run_id": identify(config), "model_version": MODEL_VERSION, **origin, **rounded, **(facts or {})}
            content["kind"] = asdict(kind_of(config))
            content["config"] = plain(config)
            content["arrays"] = digests(dataset)
            manifest.write(folder, [name for name in (RESULT, LOG) if (folder / name).exists()], content)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    publish(folder, run_dir(config))
    with suppress(OSError):  # not empty where a lease is held
        work.rmdir()
    return result_path(config)


def publish(folder: Path, place: Path) -> None:
    """Move a whole folder to its place by one rename; what was there before goes to the trash first."""
    with writing(place):
        flush(folder)
        if place.exists():
            discard(place)
        os.rename(folder, place)
        flush(place.parent)


def adopt(config: Config) -> bool:
    """Publish the whole result of a process that died just before it could; whether there was one."""
    for folder in work_dir(config).glob("result.*"):
        if manifest.flaw(folder, manifest.read(folder), identify(config), thorough=True) is None:
            publish(folder, run_dir(config))
            return True
        shutil.rmtree(folder, ignore_errors=True)
    return False


def discard(folder: Path) -> None:
    """Take a folder out of the store, by one rename; its files are then removed."""
    store = folder.parent.parent if folder.parent.name == WORK else folder.parent
    trash = store / TRASH / f"{folder.name}.{uuid.uuid4().hex[:8]}"
    trash.parent.mkdir(exist_ok=True)
    os.rename(folder, trash)
    shutil.rmtree(trash, ignore_errors=True)


def save_outcome(config: Config, state: str, message: str, final: bool = False) -> None:
    """Record how an attempt at a run ended without a result.

    ``state``: failed, timed out or interrupted; ``final``: another attempt with this code would end likewise.
    """
    said = {"state": state, "message": message, "final": final}
    write_json(work_dir(config) / OUTCOME, {**said, "made_by": manifest.code_digest(), **provenance()})


def record_loss(config: Config, state: str, message: str) -> None:
    """Record how an attempt ended that could not say so itself, as its process was killed."""
    held = lease.take(work_dir(config))
    if held:  # else somebody else goes on with the run
        with suppress(StoreError):  # a full disk: the run counts as interrupted
            save_outcome(config, state, message)
        held.release()


def outcome(config: Config) -> dict[str, Any]:
    """What ``save_outcome`` recorded last; empty if nothing."""
    return read_json(work_dir(config) / OUTCOME)


def forget_outcome(config: Config) -> None:
    """Let the run be tried again."""
    (work_dir(config) / OUTCOME).unlink(missing_ok=True)


def has_failed_for_good(said: Mapping[str, Any]) -> bool:
    """Whether an outcome is one that this code and these versions would come to again."""
    return bool(said.get("final")) and said.get("made_by") == manifest.code_digest()


def save_summary(config: Config, key: str, row: dict) -> None:
    """Keep a run's summary row beside its result, under the key of the analysis that made it."""
    write_json(run_dir(config) / SUMMARY, {"key": key, "row": row}, durable=False)


def summary(config: Config, key: str) -> dict | None:
    """The summary row that was kept under ``key`` for this result; None if there is none."""
    kept = run_dir(config) / SUMMARY
    if not _is_newer(kept, result_path(config)):
        return None
    read = read_json(kept)
    return read.get("row") if read.get("key") == key else None


def save_analysis(config: Config, key: str, dataset: xr.Dataset) -> None:
    """Keep what was found in a run beside its result, under the key of the analysis that found it."""
    packed = {"zlib": True, "complevel": 1, "shuffle": True}
    encoding = {name: packed for name in dataset.data_vars if dataset[name].size > 1}
    with published(run_dir(config) / ANALYSIS, durable=False) as partial:
        dataset.assign_attrs(key=key).to_netcdf(partial, engine="netcdf4", encoding=encoding)


def analysis(config: Config, key: str) -> xr.Dataset | None:
    """What was kept under ``key`` for this result, read whole; None if there is none."""
    path = run_dir(config) / ANALYSIS
    if not _is_newer(path, result_path(config)):
        return None
    try:
        with xr.open_dataset(path) as dataset:
            return dataset.load() if dataset.attrs.get("key") == key else None
    except (OSError, ValueError, RuntimeError):
        return None


def save_progress(config: Config, frame: int, frames: int, substeps: int) -> None:
    """Say how far a run is, for whoever watches."""
    said = {"frame": frame, "frames": frames, "substeps": substeps}
    write_json(work_dir(config) / PROGRESS, said, durable=False)


def progress(work: Path) -> dict[str, int]:
    """What ``save_progress`` last said in a work folder; empty if nothing."""
    return read_json(work / PROGRESS)


def save_checkpoint(config: Config, arrays: Mapping[str, np.ndarray]) -> None:
    """Keep what it takes to go on with a run; it replaces the one before."""
    with published(work_dir(config) / CHECKPOINT, durable=False) as partial, open(partial, "wb") as file:
        np.savez(file, made_by=np.array(manifest.code_digest()), **arrays)


def checkpoint(config: Config) -> dict[str, np.ndarray] | None:
    """What ``save_checkpoint`` kept; None if there is none, it is broken, or other code or versions made it."""
    try:
        with np.load(work_dir(config) / CHECKPOINT, allow_pickle=False) as saved:
            arrays = {name: saved[name] for name in saved.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
        return None
    return arrays if str(arrays.pop("made_by", "")) == manifest.code_digest() else None


def save_config(config: Config) -> None:
    """Say what is worked on in a work folder."""
    write_json(work_dir(config) / CONFIG, plain(config), durable=False)


def forget_progress(config: Config) -> None:
    """The run is no longer under way."""
    (work_dir(config) / PROGRESS).unlink(missing_ok=True)


def _is_newer(path: Path, result: Path) -> bool:
    """Whether what was derived from a result is there and not older than it."""
    return path.exists() and path.stat().st_mtime_ns >= result.stat().st_mtime_ns
