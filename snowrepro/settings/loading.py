"""When the snow is pressed, how long its fall is watched, and how that follows the time that the fall takes."""

import math
from typing import Annotated

from pydantic import Field, model_validator

from .base import AddedLater, Settings

MOST_FRAMES = 100_000


class Rest(Settings):
    """When the snow counts as at rest, so that the run ends before its last frame; our choice, to save time."""

    seconds: float = Field(gt=0, description="for which it has to be at rest [s]")
    energy: float = Field(gt=0, lt=1, description="kinetic energy, part of its largest since the release [1]")
    distance: float = Field(gt=0, description="that a cluster may move in this time [cells]")
    strain: float = Field(gt=0, description="by which neighbouring clusters may change their distance in it [1]")
    part: float = Field(ge=0, lt=1, description="of the clusters, and of the neighbours, that may do more [1]")


class Loading(Settings):
    """When the snow is pressed and how long it is watched (Sec. 4.1)."""

    press_frames: int = Field(gt=0, description="frames with force and sintering [1]")
    frames: int = Field(gt=0, le=MOST_FRAMES, description="frames in all [1]")
    frame_time: float = Field(gt=0, le=1, description="length of a frame [s]")
    fall_time: Annotated[float | None, AddedLater] = Field(
        None,
        gt=0,
        description="of the free fall that frames and rest.seconds are meant for: a slower fall gets more of both, a "
        "faster one less; none: they are as they stand [s]",
    )
    rest: Annotated[Rest | None, AddedLater] = Field(None, description="ends the run before; none: all frames")

    @model_validator(mode="after")
    def _falls_after_pressing(self) -> "Loading":
        if self.frames < self.press_frames:
            raise ValueError(f"frames ({self.frames}) must not be fewer than press_frames ({self.press_frames})")
        return self

    def scale_to(self, fall_time: float) -> "Loading":
        """Return the loading of a free fall that takes ``fall_time`` [s], with times as they are then.

        The frames behind the release, and those at rest that end the run, are scaled with it and rounded up.
        """
        if self.fall_time is None:
            return self
        factor = fall_time / self.fall_time
        behind = _round_up(factor * (self.frames - self.press_frames))
        rest = self.rest
        if rest:
            still = self.frame_time * _round_up(factor * rest.seconds / self.frame_time)
            rest = rest.model_copy(update={"seconds": still})
        return self.model_copy(update={"frames": self.press_frames + behind, "fall_time": None, "rest": rest})


def _round_up(frames: float) -> int:
    """Round a number of frames up to whole ones; a thousandth of a frame is round-off."""
    return math.ceil(round(frames, 3))
