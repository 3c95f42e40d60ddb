"""The report of an experiment from a store."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

from snowrepro.analysis.fragments import Fragments
from snowrepro.config import compose
from snowrepro.report.figures import POWDER, fragment_colours
from snowrepro.report.page import write_report
from snowrepro.store import runs
from tests.conftest import SMALL


@pytest.fixture
def stored(small_run, small_config, tmp_path):
    """A store with one of the two runs of a small experiment; returns both configs."""
    folders = [
        f"store={tmp_path}/runs",
        f"reports={tmp_path}/reports",
        "experiment=fig5",
        "experiment.frames=[0,20,60]",
    ]
    configs = [compose([*SMALL, *folders, f"sintering={arm}", "pressure=3000"]) for arm in ("paper", "none")]
    runs.save(small_run, configs[0], 2.0)
    return configs


def test_report_shows_runs_and_what_is_missing(stored):
    """Pictures, a row a run, the verdict first, and a missing run as missing."""
    report = write_report(stored, ["experiment=fig5"])
    page = (report.folder / "index.md").read_text()
    assert page.index("**Verdict.**") < page.index("strip.png")
    assert "| C4 |" in page
    assert "NOT RUN" in page.split("| C4 |")[1].splitlines()[0]
    assert "**missing**: 3000, none, seed 0: not run" in page
    assert "snowrepro run experiment=fig5" in page
    assert len(pd.read_csv(report.folder / "summary.csv")) == 1
    for name in ("strip.png", "fragments.png"):
        pixels = imread(report.folder / name)[..., :3]
        assert (np.abs(pixels - [0x30 / 255, 0x7A / 255, 0x78 / 255]).max(axis=-1) < 0.01).mean() > 0.02  # the floor


def test_same_store_same_bytes(stored):
    """Drawing twice gives the same files."""
    first = {p.name: p.read_bytes() for p in write_report(stored, []).folder.iterdir()}
    second = {p.name: p.read_bytes() for p in write_report(stored, []).folder.iterdir()}
    assert first == second


def test_lumps_keep_the_colour_of_their_ancestor():
    """A piece that breaks off gets a new colour, the rest keeps the old one, powder is grey."""

    def fragments(labels, lumps):
        labels = np.array(labels)
        return Fragments(0, labels, np.bincount(labels).astype(float), np.array(lumps), 0.0)

    whole = fragment_colours(fragments([0] * 9, [True]), None)
    broken = fragment_colours(fragments([0] * 5 + [1] * 3 + [2], [True, True, False]), whole)
    assert set(broken[:5]) == {whole[0]}
    assert broken[5] not in (whole[0], POWDER)
    assert broken[8] == POWDER
