"""The command line: ``snowrepro``."""

from .main import main

__all__ = ["main"]
