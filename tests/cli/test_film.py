"""``snowrepro film``, as a subprocess."""

import resource
import signal

import imageio_ffmpeg
import netCDF4

from tests.conftest import SMALL


def no_more_than_8_kb() -> None:
    """Files that this process and its children write end there, as on a full disk."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))


def test_a_film_of_a_run(snowrepro, tmp_path):
    """One picture for each stored state from late in the pressing on, as fast as the snow moved."""
    assert snowrepro("run", *SMALL, "output.every=5").returncode == 0
    (run,) = tmp_path.glob("runs/*/run.nc")
    shown = snowrepro("film", run.parent.name, "--out", "small.mp4")
    assert shown.returncode == 0, shown.stderr
    assert shown.stdout.strip() == "small.mp4"
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "small.mp4"))
    assert frames == len(range(15, 61, 5))
    assert abs(seconds - frames * 5 * 0.02) < 0.05
    assert {path.name for path in tmp_path.iterdir()} == {"runs", "small.mp4"}
    full = snowrepro("film", run.parent.name, "--out", "full.mp4", preexec_fn=no_more_than_8_kb)
    assert full.returncode == 2
    assert "cannot write full.mp4" in full.stderr
    assert "Traceback" not in full.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"runs", "small.mp4"}


def test_what_cannot_be_filmed(snowrepro, tmp_path):
    """A file of another code has no floor to draw; a folder that is none cannot be written into."""
    with netCDF4.Dataset(tmp_path / "other.nc", "w") as file:
        file.createDimension("one", 1)
    shown = snowrepro("film", "other.nc")
    assert shown.returncode == 2
    assert "no run of snowrepro" in shown.stderr
    assert "Traceback" not in shown.stderr
