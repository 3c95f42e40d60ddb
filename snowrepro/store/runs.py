"""One folder a run: ``run.nc`` once it is done, ``failed.json`` if it failed.

Beside a result are kept its row of numbers, ``summary.json``, and what its bonds saw, ``analysis.nc``.
Meanwhile ``progress.json`` says how far it is, and ``checkpoint.npz`` holds what it takes to go on.
"""

import json
import os
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import xarray as xr

from ..config import Config
from ..errors import StoreError
from ..simulation import MODEL_VERSION
from .identity import run_id
from .provenance import provenance, versions

RESULT = "run.nc"
CHECKPOINT = "checkpoint.npz"
ANALYSIS = "analysis.nc"


def identify(config: Config) -> str:
    """The run's id under this version of the model."""
    return run_id(config, MODEL_VERSION)


def run_dir(config: Config) -> Path:
    """The run's folder."""
    return Path(config.store) / identify(config)


def result_path(config: Config) -> Path:
    """Where the run's result is, or will be."""
    return run_dir(config) / RESULT


def is_done(config: Config) -> bool:
    """Whether a whole result is there: it opens and is the one that its folder promises."""
    path = result_path(config)
    if not path.exists():
        return False
    try:
        with xr.open_dataset(path) as dataset:
            return dataset.attrs.get("run_id") == identify(config)
    except (OSError, ValueError):
        return False


def open_run(id_or_path: str | Path, store: str | Path = "runs") -> xr.Dataset:
    """Open a run by its id in ``store`` or by the path of its file or folder.  Raises StoreError if there is none."""
    for candidate in (Path(id_or_path), Path(store) / id_or_path):
        path = candidate / RESULT if candidate.is_dir() else candidate
        if path.is_file():
            try:
                return xr.open_dataset(path)
            except (OSError, ValueError) as error:
                raise StoreError(f"{path} cannot be read as a run: {error}") from error
    raise StoreError(f"there is no run '{id_or_path}': neither a file nor an id in the folder '{store}'")


def save(dataset: xr.Dataset, config: Config, **seconds: float) -> Path:
    """Write a run's result, whole or not at all, and forget an earlier failure.

    ``seconds``: what it took, by name, kept as attributes.
    """
    path = result_path(config)
    rounded = {name: float(f"{value:.4g}") for name, value in seconds.items()}
    dataset = dataset.assign_attrs(run_id=identify(config), seed=config.seed, **rounded, **provenance())
    packed = {"zlib": True, "complevel": 1, "shuffle": True}
    encoding = {name: packed for name in dataset.data_vars if "snapshot" in dataset[name].dims}
    with published(path) as partial:
        dataset.to_netcdf(partial, engine="netcdf4", encoding=encoding)
    (path.parent / "failed.json").unlink(missing_ok=True)
    return path


def save_failure(config: Config, message: str) -> None:
    """Record why a run has no result."""
    with published(run_dir(config) / "failed.json") as partial:
        partial.write_text(json.dumps({"message": message, **provenance()}, indent=1))


def failure(config: Config) -> str | None:
    """Why the last attempt at a run failed; None if it did not."""
    return _read_json(run_dir(config) / "failed.json").get("message")


def save_summary(config: Config, key: str, row: dict) -> None:
    """Keep a run's summary row beside its result, under the key of the analysis that made it."""
    with published(run_dir(config) / "summary.json", durable=False) as partial:
        partial.write_text(json.dumps({"key": key, "row": row}))


def summary(config: Config, key: str) -> dict | None:
    """The summary row that was kept under ``key`` for this result; None if there is none."""
    kept = run_dir(config) / "summary.json"
    if not _is_newer(kept, result_path(config)):
        return None
    read = _read_json(kept)
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
    with published(run_dir(config) / "progress.json", durable=False) as partial:
        partial.write_text(json.dumps({"frame": frame, "frames": frames, "substeps": substeps}))


def progress(folder: Path) -> dict[str, int]:
    """What ``save_progress`` last said; empty if nothing."""
    return _read_json(folder / "progress.json")


def save_checkpoint(config: Config, arrays: Mapping[str, np.ndarray]) -> None:
    """Keep what it takes to go on with a run; it replaces the one before."""
    with published(run_dir(config) / CHECKPOINT, durable=False) as partial, open(partial, "wb") as file:
        np.savez(file, versions=np.array(versions()), **arrays)


def checkpoint(config: Config) -> dict[str, np.ndarray] | None:
    """What ``save_checkpoint`` kept; None if there is none, it is broken, or it was made with other versions."""
    try:
        with np.load(run_dir(config) / CHECKPOINT, allow_pickle=False) as saved:
            arrays = {name: saved[name] for name in saved.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
        return None
    return arrays if str(arrays.pop("versions", "")) == versions() else None


def forget_checkpoint(config: Config) -> None:
    """The run has its result, or has none to come."""
    (run_dir(config) / CHECKPOINT).unlink(missing_ok=True)


def forget_progress(config: Config) -> None:
    """The run is no longer under way."""
    (run_dir(config) / "progress.json").unlink(missing_ok=True)


def require_writable(folder: str | Path) -> None:
    """Make a folder and check that files can be made in it.  Raises StoreError if not."""
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise StoreError(f"cannot write into the folder '{folder}': {error.strerror or error}") from error


def _is_newer(path: Path, result: Path) -> bool:
    """Whether what was derived from a result is there and not older than it."""
    return path.exists() and path.stat().st_mtime_ns >= result.stat().st_mtime_ns


def _read_json(path: Path) -> dict:
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return {}


@contextmanager
def published(path: Path, durable: bool = True) -> Iterator[Path]:
    """A scratch file that becomes ``path`` in one rename if the block ends well, and vanishes if not."""
    partial = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield partial
        if durable:
            with open(partial, "rb") as file:
                os.fsync(file.fileno())
        os.replace(partial, path)
    except (OSError, RuntimeError) as error:  # netCDF4 raises RuntimeError on a full disk
        free = shutil.disk_usage(path.parent).free if path.parent.exists() else 0
        reason = f"{getattr(error, 'strerror', None) or error} ({free / 1e6:.0f} MB free on its disk)"
        raise StoreError(f"cannot write {path}: {reason}") from error
    finally:
        partial.unlink(missing_ok=True)
