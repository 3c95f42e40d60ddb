"""The paper's equations by themselves: numbers worked out by hand and by the solver, and the page on them."""

import math
import re
import shlex

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

from snowrepro.composition.compose import compose
from snowrepro.evidence import laws
from snowrepro.evidence.audit import PLANE_STRAINS, audit_model
from snowrepro.mpm.point import sinter_once
from snowrepro.point import follow_path, make_path
from snowrepro.report.document import Picture, Table, walk_blocks
from snowrepro.report.figures.audit import ITEMS
from snowrepro.sweep.plan import make_plan
from tests import command_line
from tests.report.reports import reported

PRESSURES = (300.0, 740.0, 5900.0)
P_WAVE = 1.4e5 * 0.8 / (1.2 * 0.6)  # lambda + 2 mu of Table 1


@pytest.fixture(scope="module")
def numbers():
    """Of each finding, with Table 1."""
    return {name: finding.numbers for name, finding in audit_model(compose().case, PRESSURES).items()}


def test_poissons_ratio(numbers):
    """nu_max^2 is 0.04 x 19 by Eq. 7's denominator and 0.04 x 20 as printed; nu = 0.5 at 0.75 / (nu_max^2 + 0.5)."""
    assert numbers["start"]["start"] == pytest.approx(0.2 * math.sqrt(20 / 19))
    found = numbers["lambda"]
    assert (found["density"], found["density_printed"]) == pytest.approx((525 / 1.26, 525 / 1.3))
    assert (found["largest"], found["largest_printed"]) == pytest.approx((math.sqrt(0.76), math.sqrt(0.8)))


def test_density_has_no_bound(numbers):
    """Eq. 2's first term adds C1 sigma rho_max in a second, at any density; a stress is density length^2 / time^2."""
    found = numbers["density"]
    assert (found["seconds"], found["longest"]) == pytest.approx((600 / (5e-7 * 5900 * 700), 600 / (5e-7 * 300 * 700)))
    assert found["stress"] == pytest.approx(600 / (5e-7 * 700 * 2))
    assert (found["cell"], found["C1_in_SI"]) == pytest.approx((0.02, 5e-7 / 0.02**2))
    line = audit_model(compose().case, PRESSURES)["density"].lines["5900"]
    assert line[1].max() > 1000, "goes on beyond rho_max"


def test_hardening_counts_updates(numbers):
    """0.74 for each update under 740: 33, 50 and 100 in a second; by time steps as waves cross 0.4 of a cell."""
    found = numbers["updates"]
    assert (found["long"], found["own"], found["short"]) == pytest.approx((5 + 0.74 * 33, 42, 79))
    soft, capped = (math.ceil(0.02 * math.sqrt(f * P_WAVE / 100) / 0.4) for f in (1, math.exp(5)))
    assert (found["substeps"], found["capped_substeps"]) == (50 * soft, 50 * capped) == (100, 1250)
    assert (found["substep"], found["capped"]) == pytest.approx((5 + 0.74 * 100, 5 + 0.74 * 1250))


def test_energy_is_put_in(numbers):
    """E grows by exp(9/7) for each 100 kg/m^3; at 300 nu is sqrt(0.76 / 5), at 400 it would be above the cap."""
    found = numbers["energy"]
    assert [found[f"E_{n}"] for n in (2, 3, 4)] == pytest.approx([math.exp(9 * n / 7) for n in (1, 2, 3)])

    def held(nu):
        return (1 - nu) / ((1 + nu) * (1 - 2 * nu))

    def all_sides(nu):
        return 1 / ((1 + nu) * (1 - 2 * nu))

    nu = math.sqrt(0.76 / 5)
    assert found["held_3"] == pytest.approx(math.exp(18 / 7) * held(nu) / held(0.2))
    assert found["all_sides_3"] == pytest.approx(math.exp(18 / 7) * all_sides(nu) / all_sides(0.2))
    assert found["all_sides_4"] == pytest.approx(math.exp(27 / 7) * all_sides(0.45) / all_sides(0.2))


def test_the_cap(numbers):
    """After 100 updates xi is 35 under 300 and 595 under 5900; the exponent passes 5 at J_P = 1 - 5 / xi."""
    found = numbers["cap"]
    assert (found["J_P_low"], found["J_P_high"]) == pytest.approx((1 - 5 / 35, 1 - 5 / 595))
    assert (found["factor_low"], found["factor_high"]) == pytest.approx((math.exp(3.5), math.exp(59.5)))
    assert (found["factor_first"], found["cap"]) == pytest.approx((math.exp(0.5), math.exp(5)))


def test_units(numbers):
    """0.01 kg at 100 kg/m^3 is a quarter of (0.02 m)^2; 10 cells/s^2 is 10 / (9.8 x 0.02) times the gravity of SI."""
    found = numbers["units"]
    assert (found["volume"], found["cell"]) == pytest.approx((1e-4, 0.02))
    assert found["times"] == pytest.approx(10 / (9.8 * 0.02))
    assert found["si"] == pytest.approx(100 * 9.8 * 0.02 * found["size"] / 1.4e5)


def test_planes(numbers):
    """From all sides the ratio is 1 - 2 nu; sideways held the stresses are 1 and k = nu / (1 - nu)."""
    found = numbers["plane"]
    assert (found["all_sides_first"], found["all_sides_last"]) == pytest.approx((0.6, 0.1))
    for place, k in (("first", 0.2 / 0.8), ("last", 0.45 / 0.55)):
        assert found[f"held_{place}"] == pytest.approx((1 - k) / math.sqrt(1 - k + k**2))


def test_constants_that_do_nothing():
    """Without C1, C4 and xi, and with forces that are none or huge: what is never reached is infinite."""
    case = compose(["sintering.C1=0", "sintering.C4=0", "material.xi=0", "material.nu=0.1"]).case
    found = audit_model(case, (0.0, 1e12))
    assert found["density"].numbers["seconds"] == found["lambda"].numbers["density"] == math.inf
    assert found["cap"].numbers["J_P_high"] == -math.inf and found["cap"].numbers["factor_high"] == 1
    assert audit_model(compose().case, (0.0, 1e12))["cap"].numbers["factor_high"] == math.inf


def test_the_laws_are_the_solvers(taichi):
    """One update of the solver, at several densities and stresses: the same growth of density and of xi."""
    case = compose().case
    rho, sigma = np.array([100.0, 250.0, 400.0]), np.array([300.0, 5e3, 1e5])
    new_rho, _, _, xi = sinter_once(case, rho, sigma, np.zeros(3))
    after, before = (
        [float(laws.densification_time(each, stress, case)) for each, stress in zip(rhos, sigma, strict=True)]
        for rhos in (new_rho, rho)
    )
    assert np.subtract(after, before) == pytest.approx(case.loading.frame_time, rel=1e-6)
    assert xi == pytest.approx([float(laws.hardening_coefficient(stress, 1, case)) for stress in sigma])


@pytest.mark.parametrize(("path", "label"), [("compression", "sideways held"), ("isotropic", "from all sides")])
def test_stress_and_energy_are_the_solvers(path, label):
    """At small strains, in both readings of the plane."""
    size = 1e-5
    for plane in ("strain", "stress_zz_zero"):
        case = compose([f"reading.plane={plane}"]).case
        strain = tuple(size * part for part in PLANE_STRAINS[label])
        mu, lam = laws.lame_parameters(np.array(case.material.E), np.array(case.material.nu))
        run = follow_path(case, make_path(path, size, 2)).isel(step=-1)
        stress = laws.von_mises_stress(strain, mu, lam, plane_strain=plane == "strain")
        assert float(run.von_mises) == pytest.approx(float(stress), rel=1e-3)
        assert float(run.elastic_energy) == pytest.approx(float(laws.elastic_energy(strain, mu, lam)), rel=1e-3)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The page as it is written, its folder and its blocks."""
    folder = tmp_path_factory.mktemp("audit")
    plan = make_plan(["experiment=audit", f"store={folder}/runs", f"reports={folder}"], multirun=False)
    report = reported(plan.runs, plan.overrides)
    return report.evidence.folder, list(walk_blocks(report.content.blocks))


def list_rows(folder):
    """The rows of the page's table, as cells."""
    lines = [line for line in (folder / "index.md").read_text().splitlines() if re.match(r"\| \d\. ", line)]
    return [line.strip("| ").split(" | ") for line in lines]


def test_each_place_has_a_number_a_panel_and_a_command(page):
    """Eight, in one table and one picture; nothing was run for it."""
    folder, blocks = page
    rows = list_rows(folder)
    assert [row[0] for row in rows] == [f"{number}. {item.title}" for number, item in enumerate(ITEMS, 1)]
    assert len(rows) == 8 and {len(row) for row in rows} == {4}
    for row in rows:
        assert len(re.findall(r"\*\*\d[\d.]*", row[2])) == 1, f"one number stands out: {row[2]}"
        assert re.fullmatch(r"(readings|ablation|energy): [^`]+\..* `snowrepro run experiment=\1[^`]*`", row[3])
        assert "reading." not in row[3], "a variant is told in words"
    table, picture = (next(block for block in blocks if isinstance(block, kind)) for kind in (Table, Picture))
    numbers, drawn = (pd.read_csv(folder / block.data) for block in (table, picture))
    places = [item.finding for item in ITEMS]
    assert list(dict.fromkeys(numbers["place"])) == list(dict.fromkeys(drawn["place"])) == places
    assert not (folder.parent / "runs").exists()
    first_line = np.array([0x00, 0x72, 0xB2]) / 255
    for file, columns in ((picture.file, 2), (picture.narrow, 1)):
        is_drawn = np.abs(imread(folder / file)[..., :3] - first_line).max(axis=-1) < 0.05
        rows_of_panels = np.array_split(is_drawn, 8 // columns)
        panels = [panel for row in rows_of_panels for panel in np.array_split(row, columns, axis=1)]
        assert len(panels) == 8 and min(panel.sum() for panel in panels) > 100


@pytest.mark.slow
def test_each_command_can_be_planned(page, tmp_path):
    """As the page has it: Figure 5 as it is, and each variant that is named."""
    for row in list_rows(page[0]):
        program, verb, *words = shlex.split(re.search(r"`([^`]+)`$", row[3])[1])
        assert (program, verb) == ("snowrepro", "run")
        done = command_line.run("plan", *words, cwd=tmp_path)
        assert done.returncode == 0 and re.match(r"\d+ runs, 0 of them done", done.stdout), done.stderr
