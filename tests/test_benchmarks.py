"""The benchmarks run, and their peers compute what snowrepro does; how fast they are, is not tested."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

DX = 2.0  # cells: some 2,000 particles
ROUND_OFF = 1e-11  # of positions, in cells; the peers' exp is another


@pytest.mark.parametrize("spline", ["quadratic", "cubic"])
def test_numba_kernel_computes_the_same(spline):
    """Frames with impact and plastic flow: same substeps, positions and plastic volumes."""
    pytest.importorskip("numba")
    from peers.numba_kernel import NumbaSolver
    from snow import GRAVITY, start_snow

    start = start_snow("ball_on_L", spline, DX)
    run = NumbaSolver(start, spline)
    first = start.particles["position"]
    substeps = 0
    for _ in range(6):
        expected = start.advance()
        assert run.advance_frame(GRAVITY) == expected
        substeps += expected
    assert substeps > 50
    assert (np.abs(start.read("J_P") - 1.0) > 1e-3).any(), "the snow must flow"
    assert np.abs(start.read("position") - first).max() > DX
    np.testing.assert_allclose(run.particles.position, start.read("position"), rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(run.particles.J_P, start.read("J_P"), rtol=0, atol=ROUND_OFF)


@pytest.mark.parametrize("spline", ["quadratic", "cubic"])
def test_warp_computes_the_same(spline):
    """Its time step is fixed, so the frames are short enough that snowrepro takes one substep each too."""
    warp = pytest.importorskip("warp")
    from peers.warp_mpm import WarpSolver
    from snow import GRAVITY, start_snow

    start = start_snow("ball_on_L", spline, DX, frame_time=4e-4)
    run = WarpSolver(start, spline, warp.float64)
    for _ in range(150):
        assert start.advance() == 1
        run.advance_frame(GRAVITY, substeps=1)
    assert (np.abs(start.read("J_P") - 1.0) > 1e-3).any(), "the snow must flow"
    for name in ("position", "velocity", "affine"):
        np.testing.assert_allclose(run.read(name), start.read(name), rtol=0, atol=ROUND_OFF)


@pytest.mark.nightly
@pytest.mark.parametrize("code", ["snowrepro", "numba", "warp", "mpm99"])
def test_a_case_runs_in_a_process(code):
    """For a moment, two at once."""
    from cases import BenchmarkCase, measure_together

    case = BenchmarkCase(code, in_full=code == "snowrepro", warm_up=1, updates=0.1)
    if not case.is_installed:
        pytest.skip(f"{code} is not installed")
    assert all(measured.rate > 0 and measured.megabytes > 0 for measured in measure_together([case, case]))


def test_the_largest_case_of_the_table_of_sizes_is_no_larger_than_is_allowed():
    """A million particles: nothing of them is built here."""
    import speed
    from snow import _compose_case

    from snowrepro.scene.build import check_size

    finest = min(case.dx for case in speed.SIZES)
    check_size(_compose_case("ball_on_L", "cubic", finest, 1.0, None))


@pytest.mark.nightly
def test_the_sweeps_are_measured():
    """In small."""
    script = Path(__file__).parents[1] / "benchmarks" / "sweeps.py"
    done = subprocess.run([sys.executable, script, "--quick"], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert "`snowrepro plan` of 168 runs, 20 of them finished" in done.stdout
    assert "4 preview runs, one worker: a run beyond the solver" in done.stdout


@pytest.mark.parametrize(
    ("name", "most"),
    [("flat", 0.0), ("flat first step", 0.11), ("a middle that falls by one sd", 0.02)],
)
def test_what_does_not_rise_is_rarely_called_a_rise(name, most):
    """Three seeds, five pressures: by alpha at most, and three sigmas of 150 draws; more than nothing where it may."""
    from claims import NULLS, measure_rates

    null = next(null for null in NULLS if null.name == name)
    reproduced, _ = measure_rates(null, 5, 3, 150)
    assert reproduced <= most
    assert reproduced > 0 or most < 0.1


def test_sides_keep_alpha_and_scenes_of_a_shape_are_one_toss():
    """At the threshold; four tosses agree once in sixteen, however many scenes they are."""
    from claims import NULLS, measure_rates, measure_rates_of_scenes

    for null in NULLS:
        if null.name == "one pressure at the threshold" and not null.skewed:
            assert 0 < measure_rates(null, 3, 3, 150)[0] <= 0.11
    assert 0.02 < measure_rates_of_scenes(4, 7, 0.8, 300)[0] < 0.11
    assert measure_rates_of_scenes(3, 7, 0.8, 50) == (0.0, 0.0)


@pytest.mark.nightly
def test_each_phase_of_a_start_is_timed(tmp_path):
    """Clocks are on all functions that they should be on, and what they count is about all of the time."""
    from phases import FIRST_FRAME, PHASES, REST

    words = ["run", "fidelity=preview", "loading.press_frames=4", "loading.frames=8", "output.every=4"]
    subprocess.run([sys.executable, BENCHMARKS / "phases.py", "phases.json", *words], cwd=tmp_path, check=True)
    seconds = json.loads((tmp_path / "phases.json").read_text())
    first = seconds.pop(FIRST_FRAME)
    assert 0 < first < sum(seconds.values())
    assert all(seconds[name] > 0.005 for name in PHASES[:-1]), "but for the end of the process"
    assert seconds[REST] < 0.1 * sum(seconds.values())
