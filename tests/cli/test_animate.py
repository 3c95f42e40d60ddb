"""``snowrepro animate``: what is in the files, and what is said where there is none."""

import json
import resource
import signal
import sys
from pathlib import Path

import imageio_ffmpeg
import netCDF4
import numpy as np
import pytest
from PIL import Image

from snowrepro.cli import main
from snowrepro.composition.compose import compose
from snowrepro.report.drawing.colouring import COLOURINGS
from snowrepro.report.drawing.common import SNOW
from snowrepro.report.drawing.states import LUMPS
from snowrepro.report.film.stage import FOOT, TITLE, Stage
from snowrepro.store.run import Run
from tests.configs import carrying, changed
from tests.conftest import SMALL

SHOWN = range(16, 61, 4)  # stored frames from late in the pressing on
FRAME = 0.02  # [s]
BOTH = [*SMALL, "pressure=3000", "sintering=paper,none"]  # the second of them is missing


@pytest.fixture
def stored(small_run, small_config, tmp_path, monkeypatch) -> Path:
    """An empty working folder but for a store that holds the small run; returns its file."""
    monkeypatch.chdir(tmp_path)
    return Run(changed(small_config, store="runs")).save(small_run, wall_seconds=1.0)


@pytest.fixture
def animate(capfd):
    """Run the command in this process; returns its exit code, and what it said on the error stream."""

    def call(*arguments: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as ended:
            main(["animate", *arguments])
        return ended.value.code, capfd.readouterr().err

    return call


def pictures(path: Path | str) -> np.ndarray:
    """All pictures of a gif, (count, height, width, 3)."""
    with Image.open(path) as image:
        found = []
        for k in range(image.n_frames):
            image.seek(k)
            found.append(np.asarray(image.convert("RGB"), dtype=int))
        return np.stack(found)


def seconds(path: str) -> float:
    """How long a gif takes."""
    with Image.open(path) as image:
        total = 0
        for k in range(image.n_frames):
            image.seek(k)
            total += image.info["duration"]
        return total / 1000


def panels_below(shown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The insides of two panels of equal height, one below the other, without their labels."""
    middle = (shown.shape[1] + TITLE) // 2
    return shown[:, TITLE + 40 : middle - 20], shown[:, middle + 40 :]


def has(picture: np.ndarray, colour: str) -> bool:
    """Whether a colour, as near as Pillow comes to it, covers some of a picture."""
    wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    return bool((abs(picture - wanted).max(axis=-1) <= 4).sum() > 20)


def test_an_mp4_of_a_run(animate, stored):
    """One picture for each stored state from late in the pressing on, as fast as the snow moved; even pixels."""
    code, said = animate(stored.parent.name[-10:], "--width", "501")
    assert code == 0, said
    frames, length = imageio_ffmpeg.count_frames_and_secs("animation.mp4")
    assert frames == len(SHOWN)
    assert length == pytest.approx(len(SHOWN) * 4 * FRAME, abs=0.05)
    shape = next(imageio_ffmpeg.read_frames("animation.mp4"))["size"]
    assert abs(shape[0] - 501) <= 1 and not any(side % 2 for side in shape)
    assert sorted(path.name for path in Path().iterdir()) == ["animation.mp4", "runs"]


def test_a_gif_of_a_run(animate, stored):
    """Snow at the left, lumps in their colours at the right once it is released; the same bytes again."""
    for name in ("a.gif", "b.gif"):
        code, said = animate(str(stored), "--width", "400", "--out", name)
        assert code == 0, said
    assert Path("a.gif").read_bytes() == Path("b.gif").read_bytes()
    assert seconds("a.gif") == pytest.approx(len(SHOWN) * 4 * FRAME, abs=0.01)
    shown = pictures("a.gif")[:, :-FOOT]  # without the legend
    assert len(shown) == len(SHOWN)
    left, right = shown[:, :, :200], shown[:, :, 200:]
    assert has(left[0], SNOW) and has(right[0], SNOW)
    assert has(left[-1], SNOW) and not has(right[-1], SNOW)
    assert has(right[-1], LUMPS[0]) and not has(left[-1], LUMPS[0])


def test_fps_speed_and_start(animate, stored):
    """Half as fast takes twice as long; pictures a second say how many there are; the first frame is one's own."""
    code, said = animate(
        str(stored), "--out", "a.gif", "--by", "snow", "--speed", "0.5", "--fps", "5", "--from", "40", "--width", "200"
    )
    assert code == 0, said
    shown = pictures("a.gif")
    assert len(shown) == 20 * FRAME / 0.5 * 5 + 1
    assert seconds("a.gif") == pytest.approx(len(shown) / 5)


@pytest.mark.parametrize("by", COLOURINGS)
def test_every_colouring(animate, stored, by):
    """Each makes pictures, in which snow is where it was not before."""
    code, said = animate(str(stored), "--out", "a.gif", "--by", by, "--fps", "2", "--width", "240")
    assert code == 0, said
    shown = pictures("a.gif")
    assert (shown[0] != shown[-1]).any(axis=-1).sum() > 100


def test_a_missing_run_keeps_its_panel(animate, stored):
    """Below the one that is there; it says why in dark letters, and nothing in it moves."""
    code, said = animate(*BOTH, "--out", "a.gif", "--width", "800")
    assert code == 0, said
    shown = pictures("a.gif")
    done, missing = panels_below(shown)
    assert (done[0] != done[-1]).any()
    assert (missing[0] == missing[-1]).all()
    assert (missing[0].max(axis=-1) < 60).sum() > 50
    assert not (done[0].max(axis=-1) < 60).any()


def test_runs_are_in_step_and_hold_their_end(animate, stored, small_run, small_config):
    """A run of 40 frames beside one of 60: both move until then, one alone after."""
    short = small_run.sel(snapshot=slice(0, 40), frame=slice(0, 40))
    config = compose([*SMALL, "pressure=3000", "loading.frames=40"])
    carrying(short, config).to_netcdf("short.nc")
    code, said = animate(str(stored), "short.nc", "--by", "snow", "--width", "600", "--out", "a.gif")
    assert code == 0, said
    shown = pictures("a.gif")
    assert len(shown) == len(SHOWN)
    end = SHOWN.index(40)
    long, ended = panels_below(shown)
    for panel in (long, ended):
        assert (panel[end - 1] != panel[end]).any()
    assert (long[end] != long[end + 1]).any()
    assert (ended[end] == ended[-1]).all()


def test_no_ffmpeg(animate, stored, monkeypatch):
    """It is said how to get one, and that a gif needs none."""
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setenv("PATH", "")
    code, said = animate(str(stored))
    assert code == 2
    assert "an mp4 needs ffmpeg, which pip install 'snowrepro[film]' brings" in said
    assert animate(str(stored), "--out", "a.gif", "--fps", "1", "--width", "200")[0] == 0


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_an_interrupted_one_leaves_nothing(animate, stored, monkeypatch, name):
    """Neither the file nor a scratch file."""
    drawn = []
    picture = Stage.draw_picture

    def interrupted(self, now):
        drawn.append(now)
        if len(drawn) == 15:
            raise KeyboardInterrupt
        return picture(self, now)

    monkeypatch.setattr(Stage, "draw_picture", interrupted)
    code, _ = animate(str(stored), "--out", name, "--width", "200", "--fps", "25")
    assert code == 130
    assert [path.name for path in Path().iterdir()] == ["runs"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["ball-L-7"], "'ball-L-7' should name one run of the store 'runs'; no run is"),
        (["RUN", "--out", "a.avi"], "'a.avi' should end in .mp4 or .gif"),
        (["RUN", "--fps", "0"], "--fps should be above 0 and at most 50 (got 0)"),
        (["RUN", "--speed", "-1"], "--speed should be above 0"),
        (["RUN", "--width", "10"], "--width should be 160 to 3840 (got 10)"),
        (["RUN", "--from", "61"], "--from should be a frame from 0 to 60 (got 61)"),
        (["RUN", "--speed", "0.0001", "--fps", "25"], "lower --fps or raise --speed"),
        (["pressure=7"], "never run); this makes them: snowrepro run pressure=7"),
        (["experiment=fig5"], "none of the 10 runs has a result"),
        (["experiment=fig2"], "experiment 'fig2' has no runs to show"),
        (["other.nc"], "no run of snowrepro"),
    ],
)
def test_what_cannot_be_shown(animate, stored, arguments, message):
    """One line that says why, and no file."""
    with netCDF4.Dataset("other.nc", "w") as file:
        file.createDimension("one", 1)
    code, said = animate(*(str(stored) if text == "RUN" else text for text in arguments))
    assert code == 2
    assert message in said
    assert said.count("\n") == 1
    assert sorted(path.name for path in Path().iterdir()) == ["other.nc", "runs"]


def test_a_remembered_sweep(animate, stored):
    """By its name, with the missing run among its panels."""
    sweep = {"name": "mine", "overrides": BOTH, "recorded": "", "cells": {}}
    Path("runs/sweeps/mine").mkdir(parents=True)
    Path("runs/sweeps/mine/sweep.json").write_text(json.dumps(sweep))
    assert animate("mine", "--out", "a.gif", "--width", "400")[0] == 0
    assert animate(*BOTH, "--out", "b.gif", "--width", "400")[0] == 0
    assert Path("a.gif").read_bytes() == Path("b.gif").read_bytes()


def no_more_than_4_kb() -> None:
    """Files that this process and its children write end there, as on a full disk."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))


@pytest.mark.parametrize("name", [pytest.param("full.mp4", marks=pytest.mark.nightly), "full.gif"])
def test_a_full_disk(snowrepro, stored, name):
    """It is said, and nothing is left behind."""
    full = snowrepro("animate", str(stored), "--out", name, preexec_fn=no_more_than_4_kb)
    assert full.returncode == 2
    assert f"cannot write {name}" in full.stderr
    assert "Traceback" not in full.stderr
    assert [path.name for path in Path().iterdir()] == ["runs"]
