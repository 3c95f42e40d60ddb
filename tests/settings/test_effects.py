"""Every setting of a case has an effect: another value gives the solver other inputs, or it is said what else it does.

What is compared: the constants of the kernels; the scene; the first values of particles; and what each frame gets:
gravity, damping, force, the indenter's place, and whether it is stored.
"""

import dataclasses
from collections.abc import Iterator
from functools import reduce
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

from snowrepro.composition.compose import compose
from snowrepro.errors import Diverged
from snowrepro.mpm import indenter, solver
from snowrepro.mpm.constants import make_constants
from snowrepro.mpm.frame import check_volume
from snowrepro.mpm.state import PARTICLE_STATE
from snowrepro.scene.build import build_scene
from snowrepro.settings.case import Case
from snowrepro.store.identity import run_id

BASE = (
    "fidelity=preview", "fidelity.dx=3", "pressure=3000", "loading.press_frames=4", "loading.frames=8",
    "indenter=disc", "floor.width=220", "floor.drop_x=60", "reading.press_ramp=2", "reading.press=shell",
)  # fmt: skip
# Another value of each setting, and what must show it: of the constants the number itself stands in the second place.
CHANGES: dict[str, tuple[Any, str]] = {
    "shape.outline.radius": (20.0, "scene"),
    "floor.width": (230.0, "scene"),
    "floor.drop_x": (66.0, "scene"),
    "pressure": (3100.0, "force"),
    "sintering.rho_max": (650.0, "rho_max"),
    "sintering.C1": (6e-7, "C1"),
    "sintering.C2": (2e-3, "C2"),
    "sintering.C3": (-8.0, "C3"),
    "sintering.C4": (2e-3, "C4"),
    "sintering.C5": (3e-3, "C5"),
    "material.rho": (110.0, "first"),
    "material.E": (1.5e5, "E_max"),
    "material.nu": (0.25, "nu_max"),
    "material.xi": (6.0, "first"),
    "material.theta_c": (0.02, "lowest_stretch"),
    "material.theta_s": (0.01, "highest_stretch"),
    "loading.press_frames": (5, "gravity"),
    "loading.frame_time": (0.03, "frame_time"),
    "reading.cell": (0.5, "dx"),
    "reading.drop_height": (50.0, "scene"),
    "reading.press": ("two_sides", "force"),
    "reading.press_ramp": (3, "force"),
    "reading.press_damping": (2.0, "damping"),
    "reading.external_force": ("per_particle", "force_weight"),
    "reading.cadence": ("substep", "every_substep"),
    "reading.hardening_growth": ("per_time", "hardening_per_time"),
    "reading.density_changes": ("moduli_and_volume", "volume_follows_density"),
    "reading.poisson_denominator": ("as_printed", "nu_max"),
    "reading.poisson_cap": (0.3, "poisson_cap"),
    "reading.plane": ("stress_zz_zero", "plane_strain"),
    "reading.hardening_exponent": ((-9.0, 4.0), "hardening_exponent"),
    "reading.plastic_volume": ((0.2, 8.0), "plastic_volume"),
    "reading.softening_length": (6.0, "softening"),
    "reading.contact": ("penalty", "springs"),
    "reading.friction": (0.7, "friction"),
    "reading.inside_floor": ("left", "moves_out"),
    "fidelity.dx": (2.5, "dx"),
    "fidelity.particles_per_cell": (5, "scene"),
    "solver.transfer": ("pic_flip", "transfer"),
    "solver.flip": (0.9, "flip"),
    "solver.summation": ("atomic", "summation"),
    "solver.spline": ("quadratic", "spline"),
    "solver.cfl": (0.3, "cfl"),
    "solver.max_substeps": (19999, "max_substeps"),
    "solver.precision": ("f32", "touch"),
    "seed": (7, "scene"),
    "output.every": (3, "stored"),
    "indenter.radius": (9.0, "place"),
    "indenter.depth": (3.0, "frames"),
    "indenter.speed": (0.9, "depth"),
    "indenter.friction": (0.6, "indenter_friction"),
    "indenter.rest_frames": (150, "frames"),
    "indenter.rest_damping": (9.0, "damping"),
    "indenter.every": (7, "stored"),
}
# What shows only in a run or without an indenter, and where that is tested.
ELSEWHERE = {
    "shape.outline.kind": "a polygon has other settings than a circle: tests/scene",
    "shape.outline.centre": "of no effect by itself: the snow is put over drop_x; with more rings in tests/scene",
    "shape.outline.points": "of polygons: tests/scene and tests/test_options.py",
    "shape.outline.rings": "tests/scene/test_rings.py",
    "floor.outline.kind": "as of the shape",
    "floor.outline.centre": "of circles: tests/scene",
    "floor.outline.radius": "of circles: tests/scene",
    "floor.outline.points": "tests/scene and tests/test_options.py",
    "floor.outline.rings": "tests/scene/test_rings.py",
    "sintering.enabled": "a run: tests/mpm/test_readings.py, sintering off",
    "material.mass": "by reading.external_force=per_particle alone: below",
    **dict.fromkeys(
        [f"loading.rest.{name}" for name in ("seconds", "energy", "distance", "strain", "part")],
        "an indented run takes none: tests/analysis/test_rest.py",
    ),
    "loading.frames": "an indented run takes its own: below",
    "loading.fall_time": "likewise: tests/settings/test_loading.py",
    "reading.length_unit": "the name of the unit of results: tests/mpm/test_readings.py, SI",
    "reading.gravity": "an indented run has none: below",
    "reading.unsintered": "a run: tests/mpm/test_readings.py",
    "reading.release": "a run: tests/mpm/test_readings.py",
    "reading.initial_volume": "a run: tests/mpm/test_readings.py",
    "solver.pic_rate": "of transfer=pic_flip: below",
    "solver.device": "tests/mpm/test_choices.py and test_device.py",
    "solver.max_bounded": "ends a run: below",
    "output.cluster_size": "the track of clusters: tests/analysis",
}
# Settings that act where another one has a certain value.
TOGETHER = {
    "material.mass": (("reading.external_force=per_particle", "material.mass=0.02"), "force_weight", 0.02),
    "solver.pic_rate": (("solver.transfer=pic_flip", "solver.pic_rate=3"), "pic_rate", 3.0),
}


def list_settings(section: BaseModel, under: str = "") -> Iterator[str]:
    """The names of all settings of a case, but for the names of its sections."""
    for name in type(section).model_fields:
        value = getattr(section, name)
        if isinstance(value, BaseModel):
            yield from list_settings(value, f"{under}{name}.")
        elif name != "name":
            yield f"{under}{name}"


def write(value: Any) -> str:
    """A value as an override has it."""
    return str(list(value)) if isinstance(value, tuple) else str(value)


def find_inputs(case: Case) -> dict[str, Any]:
    """All that the solver gets of a case, by name."""
    scene = build_scene(case)
    place = indenter.find_place(case, scene.positions)
    numbers = range(1, case.frames + 1)
    pressed = range(1, case.loading.press_frames + 1)
    constants = vars(make_constants(case))
    return {
        **constants,
        **vars(constants["material"]),
        **vars(constants["sintering"]),
        "scene": [np.asarray(value).tolist() for value in dataclasses.astuple(scene)],
        "frames": case.frames,
        "gravity": [case.is_tested(frame) or frame <= case.loading.press_frames for frame in numbers],
        "damping": [case.damping_in(frame) for frame in numbers],
        "force": [solver.make_pressing_force(case, scene, scene.positions, frame).tolist() for frame in pressed],
        "stored": [case.is_stored(frame) for frame in numbers],
        "depth": [indenter.depth_at(case, frame) for frame in numbers if case.is_tested(frame)],
        "place": dataclasses.astuple(place),
        "first": [np.asarray(quantity.first(scene, case.material)).tolist() for quantity in PARTICLE_STATE],
    }


@pytest.fixture(scope="module")
def base() -> dict[str, Any]:
    return find_inputs(compose(BASE).case)


def test_every_setting_is_followed():
    """None is forgotten, none is named that is not there, and none twice."""
    names = set(list_settings(compose(BASE).case))
    assert names == CHANGES.keys() | ELSEWHERE.keys()
    assert not CHANGES.keys() & ELSEWHERE.keys()
    assert TOGETHER.keys() <= ELSEWHERE.keys()


@pytest.mark.parametrize("name", CHANGES)
def test_a_setting_reaches_the_solver(base, name):
    """Another value shows in the input that it is meant for, and where that is the value itself, as it was set."""
    value, shown = CHANGES[name]
    case = compose([*BASE, f"{name}={write(value)}"]).case
    assert reduce(getattr, name.split("."), case) == value
    inputs = find_inputs(case)
    assert inputs[shown] != base[shown]
    if shown == name.rpartition(".")[2] and shown in vars(make_constants(case)):
        assert inputs[shown] == value or name.endswith("dx")
    assert run_id(case) != run_id(compose(BASE).case)


@pytest.mark.parametrize("name", TOGETHER)
def test_a_setting_acts_beside_another(name):
    overrides, shown, value = TOGETHER[name]
    assert getattr(make_constants(compose([*BASE, *overrides]).case), shown) == value


def test_what_an_indented_run_does_not_take():
    """Gravity, and the number of frames of a fall."""
    fall = [word for word in BASE if not word.startswith("indenter")]
    case = compose([*fall, "reading.gravity=20", "loading.frames=9"]).case
    assert [case.gravity_in(frame) for frame in range(1, case.frames + 1)] == [0.0] * 4 + [20.0] * 5


class Crushed:
    """Particles of which three in a hundred are at the lowest J_P."""

    def read(self, name: str) -> np.ndarray:
        return np.where(np.arange(100) < 3, 0.1, 1.0)


def test_how_many_may_be_crushed():
    """More than solver.max_bounded end the run."""
    with pytest.raises(Diverged, match=r"3% of the particles are crushed to the lowest J_P, 0\.1"):
        check_volume(Crushed().read, compose(["solver.max_bounded=0.02"]).case, 9)
    check_volume(Crushed().read, compose(["solver.max_bounded=0.04"]).case, 9)


@pytest.mark.parametrize(("name", "value"), [("softening_length", 2.0), ("contact", "penalty")])
def test_what_was_added_later_leaves_ids_as_they_were(name, value):
    """At its default a setting is not in the text that the id is made of; at another value it is."""
    plain, other = compose().case, compose([f"reading.{name}={value}"]).case
    assert run_id(plain) != run_id(other)
    assert "softening_length" not in plain.model_dump_json()
    assert "pic_rate" not in plain.model_dump_json()
