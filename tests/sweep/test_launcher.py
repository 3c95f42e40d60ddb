"""Hydra's own suites for launchers, on the local one."""

import pytest
from hydra.core.plugins import Plugins
from hydra.core.singleton import Singleton
from hydra.plugins.launcher import Launcher
from hydra.test_utils.launcher_common_tests import IntegrationTestSuite, LauncherTestSuite
from hydra.test_utils.test_utils import chdir_plugin_root  # noqa: F401
from hydra.version import VersionBase

from hydra_plugins.snowrepro_launcher.local import LocalLauncher


@pytest.fixture(autouse=True)
def _as_if_nothing_was_composed(hydra_restore_singletons):
    """Hydra keeps for the whole process which version an application asked for; the suites ask for none."""
    Singleton._instances.pop(VersionBase, None)


def test_it_is_found():
    assert LocalLauncher.__name__ in [plugin.__name__ for plugin in Plugins.instance().discover(Launcher)]


@pytest.mark.parametrize(("launcher_name", "overrides"), [("local", [])])
class TestLocalLauncher(LauncherTestSuite):
    """Any application's jobs."""


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("task_launcher_cfg", "extra_flags"),
    [({}, ["-m", "hydra/launcher=local", "hydra/hydra_logging=disabled", "hydra/job_logging=disabled"])],
)
class TestLocalLauncherIntegration(IntegrationTestSuite):
    """Whole applications."""
