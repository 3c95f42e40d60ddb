"""One point led along paths: what comes back, and how the command says it."""

from argparse import Namespace
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from snowrepro.cli.verbs import point as verb
from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.laws.quantity import Quantity
from snowrepro.laws.sand import SandMaterial
from snowrepro.mpm.state import SHAPES, Particles
from snowrepro.point import CYCLES, PATHS, TAKEN, follow_path, make_path, make_points, read_path


@pytest.mark.parametrize("name", PATHS)
def test_a_path_starts_at_rest_and_keeps_its_books(name):
    """Energy gained = work + plastic flow + hardening, but for the steps; the strain is what was asked for."""
    run = follow_path(compose(["material=cam_clay"]).case, make_path(name, 0.05, 300))
    assert run.sizes == {"step": 301}
    assert float(abs(run.pressure[0])) == float(run.work[0]) == 0
    assert float(run.strain.max()) == pytest.approx(0.05)
    rest = run.elastic_energy - run.work - run.plastic_work - run.hardening_work
    assert float(abs(rest).max()) < 0.02 * float(abs(run.work).max())
    assert float(run.J_P[-1]) != 1
    assert run.pressure.attrs == {"long_name": "mean pressure in the plane", "units": "kg cell-1 s-2"}


def test_cycles_go_there_and_back():
    strains = make_path("cycles", 0.1, 60).strains
    assert strains[0] == strains[-1] == pytest.approx(0, abs=1e-15)
    turns = np.diff(np.sign(np.diff(strains))) != 0
    assert turns.sum() == 2 * CYCLES - 1


def test_a_law_s_own_state_is_in_the_table():
    run = follow_path(compose(["material=sand"]).case, make_path("extension", 0.01, 20))
    assert float(run.gap[-1]) > 0 and float(run.broken[-1]) > 0
    assert run.gap.attrs["long_name"] == "logarithm of the volume gained by coming apart"


@pytest.mark.parametrize(
    ("path", "message"),
    [(("spiral",), "there is no path 'spiral'; there are: compression"), (("shear", -1.0), "a strain above 0"),
     (("shear", 0.1, 0), "1 to 100,000 steps")],
)  # fmt: skip
def test_a_wrong_path_is_refused(path, message):
    with pytest.raises(ConfigError, match=message):
        make_path(*path)


def test_a_table_of_strains_is_followed(tmp_path):
    """Compression and back, in a table, is the path that has a name; in two directions the corners are met."""
    file = tmp_path / "there.csv"
    file.write_text("xx, yy, xy\n0, 0, 0\n0, -0.05, 0\n")
    case = compose(["material=cam_clay"]).case
    tabled, named = (follow_path(case, path) for path in (read_path(file, 100), make_path("compression", 0.05, 100)))
    np.testing.assert_allclose(tabled.tau_yy, named.tau_yy, rtol=1e-9)
    np.testing.assert_allclose(tabled.strain, named.strain, rtol=1e-9)
    file.write_text("yy,xx,xy,note\n1,1,0,start\n1,0.98,0,a\n0.97,0.98,0.01,b\n0.97,0.98,0.01,stays\n")
    run = follow_path(case, read_path(file, 50))
    last = run.isel(step=-1)
    assert [float(last[f"strain_{name}"]) for name in ("xx", "yy", "xy")] == pytest.approx([-0.02, -0.03, 0.01])
    assert float(last.strain) == pytest.approx(0.02 + np.sqrt(0.03**2 + 2 * 0.01**2)) and last.attrs["path"] == "there"
    corner = run.isel(step=int(abs(run.strain - 0.02).argmin()))
    assert float(corner.strain_xx) == pytest.approx(-0.02) and float(corner.strain_yy) == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [("", "cannot be read"), ("xx,yy\n0,0\n1,0\n", "xy 0 times"),
     ("xx,yy,xy,yy\n0,0,0,0\n1,0,0,1\n", "yy 2 times"), ("xx,yy,xy\n0,0,0,9\n1,0,0,9\n", "row 1 has 4 values, for 3"),
     ("xx,yy,xy\n0,0,0\n1,0\n", "row 2 has 2 values"), ("xx,yy,xy\n0,0,0\n", "it has 1 rows"),
     ("xx,yy,xy\n0,0,0\n0,much,0\n", "row 2 has something else"), ("xx,yy,xy\n0,0,0\n0,inf,0\n", "row 2"),
     ("xx,yy,xy\n0,0,0\n0,0,0\n", "from row to row by 0"), ("xx,yy,xy\n0,0,0\n0,9,0\n", "more than 5"),
     ("xx,yy,xy\n0,0,0\n0,9,0\n0,9,0\n", "more than 5")],
)  # fmt: skip
def test_a_wrong_table_is_refused(text, message, tmp_path):
    file = tmp_path / "strains.csv"
    file.write_text(text)
    with pytest.raises(ConfigError, match=message) as error:
        read_path(file)
    assert str(file) in str(error.value)


def keep(monkeypatch, *state) -> None:
    """Have sand keep these quantities."""
    monkeypatch.setattr(SandMaterial, "STATE", state)


LIKE = Quantity("", (), "own", "1")


@pytest.mark.parametrize(
    "name", ["tau", "strain", "work", "shear", "count", "write", "step", "seconds", "indenter_force"]
)
def test_a_law_keeps_nothing_under_a_name_that_is_taken(monkeypatch, name):
    keep(monkeypatch, replace(LIKE, name=name))
    with pytest.raises(ConfigError, match=f"material law 'sand': STATE has names that are taken: {name}"):
        follow_path(compose(["material=sand"]).case, make_path())


@pytest.mark.parametrize(
    ("state", "message"),
    [
        (("gap",), "no Quantity: 'gap'"),
        ((replace(LIKE, name="my gap"),), "no words of letters, digits and _: my gap"),
        ((replace(LIKE, name="gap"), replace(LIKE, name="gap")), "names twice: gap"),
        ((replace(LIKE, name="back", shape=(2, 2)),), "no scalars: back"),
    ],
)
def test_a_wrong_state_is_refused(monkeypatch, state, message):
    keep(monkeypatch, *state)
    with pytest.raises(ConfigError, match=message):
        follow_path(compose(["material=sand"]).case, make_path())


def test_all_names_that_there_are_are_taken(taichi, small_run, indented_run):
    assert {*vars(Particles(1)), *dir(Particles)} <= {*TAKEN, *(name for name in dir(Particles) if name[0] == "_")}
    for run in (small_run, indented_run):
        assert {*run.variables, *run.dims} <= TAKEN
    assert {*follow_path(compose([]).case, make_path(steps=1)).variables} <= TAKEN


def test_a_first_value_may_use_the_scene(monkeypatch, taichi):
    """Points are a square of snow, undeformed, of one unit of volume each."""
    first = lambda scene, material: scene.depth + material.rho * scene.volume
    keep(monkeypatch, replace(LIKE, name="deep", first=first), SandMaterial.STATE[1])
    case = compose(["material=sand"]).case
    points = make_points(case, 9)
    assert (points.read("deep") - case.material.rho).tolist() == [0.5, 0.5, 0.5, 0.5, 1.5, 0.5, 0.5, 0.5, 0.5]
    assert set(points.read("mass")) == {case.material.rho} and set(points.read("volume")) == {1}
    assert {*points.particles.shapes} == {*SHAPES, "deep", "broken"}


@pytest.mark.parametrize(
    ("asked", "instead", "message"),
    [
        (["path=shear", "steps=3"], "check", "--check has no path: leave out path, steps"),
        (["path=shear"], "map", "--map has no path: leave out path$"),
        (["path=MINE.CSV", "strain=0.1"], "", "path=MINE.CSV has its own strains"),
    ],
)
def test_what_a_path_is_not_asked_for_is_refused(asked, instead, message):
    options = Namespace(overrides=asked, check=instead == "check", map=instead == "map", out=None)
    with pytest.raises(ConfigError, match=message):
        verb.execute(options)


@pytest.mark.slow
def test_the_command_writes_a_table_and_a_picture(snowrepro, tmp_path):
    done = snowrepro("point", "material=sand", "path=shear", "steps=20", "--out", "sand.svg")
    assert done.returncode == 0, done.stderr
    assert len(pd.read_csv(tmp_path / "sand.csv")) == 21
    assert (tmp_path / "sand.svg").stat().st_size > 1000
    (tmp_path / "mine.csv").write_text("xx,yy,xy\n0,0,0\n-0.01,0,0\n-0.01,-0.02,0\n")
    assert snowrepro("point", "path=mine.csv", "steps=30", "--out", "mine.png").returncode == 2  # would be overwritten
    done = snowrepro("point", "path=mine.csv", "steps=30", "--out", "followed.png")
    assert done.returncode == 0, done.stderr
    assert len(pd.read_csv(tmp_path / "followed.csv")) == 31
    refused = snowrepro("point", "path=mine.csv", "strain=0.1")
    assert refused.returncode == 2 and "leave out strain=" in refused.stderr
    refused = snowrepro("point", "strain=much")
    assert refused.returncode == 2 and "strain is a number" in refused.stderr
