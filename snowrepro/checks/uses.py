"""The experiments whose runs a check uses, as their files say: read when a check needs them, not before."""

from ..composition.experiments import checked
from ..errors import ConfigError


def find_experiments(use: str) -> list[str]:
    """Find the experiments whose runs a check uses in a way, "coarse", "fine" or "mutants": see ``Experiment.checks``.

    Raises ConfigError where no experiment's file has that use.
    """
    names = checked(use)
    if not names:
        raise ConfigError(f"no experiment is there to check with: none has '{use}' among experiment.checks")
    return names


def find_one_experiment(use: str) -> str:
    """Find the one experiment with a use.  Raises ConfigError where there is none, or more than one."""
    names = find_experiments(use)
    if len(names) > 1:
        raise ConfigError(f"'{use}' may be among experiment.checks of one experiment, and is of {', '.join(names)}")
    return names[0]
