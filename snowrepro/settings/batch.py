"""What a case needs to be computed side by side with others."""

from ..errors import ConfigError
from .case import Case


def require_fit_for_batch(case: Case) -> None:
    """Check that a case can be computed side by side with others.  Raises ConfigError."""
    if case.solver.summation != "fixed_point":
        raise ConfigError(
            f"solver.summation={case.solver.summation} gives other bits in other company: a batch needs "
            "solver.summation=fixed_point"
        )
    if case.indenter:
        raise ConfigError("a batch takes no indenter: hydra/launcher=local makes hardness tests")
