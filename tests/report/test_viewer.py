"""What the viewer is given: numbers that come back, nothing that breaks a page, no more than there is room for."""

import base64
import json
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from snowrepro.composition.compose import compose
from snowrepro.report.drawing.states import colour_fragments
from snowrepro.report.viewer import viewer
from snowrepro.report.viewer.embedded import FIELDS, embed
from snowrepro.report.viewer.packing import pack, round_to_levels, take_differences
from snowrepro.store.run import Run
from snowrepro.summary.classify import classify
from snowrepro.summary.row import read_row
from tests.configs import changed
from tests.conftest import SMALL
from tests.report import small_runs

ROOM = 10**7  # enough for all


def unpacked(text: str, kind: type = np.int32) -> np.ndarray:
    """The numbers that ``packed`` was given, in a row; ``kind``: np.uint8 for bytes, else np.int32."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8)
    if kind is np.uint8:
        return planes
    zigzag = np.ascontiguousarray(planes.reshape(4, -1).T).view("<u4").ravel().astype(np.int64)
    return ((zigzag >> 1) ^ -(zigzag & 1)).astype(np.int32)


def sums(values: np.ndarray) -> np.ndarray:
    """What ``take_differences`` was given."""
    return np.cumsum(values, axis=0, dtype=values.dtype)


@pytest.fixture(scope="module")
def runs(small_run, tmp_path_factory):
    """Four finished runs."""
    return small_runs.saved(small_run, tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def whole(runs):
    """All that the viewer shows of them."""
    return viewer.embed_runs(runs, ROOM)


@given(hnp.arrays(np.int32, st.integers(0, 40)), hnp.arrays(np.uint8, (3, 5)))
def test_numbers_come_back(numbers, small):
    """Packing loses nothing, of any whole number of 31 bits and sign and of any byte, as differences too."""
    numbers = np.maximum(numbers, -(2**31) + 1)
    assert (unpacked(pack(numbers)) == numbers).all()
    assert (unpacked(pack(take_differences(small)), np.uint8) == take_differences(small).ravel()).all()
    assert (sums(take_differences(small)) == small).all()


def test_levels_span_what_they_should():
    """The ends are the first and the last level, what is beyond is too; a field that does not vary is one level."""
    assert round_to_levels(np.array([0.0, 1.0, 1.4, 1.6, 2.0, 9.0]), 1.0, 2.0, 3).tolist() == [0, 0, 1, 1, 2, 2]
    assert round_to_levels(np.full(3, 7.0), 7.0, 7.0, 64).tolist() == [0, 0, 0]


def test_places_are_right_within_half_a_quantum(runs, whole):
    """Unpacked places are those of the run but for rounding, particle by particle in some order."""
    data = json.loads(whole.data)
    for run, shown in zip(runs[:3], data["runs"], strict=False):  # the fourth loses particles
        places = unpacked(shown["places"]).reshape(len(data["frames"]), 2, -1)
        places = sums(places).transpose(0, 2, 1) * shown["quantum"]
        with run.open() as dataset:
            right = dataset["position"].sel(snapshot=data["frames"]).values
        held = embed(run, data["frames"]).places
        assert np.abs(places - held).max() <= shown["quantum"] / 2 * (1 + 1e-6)
        assert np.array_equal(np.sort(held, axis=1), np.sort(right.astype(float), axis=1))


def test_shares_and_colours_are_those_of_classify(runs, whole):
    """Of each embedded frame, with all digits; at the end the numbers of the run's row, which the report prints."""
    data = json.loads(whole.data)
    frames = data["frames"]
    released = [frame for frame in frames if frame >= runs[0].case.loading.press_frames]
    for run, shown in zip(runs, data["runs"], strict=True):
        with run.open() as dataset:
            found = classify(dataset, frames=released)
        first = frames.index(released[0])
        assert shown["shares"][:first] == shown["lumps"][:first] == [None] * first
        assert shown["shares"][first:] == [list(now.shares.values()) for now in found.fragments]
        assert shown["lumps"][first:] == [now.lumps for now in found.fragments]
        row = read_row(run)
        assert shown["shares"][-1] == [row[f"{state}_fraction"] for state in data["states"]]
        colours = sums(unpacked(shown["colours"], np.uint8).reshape(len(frames), -1))
        assert not colours[:first].any(), "all is snow before the release"
        drawn = np.array(data["colours"]["palette"])[colours[first:]]
        expected = np.array(colour_fragments(found)).astype(drawn.dtype)
        assert (np.sort(drawn, axis=1) == np.sort(expected, axis=1)).all()
    assert len({tuple(shown["shares"][-1]) for shown in data["runs"]}) == len(runs), "the runs differ"


def test_vanished_particles_are_kept(whole):
    """Of the fourth run: when particles vanish."""
    data = json.loads(whole.data)
    run = data["runs"][3]
    gone, frames = unpacked(run["gone"]), data["frames"]
    assert data["runs"][0]["gone"] is None
    vanished = gone < len(frames)
    assert vanished.sum() == len(range(0, run["particles"], 17))
    assert {frames[at] for at in gone[vanished]} == {min(frame for frame in frames if frame > 48)}


def test_frames_of_the_figure_and_the_ends_are_there(runs):
    """And most others lie where the snow lands."""
    frames = viewer.choose_frames(runs[0])
    assert {0, 20, 60} <= set(frames) and frames == sorted(frames)


def test_the_same_bytes_each_time(runs, whole):
    """Nothing in the data depends on when it was made."""
    assert viewer.embed_runs(runs, ROOM) == whole


def test_names_do_no_harm():
    """No name ends the element that the data stands in, and it is read back as it was."""
    content = {"label": "</script><script>alert(1)</script><!-- & \u2028"}
    text = viewer.dump_safe_json(content)
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == content


def test_a_budget_is_kept(runs, whole):
    """With less room fewer particles are drawn, then runs are left out; both is said.  With none there is no viewer."""
    assert "is drawn" not in " ".join(whole.sentences) and len(json.loads(whole.data)["runs"]) == 4
    room = len(whole.data) // 2
    thinned = viewer.embed_runs(runs, room)
    data = json.loads(thinned.data)
    assert len(thinned.data) <= room and len(data["runs"]) == 4
    assert "is drawn; the parts count all of them" in " ".join(thinned.sentences)
    assert [run["shares"] for run in data["runs"]] == [run["shares"] for run in json.loads(whole.data)["runs"]]
    room = len(whole.data) // 12
    fewer = viewer.embed_runs(runs, room)
    data = json.loads(fewer.data)
    assert len(fewer.data) <= room and 0 < len(data["runs"]) < 4
    assert "ball on L, 3000, none, seed 0" in " ".join(fewer.sentences)
    assert viewer.embed_runs(runs, 1000) is None


def test_what_cannot_be_compared_is_left_out(runs):
    """Runs classified otherwise are named; any definition can be shown."""
    other = replace_analysis(runs[1], lump_mass=0.02)
    shown = viewer.embed_runs([runs[0], other], ROOM)
    assert len(json.loads(shown.data)["runs"]) == 1
    assert "Left out" in " ".join(shown.sentences) and "3000, paper" in " ".join(shown.sentences)
    assert viewer.embed_runs([replace_analysis(runs[0], definition="grid")], ROOM) is not None
    assert viewer.embed_runs([], ROOM) is None


def replace_analysis(run: Run, **settings) -> Run:
    """The same run with other settings of the analysis."""
    return Run(changed(run.config, analysis=run.config.question.analysis.model_copy(update=settings)))


def test_fields_are_stored_for_every_frame(runs, whole):
    """A level for each particle and frame; density does not change after the release."""
    data = json.loads(whole.data)
    for run in data["runs"]:
        for name in FIELDS:
            values = sums(unpacked(run["fields"][name], np.uint8).reshape(len(data["frames"]), -1))
            assert values.shape[1] == run["particles"] and values.max() < data["levels"]
            assert name == "J_P" or (values[data["frames"].index(20) :] == values[-1]).all()


def test_a_run_too_fine_for_its_label_is_told_in_full(runs):
    """Runs that differ in their seeds alone have labels that differ."""
    shown = embed(runs[0], [0, 20, 60])
    other = replace(shown, run=Run(compose([*SMALL, "pressure=500", "seed=1"])))
    assert viewer._make_labels([shown, other]) == ["ball on L, 500, paper, seed 0", "ball on L, 500, paper, seed 1"]
