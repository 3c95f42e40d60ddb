"""What would take too much is refused at once, with the number and the bound, before anything of it is there."""

import resource
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.scene.build import build_scene, check_size
from snowrepro.sweep.plan import make_plan

NUMBERS = [
    "material.rho", "material.E", "material.nu", "material.mass", "material.xi", "pressure", "reading.cell",
    "reading.gravity", "reading.drop_height", "reading.press_damping", "reading.friction", "reading.press_ramp",
    "fidelity.dx", "fidelity.particles_per_cell", "solver.cfl", "solver.max_substeps", "loading.frames",
    "loading.press_frames", "loading.frame_time", "output.every", "floor.width", "floor.drop_x", "sintering.rho_max",
    "sintering.C1", "sintering.C2", "sintering.C3", "sintering.C4", "sintering.C5", "seed", "shape.outline.radius",
]  # fmt: skip


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["fidelity.dx=1e-6"], r"fidelity.dx: should be greater than or equal to 0.01 .got 1e-06"),
        (["fidelity.dx=4"], r"fidelity.dx: should be less than or equal to 3 .got 4"),
        (["fidelity.dx=0.01"], r"this would have 81,\d{3},\d{3} particles of shape 'ball', at most 2,000,000"),
        (["shape.outline.radius=4000"], r"201,061,930 particles of shape 'ball', at most 2,000,000"),
        (["floor.width=10000", "fidelity.dx=0.1"], r"136,101,361 grid nodes around floor 'L', at most 4,000,000"),
        (["reading.drop_height=1e20"], r"grid nodes around floor 'L', at most 4,000,000"),
        (["loading.frames=1000000000000000"], r"loading.frames: should be less than or equal to 100000"),
        (["loading.frames=100000", "output.every=1"], "52,169,060,039 bytes of stored states, at most 8,000"),
        (["solver.cfl=1e-12"], r"^a frame needs 788,\d{3},\d{3},\d{3} substeps or more, solver.max_substeps allows"),
        (["material.E=1e9", "material.nu=0.4999999"], r"a frame needs 204,124 substeps or more"),
        (["material.E=1e300"], r"material: E: a number other than 0 must be 1e-30 to 1e\+30 in size .got 1e\+300"),
        (["reading.cell=1e-200"], r"reading: cell: a number other than 0 must be 1e-30 to 1e\+30"),
        (["output.every=1" + 400 * "0"], r"output: every: a number other than 0"),
    ],
    ids=lambda value: value[0][:30] if isinstance(value, list) else "",
)  # fmt: skip
def test_what_takes_too_much_is_refused_at_once(overrides, message):
    began, memory = time.monotonic(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(ConfigError, match=message):
        check_size(compose(overrides).case)
    with pytest.raises(ConfigError, match=message):
        build_scene(compose(overrides).case)
    assert time.monotonic() - began < 10
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory < 200_000  # kB


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["seed=range(0,100000000)"], r"'seed=range\(0,100000000\)' names 100,000,000 runs, at most 100,000"),
        (["seed=shuffle(range(0,100000000))"], "names 100,000,000 runs"),
        (["pressure=range(0,1e9,1e-9)"], "names 1,000,000,000,000,000,000 runs"),
        (["pressure=range(0,10,0)"], "names inf runs"),
        (["seed=range(0,1" + 400 * "0" + ")"], "names inf runs"),
        (["seed=range(0,5,1" + 400 * "0" + ")"], "names inf runs"),
        (["pressure=range(0,nan)"], "names nan runs"),
        (["seed=range(0,1000)", "pressure=range(1,1000)"], "this names 999,000 runs, at most 100,000 are allowed"),
    ],
)
def test_a_sweep_of_too_many_runs_is_refused_at_once(overrides, message):
    began = time.monotonic()
    with pytest.raises(ConfigError, match=message):
        make_plan(overrides, multirun=True)
    assert time.monotonic() - began < 10


@settings(deadline=None, max_examples=20, derandomize=True)
@given(st.sampled_from(NUMBERS), st.floats() | st.integers(-(10**400), 10**400) | st.sampled_from([0, 1e-300, 5e-324]))
def test_any_number_is_allowed_or_refused_in_one_line(key, value):
    """Whatever it is: never another error, and nothing that takes long."""
    began = time.monotonic()
    try:
        check_size(compose([f"{key}={value}"]).case)
    except ConfigError as error:
        assert str(error).count("\n") == 0
    assert time.monotonic() - began < 10
