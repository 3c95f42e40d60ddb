"""Runs in motion: one alone or several in a grid, synchronous in time."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from ...errors import ConfigError, StoreError
from ...store import states
from ...store.find import open_run
from ...store.run import Run
from ..drawing.colouring import COLOURINGS, make_scale
from ..drawing.common import get_panel_size, own_style
from .movie import Movie, require_writer, write_movie
from .panels import arrange_panels, find_varied_keys, format_label, format_title
from .stage import MOMENT, MovingSnow, Panel, Stage, find_last_state

FIRST = 0.75  # part of the pressing that is left out at the start
USUAL_FPS, MOST_FPS = 25.0, 50.0  # viewers slow faster gifs down
LEAST_WIDTH, MOST_WIDTH = 160, 3840
MOST_SPEED = 1000.0
MOST_SECONDS = 600.0  # of a picture; a gif cannot say 656
MOST_PICTURES = 10_000
IN_WORDS = {"snow": "snow", "fragment": "by state"}


@dataclass(frozen=True)
class AnimatedRun:
    """A run to animate: its result, as a file or in memory, or None and the reason why there is none."""

    run: Run
    result: Path | xr.Dataset | None
    reason: str = ""

    def open(self) -> AbstractContextManager[xr.Dataset]:
        """Open the result, which must be there, for as long as the context lasts."""
        assert self.result is not None
        return nullcontext(self.result) if isinstance(self.result, xr.Dataset) else open_run(self.result)


@dataclass(frozen=True)
class AnimationSettings:
    """How runs are animated.

    ``colour_by``: a name of COLOURINGS, or None: one run as snow and by fragment, several by fragment.  ``fps``:
    pictures a second, or None: one for each stored state, if that is no more than USUAL_FPS.  ``speed``: 1 is as fast
    as the snow moved.  ``start``: a frame, or None: late in the pressing.  ``width``: of a picture [pixels].
    """

    colour_by: str | None = None
    fps: float | None = None
    speed: float = 1.0
    start: int | None = None
    width: int = 1080


def look_up_run(run: Run) -> AnimatedRun:
    """Look up a run of the store: with its result, or with the reason why it has none."""
    standing = states.standing(run)
    if standing.state == states.DONE:
        try:
            run.open().close()
        except StoreError as error:
            return AnimatedRun(run, None, f"{states.BROKEN}: {error}")
        return AnimatedRun(run, run.result)
    reason = standing.reason if standing.state == states.PENDING else f"{standing.state}: {standing.reason}"
    return AnimatedRun(run, None, reason)


@own_style()
def animate(
    animated_runs: Sequence[AnimatedRun],
    settings: AnimationSettings,
    path: Path,
    on_progress: Callable[[int, int], None] = lambda drawn, count: None,
) -> int:
    """Write an mp4 or gif of runs, at least one of which has a result; returns its number of pictures.

    A run that has ended stays as it is until the last has ended.  ``on_progress`` is called with the number of drawn
    pictures and of all.  Raises ConfigError for settings out of bounds, another ending, or if there is no ffmpeg;
    StoreError if a file cannot be read or written.
    """
    require_writer(path)
    _check_settings(settings)
    times, fps = _choose_times([animated for animated in animated_runs if animated.result is not None], settings)
    panels = _make_panels(animated_runs, settings, times)
    scale = make_scale([panel.snow.colouring for panel in panels if panel.snow])
    stage = Stage(panels, _make_title(animated_runs, settings), scale, settings.width)
    movie = Movie(lambda k: stage.draw_picture(times[k]), len(times), fps, stage.colours)
    write_movie(movie, path, lambda drawn: on_progress(drawn, len(times)))
    return len(times)


def _check_settings(settings: AnimationSettings) -> None:
    """Check that all numbers are within bounds.  Raises ConfigError if not."""
    if settings.fps is not None and not 0 < settings.fps <= MOST_FPS:
        raise ConfigError(f"--fps should be above 0 and at most {MOST_FPS:g} (got {settings.fps:g})")
    if not 0 < settings.speed <= MOST_SPEED:
        raise ConfigError(f"--speed should be above 0 and at most {MOST_SPEED:g} (got {settings.speed:g})")
    if not LEAST_WIDTH <= settings.width <= MOST_WIDTH:
        raise ConfigError(f"--width should be {LEAST_WIDTH} to {MOST_WIDTH} (got {settings.width})")


def _choose_times(animated_runs: Sequence[AnimatedRun], settings: AnimationSettings) -> tuple[np.ndarray, float]:
    """Choose the time of each picture [s], and the pictures a second.

    The times go evenly from the first stored state that is asked for to the last of all runs.  Raises ConfigError if
    there are none or too many.
    """
    stored = [times for animated in animated_runs if len(times := _read_times(animated, settings.start))]
    if not stored or (settings.start or 0) < 0:
        last = max(animated.run.case.frames for animated in animated_runs)
        raise ConfigError(f"--from should be a frame from 0 to {last} (got {settings.start})")
    begin, end = min(times[0] for times in stored), max(times[-1] for times in stored)
    finest = min((float(np.median(np.diff(times))) for times in stored if len(times) > 1), default=1.0)
    fps = settings.fps or min(USUAL_FPS, settings.speed / finest)
    if fps * MOST_SECONDS < 1:
        raise ConfigError(
            f"--speed of {settings.speed:g} makes a picture last {1 / fps:,.0f} s, and {MOST_SECONDS:g} s is the most"
        )
    step = settings.speed / fps
    count = int(np.ceil((end - begin) / step - MOMENT)) + 1
    if count > MOST_PICTURES:
        raise ConfigError(f"that makes {count:,} pictures, more than {MOST_PICTURES:,}: lower --fps or raise --speed")
    return np.minimum(begin + step * np.arange(count), end), fps


def _read_times(animated: AnimatedRun, start: int | None) -> np.ndarray:
    """Read the times [s] of a run's stored states from the frame ``start`` on; None: from late in the pressing on."""
    first = FIRST * animated.run.case.loading.press_frames if start is None else start
    with animated.open() as dataset:
        return dataset["snapshot_time"].values[dataset["snapshot"].values >= first]


def _make_panels(animated_runs: Sequence[AnimatedRun], settings: AnimationSettings, times: np.ndarray) -> list[Panel]:
    """Make the panels, with the states that are shown at these times."""
    colourings = _choose_colourings(animated_runs, settings)
    if len(colourings) > 1:
        return [
            _make_panel(animated_runs[0], colour_by, IN_WORDS[colour_by], (0, column), times)
            for column, colour_by in enumerate(colourings)
        ]
    runs = [animated.run for animated in animated_runs]
    keys = find_varied_keys(runs)
    cells = arrange_panels(runs, keys, float(np.median([np.divide(*get_panel_size(run)) for run in runs])))
    return [
        _make_panel(animated, colourings[0], format_label(animated.run, keys), cell, times)
        for animated, cell in zip(animated_runs, cells, strict=True)
    ]


def _make_panel(animated: AnimatedRun, colour_by: str, label: str, cell: tuple[int, int], times: np.ndarray) -> Panel:
    """Make a panel with the states of one run that are shown at one of these times."""
    if animated.result is None:
        return Panel(animated.run, label, cell, reason=animated.reason)
    with animated.open() as dataset:
        times_stored = dataset["snapshot_time"].values
        states_shown = np.unique(find_last_state(times_stored, times))
        states = dataset.isel(snapshot=states_shown)
        colouring = COLOURINGS[colour_by](dataset, animated.run, states["snapshot"].values.tolist())
        snow = MovingSnow(times_stored[states_shown], states["position"].values, colouring)
        return Panel(animated.run, label, cell, snow)


def _choose_colourings(animated_runs: Sequence[AnimatedRun], settings: AnimationSettings) -> tuple[str, ...]:
    """Choose the colourings in which each run is shown."""
    if settings.colour_by:
        return (settings.colour_by,)
    return ("snow", "fragment") if len(animated_runs) == 1 else ("fragment",)


def _make_title(animated_runs: Sequence[AnimatedRun], settings: AnimationSettings) -> str:
    """Make the title: what all panels share."""
    runs = [animated.run for animated in animated_runs]
    colouring = "by state" if _choose_colourings(animated_runs, settings) == ("fragment",) else ""
    return ", ".join(filter(None, (format_title(runs, find_varied_keys(runs)), colouring)))
