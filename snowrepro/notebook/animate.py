"""``snowrepro.animate``: a film of runs inside a notebook."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from ..composition.compose import config_of
from ..errors import ConfigError
from ..progress import show_progress
from ..report.film import animation
from ..report.film.animation import AnimatedRun, AnimationSettings
from ..report.film.panels import find_varied_keys, format_title
from ..store.run import Run
from ..sweep import record
from ..text import quote
from .arguments import naming_arguments
from .named import find_sweep
from .shown import Film
from .states import read_run, require_colouring

WIDTH = 720  # pixels
FORMATS = ("gif", "mp4")

Shown = xr.Dataset | str | Path


def animate(
    data: Shown | Sequence[Shown],
    *,
    by: str | None = None,
    speed: float = 1.0,
    start: int | None = None,
    width: int = WIDTH,
    format: str = "gif",  # noqa: A002 - as Matplotlib and Pillow call it
    store: str | Path = "runs",
    progress: bool = True,
) -> Film:
    """Draw runs in motion, side by side if there are several; a notebook shows the film, ``save(path)`` writes it.

    ``data``: a run (as ``simulate`` or ``open_run`` gives it, or its id or path), a sweep of ``store``, or
    a list of these.  ``by``: what colours show: fragment, snow, density, J_P or damage.  ``speed``: 1 is as fast as the
    snow moved.  ``start``: the frame to begin with, by default late in the pressing.  ``width``: in pixels.
    ``format``: gif, or mp4, which is smaller and needs ffmpeg.  ``progress``: whether to show a bar.
    Raises ConfigError for what cannot be drawn so, StoreError where data is broken.
    """
    if by is not None:
        require_colouring(by)
    if format not in FORMATS:
        raise ConfigError(f"format: should be {' or '.join(FORMATS)} (got {quote(format)})")
    each = [data] if isinstance(data, Shown) else list(data)
    shown = [run for one in each for run in _find_runs(one, store)]
    if not any(run.result is not None for run in shown):
        why = f": {shown[0].reason}" if shown else ""
        raise ConfigError(f"there is nothing to show: no run has a result{why}")
    settings = AnimationSettings(by, speed=speed, start=start, width=width)
    with (
        tempfile.TemporaryDirectory() as folder,
        show_progress("picture", 1, is_hidden=not progress) as update,
        naming_arguments(),
    ):
        path = Path(folder) / f"film.{format}"
        animation.animate(shown, settings, path, update)
        runs = [animated.run for animated in shown]
        return Film(path.read_bytes(), path.suffix, format_title(runs, find_varied_keys(runs)) or "runs")


def _find_runs(one: Shown, store: str | Path) -> list[AnimatedRun]:
    """Find a run, or the runs of a sweep.  Raises ConfigError where it is the name of neither."""
    if sweep := find_sweep(one, store):
        return [animation.look_up_run(run) for run in record.plan_remembered(sweep, store).runs]
    dataset = read_run(one, store)
    return [AnimatedRun(Run(config_of(dataset)), dataset)]
