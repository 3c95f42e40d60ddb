"""How the settings of a sweep are sampled, where their values are not listed."""

from typing import Literal

from pydantic import Field

from .base import Settings

MOST_POINTS = 100_000


class Design(Settings):
    """How settings are sampled whose ranges are written as interval(), log(), whole() or choice()."""

    name: Literal["sobol", "latin", "morris", "saltelli"]
    points: int = Field(
        gt=0,
        le=MOST_POINTS,
        description="sobol, latin: points, each a run; morris: paths, each of one run more than there are settings; "
        "saltelli: points, each of two runs more [1]",
    )
    seed: int = Field(0, ge=0, le=2**31 - 1, description="of the design's random numbers; not that of the runs [1]")
