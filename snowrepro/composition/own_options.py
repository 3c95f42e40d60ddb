"""The user's own options beside the built-in ones: folders ``conf`` and ``experiments`` in the working directory.

Behind them come the laws of installed packages.
"""

import functools
import logging
from pathlib import Path

from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.object_type import ObjectType
from hydra.core.plugins import Plugins
from hydra.plugins.config_source import ConfigResult, ConfigSource
from hydra.plugins.search_path_plugin import SearchPathPlugin

from ..own_law import GROUPS, list_laws, name_package
from .experiments import CONF_DIR, FOLDER, OWN_DIR, find_own_experiments
from .hydra_private import FileConfigSource
from .own_laws import LawsSource


class ExperimentsSource(ConfigSource):
    """Shows Hydra a folder of experiments as the group of that name, whatever the folder is called."""

    def __init__(self, provider: str, path: str) -> None:
        super().__init__(provider, path)
        self.files = FileConfigSource(provider, self.path)

    @staticmethod
    def scheme() -> str:
        """What a search path to such a folder begins with."""
        return "experiments"

    def available(self) -> bool:
        """Whether the folder is there."""
        return bool(self.files.available())

    def load_config(self, config_path: str) -> ConfigResult:
        """An option of the group."""
        return self.files.load_config(config_path.removeprefix(f"{FOLDER}/"))

    def is_group(self, config_path: str) -> bool:
        """Whether this is the group, or what holds it."""
        return config_path.strip("/") in ("", FOLDER)

    def is_config(self, config_path: str) -> bool:
        """Whether this is an option of the group."""
        group, _, name = config_path.strip("/").partition("/")
        return group == FOLDER and bool(name) and bool(self.files.is_config(name))

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        """The options of the group, or the group."""
        if config_path.strip("/") == FOLDER:
            return [] if results_filter == ObjectType.GROUP else self.files.list("", ObjectType.CONFIG)
        return [] if config_path or results_filter == ObjectType.CONFIG else [FOLDER]


class OwnOptions(SearchPathPlugin):
    """Lets Hydra find the user's options and laws behind the built-in ones, whatever the folders' paths are."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Add the user's folders, as far as there are any, to a search path of this program; leave others' alone."""
        if not any(element.path == str(CONF_DIR) for element in search_path.get_path()):
            return
        own, experiments = OWN_DIR.resolve(), find_own_experiments()
        if own.is_dir() and own != CONF_DIR:
            search_path.append(provider="own", path=f"file://{own}")
        if experiments:
            search_path.append(provider="own experiments", path=f"{ExperimentsSource.scheme()}://{experiments}")
        search_path.append(provider="own laws", path=f"{LawsSource.scheme()}://installed")


def offer_own_options() -> None:
    """Let Hydra know of the user's options, which it forgets with all its state in a process that a launcher starts."""
    for plugin, kind in ((OwnOptions, SearchPathPlugin), (ExperimentsSource, ConfigSource), (LawsSource, ConfigSource)):
        if plugin not in Plugins.instance().discover(kind):
            Plugins.instance().register(plugin)
    warn_of_hidden_laws()


@functools.cache
def warn_of_hidden_laws() -> None:
    """Say once which laws of installed packages cannot be chosen, as an option of this program has their name."""
    for kind in GROUPS:
        for name, points in list_laws(kind).items():
            if Path(CONF_DIR, kind, f"{name}.yaml").is_file():
                packages = ", ".join(name_package(point) for point in points)
                text = "%s=%s is the program's own; the law that %s offers by this name cannot be chosen"
                logging.getLogger("snowrepro").warning(text, kind, name, packages)
