"""Hardness, flattening and rebound from runs that are made by hand, and from small ones that are simulated."""

import numpy as np
import pytest

from snowrepro.analysis.hardness import (
    cut_curve,
    find_quantiles,
    measure_chord,
    measure_hardness,
    measure_height,
    measure_impact,
    measure_work,
)
from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.mpm.indenter import find_place
from snowrepro.run import simulate
from snowrepro.scene.build import build_scene
from snowrepro.store.run import Run
from snowrepro.summary.measure import measure_test
from tests.conftest import QUICK
from tests.validation.test_restart import assert_same_bits


def test_quantiles_are_of_mass():
    """Half of the mass, not of the particles, lies below the median."""
    assert find_quantiles(np.array([1.0, 2.0, 3.0]), np.ones(3), [0.5]) == [2.0]
    assert find_quantiles(np.array([3.0, 1.0, 2.0]), np.array([6.0, 1.0, 1.0]), [0.5]) > 2.5
    even = np.arange(1001) / 1000
    np.testing.assert_allclose(find_quantiles(even, np.ones(1001), (0.05, 0.95)), [0.05, 0.95], atol=1e-3)


def columns_of_snow(heights: list[float]) -> np.ndarray:
    """Places along the upward axis of a column of so much height in each state."""
    return np.array(heights)[:, None] * np.linspace(0, 1, 501)


def fall(heights: list[float], speeds: list[float]) -> dict[str, float]:
    """What a column of such heights and speeds upward since its release comes to."""
    measured = np.array([measure_height(column, np.ones(501)) for column in columns_of_snow(heights)])
    return measure_impact(measured, np.array(speeds))


def test_flattening_and_rebound_by_hand():
    """From 10 high at release to 4 at most and 5 at the end; down at 8, back up at 2."""
    found = fall([10, 9, 4, 5], [0, -8, -3, 2])
    assert found["flattening_most"] == pytest.approx(0.6)
    assert found["flattening_end"] == pytest.approx(0.5)
    assert found["rebound"] == pytest.approx(0.25)


def test_what_stays_down_does_not_rebound():
    """Nor does what never fell."""
    assert fall([10, 4], [0, -8])["rebound"] == 0.0
    assert np.isnan(fall([10, 10], [0, 0])["rebound"])


def test_a_grain_that_flies_changes_no_height():
    places = columns_of_snow([10, 10])
    places[1, 7] = 500.0
    heights = [measure_height(column, np.ones(501)) for column in places]
    assert heights[1] == pytest.approx(heights[0], rel=0.01)


def test_the_chord_of_a_disc():
    """Pythagoras; nothing above the touch, the diameter at the middle."""
    np.testing.assert_allclose(measure_chord(np.array([-1.0, 0.0, 2.0, 5.0]), 5.0), [0, 0, 8, 10])


def test_hardness_of_a_known_curve():
    """Force = 3 x chord x depth: hardness is three times the depth, about, and the work its integral."""
    way = np.arange(-100, 401) * 0.01
    middle = way - 0.005
    before = np.full(5, np.nan)
    forces = 3 * measure_chord(middle, 8.0) * middle
    depth, force = cut_curve(np.concatenate([before, way]), np.concatenate([0 * before, forces]))
    np.testing.assert_allclose(depth, middle)
    np.testing.assert_array_equal(force, forces)
    assert measure_hardness(depth, force, 4.0, 8.0, 1.0) == pytest.approx(3 * 3.8, rel=1e-3)
    assert measure_hardness(depth, force, 1.0, 8.0, 1.0) == pytest.approx(3 * 0.95, rel=1e-3)
    x = np.linspace(0, 4, 100001)
    work = float((3 * measure_chord(x, 8.0) * x).mean() * 4)
    assert measure_work(depth, force) == pytest.approx(work, rel=5e-3)


def test_an_indented_run_is_the_falling_one_up_to_release(indented_run, small_run):
    """The same bits in frames 0 to 20; then no gravity, rest, and a disc that arrives."""
    for name in small_run.data_vars:
        if "snapshot" in small_run[name].dims:
            one, other = (run[name].sel(snapshot=slice(0, 20)) for run in (indented_run, small_run))
        elif "frame" in small_run[name].dims:
            one, other = indented_run[name][:21], small_run[name][:21]
        np.testing.assert_array_equal(one.values, other.values, err_msg=name)
    assert (indented_run.gravity_work == 0).all()
    assert float(indented_run.kinetic_energy[30]) < 0.2 * float(indented_run.kinetic_energy[20])
    assert np.isnan(indented_run.indenter_depth[:31]).all() and np.isfinite(indented_run.indenter_depth[31:]).all()
    assert (indented_run.indenter_force[:31] == 0).all()
    assert indented_run.indenter_force.attrs["units"] == "kg cell s-2"
    assert indented_run.snapshot.values.tolist() == [0, 4, 8, 12, 16, 20, 40, 60, 80, 100, 118]
    assert indented_run.sizes["frame"] == compose(QUICK).case.frames + 1 == 119
    last = indented_run.position.sel(snapshot=118).values - indented_run.position.sel(snapshot=40).values
    held = (
        indented_run.position.sel(snapshot=40, axis="y") < indented_run.position.sel(snapshot=40, axis="y").mean() - 5.0
    )
    assert np.abs(last[held.values]).max() < 1e-5  # in the vice
    assert np.abs(last).max() > 1.0


@pytest.mark.nightly
def test_going_on_in_mid_indentation(indented_run):
    """While it rests, before and behind the first move of the disc, in mid-test: the same bits."""
    config, saved = compose(QUICK), {}
    whole = simulate(config, lambda progress: saved.update({progress.frame: progress.checkpoint()}))
    assert_same_bits(whole, indented_run)
    for frame in (25, 30, 31, 77):
        assert_same_bits(simulate(config, resume=saved[frame]), whole)


@pytest.mark.nightly
def test_threads_and_a_stop_change_no_bit_in_fixed_point():
    """The disc's force too is summed in one order."""
    config, saved = compose([*QUICK, "solver.summation=fixed_point"]), {}
    whole = simulate(config, lambda progress: saved.update({progress.frame: progress.checkpoint()}))
    two = compose([*QUICK, "solver.summation=fixed_point", "threads=2"])
    assert_same_bits(simulate(two), whole)
    assert_same_bits(simulate(two, resume=saved[77]), whole)


@pytest.mark.parametrize("transfer", ["pic_flip", "mls"])
def test_every_transfer_can_be_indented(transfer, indented_run):
    """The disc meets resistance of the same order."""
    other = simulate(compose([*QUICK, f"solver.transfer={transfer}"]))
    ratio = measure_test(other)["hardness"] / measure_test(indented_run)["hardness"]
    assert 0.5 < ratio < 2.0


def test_metres_are_cells(indented_run):
    """In SI the depth is in metres; the disc moves as many cells."""
    config = compose([*QUICK, "reading=si", "loading.press_frames=2", "indenter.rest_frames=2"])
    run = simulate(config)
    assert run.indenter_depth.attrs["units"] == "m"
    assert float(run.indenter_depth[-1]) == pytest.approx(3.0 * 0.02, abs=4.0 * 0.02 * 0.02)


def test_a_run_without_indenter_is_named_as_before():
    """No key in its config, the id that stored runs have; the frames of a fall do not name a hardness test."""

    def id_of(*overrides: str) -> str:
        return Run(compose(["pressure=340", *overrides])).id

    config = compose(["pressure=340"])
    assert "indenter" not in config.settings() and "indenter" not in config.record()
    assert id_of() == "ball-L-340-paper-paper-0-223db3ff65"
    assert id_of("indenter=none") == id_of()
    test = id_of("indenter=disc")
    assert test.startswith("ball-L-340-paper-paper-0-disc-")
    assert id_of("indenter=disc", "loading.frames=700") == test
    assert id_of("indenter=disc", "indenter.speed=0.1") != test


def test_frames_follow_from_the_way():
    """100 pressed, 200 at rest, two grid spacings and 4 cells at 0.2 cells/s in frames of 0.02 s."""
    case = compose(["indenter=disc"]).case
    assert (case.frames, case.frames_before_test) == (100 + 200 + 1500, 300)
    assert [f for f in range(1801) if case.is_stored(f)] == [*range(0, 101, 4), *range(150, 1801, 50)]
    assert (case.gravity_in(101), case.damping_in(300), case.damping_in(301)) == (0.0, 5.0, 0.0)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["indenter.depth=9"], r"depth \(9\) must not exceed the disc's radius \(8\)"),
        (["indenter.speed=1e-5"], r"makes a test of .* frames; at most 100,000 are allowed"),
        (["indenter.speed=0"], "indenter.speed: should be greater than 0"),
        (["indenter.dept=3"], "there is no setting 'indenter.dept'; did you mean 'indenter.depth'"),
        (["indenter.radius=40", "indenter.depth=30"], r"indenter.depth \(30 cells\) is more than shape 'ball' has"),
        (
            ["indenter.radius=3", "indenter.depth=2", "fidelity=preview"],
            r"indenter.radius .* at least two grid spacings",
        ),
    ],
)
def test_tests_that_cannot_be_made_are_refused(overrides, message):
    with pytest.raises(ConfigError, match=message):
        build_scene(compose(["indenter=disc", *overrides]).case)


def test_a_body_that_pressing_made_too_small_is_refused():
    """Known only at release: the disc would come down to the vice."""
    case = compose(["indenter=disc"]).case
    grid = np.stack(np.meshgrid(np.arange(0, 20, 0.5), np.arange(0, 11, 0.5)), axis=-1).reshape(-1, 2)
    with pytest.raises(ConfigError, match=r"indenter.depth \(4 cells\) reaches the vice: 5.25 cells"):
        find_place(case, grid)
    tall = find_place(case, grid * [1, 2])
    assert (tall.x, tall.vice) == pytest.approx((9.75, 10.5))
    assert tall.touch == pytest.approx(21.0, abs=0.01)
