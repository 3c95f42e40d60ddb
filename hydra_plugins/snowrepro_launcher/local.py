"""``hydra/launcher=local``: every job in a fresh process, one thread each, with a live table.

Hydra scans this module in every application of the environment, so heavy imports wait until use.
"""

import functools
from collections.abc import Sequence
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
    """Settings: ``workers`` processes at a time, 0 for one a core."""

    _target_: str = "hydra_plugins.snowrepro_launcher.local.LocalLauncher"
    workers: int = 0


ConfigStore.instance().store(
    group="hydra/launcher", name="local", node=LocalLauncherConf, provider="snowrepro_launcher"
)


class LocalLauncher(Launcher):
    """Runs the jobs of a sweep in processes of this machine."""

    def __init__(self, workers: int = 0):
        self.workers = workers
        self.config: DictConfig | None = None
        self.task_function: TaskFunction | None = None
        self.hydra_context: HydraContext | None = None

    def setup(self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig) -> None:
        """Hydra's hook before ``launch``."""
        self.config = config
        self.task_function = task_function
        self.hydra_context = hydra_context

    def launch(self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int) -> Sequence[JobReturn]:
        """Run all jobs and return what each returned, in order; a crashed one as a failed JobReturn."""
        from snowrepro.sweep.processes import run_jobs, usable_cores
        from snowrepro.sweep.table import SweepTable

        setup_globals()
        assert self.config is not None
        configure_log(self.config.hydra.hydra_logging, self.config.hydra.verbose)
        Path(str(self.config.hydra.sweep.dir)).mkdir(parents=True, exist_ok=True)
        common = set(job_overrides[0]).intersection(*job_overrides)
        jobs = [self._job(job, initial_job_idx + i, common) for i, job in enumerate(job_overrides)]
        with SweepTable() as table:
            run_jobs(jobs, self.workers or usable_cores(), table)
        return [_job_return(job.result) for job in jobs]

    def _job(self, overrides: Sequence[str], index: int, common: set[str]) -> Any:
        """A job that can travel to another process, labelled by what sets it apart from the others."""
        import cloudpickle

        from snowrepro.sweep.processes import Job

        assert self.config is not None and self.hydra_context is not None
        config = self.hydra_context.config_loader.load_sweep_config(self.config, list(overrides))
        with open_dict(config):
            config.hydra.job.id = f"{config.hydra.job.name}_{index}"
            config.hydra.job.num = index
        call = functools.partial(execute, self.hydra_context, self.task_function, config, Singleton.get_state())
        label = " ".join(o for o in filter_overrides(overrides) if o not in common) or f"job {index}"
        folder, result = _stored(config)
        if result:
            finished = JobReturn(status=JobStatus.COMPLETED)
            finished.return_value = str(result)
            return Job(label, b"", folder, state="done", result=finished)
        return Job(label, cloudpickle.dumps(call), folder)


def execute(
    hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig, singletons: dict[Any, Any]
) -> JobReturn:
    """Run one job; called in the fresh process."""
    setup_globals()
    Singleton.set_state(singletons)
    return run_job(
        hydra_context=hydra_context,
        task_function=task_function,
        config=config,
        job_dir_key="hydra.sweep.dir",
        job_subdir_key="hydra.sweep.subdir",
    )


def _stored(config: DictConfig) -> tuple[Path | None, Path | None]:
    """Where a job of snowrepro reports its progress, and its result if that is there; None for other applications."""
    from snowrepro.composition import validate
    from snowrepro.errors import ConfigError
    from snowrepro.store import runs

    try:
        run = validate(config)
    except ConfigError:
        return None, None
    return runs.run_dir(run), runs.result_path(run) if runs.is_done(run) else None


def _job_return(result: Any) -> JobReturn:
    """What Hydra expects of a job, also of one that died."""
    if isinstance(result, JobReturn):
        return result
    failed = JobReturn(status=JobStatus.FAILED)
    failed.return_value = result if isinstance(result, BaseException) else RuntimeError("the job left no result")
    return failed
