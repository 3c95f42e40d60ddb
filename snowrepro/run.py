"""One run from config to stored result; doing it again finds it done."""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import xarray as xr
from omegaconf import DictConfig

from .analysis.summary import row_of
from .composition import validate
from .config import Config
from .errors import SnowreproError, StoreError
from .mpm import diagnostics
from .simulation import Progress, simulate
from .store import runs

log = logging.getLogger("snowrepro")
PROGRESS_SECONDS = 0.5


def run(config: Config, on_progress: Callable[[Progress], None] | None = None) -> Path:
    """Make sure that the run's result is in the store, and return its path.

    Raises the errors of ``simulate``, recorded in the run's folder, and StoreError.
    """
    path = runs.result_path(config)
    if runs.is_done(config):
        return path
    runs.require_writable(runs.run_dir(config))
    with _log_to(runs.run_dir(config) / "run.log"):
        clock: list[float] = []  # when each frame was there
        started = time.perf_counter()
        log.info("run %s", runs.identify(config))
        try:
            dataset = simulate(config, _announce(config, clock, on_progress))
            seconds = time.perf_counter() - started
            per_frame = (clock[-1] - clock[1]) / max(len(clock) - 2, 1)  # frame 1 compiles
            path = runs.save(dataset, config, wall_seconds=seconds, seconds_per_frame=per_frame)
        except SnowreproError as error:
            log.error("%s", error)
            with suppress(StoreError):  # a full disk must not hide the first error
                runs.save_failure(config, str(error))
            raise
        finally:
            runs.forget_progress(config)
        for line in diagnostics.bounded(dataset):
            log.info("%s", line)
        log.info("%s particles, %s substeps, %.1f s", *_counts(dataset), seconds)
    row_of(config)
    return path


def _counts(dataset: xr.Dataset) -> tuple[str, str]:
    return f"{dataset.sizes['particle']:,}", f"{int(dataset['substeps'].sum()):,}"


def run_raw(raw: DictConfig) -> str:
    """The task that Hydra's launchers call with each composed config."""
    return str(run(validate(raw)))


def _announce(
    config: Config, clock: list[float], on_progress: Callable[[Progress], None] | None
) -> Callable[[Progress], None]:
    """A frame callback that notes the time and says how far the run is, at most every PROGRESS_SECONDS."""
    last = 0.0

    def on_frame(progress: Progress) -> None:
        nonlocal last
        clock.append(time.perf_counter())
        if on_progress:
            on_progress(progress)
        if time.monotonic() - last > PROGRESS_SECONDS:
            last = time.monotonic()
            runs.save_progress(config, progress.frame, progress.frames, progress.substeps)

    return on_frame


@contextmanager
def _log_to(path: Path) -> Iterator[None]:
    """Send the package's log to a file for as long as a run lasts."""
    handler = logging.FileHandler(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        handler.close()
