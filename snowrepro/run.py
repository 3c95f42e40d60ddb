"""One run from its configuration to a stored result; doing it again finds it done."""

import functools
import json
import logging
import os
import shutil
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from omegaconf import DictConfig

from . import compiler
from .composition.compose import job_overrides, validate
from .errors import ConfigError, Diverged, FailedBefore, LeaseLost, SnowreproError, StoreError
from .foreign import Unreadable, is_plain_file
from .mpm import home, ledger
from .own_law import pass_law
from .progress import show_progress
from .settings.config import Config
from .settings.laws import InstalledLaw
from .store import lease, states
from .store.files import require_writable
from .store.folders import discard
from .store.lease import Lease
from .store.models import or_none
from .store.provenance import command, now, peak_memory_mb
from .store.run import CHECKPOINT, LOG, Run, has_failed_for_good
from .summary.row import read_row

if TYPE_CHECKING:
    from .mpm.service import Address
    from .simulation import Progress

log = logging.getLogger("snowrepro")
PROGRESS_SECONDS = 0.5
_service: ContextVar["Address | None"] = ContextVar("_service", default=None)
MOST_WRITING = 20.0  # a checkpoint waits this many times what the last one took to write


def simulate(
    config: Config,
    on_frame: Callable[["Progress"], None] | None = None,
    resume: Mapping[str, np.ndarray] | None = None,
    progress: bool = False,
    material: Any = None,
    sintering: Any = None,
) -> xr.Dataset:
    """Simulate one run, in memory alone; see ``simulate_case`` for what is returned and raised.

    ``progress``: whether to show a bar, on a terminal or in a notebook; ``material``, ``sintering``: a law in place of
    the configuration's, see ``own_law.pass_law``.  Raises NoSolver where no compiler is installed, ConfigError where it
    computes on another device than was asked for, where a law of somebody else's breaks a rule, or for what is no
    configuration.
    """
    if not isinstance(config, Config):
        raise ConfigError(f"simulate takes a configuration, not {type(config).__name__}: simulate(compose([...]))")
    solver, device = _solver(), _device()
    warn_of_settings_left_out()
    config = _with_laws(config, material=material, sintering=sintering)
    _require_lawful(config)
    with show_progress("frame", config.case.frames, is_hidden=not progress) as update:

        def note_frame(now: "Progress") -> None:
            """See that the frame was computed where it should be, and pass it on."""
            device.require_device(config.case.solver.device)
            update(now.frame, now.frames)
            if on_frame:
                on_frame(now)

        dataset = solver.simulate_case(config.case, note_frame, resume, config.execution.threads, _service.get())
    return dataset.assign_attrs(config=json.dumps(config.settings()))


def use_service(address: "Address") -> None:
    """Have the runs of this process computed by another one, side by side with those of others."""
    _service.set(address)


def _with_laws(config: Config, **laws: Any) -> Config:
    """A configuration with the laws that were passed, by kind; those that are None stay its own."""
    settings = config.settings()
    given = {kind: pass_law(kind, law).model_dump() for kind, law in laws.items() if law is not None}
    if not given:
        return config
    return Config.model_validate({**settings, **{kind: {**settings[kind], "law": law} for kind, law in given.items()}})


def _require_lawful(config: Config) -> None:
    """Check that laws that are somebody else's break no rule.  Raises ConfigError with the rule and the point."""
    if any(isinstance(law, InstalledLaw) for law in (config.case.material.law, config.case.sintering.law)):
        from .rules import require_lawful

        require_lawful(config.case)


def _solver() -> ModuleType:
    """The computing half of the program, loaded only here: all the rest reads stores without it.  Raises NoSolver."""
    from . import simulation

    return simulation


def _device() -> ModuleType:
    """What asks the compiler where it computes, loaded as late."""
    from .mpm import device

    return device


def warn_of_settings_left_out() -> None:
    """Take the compiler's settings out of the environment, and say once which of them are not used.

    That one of ours chose the compiler is said too.
    """
    home.leave_settings_out()
    if compiler.is_asked_for():
        _warn_once(f"{compiler.VARIABLE}: compiled by {compiler.name_compiler()}")
    if home.left_out:
        given = ", ".join(f"{name}={value}" for name, value in sorted(home.left_out.items()))
        _warn_once(f"not used: {given}; what a run is computed on, and how, its configuration says (solver.device)")


@functools.cache
def _warn_once(message: str) -> None:
    """Say this, if it was not said before."""
    log.warning("%s", message)


def do_run(run: Run, on_progress: Callable[["Progress"], None] | None = None) -> Path:
    """Make sure that a run's result is in the store, and return its file.

    Waits for another process that works on the same run.  A run that was stopped goes on from its last
    checkpoint, to the same bits as if it had not been.  Raises the errors of ``simulate``, but for NoSolver
    recorded in the store; FailedBefore where trying again would end likewise; StoreError.
    """
    if run.is_current():
        return run.result
    run.require_own_folders()
    _solver()  # nothing is recorded of a run where none could be made
    require_writable(run.work)
    if other := lease.holder(run.work):
        log.info("waits for %s, which works on this run", other)
    with lease.hold_lease(run.work) as lease_of_run:
        run.adopt()
        if not run.is_current():
            _attempt(run, on_progress, lease_of_run)
        with suppress(OSError):  # what is left is a scrap
            discard(run.work)
    read_row(run)
    return run.result


def _attempt(run: Run, on_progress: Callable[["Progress"], None] | None, lease_of_run: Lease) -> None:
    """Simulate and publish, or record why not."""
    before = or_none(run.outcome)
    if before and has_failed_for_good(before):
        raise FailedBefore(f"{before.message} (as found before; 'snowrepro retry' tries again)")
    with _log_to(run.work / LOG):
        run.save_config()
        resume = _load_checkpoint(run)
        start = f", goes on from frame {int(resume['frame'])}" if resume else ""
        log.info("run %s%s", run.id, start)
        watch = Watch(run, on_progress, lease_of_run, resume or {})
        folder = run.prepare_result()
        try:
            with watch.stop_between_frames():
                dataset = _simulate_on(run, watch, resume)
            for line in ledger.bounded(dataset):
                log.info("%s", line)
            particles, substeps = dataset.sizes["particle"], int(dataset["substeps"].sum())
            log.info("%s particles, %s substeps, %.1f s", f"{particles:,}", f"{substeps:,}", watch.seconds())
            facts = {"peak_memory_mb": peak_memory_mb(), "began": watch.began, "command": command(job_overrides())}
            facts["device"] = _device().read_device()
            run.save(dataset, facts, folder, wall_seconds=watch.seconds(), seconds_per_frame=watch.per_frame())
        except KeyboardInterrupt:
            _record(run, lease_of_run, states.INTERRUPTED, watch.describe_stop())
            raise
        except Diverged as error:
            error = _with_last_good_state(error, run)
            _record(run, lease_of_run, states.FAILED, str(error), final=True)
            raise error from None
        except LeaseLost:
            raise
        except Exception as error:
            lease_of_run.require_held()  # with it the folder of the result is lost
            _record(run, lease_of_run, states.FAILED, str(error) or type(error).__name__)
            raise
        finally:
            shutil.rmtree(folder, ignore_errors=True)
            if not lease_of_run.lost:
                run.forget_progress()


def _simulate_on(run: Run, watch: "Watch", resume: Mapping[str, np.ndarray] | None) -> xr.Dataset:
    """Simulate a run from its checkpoint on; from the start if there is none, or it is none of this scene."""
    try:
        return simulate(run.config, watch, resume)
    except SnowreproError:
        raise
    except Exception as error:
        if not resume or watch.frame:
            raise
        log.info("begins anew: %s is none of this scene (%s: %s)", CHECKPOINT, type(error).__name__, error)
        return simulate(run.config, watch, None)


def _load_checkpoint(run: Run) -> Mapping[str, np.ndarray] | None:
    """What it takes to go on with a run; None if there is nothing, or nothing of use, which the log then says."""
    try:
        resume = run.load_checkpoint()
    except Unreadable as error:
        log.info("begins anew: %s %s", CHECKPOINT, error.reason)
        return None
    return resume if resume and {"frame", "seconds"} <= {*resume} else None


def _record(run: Run, lease_of_run: Lease, state: str, message: str, final: bool = False) -> None:
    """Write into log and store how an attempt ended, unless another process has taken over."""
    log.log(logging.INFO if state == states.INTERRUPTED else logging.ERROR, "%s: %s", state, message)
    if lease_of_run.lost:
        return
    with suppress(StoreError):  # a full disk must not hide the first error
        run.save_outcome(state, message, final)


def _with_last_good_state(error: Diverged, run: Run) -> Diverged:
    """Keep the state before the frame that failed as the run's checkpoint, and say so if that was possible.

    A run repeats its bits, so the state is had by going there again from the last checkpoint.
    """
    if _service.get():  # which is busy with others
        return error
    frame = error.frame - 1

    def save_if_last(progress: "Progress") -> None:
        """Save the state before the frame that failed."""
        if progress.frame == frame:
            run.save_checkpoint({**progress.checkpoint(), "seconds": np.array(0.0)})

    checkpoint = run.checkpoint()
    if checkpoint is None or int(checkpoint["frame"]) < frame:
        with suppress(Diverged, StoreError):  # a full disk must not hide the first error
            simulate(run.config, save_if_last, checkpoint)
        checkpoint = run.checkpoint()
    if checkpoint is None:
        return error
    where = (run.work / CHECKPOINT).relative_to(run.store)  # a report takes the message over
    return Diverged(f"{error}; last good state: frame {int(checkpoint['frame'])}, in {where} of the store", error.frame)


def do_job(raw: DictConfig) -> str:
    """The task that Hydra's launchers call with each composed configuration."""
    return str(do_run(Run(validate(raw))))


class Watch:
    """Called after each frame: takes the time, says how far the run is, and keeps checkpoints.

    Where the disk is full it says so once and goes on: there may be room again when the result is there.
    Raises LeaseLost.
    """

    def __init__(
        self,
        run: Run,
        on_progress: Callable[["Progress"], None] | None,
        lease_of_run: Lease,
        resume: Mapping[str, np.ndarray],
    ) -> None:
        self.run, self.on_progress, self.lease = run, on_progress, lease_of_run
        self.spent = float(resume["seconds"]) if resume else 0.0  # in earlier attempts
        self.began = str(resume.get("began", now()))  # the first attempt; an older checkpoint does not say
        self.frame = 0
        self.warned = False
        self.started = time.perf_counter()
        self.frames: list[float] = []  # when each was there
        self.last_report = self.last_checkpoint = time.perf_counter()
        self.writing_seconds = 0.0  # how long the last checkpoint took to write
        self.kept: int | None = None  # the frame of the last checkpoint
        self.is_stopping = False

    def __call__(self, progress: "Progress") -> None:
        """Take note of a frame; report and keep a checkpoint if it is time to.  Raises LeaseLost."""
        moment = time.perf_counter()
        self.frames.append(moment)
        self.frame = progress.frame
        if self.on_progress:
            self.on_progress(progress)
        if moment - self.last_report > PROGRESS_SECONDS:
            self.last_report = moment
            self.lease.require_held()
            with self._warn_once():
                self.run.save_progress(progress.frame, progress.frames, progress.substeps)
        pause = max(self.run.config.execution.checkpoint_seconds, MOST_WRITING * self.writing_seconds)
        if self.is_stopping or moment - self.last_checkpoint > pause:
            self._keep_checkpoint(progress)
        if self.is_stopping:
            raise KeyboardInterrupt

    def _keep_checkpoint(self, progress: "Progress") -> None:
        """Keep what it takes to go on from this frame.  Raises LeaseLost."""
        moment = time.perf_counter()
        arrays = progress.checkpoint()
        self.lease.require_held()
        with self._warn_once():
            origin = {"seconds": np.array(self.seconds()), "began": np.array(self.began)}
            self.run.save_checkpoint({**arrays, **origin})
            self.kept = progress.frame
        self.last_checkpoint = time.perf_counter()
        self.writing_seconds = self.last_checkpoint - moment

    @contextmanager
    def stop_between_frames(self) -> Iterator[None]:
        """Within it, Ctrl-C and SIGTERM wait for the end of the frame, which is kept; a second one does not wait.

        Nor does one before the first frame, which compiles for seconds.  Raises KeyboardInterrupt.
        """

        def stop(*_: object) -> None:
            """Take note of a signal."""
            if self.is_stopping or not self.frames:
                raise KeyboardInterrupt
            self.is_stopping = True

        signals = (signal.SIGINT, signal.SIGTERM) if threading.current_thread() is threading.main_thread() else ()
        taken = [
            each for each in signals if signal.getsignal(each) is signal.default_int_handler
        ]  # others are not ours
        for each in taken:
            signal.signal(each, stop)
        try:
            yield
        finally:
            for each in taken:
                signal.signal(each, signal.default_int_handler)
        if self.is_stopping:  # since the last frame
            raise KeyboardInterrupt

    def describe_stop(self) -> str:
        """Where a run was stopped: after a frame that is kept, or in one that is lost."""
        is_kept = self.kept is not None and self.kept == self.frame
        return f"stopped after frame {self.frame}" if is_kept else f"stopped in frame {self.frame + 1}"

    @contextmanager
    def _warn_once(self) -> Iterator[None]:
        """What cannot be written is no reason to stop."""
        try:
            yield
        except StoreError as error:
            if not self.warned:
                log.warning("%s; goes on without", error)
            self.warned = True

    def seconds(self) -> float:
        """Wall time of the run so far, in all processes that had a part in it.

        Where it is computed beside others it is charged with its share, from its first frame on.
        """
        sharers = _device().count_sharers()
        began = self.frames[0] if sharers > 1 and self.frames else self.started
        return self.spent + (time.perf_counter() - began) / sharers

    def per_frame(self) -> float:
        """Wall time of a frame in this process, or its share; the first one compiles and does not count."""
        if len(self.frames) <= 2:
            return float("nan")
        return (self.frames[-1] - self.frames[1]) / (len(self.frames) - 2) / _device().count_sharers()


@contextmanager
def _log_to(path: Path) -> Iterator[None]:
    """Send the package's log to a file for as long as a run lasts.  Raises StoreError where it is no regular file."""
    if os.path.lexists(path) and not is_plain_file(path):
        raise StoreError(f"{path} is no regular file: remove it")
    handler = logging.FileHandler(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        handler.close()
