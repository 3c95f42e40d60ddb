"""Positions over time from anywhere: what is read, what is assumed, and what is refused."""

import numpy as np
import pytest
import xarray as xr

from snowrepro.errors import DataError
from snowrepro.summary.classify import classify
from tests.analysis.pictures import ball

X = ball("preview")
HALVES = X + np.where(X[:, :1] > 0, 10.0, 0.0) * [1.0, 0.0]
STATES = np.stack([X, X, HALVES])


def foreign(states: np.ndarray = STATES, **attrs) -> xr.Dataset:
    """As another code might write it."""
    return xr.Dataset({"position": (("step", "atom", "xyz"), states)}, attrs=attrs)


def test_arrays_datasets_and_components_are_the_same():
    """One motion in four spellings."""
    expected = classify(STATES, release=1).last
    assert expected.lumps == 2
    x_and_y = xr.Dataset({name: (("t", "p"), STATES[:, :, d]) for d, name in enumerate("xy")})
    numbered = foreign().assign_coords(step=[10, 20, 30])
    for data, release in ((foreign(), 1), (x_and_y, 1), (numbered, 20)):
        found = classify(data, release=release).last
        np.testing.assert_array_equal(found.label, expected.label)
    assert classify(numbered, release=20).last.frame == 30


def test_what_is_not_said_is_assumed_and_told():
    """Grid spacing from the particles, within a tenth of the true one; equal masses; a cell of four."""
    found = classify(STATES, release=0)
    assert found.motion.grid_spacing == pytest.approx(2.0, rel=0.1)
    assert [line.split(":")[0] for line in found.assumed] == ["mass", "grid spacing", "cell", "mass of a cell"]
    told = classify(foreign(release_frame=0, grid_spacing=2.0, cell=2.0, cell_mass=100.0), mass=25.0)
    assert told.assumed == []
    assert told.motion.grid_spacing == 2.0


def test_stored_velocities_win():
    """Where the data has velocities, they are those of the fragments."""
    data = foreign(release_frame=0)
    data["velocity"] = (data["position"].dims, np.broadcast_to([7.0, -1.0], STATES.shape))
    assert classify(data).table()["velocity_x"].to_numpy() == pytest.approx(7.0)


def test_velocities_by_differences_are_of_second_order():
    """Exact for a thrown body, but for the first and last state."""
    time = np.array([0.0, 0.1, 0.2, 0.3])
    fall = np.stack([X + np.array([3.0 * t, -5.0 * t**2]) for t in time])
    data = foreign(fall, release_frame=0).assign_coords(step=("step", time))
    found = classify(data, frames=[1, 2]).table()
    np.testing.assert_allclose(found["velocity_x"], 3.0)
    np.testing.assert_allclose(found["velocity_y"], [-1.0, -2.0])


def test_particles_that_vanish_are_neither_lumps_nor_powder():
    """A third class, by mass; their bonds are broken from then on."""
    states = STATES[[0, 0, 0]].copy()
    gone = X[:, 1] > 10
    states[2, gone] = np.nan
    mass = np.where(gone, 2.0, 1.0)
    for definition in ("bonds", "proximity", "grid", "damage"):
        found = classify(states, release=0, mass=mass, definition=definition)
        assert found.last.vanished == pytest.approx(mass[gone].sum() / mass.sum(), rel=1e-12)
        assert found.lump_fraction == pytest.approx(1 - found.last.vanished, abs=0.01)
        assert found.last.powder_fraction == pytest.approx(0.0, abs=0.01)
        table = found.table()
        assert table["particles"].sum() == (~gone).sum()
        assert table["extent_y"].notna().all()
    assert found.broken["stretch"].iloc[-1] > 0.05


def test_a_heavy_particle_that_vanishes_is_no_lump():
    """Alone it would have the mass of one."""
    states = STATES[[0, 0]].copy()
    states[1, 7] = np.nan
    mass = np.where(np.arange(len(X)) == 7, 0.2 * len(X), 1.0)
    found = classify(states, release=0, mass=mass, definition="bonds", lump_cells=0.0).last
    assert found.lumps == 1
    assert found.lump_fraction + found.vanished == pytest.approx(1.0)
    assert found.vanished == pytest.approx(mass[7] / mass.sum())


def test_one_particle_and_few():
    """One is a fragment, without bonds; three on a line are bonded along it."""
    alone = classify(np.zeros((2, 1, 2)), release=0)
    assert alone.last.mass.tolist() == [1.0]
    assert alone.last.largest == 1.0
    line = np.stack([np.arange(3.0), np.zeros(3)], axis=1)
    assert len(classify(np.stack([line, line]), release=0, grid_spacing=1.0).last.mass) == 1
    apart = line * [3.0, 1.0]
    assert len(classify(np.stack([line, apart]), release=0, grid_spacing=1.0).last.mass) == 3


def bad(change) -> np.ndarray:
    states = STATES.copy()
    change(states)
    return states


def set_to(index, value):
    return lambda states: states.__setitem__(index, value)


@pytest.mark.parametrize(
    ("data", "arguments", "message"),
    [
        (foreign(), {}, "does not say when the snow was released.*--release"),
        (foreign(release_frame=7), {}, "release in frame 7 is not stored: stored are 3 frames from 0 to 2"),
        (bad(set_to((0, 5, 0), np.nan)), {"release": 0}, "1 particles have no place.*particle 5"),
        (bad(set_to((1, 5), np.nan)), {"release": 0}, "particle 5 has no place .NaN. in frame 1 and one in frame 2"),
        (bad(set_to((2, 3, 1), np.inf)), {"release": 0}, "particle 3 is at infinity in frame 2"),
        (bad(set_to(2, np.nan)), {"release": 0}, "all particles have vanished"),
        (STATES[0], {"release": 0}, "must have shape"),
        (np.zeros((3, 0, 2)), {"release": 0}, "must have dimensions"),
        (np.zeros((3, 5, 4)), {"release": 0}, "axis of 2 or 3"),
        (np.zeros((3, 50, 2)), {"release": 0}, "most particles are at one place"),
        (xr.Dataset({"density": ("p", [1.0])}), {"release": 0}, "there are no positions.*density"),
        (STATES, {"release": 0, "mass": -1.0}, "masses must be positive"),
        (STATES, {"release": 0, "mass": np.ones(3)}, "one number or one a particle"),
        (STATES, {"release": 0, "grid_spacing": 0.0}, "grid_spacing must be positive"),
        ([["a"]], {"release": 0}, "must be numbers"),
        (foreign().assign_coords(step=[3, 2, 1]), {"release": 2}, "must rise"),
    ],
)
def test_what_cannot_be_classified_is_refused(data, arguments, message):
    """Each with what is wrong and where."""
    with pytest.raises(DataError, match=message):
        classify(data, **arguments)
