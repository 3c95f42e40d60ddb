"""Law against measurement, from a store."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

from snowrepro.analysis import laws as paper
from snowrepro.composition import compose
from snowrepro.reference.snow import MODULI
from snowrepro.report import laws
from snowrepro.report.document import Fold, Picture, Table
from snowrepro.report.evidence import gathered
from snowrepro.simulation import simulate
from snowrepro.store import runs
from tests.conftest import SMALL


@pytest.fixture
def study(small_run, tmp_path):
    """Findings on one run that is there and one that is not, under further overrides; the report's folder."""
    (tmp_path / "report").mkdir()

    def make(*overrides, stored=True):
        asked = [*SMALL, f"store={tmp_path}/runs", "experiment=laws", *overrides]
        configs = [compose([*asked, f"pressure={pressure}"]) for pressure in (3000, 340)]
        if stored:
            runs.save(small_run, configs[0], wall_seconds=2.0, seconds_per_frame=0.01)
        return laws.report(gathered(configs, tmp_path / "report")), tmp_path / "report", configs[0]

    return make


def test_pictures_with_their_numbers(study):
    """Every picture and table that is named is there, and each measured law is drawn in its range alone."""
    findings, folder, config = study()
    pictures = [block for block in findings.blocks if isinstance(block, Picture)]
    assert [p.file for p in pictures] == ["young.png", "poisson.png", "densification.png", "viscosity.png"]
    for picture in pictures:
        assert imread(folder / picture.file).std() > 0.01 and picture.alt and picture.source
    drawn = {picture.file: pd.read_csv(folder / picture.data) for picture in pictures}
    young = drawn["young.png"].set_index("curve")
    for law in MODULI:
        points = young.loc[law.name]
        assert (points[laws.DENSITY].min(), points[laws.DENSITY].max()) == (law.low, law.high)
        assert points["Young's modulus [Pa]"].to_numpy() == pytest.approx(law.at(points[laws.DENSITY]), rel=1e-4)
    cap = drawn["poisson.png"].set_index("curve").loc["cap of the runs, 0.45"]
    assert set(cap["Poisson's ratio [1]"]) == {config.reading.poisson_cap}


def test_particles_follow_the_papers_curves(tmp_path):
    """The solver's moduli are those of the curves, at the density one frame before (Eq. 7: rho_r^n gives E^(n+1))."""
    strong = ["pressure=30000", "sintering.C2=0.1", "loading.frames=20", "output.every=1"]
    config = compose([*SMALL, "experiment=laws", f"store={tmp_path}", *strong])
    result = simulate(config)
    runs.save(result, config, wall_seconds=1.0)
    snow = laws.snow_of(config)
    before = result["density"].sel(snapshot=19).values.astype(float)
    assert before.max() > 150
    assert snow.young == pytest.approx(paper.youngs_modulus(before, config), rel=1e-4)
    assert snow.poisson == pytest.approx(paper.poissons_ratio(before, config, as_printed=False), rel=1e-4)
    mean_factor = float(result["mean_factor"][20])
    assert abs(np.log(mean_factor)) > 0.1
    assert np.log(snow.factor).mean() == pytest.approx(np.log(mean_factor), rel=1e-3)
    assert snow.density[-1] == pytest.approx(snow.rho.mean(), rel=1e-4)


def test_the_verdict_follows_from_the_laws(study):
    """Slope, level, the place where nu passes 0.5, and the pace of the run that is there."""
    findings, folder, config = study()
    pace = pd.read_csv(folder / "pace.csv")
    assert len(pace) == 1 and pace["pressed [s]"][0] == pytest.approx(0.4)
    crocus = 3000 / (7.62237e6 * 0.4 * np.exp(2.3))
    gained = pace["density at release"][0] / 100 - 1
    assert pace["times faster"][0] == pytest.approx(gained / crocus / 0.4, rel=0.05)  # gains little: linear
    factors = paper.level(config)
    for told in (
        "0.0129 m³/kg, lies within the measured ones from 218 to 450 kg/m³",
        f"measured moduli are {factors.min():.2g} to 130 times",
        "passes 0.5 at 417 kg/m³ (with Eq. 8 as printed: 404)",
        "between 0.09 and 0.19",
        f"densifies {float(pace['times faster'].map('{:.2g}'.format)[0]):,g} times as fast as Crocus",
    ):
        assert told in findings.verdict


def test_other_constants_other_verdict(study):
    """A gentler C3, a lower nu_0; and no run at all is told and does no harm."""
    findings, folder, _ = study("sintering.C3=-1", "material.nu=0.1", stored=False)
    assert "0.0014 m³/kg, lies within the measured ones nowhere" in findings.verdict
    assert "stays below 0.5 up to the largest density" in findings.verdict
    assert findings.verdict.endswith("no run says how its densification stands to measured snow.")
    assert not (folder / "densification.png").exists() and (folder / "viscosity.png").exists()


def test_units_and_what_is_not_known_are_said(study):
    """The reading decides the units; lumps were measured by nobody."""
    text = " ".join(block for block in study()[0].blocks if isinstance(block, str))
    assert "Reading `grid_units`" in text and "read as Pa" in text
    assert "No measured fraction of lumps" in text
    si = " ".join(b for b in study("reading=si", stored=False)[0].blocks if isinstance(b, str))
    assert "lengths in m, so E, stresses and pressures are in Pa" in si


def test_each_law_is_cited(study):
    """A row a law with range and reference; how far it was checked stands behind the fold and in the file."""
    findings, folder, _ = study(stored=False)
    table = next(b for b in findings.blocks if isinstance(b, Table) and b.data == "laws.csv").frame
    assert "100 to 350" in table[laws.DENSITY].tolist() and "https://doi.org/10.5194" in table["reference"].str.cat()
    fold = next(block for block in findings.blocks if isinstance(block, Fold))
    written = pd.read_csv(folder / "laws.csv")
    assert len(fold.blocks[1].frame) == len(written) == len(table)
    assert written["checked"].notna().all()
