"""Frames that follow the fall: how many there are, what a run is called then, and what is refused."""

import math

import pytest

from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.store.identity import is_id_of, run_id
from snowrepro.sweep.plan import make_plan


def frames_after_release(*overrides: str) -> int:
    case = compose(["loading=falling", *overrides]).case
    return case.frames - case.loading.press_frames


def test_a_run_of_the_default_fall_is_that_of_the_paper():
    """Same frames, same id: it is not run twice; and the record of either is that of the run."""
    paper, falling = compose(), compose(["loading=falling"])
    assert (falling.case.frames, falling.case.frames_at_rest) == (600, 25)
    assert run_id(falling.case) == run_id(paper.case)
    assert all(is_id_of(run_id(paper.case), config.record()) for config in (paper, falling))


@pytest.mark.parametrize(
    ("changed", "factor"),
    [
        (("reading.gravity=2.5",), 2.0),
        (("reading.gravity=40",), 0.5),
        (("reading.drop_height=240",), 2.0),
        (("reading.gravity=0.2",), math.sqrt(50)),
        (("reading=si",), math.sqrt(0.02 / 0.98)),
    ],
)
def test_a_slower_fall_has_more_frames(changed, factor):
    """As many as its time is longer, sqrt(2 H / g), and as much longer has it to be at rest; rounded up."""
    assert frames_after_release(*changed) == math.ceil(500 * factor)
    assert compose(["loading=falling", *changed]).case.frames_at_rest == math.ceil(25 * factor)


def test_the_touch_is_at_the_same_part_of_every_fall():
    """A third of the frames behind the release are the fall itself, at whichever gravity."""
    for gravity in (0.2, 3, 10, 40):
        case = compose(["loading=falling", f"reading.gravity={gravity}"]).case
        touch = math.sqrt(2 * 60 / gravity) / case.loading.frame_time
        assert touch / (case.frames - 100) == pytest.approx(173.2 / 500, abs=0.003)
        assert case.is_stored(case.frames) and not case.is_stored(case.frames + 1)


def test_a_sweep_over_gravity_has_its_frames():
    """Also where runs are put together from others, and not composed."""
    plan = make_plan(["loading=falling", "reading.gravity=10,2.5,40", "pressure=300,740"], multirun=True)
    assert [run.case.frames for run in plan.runs] == [600, 600, 1100, 1100, 350, 350]
    assert len({run.id for run in plan.runs}) == 6


def test_a_test_of_hardness_takes_nothing_of_the_fall():
    indented = [compose([*words, "indenter=disc"]).case for words in ((), ("loading=falling",))]
    assert run_id(indented[0]) == run_id(indented[1]) and indented[0].frames == indented[1].frames
    compose(["loading=falling", "indenter=disc", "reading.gravity=0"])


def test_a_fall_without_end_is_refused():
    with pytest.raises(ConfigError, match=r"loading.fall_time follows a fall, and reading.gravity=0 has none: set it"):
        compose(["loading=falling", "reading.gravity=0"])
    with pytest.raises(ConfigError, match=r"loading.fall_time makes 158,214 frames .* 1,095 s; at most 100,000"):
        compose(["loading=falling", "reading.gravity=1e-4"])
    compose(["loading=falling", "loading.fall_time=null", "reading.gravity=0"])
