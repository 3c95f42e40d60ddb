"""One run from config to stored result; doing it again finds it done."""

import logging
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from omegaconf import DictConfig

from .analysis.summary import row_of
from .composition import job_overrides, validate
from .config import Config
from .errors import Diverged, FailedBefore, LeaseLost, StoreError
from .mpm import diagnostics
from .simulation import Progress, simulate
from .store import lease, runs, states
from .store.files import require_writable
from .store.lease import Lease
from .store.provenance import command, now, peak_memory_mb

log = logging.getLogger("snowrepro")
PROGRESS_SECONDS = 0.5
MOST_KEEPING = 20.0  # a checkpoint waits this many times what the last one took to write


def run(config: Config, on_progress: Callable[[Progress], None] | None = None) -> Path:
    """Make sure that the run's result is in the store, and return its path.

    Waits for another process that works on the same run.  A run that was stopped goes on from its last
    checkpoint, to the same bits as if it had not been.  Raises the errors of ``simulate``, recorded in the
    store; FailedBefore where trying again would end likewise; StoreError.
    """
    path = runs.result_path(config)
    if runs.is_current(config):
        return path
    work = runs.work_dir(config)
    require_writable(work)
    if other := lease.holder(work):
        log.info("waits for %s, which works on this run", other)
    with lease.held(work) as held:
        runs.adopt(config)
        if not runs.is_current(config):
            _attempt(config, on_progress, held)
        with suppress(OSError):  # what is left is a scrap
            runs.discard(work)
    row_of(config)
    return path


def _attempt(config: Config, on_progress: Callable[[Progress], None] | None, held: Lease) -> None:
    """Simulate and publish, or record why not."""
    before = runs.outcome(config)
    if runs.has_failed_for_good(before):
        raise FailedBefore(f"{before['message']} (as found before; 'snowrepro retry' tries again)")
    with _log_to(runs.work_dir(config) / runs.LOG):
        runs.save_config(config)
        resume = runs.checkpoint(config)
        start = f", goes on from frame {int(resume['frame'])}" if resume else ""
        log.info("run %s%s", runs.identify(config), start)
        watch = Watch(config, on_progress, held, resume or {})
        try:
            dataset = simulate(config, watch, resume)
            for line in diagnostics.bounded(dataset):
                log.info("%s", line)
            particles, substeps = dataset.sizes["particle"], int(dataset["substeps"].sum())
            log.info("%s particles, %s substeps, %.1f s", f"{particles:,}", f"{substeps:,}", watch.seconds())
            facts = {"peak_memory_mb": peak_memory_mb(), "began": watch.began, "command": command(job_overrides())}
            runs.save(dataset, config, facts, wall_seconds=watch.seconds(), seconds_per_frame=watch.per_frame())
        except KeyboardInterrupt:
            _record(config, states.INTERRUPTED, f"stopped in frame {watch.frame + 1}")
            raise
        except Diverged as error:
            error = _with_last_good_state(error, config)
            _record(config, states.FAILED, str(error), final=True)
            raise error from None
        except LeaseLost:
            raise
        except Exception as error:
            _record(config, states.FAILED, str(error) or type(error).__name__)
            raise
        finally:
            runs.forget_progress(config)


def _record(config: Config, state: str, message: str, final: bool = False) -> None:
    """Say in log and store how an attempt ended."""
    log.log(logging.INFO if state == states.INTERRUPTED else logging.ERROR, "%s: %s", state, message)
    with suppress(StoreError):  # a full disk must not hide the first error
        runs.save_outcome(config, state, message, final)


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
    where = (runs.work_dir(config) / runs.CHECKPOINT).relative_to(config.store)  # a report takes the message over
    return Diverged(f"{error}; last good state: frame {int(kept['frame'])}, in {where} of the store", error.frame)


def run_raw(raw: DictConfig) -> str:
    """The task that Hydra's launchers call with each composed config."""
    return str(run(validate(raw)))


class Watch:
    """Called after each frame: takes the time, says how far the run is, and keeps checkpoints.

    Where the disk is full it says so once and goes on: there may be room again when the result is there.
    Raises LeaseLost.
    """

    def __init__(
        self,
        config: Config,
        on_progress: Callable[[Progress], None] | None,
        held: Lease,
        resume: Mapping[str, np.ndarray],
    ):
        self.config, self.on_progress, self.held = config, on_progress, held
        spent = float(resume["seconds"]) if resume else 0.0
        self.began = str(resume.get("began", now()))  # the first attempt; an older checkpoint does not say
        self.frame = 0
        self.warned = False
        self.started = time.perf_counter() - spent
        self.frames: list[float] = []  # when each was there
        self.told = self.kept = time.perf_counter()
        self.keeping = 0.0  # how long the last checkpoint took to write

    def __call__(self, progress: Progress) -> None:
        moment = time.perf_counter()
        self.frames.append(moment)
        self.frame = progress.frame
        if self.on_progress:
            self.on_progress(progress)
        if moment - self.told > PROGRESS_SECONDS:
            self.told = moment
            if self.held.lost:
                raise LeaseLost(f"another process took over {runs.identify(self.config)}")
            with self._warning():
                runs.save_progress(self.config, progress.frame, progress.frames, progress.substeps)
        if moment - self.kept > max(self.config.checkpoint_seconds, MOST_KEEPING * self.keeping):
            arrays = progress.checkpoint()
            with self._warning():
                kept = {"seconds": np.array(self.seconds()), "began": np.array(self.began)}
                runs.save_checkpoint(self.config, {**arrays, **kept})
            self.kept = time.perf_counter()
            self.keeping = self.kept - moment

    @contextmanager
    def _warning(self) -> Iterator[None]:
        """What cannot be written is no reason to stop."""
        try:
            yield
        except StoreError as error:
            if not self.warned:
                log.warning("%s; goes on without", error)
            self.warned = True

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
