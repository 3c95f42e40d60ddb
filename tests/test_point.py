"""One point led along paths: what comes back, and how the command says it."""

import numpy as np
import pandas as pd
import pytest

from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.point import CYCLES, PATHS, Path, follow_path


@pytest.mark.parametrize("name", PATHS)
def test_a_path_starts_at_rest_and_keeps_its_books(name):
    """Energy gained = work + plastic flow + hardening, but for the steps; the strain is what was asked for."""
    run = follow_path(compose(["material=cam_clay"]).case, Path(name, 0.05, 300))
    assert run.sizes == {"step": 301}
    assert float(abs(run.pressure[0])) == float(run.work[0]) == 0
    assert float(run.strain.max()) == pytest.approx(0.05)
    rest = run.elastic_energy - run.work - run.plastic_work - run.hardening_work
    assert float(abs(rest).max()) < 0.02 * float(abs(run.work).max())
    assert float(run.J_P[-1]) != 1
    assert run.pressure.attrs == {"long_name": "mean pressure in the plane", "units": "kg cell-1 s-2"}


def test_cycles_go_there_and_back():
    strains = Path("cycles", 0.1, 60).strains
    assert strains[0] == strains[-1] == pytest.approx(0, abs=1e-15)
    turns = np.diff(np.sign(np.diff(strains))) != 0
    assert turns.sum() == 2 * CYCLES - 1


def test_a_law_s_own_state_is_in_the_table():
    run = follow_path(compose(["material=sand"]).case, Path("extension", 0.01, 20))
    assert float(run.gap[-1]) > 0 and float(run.broken[-1]) > 0
    assert run.gap.attrs["long_name"] == "logarithm of the volume gained by coming apart"


@pytest.mark.parametrize(
    ("path", "message"),
    [(("spiral",), "there is no path 'spiral'; there are: compression"), (("shear", -1.0), "a strain above 0"),
     (("shear", 0.1, 0), "1 to 100,000 steps")],
)  # fmt: skip
def test_a_wrong_path_is_refused(path, message):
    with pytest.raises(ConfigError, match=message):
        Path(*path)


@pytest.mark.slow
def test_the_command_writes_a_table_and_a_picture(snowrepro, tmp_path):
    done = snowrepro("point", "material=sand", "path=shear", "steps=20", "--out", "sand.svg")
    assert done.returncode == 0, done.stderr
    assert len(pd.read_csv(tmp_path / "sand.csv")) == 21
    assert (tmp_path / "sand.svg").stat().st_size > 1000
    refused = snowrepro("point", "strain=much")
    assert refused.returncode == 2 and "strain is a number" in refused.stderr
