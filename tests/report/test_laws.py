"""Law against measurement, from a store."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

from snowrepro.composition.compose import compose
from snowrepro.evidence import laws as paper
from snowrepro.evidence.gather import gather_evidence
from snowrepro.reference.snow import MODULI
from snowrepro.report.document import Fold, Picture, Table
from snowrepro.report.figures import laws
from snowrepro.store.run import Run
from tests.conftest import SMALL


@pytest.fixture
def study(small_run, tmp_path):
    """Findings on one run that is there and one that is not, under further overrides; the report's folder."""
    (tmp_path / "report").mkdir()

    def make(*overrides, stored=True):
        asked = [*SMALL, f"store={tmp_path}/runs", "experiment=laws", *overrides]
        runs = [Run(compose([*asked, f"pressure={pressure}"])) for pressure in (3000, 340)]
        if stored:
            runs[0].save(small_run, wall_seconds=2.0, seconds_per_frame=0.01)
        return laws.report(gather_evidence(runs, tmp_path / "report")), tmp_path / "report", runs[0].case

    return make


def test_pictures_with_their_numbers(study):
    """Every picture and table that is named is there, and each measured law is drawn in its range alone."""
    content, folder, case = study()
    pictures = [block for block in content.blocks if isinstance(block, Picture)]
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
    assert set(cap["Poisson's ratio [1]"]) == {case.reading.poisson_cap}


def test_the_verdict_follows_from_the_laws(study):
    """Slope, level, the place where nu passes 0.5, and the pace of the run that is there."""
    content, folder, case = study()
    pace = pd.read_csv(folder / "pace.csv")
    assert len(pace) == 1 and pace["pressed [s]"][0] == pytest.approx(0.4)
    crocus = 3000 / (7.62237e6 * 0.4 * np.exp(2.3))
    gained = pace["density at release"][0] / 100 - 1
    assert pace["times faster"][0] == pytest.approx(gained / crocus / 0.4, rel=0.05)  # gains little: linear
    factors = paper.compare_levels(case)
    for told in (
        "0.0129 m³/kg, lies within the measured ones from 218 to 450 kg/m³",
        f"measured moduli are {factors.min():.2g} to 130 times",
        "passes 0.5 at 417 kg/m³ (with Eq. 8 as printed: 404)",
        "between 0.09 and 0.19",
        f"densifies {float(pace['times faster'].map('{:.2g}'.format)[0]):,g} times as fast as Crocus",
    ):
        assert told in content.verdict


def test_other_constants_other_verdict(study):
    """A gentler C3, a lower nu_0; and no run at all is told and does no harm."""
    content, folder, _ = study("sintering.C3=-1", "material.nu=0.1", stored=False)
    assert "0.0014 m³/kg, lies within the measured ones nowhere" in content.verdict
    assert "stays below 0.5 up to the largest density" in content.verdict
    assert content.verdict.endswith("no run says how its densification stands to measured snow.")
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
    content, folder, _ = study(stored=False)
    table = next(b for b in content.blocks if isinstance(b, Table) and b.data == "laws.csv").frame
    assert "100 to 350" in table[laws.DENSITY].tolist() and "https://doi.org/10.5194" in table["reference"].str.cat()
    fold = next(block for block in content.blocks if isinstance(block, Fold))
    written = pd.read_csv(folder / "laws.csv")
    assert len(fold.blocks[1].frame) == len(written) == len(table)
    assert written["checked"].notna().all()
