"""Runs in motion: one alone or several in a grid, in step by time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from ..config import Config
from ..errors import ConfigError
from ..store.runs import open_run
from .drawing import crop
from .movie import Pictures, require_writer, write_movie
from .paint import PAINTS, scale_of
from .panels import arrange, label_of, title_of, varied
from .stage import MOMENT, Panel, Stage, last_until

FIRST = 0.75  # part of the pressing that is left out at the start
USUAL_FPS, MOST_FPS = 25.0, 50.0  # viewers slow faster gifs down
LEAST_WIDTH, MOST_WIDTH = 160, 3840
MOST_SPEED = 1000.0
MOST_PICTURES = 10_000
IN_WORDS = {"snow": "snow", "fragment": "by fragment"}


@dataclass(frozen=True)
class Shown:
    """A run to show: its result, or None and why there is none."""

    config: Config
    path: Path | None
    reason: str = ""


@dataclass(frozen=True)
class Settings:
    """How it is shown.

    ``by``: a name of PAINTS, or None: one run as snow and by fragment, several by fragment.  ``fps``: pictures a
    second, or None: one for each stored state, if that is no more than USUAL_FPS.  ``speed``: 1 as fast as the snow
    moved.  ``start``: a frame, or None: late in the pressing.  ``width``: of a picture [pixels].
    """

    by: str | None = None
    fps: float | None = None
    speed: float = 1.0
    start: int | None = None
    width: int = 1080


def animate(
    runs: Sequence[Shown], settings: Settings, path: Path, tell: Callable[[int, int], None] = lambda done, count: None
) -> int:
    """Write an mp4 or gif of runs, at least one of which has a result, and return its number of pictures.

    A run that has ended stays as it ended until the last has.  ``tell`` hears how many of how many pictures are drawn.
    Raises ConfigError for settings that are out of bounds, another ending, or where there is no ffmpeg; StoreError
    where a file cannot be read or written.
    """
    require_writer(path)
    _check(settings)
    times, fps = _moments([run for run in runs if run.path], settings)
    panels = _panels(runs, settings, times)
    scale = scale_of([panel.paint for panel in panels if panel.paint])
    stage = Stage(panels, _title(runs, settings), scale, settings.width)
    pictures = Pictures(lambda k: stage.picture(times[k]), len(times), fps, stage.colours)
    write_movie(pictures, path, lambda done: tell(done, len(times)))
    return len(times)


def _check(settings: Settings) -> None:
    """Raises ConfigError for a number that is out of bounds."""
    if settings.fps is not None and not 0 < settings.fps <= MOST_FPS:
        raise ConfigError(f"--fps should be above 0 and at most {MOST_FPS:g} (got {settings.fps:g})")
    if not 0 < settings.speed <= MOST_SPEED:
        raise ConfigError(f"--speed should be above 0 and at most {MOST_SPEED:g} (got {settings.speed:g})")
    if not LEAST_WIDTH <= settings.width <= MOST_WIDTH:
        raise ConfigError(f"--width should be {LEAST_WIDTH} to {MOST_WIDTH} (got {settings.width})")


def _moments(runs: Sequence[Shown], settings: Settings) -> tuple[np.ndarray, float]:
    """The time that each picture shows [s], and pictures a second.  Raises ConfigError if there are none or too many.

    They go evenly from the first stored state that is asked for to the last of all.
    """
    stored = [times for run in runs if len(times := _stored(run, settings.start))]
    if not stored or (settings.start or 0) < 0:
        last = max(run.config.frames for run in runs)
        raise ConfigError(f"--from should be a frame from 0 to {last} (got {settings.start})")
    begin, end = min(times[0] for times in stored), max(times[-1] for times in stored)
    finest = min((float(np.median(np.diff(times))) for times in stored if len(times) > 1), default=1.0)
    fps = settings.fps or min(USUAL_FPS, settings.speed / finest)
    step = settings.speed / fps
    count = int(np.ceil((end - begin) / step - MOMENT)) + 1
    if count > MOST_PICTURES:
        raise ConfigError(f"that makes {count:,} pictures, more than {MOST_PICTURES:,}: lower --fps or raise --speed")
    return np.minimum(begin + step * np.arange(count), end), fps


def _stored(run: Shown, start: int | None) -> np.ndarray:
    """Times of a run's stored states [s] from a frame on, by default from late in the pressing on."""
    first = FIRST * run.config.loading.press_frames if start is None else start
    with open_run(run.path) as dataset:
        return dataset["snapshot_time"].values[dataset["snapshot"].values >= first]


def _panels(runs: Sequence[Shown], settings: Settings, times: np.ndarray) -> list[Panel]:
    """What each panel shows at these times."""
    configs, ways = [run.config for run in runs], _ways(runs, settings)
    if len(ways) > 1:
        return [_panel(runs[0], by, IN_WORDS[by], (0, k), times) for k, by in enumerate(ways)]
    keys = varied(configs)
    cells = arrange(configs, keys, float(np.median([np.divide(*crop(config)) for config in configs])))
    return [
        _panel(run, ways[0], label_of(run.config, keys), cell, times) for run, cell in zip(runs, cells, strict=True)
    ]


def _panel(run: Shown, by: str, label: str, cell: tuple[int, int], times: np.ndarray) -> Panel:
    """A panel with the states that are shown at one of these times."""
    if run.path is None:
        return Panel(run.config, label, cell, reason=run.reason)
    with open_run(run.path) as dataset:
        stored = dataset["snapshot_time"].values
        seen = np.unique(last_until(stored, times))
        states: xr.Dataset = dataset.isel(snapshot=seen)
        paint = PAINTS[by](dataset, run.config, states["snapshot"].values.tolist())
        return Panel(run.config, label, cell, stored[seen], states["position"].values, paint)


def _ways(runs: Sequence[Shown], settings: Settings) -> tuple[str, ...]:
    """In which colourings each run is shown."""
    return (settings.by,) if settings.by else ("snow", "fragment") if len(runs) == 1 else ("fragment",)


def _title(runs: Sequence[Shown], settings: Settings) -> str:
    """What all panels share."""
    configs = [run.config for run in runs]
    by = "by fragment" if _ways(runs, settings) == ("fragment",) else ""
    return ", ".join(filter(None, (title_of(configs, varied(configs)), by)))
