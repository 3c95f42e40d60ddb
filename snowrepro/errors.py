"""Failures that a user can act on, each with its exit code; the command line prints them in one line."""

from enum import IntEnum


class ExitCode(IntEnum):
    """Exit codes of ``snowrepro``."""

    FINE = 0
    REGRESSED = 1  # what was measured is not what it was, or contradicts what it should show
    USAGE = 2
    RUNS_FAILED = 3
    INCOMPLETE = 4  # nothing was measured, or not all that was asked for
    INTERRUPTED = 130


class SnowreproError(Exception):
    """Base of the errors that end a command with one message."""

    exit_code = ExitCode.RUNS_FAILED


class ConfigError(SnowreproError):
    """A name, value or combination that cannot be run."""

    exit_code = ExitCode.USAGE


class NoSolver(SnowreproError):
    """A simulation was asked for on a machine that can only read results."""

    exit_code = ExitCode.USAGE

    def __init__(self) -> None:
        super().__init__(
            "a simulation needs Taichi, which is not installed here, or Quadrants (neither has a package for every "
            "system and version of Python): results can be read, classified and reported, but not made"
        )


class StoreError(SnowreproError):
    """A folder or file that cannot be read or written."""

    exit_code = ExitCode.USAGE


class DataError(SnowreproError, ValueError):
    """Positions over time that cannot be classified."""

    exit_code = ExitCode.USAGE


class LeaseLost(StoreError):
    """Another process took over a run that this one seemed to have given up."""

    exit_code = ExitCode.RUNS_FAILED


class FailedBefore(SnowreproError):
    """A run that failed, and would fail likewise if it were tried again."""


class Diverged(SnowreproError):
    """The simulation stopped being one: it says cause, particle, frame and time; ``frame`` is the one it failed in."""

    def __init__(self, message: str, frame: int) -> None:
        super().__init__(message, frame)  # both, so that it can be sent between processes
        self.frame = frame

    def __str__(self) -> str:
        return str(self.args[0])


class RunsFailed(SnowreproError):
    """A sweep in which at least one run has no result."""
