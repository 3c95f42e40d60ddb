"""How a run is carried out: none of it makes another run."""

from typing import Literal

from pydantic import Field

from .base import Settings

COULD_CHANGE_BITS = ("threads", "deterministic")  # and would, if a promise were broken


class Execution(Settings):
    """On how many threads, under which promise, and where the result is kept."""

    threads: int = Field(ge=1, le=1024, description="of one run [1]")
    deterministic: bool = Field(description="refuse what does not repeat its bits")
    checkpoint_seconds: float = Field(ge=0, description="wall time between two checkpoints of a run [s]")
    store: str = Field(min_length=1, description="folder that keeps the runs")
    rerun: tuple[Literal["config", "code", "environment"], ...] = Field(
        (), description="run again what is done, if one of these changed since"
    )
