"""The version of the program that is installed."""

from importlib.metadata import PackageNotFoundError, version


def find_version() -> str:
    """Find the version that the installation says; "unknown (not installed)" where there is none."""
    try:
        return version("snowrepro")
    except PackageNotFoundError:
        return "unknown (not installed)"
