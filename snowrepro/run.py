"""One run from config to stored result; doing it again finds it done."""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from omegaconf import DictConfig

from .config import Config, validate
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
        started = time.perf_counter()
        log.info("run %s", runs.identify(config))
        try:
            dataset = simulate(config, _announce(config, on_progress))
            seconds = time.perf_counter() - started
            path = runs.save(dataset, config, seconds)
        except SnowreproError as error:
            log.error("%s", error)
            with suppress(StoreError):  # a full disk must not hide the first error
                runs.save_failure(config, str(error))
            raise
        finally:
            runs.forget_progress(config)
        for line in diagnostics.bounded(dataset):
            log.info("%s", line)
        log.info("%d particles, %d substeps, %.1f s", dataset.sizes["particle"], dataset.substeps.sum(), seconds)
    return path


def run_raw(raw: DictConfig) -> str:
    """The task that Hydra's launchers call with each composed config."""
    return str(run(validate(raw)))


def _announce(config: Config, on_progress: Callable[[Progress], None] | None) -> Callable[[Progress], None]:
    """A frame callback that says how far the run is, at most every PROGRESS_SECONDS."""
    last = 0.0

    def on_frame(progress: Progress) -> None:
        nonlocal last
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
