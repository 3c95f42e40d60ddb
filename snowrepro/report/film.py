"""A film of one run: the snow as the paper shows it, and beside it coloured by fragment."""

from pathlib import Path
from subprocess import CalledProcessError

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.animation import FFMpegWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.progress import track

from ..analysis.classify import Classified, classify
from ..config import Config
from ..errors import ConfigError
from ..store.files import published
from .drawing import SNOW, crop, draw_snow, draw_stage, fragment_colours

PANEL = 4.0  # width [inches]
FILM_DPI = 120
FIRST = 0.75  # part of the pressing that is left out at the start


def film(dataset: xr.Dataset, config: Config, path: Path, quiet: bool = False) -> int:
    """Write an mp4 of a run and return its number of pictures; it plays as fast as the snow moved.

    Raises ConfigError where there is no ffmpeg, and StoreError where the file cannot be written.
    """
    found = classify(dataset, config.analysis, frames="all")
    begin = FIRST * config.loading.press_frames
    frames = [int(frame) for frame in dataset["snapshot"].values if frame >= begin]
    painted = dict(zip((f.frame for f in found.fragments), fragment_colours(found.fragments), strict=True))
    figure, axes = _stage(config)
    steps = np.diff(frames)
    rate = 1.0 / (float(np.median(steps)) * config.loading.frame_time) if len(steps) else 1.0
    with published(path) as partial:
        scratch = partial.with_suffix(".mp4")  # ffmpeg goes by the name
        writer = FFMpegWriter(fps=rate, codec="libx264", extra_args=["-pix_fmt", "yuv420p", "-crf", "24"])
        try:
            with matplotlib.rc_context({"animation.ffmpeg_path": _ffmpeg()}), writer.saving(figure, scratch, FILM_DPI):
                for frame in track(frames, "film", disable=quiet):
                    _draw(figure, axes, config, dataset, frame, painted.get(frame), found)
                    writer.grab_frame()
            scratch.replace(partial)
        except CalledProcessError as error:
            raise OSError(f"ffmpeg ended with code {error.returncode}") from error
        finally:
            scratch.unlink(missing_ok=True)
    return len(frames)


def _ffmpeg() -> str:
    """The program of the optional package, or the machine's own."""
    try:
        import imageio_ffmpeg

        return imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        if FFMpegWriter.isAvailable():
            return matplotlib.rcParams["animation.ffmpeg_path"]
    raise ConfigError("a film needs ffmpeg: pip install 'snowrepro[film]' brings one")


def _stage(config: Config) -> tuple[Figure, list[Axes]]:
    """A figure of two panels with an even number of pixels, as the codec wants."""
    width, height = crop(config)
    inches = (2 * PANEL + 0.1, PANEL * height / width + 0.35)
    even = [2 * round(side * FILM_DPI / 2) / FILM_DPI for side in inches]
    figure = Figure(figsize=even, facecolor="white")
    axes = list(figure.subplots(1, 2))
    figure.subplots_adjust(left=0.003, right=0.997, bottom=0.003, top=1 - 0.34 / even[1], wspace=0.015)
    return figure, axes


def _draw(
    figure: Figure,
    axes: list[Axes],
    config: Config,
    dataset: xr.Dataset,
    frame: int,
    colours: np.ndarray | None,
    found: Classified,
) -> None:
    """One picture: ``colours`` (n,) by fragment, None before release."""
    places = dataset["position"].sel(snapshot=frame).values
    for ax, colour in zip(axes, (SNOW, SNOW if colours is None else colours), strict=True):
        ax.clear()
        draw_stage(ax, config)
        draw_snow(ax, config, places, PANEL * 72 / crop(config)[0], colour)
    arm = "sintering" if config.sintering.enabled else "no sintering"
    axes[0].set_title(
        f"{config.shape.name} on {config.floor.name}, pressure {config.pressure:g}, {arm}", fontsize=9, loc="left"
    )
    now = next((f for f in found.fragments if f.frame == frame), None)
    told = "pressed" if now is None else f"mass in lumps {now.lump_fraction:.2f}, number of lumps {now.lumps}"
    axes[1].set_title(f"{frame * config.loading.frame_time:.2f} s   {told}", fontsize=9, loc="left")
