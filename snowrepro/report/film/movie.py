"""Movie files: mp4 through ffmpeg, gif through Pillow."""

import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from ...errors import ConfigError
from ...store.files import published

ENDINGS = (".mp4", ".gif")
GIF_COLOURS = 127  # half of what a gif can have: one more marks what did not change
SAMPLED = 12  # pictures that the colours of a gif are chosen from


@dataclass(frozen=True)
class Movie:
    """The pictures of a movie.

    ``draw(k)`` returns picture k of ``count``, (height, width, 3) as u8; ``fps``: pictures a second; ``colours``
    (k, 3) as u8: those that a gif must have, even if they cover little.
    """

    draw: Callable[[int], np.ndarray]
    count: int
    fps: float
    colours: np.ndarray


def require_writer(path: Path) -> None:
    """Check that there is a way to write this file.  Raises ConfigError if not."""
    if path.suffix not in ENDINGS:
        raise ConfigError(f"'{path}' should end in {' or '.join(ENDINGS)}")
    if path.suffix == ".mp4":
        _find_ffmpeg()


def write_movie(movie: Movie, path: Path, on_progress: Callable[[int], None] = lambda drawn: None) -> None:
    """Write an mp4 or a gif, by the ending of ``path``, completely or not at all.

    ``on_progress`` is called with the number of pictures drawn.  Raises ConfigError for another ending or if there is
    no ffmpeg, StoreError if the file cannot be written.
    """
    require_writer(path)
    with published(path) as partial:
        (_write_mp4 if path.suffix == ".mp4" else _write_gif)(movie, partial, on_progress)


def _write_mp4(movie: Movie, path: Path, on_progress: Callable[[int], None]) -> None:
    """Send the pictures to ffmpeg.  Raises OSError if it fails, with its last message."""
    first = movie.draw(0)
    command = [_find_ffmpeg(), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{first.shape[1]}x{first.shape[0]}", "-r", f"{movie.fps:.6f}", "-i", "-"]
    command += ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "26", "-movflags", "+faststart", "-f", "mp4"]
    with tempfile.TemporaryFile() as messages:
        process = subprocess.Popen([*command, str(path)], stdin=subprocess.PIPE, stdout=messages, stderr=messages)
        pipe = process.stdin
        assert pipe is not None, "it was asked for"
        try:
            for k in range(movie.count):
                pipe.write((movie.draw(k) if k else first).tobytes())
                on_progress(k + 1)
            pipe.close()
        except BrokenPipeError:
            pass  # ffmpeg ended early: its message is read below
        except BaseException:
            process.kill()
            raise
        finally:
            code = process.wait()
        if code:
            messages.seek(0)
            last = messages.read().decode(errors="replace").strip().splitlines()[-1:] or [""]
            raise OSError(f"ffmpeg ended with code {code}: {last[0]}".rstrip(": "))


def _find_ffmpeg() -> str:
    """Find ffmpeg: that of the optional package, or the machine's own.  Raises ConfigError if there is neither."""
    try:
        import imageio_ffmpeg  # noqa: PLC0415 - an optional package, needed for mp4 alone

        return imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        path = shutil.which("ffmpeg")
    if path is None:
        raise ConfigError(
            "an mp4 needs ffmpeg, which pip install 'snowrepro[film]' brings; a gif does not: --out animation.gif"
        )
    return path


def _write_gif(movie: Movie, path: Path, on_progress: Callable[[int], None]) -> None:
    """Write every picture in the same few colours: the file is small, and what stands still does not flicker."""
    palette = _choose_palette(movie)
    ends = np.round(100 * np.arange(movie.count + 1) / movie.fps).astype(int)  # hundredths of a second

    def draw_all() -> Iterator[Image.Image]:
        """Draw all pictures, one after the other."""
        for k in range(movie.count):
            yield Image.fromarray(movie.draw(k)).quantize(palette=palette, dither=Image.Dither.NONE)
            on_progress(k + 1)

    images = draw_all()
    durations = (10 * np.diff(ends)).tolist()
    next(images).save(path, "GIF", save_all=True, append_images=images, duration=durations, loop=0, optimize=False)


def _choose_palette(movie: Movie) -> Image.Image:
    """Choose the colours of a gif: those that it must have, and those that pictures of the whole time need most."""
    chosen = np.unique(np.linspace(0, movie.count - 1, SAMPLED).round().astype(int))
    together = Image.fromarray(np.concatenate([movie.draw(int(k)) for k in chosen]))
    others = together.quantize(GIF_COLOURS - len(movie.colours), dither=Image.Dither.NONE).getpalette()
    assert others is not None, "quantizing makes a palette"
    palette = Image.new("P", (1, 1))
    palette.putpalette([*movie.colours.ravel().tolist(), *others][: 3 * GIF_COLOURS])
    return palette
