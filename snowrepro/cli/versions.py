"""``snowrepro --version``."""

from ..version import find_version


def read_version() -> str:
    """The program's name and the version that is installed."""
    return f"snowrepro {find_version()}"
