"""One run from config to stored result; doing it again finds it done."""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from omegaconf import DictConfig

from .analysis.summary import row_of
from .composition import validate
from .config import Config
from .errors import Diverged, SnowreproError, StoreError
from .mpm import diagnostics
from .simulation import Progress, simulate
from .store import runs

log = logging.getLogger("snowrepro")
PROGRESS_SECONDS = 0.5
MOST_KEEPING = 20.0  # a checkpoint waits this many times what the last one took to write


def run(config: Config, on_progress: Callable[[Progress], None] | None = None) -> Path:
    """Make sure that the run's result is in the store, and return its path.

    A run that was stopped goes on from its last checkpoint, to the same bits as if it had not been.
    Raises the errors of ``simulate``, recorded in the run's folder, and StoreError.
    """
    path = runs.result_path(config)
    if runs.is_done(config):
        return path
    runs.require_writable(runs.run_dir(config))
    with _log_to(runs.run_dir(config) / "run.log"):
        resume = runs.checkpoint(config)
        start = f", goes on from frame {int(resume['frame'])}" if resume else ""
        log.info("run %s%s", runs.identify(config), start)
        watch = Watch(config, on_progress, float(resume["seconds"]) if resume else 0.0)
        try:
            dataset = simulate(config, watch, resume)
            path = runs.save(dataset, config, wall_seconds=watch.seconds(), seconds_per_frame=watch.per_frame())
        except SnowreproError as error:
            if isinstance(error, Diverged):
                error = _with_last_good_state(error, config)
            log.error("%s", error)
            with suppress(StoreError):  # a full disk must not hide the first error
                runs.save_failure(config, str(error))
            raise error from None
        finally:
            runs.forget_progress(config)
        runs.forget_checkpoint(config)
        for line in diagnostics.bounded(dataset):
            log.info("%s", line)
        particles, substeps = dataset.sizes["particle"], int(dataset["substeps"].sum())
        log.info("%s particles, %s substeps, %.1f s", f"{particles:,}", f"{substeps:,}", watch.seconds())
    row_of(config)
    return path


def _with_last_good_state(error: Diverged, config: Config) -> Diverged:
    """Keep the state before the frame that failed as the run's checkpoint, and say so if that was possible.

    A run repeats its bits, so the state is had by going there again from the last checkpoint.
    """
    frame = error.frame - 1

    def keep(progress: Progress) -> None:
        if progress.frame == frame:
            runs.save_checkpoint(config, {**progress.checkpoint(), "seconds": np.array(0.0)})

    kept = runs.checkpoint(config)
    if kept is None or int(kept["frame"]) < frame:
        with suppress(Diverged, StoreError):  # a full disk must not hide the first error
            simulate(config, keep, kept)
        kept = runs.checkpoint(config)
    if kept is None:
        return error
    where = runs.run_dir(config) / runs.CHECKPOINT
    return Diverged(f"{error}; last good state: frame {int(kept['frame'])}, in {where}", error.frame)


def run_raw(raw: DictConfig) -> str:
    """The task that Hydra's launchers call with each composed config."""
    return str(run(validate(raw)))


class Watch:
    """Called after each frame: takes the time, says how far the run is, and keeps checkpoints."""

    def __init__(self, config: Config, on_progress: Callable[[Progress], None] | None, spent: float):
        self.config, self.on_progress = config, on_progress
        self.started = time.perf_counter() - spent
        self.frames: list[float] = []  # when each was there
        self.told = self.kept = time.perf_counter()
        self.keeping = 0.0  # how long the last checkpoint took to write

    def __call__(self, progress: Progress) -> None:
        now = time.perf_counter()
        self.frames.append(now)
        if self.on_progress:
            self.on_progress(progress)
        if now - self.told > PROGRESS_SECONDS:
            self.told = now
            runs.save_progress(self.config, progress.frame, progress.frames, progress.substeps)
        if now - self.kept > max(self.config.checkpoint_seconds, MOST_KEEPING * self.keeping):
            arrays = progress.checkpoint()
            runs.save_checkpoint(self.config, {**arrays, "seconds": np.array(self.seconds())})
            self.kept = time.perf_counter()
            self.keeping = self.kept - now

    def seconds(self) -> float:
        """Wall time of the run so far, in all processes that had a part in it."""
        return time.perf_counter() - self.started

    def per_frame(self) -> float:
        """Wall time of a frame in this process; the first one compiles and does not count."""
        return (self.frames[-1] - self.frames[1]) / (len(self.frames) - 2) if len(self.frames) > 2 else float("nan")


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
