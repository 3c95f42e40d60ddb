"""What the two configurations say; needs no cluster, and no plugin but to compose."""

import importlib.util
import warnings

import pytest
from omegaconf import DictConfig

from snowrepro.composition import messages
from snowrepro.composition.compose import CONF_DIR, compose_raw
from snowrepro.errors import ConfigError
from snowrepro.sweep import launch
from snowrepro.sweep.plan import make_plan


def launcher(*overrides: str) -> DictConfig:
    """Hydra's launcher node."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # ray.yaml has the name of the plug-in's schema, and that is to be
        return compose_raw(overrides, hydra_node=True).hydra.launcher


def test_ray_gives_each_run_a_process_and_a_processor():
    """And nothing that a cluster which is there refuses."""
    found = launcher("hydra/launcher=ray")
    assert found._target_.endswith("RayLauncher")
    assert dict(found.ray.remote) == {"num_cpus": 1, "max_calls": 1, "max_retries": 3}
    assert found.ray.init.object_store_memory is None
    assert launcher("hydra/launcher=ray", "hydra.launcher.ray.init.address=h:1").ray.init.address == "h:1"


@pytest.mark.skipif(
    importlib.util.find_spec("hydra_plugins.hydra_submitit_launcher") is None, reason="pip install 'snowrepro[slurm]'"
)
def test_slurm_bounds_a_run_and_requeues_it():
    """Its folder lies in the store; partition and account can be set."""
    found = launcher("hydra/launcher=slurm", "store=/shared/runs", "hydra.launcher.partition=p")
    assert found._target_.endswith("SlurmLauncher")
    assert (found.cpus_per_task, found.mem_gb, found.partition) == (1, 2, "p")
    assert 0 < found.signal_delay_s < 60 * found.timeout_min
    assert found.max_num_timeout > 0 and found.array_parallelism > 0


@pytest.mark.parametrize("name", ["ray", "slurm"])
def test_both_are_packaged(name):
    """They lie in the folder that the wheel takes along."""
    assert (CONF_DIR / "hydra" / "launcher" / f"{name}.yaml").is_file()


def test_a_launcher_that_is_not_installed_is_said(monkeypatch, tmp_path):
    """With the command that installs it, before anything is run."""
    plan = make_plan(["pressure=1,2", "hydra/launcher=ray", f"store={tmp_path}"], True)
    monkeypatch.setattr(launch.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"pip install 'snowrepro\[ray\]'"):
        launch.launch(plan, plan.planned, memory_mb=400)
    hydras = "In 'hydra/launcher/slurm': Could not load 'hydra/launcher/submitit_slurm'."  # as it says it
    assert messages.one_message(ValueError(hydras)).endswith("pip install 'snowrepro[slurm]'")
