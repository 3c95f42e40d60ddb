"""``snowrepro --version``."""

from importlib.metadata import PackageNotFoundError, version


def read_version() -> str:
    """The program's name and the version that is installed."""
    try:
        return f"snowrepro {version('snowrepro')}"
    except PackageNotFoundError:
        return "snowrepro, not installed"
