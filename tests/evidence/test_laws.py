"""The paper's laws as curves, and how they stand to measured ones."""

import math

import numpy as np
import pandas as pd
import pytest

from snowrepro.composition.compose import compose
from snowrepro.evidence import laws
from snowrepro.reference.snow import VISCOSITY, Law, Source
from snowrepro.run import simulate
from snowrepro.store.run import Run
from tests.conftest import SMALL


@pytest.fixture(scope="module")
def paper():
    """Table 1."""
    return compose().case


def law(value, low=100.0, high=200.0):
    return Law("made up", VISCOSITY, "Pa s", "", low, high, "", Source(""), "", value)


def test_the_modulus_of_table_1(paper):
    """E0 at the start, and exp(9 x 100/700) times more for each 100 kg/m^3."""
    young = laws.youngs_modulus(np.array([100.0, 200.0, 400.0]), paper)
    assert young == pytest.approx([1.4e5, 1.4e5 * math.exp(9 / 7), 1.4e5 * math.exp(27 / 7)])
    assert laws.slope_of_paper(paper) == pytest.approx(9 / 700)


def test_poissons_ratio_in_both_readings(paper):
    """As read it starts at nu_0; as printed above it; 0.5 is passed where the inverse says."""
    start = np.array([100.0])
    assert laws.poissons_ratio(start, paper, as_printed=False) == pytest.approx(0.2)
    assert laws.poissons_ratio(start, paper, as_printed=True) == pytest.approx(0.2 * math.sqrt(20 / 19))
    for as_printed, density in ((False, 417), (True, 404)):
        passed = laws.density_of_ratio(0.5, paper, as_printed)
        assert passed == pytest.approx(density, abs=0.5)
        assert laws.poissons_ratio(np.array([passed]), paper, as_printed) == pytest.approx(0.5)
    assert laws.density_of_ratio(0.95, paper, as_printed=False) == math.inf, "nu_max is 0.87"


def test_the_first_term_of_eq_2_as_a_viscosity(paper):
    assert laws.viscosity(np.array([100.0, 350.0]), paper) == pytest.approx([1 / 7 / 5e-7, 0.5 / 5e-7])
    assert laws.viscosity(np.array([100.0]), compose(["sintering.C1=0"]).case) == math.inf


def test_slopes_end_with_the_laws():
    """A power law's slope is its exponent over density; beside the range there is none."""
    power, steep = law(lambda rho: rho**3), law(lambda rho: np.exp(0.02 * rho), 150.0, 300.0)
    table = pd.DataFrame({"power": power.at(np.arange(100, 301.0)), "steep": steep.at(np.arange(100, 301.0))})
    table.index = np.arange(100, 301.0)
    found = laws.differentiate_laws(table)
    assert found["power"][150.0] == pytest.approx(3 / 150, rel=1e-3)
    assert found["steep"].dropna().index[[0, -1]].tolist() == [150, 300]
    assert found["steep"].dropna().to_numpy() == pytest.approx(0.02)
    assert laws.select_comparable(found).index[[0, -1]].tolist() == [150, 200]


def test_stretches_of_density():
    rows = pd.Series([True, True, False, False, True], index=[100.0, 101.0, 102.0, 103.0, 104.0])
    assert laws.find_spans(rows) == [(100, 101), (104, 104)]
    assert laws.find_spans(~rows) == [(102, 103)]


def test_where_the_papers_slope_is_measured(paper):
    """2.8/rho, the least steep law, falls below 9/700 at 217.8; past 450 only one law is left."""
    assert laws.find_slope_spans(paper) == [(218, 450)]
    assert laws.find_slope_spans(compose(["sintering.C3=-1"]).case) == []


def test_level_is_a_ratio_to_the_papers(paper):
    """Van Herwijnen's 0.93 x 110^2.8 beside the paper's; twice the E_0, half the ratio."""
    ratio = laws.compare_levels(paper)
    own = 0.93 * 110**2.8 / (1.4e5 * math.exp(9 / 70))
    assert ratio[110.0, "van Herwijnen 2016"] == pytest.approx(own)
    assert laws.compare_levels(compose(["material.E=2.8e5"]).case).to_numpy() == pytest.approx(ratio.to_numpy() / 2)


def test_settling_under_a_constant_viscosity():
    """rho = rho_0 exp(stress t / viscosity); out of the law's range there is no time."""
    flat = law(lambda rho: np.full_like(rho, 1e7))
    time, rho = laws.integrate_settling(flat, 500.0, 100.0, 150.0)
    assert (rho[0], rho[-1], time[0]) == pytest.approx((100, 150, 0))
    assert time[-1] == pytest.approx(1e7 / 500 * math.log(1.5), rel=1e-5)
    assert np.isnan(laws.integrate_settling(flat, 500.0, 100.0, 250.0)[0][-1])


def test_particles_follow_the_papers_curves(tmp_path):
    """The solver's moduli are those of the curves, at the density one frame before (Eq. 7: rho_r^n gives E^(n+1))."""
    strong = ["pressure=30000", "sintering.C2=0.1", "loading.frames=20", "output.every=1"]
    run = Run(compose([*SMALL, "experiment=laws", f"store={tmp_path}", *strong]))
    result = simulate(run.config)
    run.save(result, wall_seconds=1.0)
    snow = laws.read_snow(run)
    before = result["density"].sel(snapshot=19).values.astype(float)
    assert before.max() > 150
    assert snow.young == pytest.approx(laws.youngs_modulus(before, run.case), rel=1e-4)
    assert snow.poisson == pytest.approx(laws.poissons_ratio(before, run.case, as_printed=False), rel=1e-4)
    mean_factor = float(result["mean_factor"][20])
    assert abs(np.log(mean_factor)) > 0.1
    assert np.log(snow.factor).mean() == pytest.approx(np.log(mean_factor), rel=1e-3)
    assert snow.density[-1] == pytest.approx(snow.rho.mean(), rel=1e-4)
