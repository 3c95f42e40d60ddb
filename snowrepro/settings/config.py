"""A whole configuration: the case, its execution and the question, in files and overrides side by side.

Users write ``pressure=500 threads=2 experiment=fig5`` without knowing which of the three each belongs to.
"""

from typing import Any

from pydantic import model_validator

from .base import Settings
from .case import Case
from .execution import Execution
from .question import Question

PARTS: dict[str, type[Settings]] = {"case": Case, "execution": Execution, "question": Question}
NOT_RECORDED = ("store", "rerun", "claims", "experiment", "design", "reports")  # of whoever asked, not of the result


class Config(Settings):
    """What one run is, how it is carried out, and what is asked of it."""

    case: Case
    execution: Execution
    question: Question

    @model_validator(mode="before")
    @classmethod
    def _sort_settings(cls, given: Any) -> Any:
        """Put the settings of one level into the parts that they belong to; unknown ones stay, to be refused."""
        if not isinstance(given, dict) or given.keys() <= PARTS.keys():
            return given
        known = {name: part.model_fields.keys() & given.keys() for name, part in PARTS.items()}
        rest = {key: value for key, value in given.items() if not any(key in keys for keys in known.values())}
        return {**{name: {key: given[key] for key in keys} for name, keys in known.items()}, **rest}

    @model_validator(mode="after")
    def _repeats_its_bits(self) -> "Config":
        threads = self.execution.threads
        if threads > 1 and self.case.solver.summation == "in_order":
            raise ValueError(
                f"threads={threads} needs solver.summation=fixed_point, which gives the same bits at any "
                "number of threads, or atomic, which does not; in_order takes one thread"
            )
        parallel = threads > 1 or self.case.solver.device == "cuda"
        if self.execution.deterministic and parallel and self.case.solver.summation == "atomic":
            raise ValueError(
                "deterministic=true cannot be had with solver.summation=atomic on more than one thread: "
                "choose fixed_point, or deterministic=false"
            )
        return self

    def settings(self) -> dict[str, Any]:
        """All settings on one level as plain values; without an indenter as before there were any."""
        parts = {name: getattr(self, name).model_dump(mode="json") for name in PARTS}
        indenter = parts["case"].pop("indenter")
        plain = {**parts["case"], **parts["question"], **parts["execution"]}
        return {**plain, "indenter": indenter} if indenter else plain

    def record(self) -> dict[str, Any]:
        """The settings that are written down with a result."""
        return {name: value for name, value in self.settings().items() if name not in NOT_RECORDED}
