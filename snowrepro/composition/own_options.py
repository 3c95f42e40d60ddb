"""The user's own options: a folder ``conf`` in the working directory, beside the built-in one."""

from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.plugins import Plugins
from hydra.plugins.search_path_plugin import SearchPathPlugin

from .experiments import CONF_DIR, OWN_DIR


class OwnOptions(SearchPathPlugin):
    """Lets Hydra find the user's options behind the built-in ones, whatever letters the folder's path has."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Add the user's folder, if there is one, to a search path of this program; leave other programs' alone."""
        own = OWN_DIR.resolve()
        is_ours = any(element.path == str(CONF_DIR) for element in search_path.get_path())
        if is_ours and own.is_dir() and own != CONF_DIR:
            search_path.append(provider="own", path=f"file://{own}")


def offer_own_options() -> None:
    """Let Hydra know of the user's options, which it forgets with all its state in a process that a launcher starts."""
    if OwnOptions not in Plugins.instance().discover(SearchPathPlugin):
        Plugins.instance().register(OwnOptions)
