"""Hand runs to a launcher of Hydra's; which one, ``hydra/launcher`` says."""

import contextlib
import importlib.util
import sys
import traceback
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from hydra import initialize_config_dir
from hydra.core.plugins import Plugins
from hydra.types import HydraContext, RunMode
from omegaconf import DictConfig, OmegaConf, open_dict

from ..composition import hydra_private
from ..composition.compose import CONF_DIR, quiet_about_schemas
from ..composition.overrides import override_folder
from ..composition.own_options import offer_own_options
from ..errors import ConfigError, RunsFailed
from ..run import do_job, warn_of_settings_left_out
from ..settings.batch import require_fit_for_batch
from ..store.run import Run
from .plan import Plan, Planned, split_swept
from .table import watching

LOG = "sweep.log"
PLUGINS = {"hydra_plugins.hydra_ray_launcher": "ray", "hydra_plugins.hydra_submitit_launcher": "slurm"}


def launch(plan: Plan, chosen: Sequence[Planned], memory_mb: float) -> None:
    """Run some of a sweep's runs, by the launcher that its overrides name; each needs ``memory_mb``.

    What becomes of them the store says: what a launcher returns of jobs that failed is not trusted.  Raises
    ConfigError where its plug-in is not installed, RunsFailed where the launcher itself fails.
    """
    warn_of_settings_left_out()  # here, as the processes of this machine no longer see them
    store = plan.runs[0].store.resolve()
    jobs = [_with_store(planned.overrides, store) for planned in chosen]
    overrides, _ = split_swept(plan.overrides)  # what varies, the jobs say
    hydra_private.forget_hydra()
    offer_own_options()
    with initialize_config_dir(version_base="1.3", config_dir=str(CONF_DIR), job_name="snowrepro"):
        hydra = hydra_private.initialised_hydra()
        with quiet_about_schemas():
            config = hydra.compose_config("config", overrides, RunMode.MULTIRUN, with_log_configuration=False)
        _require_plugin(config)
        target = config.hydra.launcher._target_
        if target.endswith("BatchLauncher"):
            _require_fit_for_batches(chosen, config.hydra.launcher.most)
        _set_memory(config, memory_mb)
        context = hydra_private.context_of(hydra, config)
        is_own = target.startswith("hydra_plugins.snowrepro_launcher.")  # which shows its jobs itself
        with (
            _noise_into(store / LOG),
            contextlib.nullcontext() if is_own else watching([planned.run for planned in chosen]),
        ):
            runs = {tuple(job): planned.run for job, planned in zip(jobs, chosen, strict=True)} if is_own else {}
            _launch(jobs, runs, context, config, store / LOG)


def _launch(
    jobs: Sequence[Sequence[str]],
    runs: Mapping[tuple[str, ...], Run],
    context: HydraContext,
    config: DictConfig,
    log: Path,
) -> None:
    """Have Hydra's launcher run the jobs; one of ours is told which ``runs`` they are.  Raises RunsFailed."""
    try:
        launcher: Any = Plugins.instance().instantiate_launcher(
            hydra_context=context, task_function=do_job, config=config
        )
        if runs:
            launcher.runs = runs
        size = OmegaConf.select(config, "hydra.sweeper.max_batch_size") or len(jobs)
        for first in range(0, len(jobs), size):
            launcher.launch(jobs[first : first + size], initial_job_idx=first)
    except Exception as error:
        traceback.print_exc()
        raise RunsFailed(f"the launcher failed: {error or type(error).__name__} (more in {log})") from error
    finally:
        if ray := sys.modules.get("ray"):  # else it goes on to print
            ray.shutdown()


def _with_store(overrides: Sequence[str], store: Path) -> list[str]:
    """A job's overrides with the store from the root: workers elsewhere start in other folders."""
    return [*(o for o in overrides if not o.startswith("store=")), override_folder("store", str(store))]


def _require_plugin(config: DictConfig) -> None:
    """Raises ConfigError where the launcher is a plug-in that is not installed."""
    for package, extra in PLUGINS.items():
        if config.hydra.launcher._target_.startswith(package) and importlib.util.find_spec(package) is None:
            raise ConfigError(f"this launcher is not installed: pip install 'snowrepro[{extra}]'")


def _require_fit_for_batches(chosen: Sequence[Planned], most: int) -> None:
    """Raises ConfigError where a run cannot be computed side by side with others, ``most`` at a time."""
    if most < 1:
        raise ConfigError(f"hydra.launcher.most: should be at least 1 (got {most})")
    for planned in chosen:
        require_fit_for_batch(planned.run.case)


def _set_memory(config: DictConfig, memory_mb: float) -> None:
    """Tell a launcher that wants to know, and was not told by the user."""
    if "memory_gb" in config.hydra.launcher and config.hydra.launcher.memory_gb is None:
        with open_dict(config):
            config.hydra.launcher.memory_gb = memory_mb / 1000.0


@contextlib.contextmanager
def _noise_into(log: Path) -> Iterator[None]:
    """What libraries print goes into a file, for the table and the store tell it better."""
    with (
        log.open("a", encoding="utf-8") as noise,
        contextlib.redirect_stderr(noise),
        contextlib.redirect_stdout(noise),
    ):
        yield
