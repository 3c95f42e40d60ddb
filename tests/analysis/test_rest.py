"""When the snow counts as at rest: on built motions, and in a run, which then ends."""

import numpy as np
import pytest

from snowrepro.analysis.clusters import group_particles
from snowrepro.analysis.rest import is_at_rest
from snowrepro.composition.compose import compose
from snowrepro.run import simulate
from snowrepro.settings.loading import Rest
from snowrepro.summary.row import summarise
from tests.conftest import SMALL
from tests.validation.test_restart import assert_same_bits

FRAMES = 10
REST = Rest(seconds=0.2, energy=1e-3, distance=0.5, strain=0.01, part=0.002)
CORNERS = np.stack(np.meshgrid(np.arange(30), np.arange(30)), axis=-1).reshape(-1, 2) + 0.5  # of 900 clusters
QUIET = [1.0] * 5 + [1e-4] * 40


def judge(energies: list[float], motion: np.ndarray) -> bool:
    """Whether clusters are at rest that went a ``motion`` (t, 900, 2) from where they began."""
    clusters = group_particles(CORNERS, np.ones(len(CORNERS)), 1.0)
    return is_at_rest(energies, [clusters.position + step for step in motion], clusters, REST, FRAMES, 1.0)


def still(frames: int = 45) -> np.ndarray:
    return np.zeros((frames, len(CORNERS), 2))


def test_snow_that_lies_still_is_at_rest():
    assert judge(QUIET, still())


@pytest.mark.parametrize("frames", [1, 2, FRAMES])
def test_it_has_to_lie_still_for_as_long_as_asked(frames):
    assert not judge([1.0] + [1e-4] * (frames - 1), still(frames))
    assert not judge([*QUIET[:-3], 2e-3, *QUIET[-2:]], still()), "one frame within moves"


def test_falling_snow_is_never_at_rest():
    """Each frame has the largest energy so far, and a body at the top of its way goes on falling."""
    fall = still() - np.linspace(0.0, 1.0, 45)[:, None, None] ** 2 * [0.0, 30.0]
    assert not judge(list(np.linspace(0.0, 1.0, 45) ** 2), fall)
    assert not judge(QUIET, fall)


def test_without_any_motion_there_is_no_rest():
    """Snow that has not begun to fall has no largest energy that it could have lost."""
    assert not judge([0.0] * 45, still())


@pytest.mark.parametrize(("moving", "at_rest"), [(1, True), (2, False)])
def test_rubble_that_rolls_is_waited_for(moving, at_rest):
    """Two of a thousand clusters may move; here one is less than that, and two are more."""
    rolls = still()
    rolls[:, :moving, 0] = -np.linspace(0.0, 8.0, 45)[:, None]
    assert judge(QUIET, rolls) == at_rest


@pytest.mark.parametrize(("rate", "at_rest"), [(0.0005, True), (0.002, False)])
def test_snow_that_slowly_sinks_is_waited_for(rate, at_rest):
    """No cluster moves by half a cell, but neighbours come nearer: by 0.5 and 2 % in the time."""
    sinks = still()
    sinks[:, :, 1] = -np.minimum(np.arange(45)[:, None] * rate, 1.0) * np.minimum(CORNERS[:, 1], 15.0)
    assert judge(QUIET, sinks) == at_rest


@pytest.fixture(scope="module")
def ended():
    """A small run that comes to rest before its last frame, and its checkpoint by frame."""
    saved = {}
    config = compose([*SMALL, "loading.frames=240", "pressure=500", "loading.rest.seconds=0.3"])
    run = simulate(config, lambda now: saved.update({now.frame: (now.frames, now.checkpoint())}))
    return config, run, saved


def test_a_run_ends_at_rest_and_keeps_its_end(ended):
    config, run, saved = ended
    end = int(run["frame"][-1])
    assert 60 < end < config.case.frames
    assert int(run["snapshot"][-1]) == int(run["tracked"][-1]) == end
    assert saved[end][0] == end and saved[end - 1][0] == config.case.frames, "the bar reaches its end"
    assert summarise(run)["end_frame"] == end


def test_until_then_it_is_the_run_that_goes_on(ended):
    """The rule decides when to stop, and nothing else; what comes after it is little."""
    config, run, _ = ended
    whole = simulate(compose([*SMALL, "loading.frames=240", "pressure=500", "loading=whole"]))
    assert whole.sizes["frame"] == config.case.frames + 1
    both = np.intersect1d(run["snapshot"], whole["snapshot"])
    assert_same_bits(
        run.isel(tracked=slice(-1)).sel(snapshot=both)[["position", "velocity", "cluster_position"]],
        whole.isel(tracked=slice(run.sizes["tracked"] - 1)).sel(snapshot=both)[
            ["position", "velocity", "cluster_position"]
        ],
    )
    early, late = summarise(run), summarise(whole)
    for name in ("lump_fraction", "crushed_fraction", "loose_fraction", "flattening_end"):
        assert early[name] == pytest.approx(late[name], abs=0.01), name


def test_going_on_from_its_last_frame_adds_nothing(ended):
    """As a run does that was killed between its last frame and its result."""
    config, run, saved = ended
    for frame in (int(run["frame"][-1]), int(run["frame"][-1]) - 1):
        assert_same_bits(simulate(config, resume=saved[frame][1]), run)
