"""Moving pictures in files: mp4 through ffmpeg, gif through Pillow."""

import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from ..errors import ConfigError
from ..store.files import published

ENDINGS = (".mp4", ".gif")
GIF_COLOURS = 127  # half of what a gif can have: one more marks what did not change
SAMPLED = 12  # pictures that the colours of a gif are chosen from


@dataclass(frozen=True)
class Pictures:
    """What is shown: ``draw(k)`` gives picture k of ``count``, (height, width, 3) as u8; ``fps`` of them a second.

    ``colours`` (k, 3) as u8: those that a gif must have, however little they cover.
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
        _ffmpeg()


def write_movie(pictures: Pictures, path: Path, tell: Callable[[int], None] = lambda drawn: None) -> None:
    """Write an mp4 or a gif, by the ending of ``path``, whole or not at all; ``tell`` hears how many are drawn.

    Raises ConfigError for another ending or where there is no ffmpeg, StoreError where the file cannot be written.
    """
    require_writer(path)
    with published(path) as partial:
        (_write_mp4 if path.suffix == ".mp4" else _write_gif)(pictures, partial, tell)


def _write_mp4(pictures: Pictures, path: Path, tell: Callable[[int], None]) -> None:
    first = pictures.draw(0)
    command = [_ffmpeg(), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{first.shape[1]}x{first.shape[0]}", "-r", f"{pictures.fps:.6f}", "-i", "-"]
    command += ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "21", "-movflags", "+faststart", "-f", "mp4"]
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen([*command, str(path)], stdin=subprocess.PIPE, stdout=said, stderr=said)
        try:
            for k in range(pictures.count):
                process.stdin.write((pictures.draw(k) if k else first).tobytes())
                tell(k + 1)
            process.stdin.close()
        except BrokenPipeError:
            pass  # it ended early: why is told below
        except BaseException:
            process.kill()
            raise
        finally:
            code = process.wait()
        if code:
            said.seek(0)
            last = said.read().decode(errors="replace").strip().splitlines()[-1:] or [""]
            raise OSError(f"ffmpeg ended with code {code}: {last[0]}".rstrip(": "))


def _ffmpeg() -> str:
    """The program of the optional package, or the machine's own.  Raises ConfigError if there is neither."""
    try:
        import imageio_ffmpeg

        return imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        found = shutil.which("ffmpeg")
    if found is None:
        raise ConfigError(
            "an mp4 needs ffmpeg, which pip install 'snowrepro[film]' brings; a gif does not: --out animation.gif"
        )
    return found


def _write_gif(pictures: Pictures, path: Path, tell: Callable[[int], None]) -> None:
    """Every picture in the same few colours: the file is small, and what stands still does not flicker."""
    palette = _palette(pictures)
    ends = np.round(100 * np.arange(pictures.count + 1) / pictures.fps).astype(int)  # hundredths of a second

    def drawn() -> Iterator[Image.Image]:
        for k in range(pictures.count):
            yield Image.fromarray(pictures.draw(k)).quantize(palette=palette, dither=Image.Dither.NONE)
            tell(k + 1)

    images = drawn()
    durations = (10 * np.diff(ends)).tolist()
    next(images).save(path, "GIF", save_all=True, append_images=images, duration=durations, loop=0, optimize=False)


def _palette(pictures: Pictures) -> Image.Image:
    """The colours that a gif must have, and those that pictures from the whole time need most beside."""
    chosen = np.unique(np.linspace(0, pictures.count - 1, SAMPLED).round().astype(int))
    together = Image.fromarray(np.concatenate([pictures.draw(int(k)) for k in chosen]))
    others = together.quantize(GIF_COLOURS - len(pictures.colours), dither=Image.Dither.NONE).getpalette()
    palette = Image.new("P", (1, 1))
    palette.putpalette([*pictures.colours.ravel().tolist(), *others][: 3 * GIF_COLOURS])
    return palette
