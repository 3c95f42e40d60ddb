"""``hydra/launcher=local``: every job in a fresh process, one thread each, with a live table.

Hydra scans this module in every application of the environment, so heavy imports wait until use.
"""

import contextlib
import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hydra.core.config_store import ConfigStore
from hydra.core.singleton import Singleton
from hydra.core.utils import JobReturn, JobStatus, configure_log, filter_overrides, run_job, setup_globals
from hydra.plugins.launcher import Launcher
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, open_dict


@dataclass
class LocalLauncherConf:
    """Settings of the launcher.

    ``workers``: processes at a time, 0 for as many as cores and memory allow; ``memory_gb``: of a run, null for what
    earlier ones used; ``time_limit_minutes``: of a run, 0 for none; ``retries``: of a run whose process crashed.
    """

    _target_: str = "hydra_plugins.snowrepro_launcher.local.LocalLauncher"
    workers: int = 0
    memory_gb: float | None = None
    time_limit_minutes: float = 0.0
    retries: int = 1


@dataclass
class BatchLauncherConf(LocalLauncherConf):
    """Settings of the launcher where one process computes the runs of all others side by side.

    ``most``: cases in one launch; ``threads`` that it computes on, 0 for all cores.
    """

    _target_: str = "hydra_plugins.snowrepro_launcher.local.BatchLauncher"
    most: int = 256
    threads: int = 0


for _name, _node in {"local": LocalLauncherConf, "batch": BatchLauncherConf}.items():
    ConfigStore.instance().store(group="hydra/launcher", name=_name, node=_node, provider="snowrepro_launcher")


class LocalLauncher(Launcher):
    """Runs the jobs of a sweep in processes of this machine."""

    def __init__(
        self, workers: int = 0, memory_gb: float | None = None, time_limit_minutes: float = 0.0, retries: int = 1
    ) -> None:
        self.workers = workers
        self.memory_gb = memory_gb
        self.time_limit_minutes = time_limit_minutes
        self.retries = retries
        self.running = 0  # jobs at a time
        self.service: Any = None
        self.runs: Mapping[tuple[str, ...], Any] = {}  # of snowrepro, by the overrides of their jobs
        self.common = b""
        self.config: DictConfig | None = None
        self.task_function: TaskFunction | None = None
        self.hydra_context: HydraContext | None = None

    def setup(self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig) -> None:
        """Hydra's hook before ``launch``."""
        self.config = config
        self.task_function = task_function
        self.hydra_context = hydra_context

    def launch(self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int) -> Sequence[JobReturn]:
        """Run all jobs and return what each returned, in order; a lost one as a failed JobReturn."""
        import cloudpickle

        from snowrepro.sweep.processes import Job, Limits, run_jobs
        from snowrepro.sweep.table import SweepTable

        setup_globals()
        assert self.config is not None
        configure_log(self.config.hydra.hydra_logging, self.config.hydra.verbose)
        Path(str(self.config.hydra.sweep.dir)).mkdir(parents=True, exist_ok=True)
        self.common = cloudpickle.dumps((self.hydra_context, self.task_function, self.config, Singleton.get_state()))
        common = set(job_overrides[0]).intersection(*job_overrides)
        jobs = []
        for index, overrides in enumerate(job_overrides, initial_job_idx):
            label = " ".join(o for o in filter_overrides(overrides) if o not in common) or f"job {index}"
            jobs.append(Job(label, functools.partial(self._prepare_job, overrides, index)))
        limits = Limits(self._choose_workers(len(jobs)), 60.0 * self.time_limit_minutes, self.retries)
        self.running = limits.workers
        with self._start_service(), SweepTable(len(jobs), limits.workers) as table:
            run_jobs(jobs, limits, table)
        return [_make_job_return(job.result) for job in jobs]

    def _start_service(self) -> contextlib.AbstractContextManager[None]:
        """Start what the jobs need beside their own processes: nothing."""
        return contextlib.nullcontext()

    def _choose_workers(self, jobs: int) -> int:
        """Choose how many of ``jobs`` run at a time: as set, or as cores and memory allow; at least one."""
        from snowrepro.sweep.processes import free_memory, usable_cores

        fitting = int(free_memory() / (1e9 * self.memory_gb)) if self.memory_gb else jobs
        return max(1, min(jobs, self.workers or min(usable_cores(), fitting)))

    def _prepare_job(self, overrides: Sequence[str], index: int, job: Any) -> bytes:
        """Pickle the call of a job that is about to start.  A run of snowrepro is told where it is in the store.

        Its configuration is composed in its own process: here that would take a tenth of a second a job, one by one.
        """
        import cloudpickle

        if run := self.runs.get(tuple(overrides)):
            _tie_to_store(job, run)
        return cloudpickle.dumps(functools.partial(execute, self.common, overrides, index, self.service))


class BatchLauncher(LocalLauncher):
    """Runs the jobs of a sweep in processes of this machine, for which one process computes, side by side."""

    def __init__(self, most: int = 256, threads: int = 0, **settings: Any) -> None:
        super().__init__(**settings)
        self.most = most
        self.threads = threads

    def _choose_workers(self, jobs: int) -> int:
        """Choose how many of ``jobs`` there are at a time: they hardly compute, and wait for each other's frames."""
        from snowrepro.sweep.processes import free_memory

        fitting = int(free_memory() / (1e9 * self.memory_gb)) if self.memory_gb else jobs
        return max(1, min(jobs, self.workers or min(self.most, fitting)))

    @contextlib.contextmanager
    def _start_service(self) -> Iterator[None]:
        """Start the process that computes, for as long as the jobs run."""
        from snowrepro.sweep.together import start_service

        with start_service(self.threads, min(self.most, self.running)) as self.service:
            yield


class TaskFailed(Exception):
    """A job whose task raised; holds the JobReturn that says what, and says the same."""

    def __str__(self) -> str:
        from snowrepro.composition.hydra_private import result_of

        return str(result_of(self.args[0]))


def execute(common: bytes, overrides: Sequence[str], index: int, service: Any = None) -> JobReturn:
    """Run one job, computed by ``service`` if there is one; called in the fresh process.  Raises TaskFailed.

    ``common``: what all jobs have in common, pickled.
    """
    import cloudpickle

    if service:
        from snowrepro.run import use_service

        use_service(service)
    hydra_context, task_function, sweep_config, singletons = cloudpickle.loads(common)
    setup_globals()
    Singleton.set_state(singletons)
    config = hydra_context.config_loader.load_sweep_config(sweep_config, list(overrides))
    with open_dict(config):
        config.hydra.job.id = f"{config.hydra.job.name}_{index}"
        config.hydra.job.num = index
    returned = run_job(
        hydra_context=hydra_context,
        task_function=task_function,
        config=config,
        job_dir_key="hydra.sweep.dir",
        job_subdir_key="hydra.sweep.subdir",
    )
    if returned.status == JobStatus.FAILED:
        raise TaskFailed(returned)
    return returned


def _tie_to_store(job: Any, run: Any) -> None:
    """Set where a job of snowrepro reports progress, who else works on it, and where its loss is recorded."""
    from snowrepro.store import lease

    job.folder = run.work

    def is_elsewhere(job: Any) -> bool:
        """Return whether another process does the run; a run that is done already ends the job."""
        if run.is_current():
            job.state, job.result = "done", JobReturn(status=JobStatus.COMPLETED)
            job.result.return_value = str(run.result)
            return False
        return lease.holder(job.folder) is not None

    job.is_elsewhere = is_elsewhere
    job.on_loss = run.record_loss


def _make_job_return(result: Any) -> JobReturn:
    """Make the JobReturn that Hydra expects from the result of a job, also of one that died."""
    if isinstance(result, JobReturn):
        return result
    if isinstance(result, TaskFailed):
        return result.args[0]
    failed = JobReturn(status=JobStatus.FAILED)
    failed.return_value = result if isinstance(result, BaseException) else RuntimeError("the job left no result")
    return failed
