"""What other definitions of a lump make of the same numbers."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from snowrepro.analysis.lumps import make_bond_variables
from snowrepro.composition.compose import compose
from snowrepro.evidence.sensitivity import CHOICES, scan_other_definitions
from snowrepro.report.sections import specification as sensitivity
from snowrepro.store.run import Run
from snowrepro.summary.classify import classify
from tests.conftest import SMALL
from tests.report.reports import reported


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([0.1, 0.3, 0.8], True),
        ([0.9, 0.1, 0.6, 0.7], True),  # 0.1, 0.6, 0.7
        ([0.1, 0.8, 0.3, 0.2], False),  # nothing rises twice to above one half
        ([0.6, 0.7, 0.8], False),
        ([0.1, 0.2, 0.3], False),
        ([0.1, 0.6, 0.6], False),
    ],
)
def test_three_pressures_that_would_do(values, expected):
    """By hand."""
    assert sensitivity._has_rising_three(np.array([values]))[0] == expected


def test_exceptions_are_single_changes():
    """Only definitions one choice away from the one used are named, with what they lose."""
    nothing = dict.fromkeys(CHOICES, np.nan) | {"break_by": "", "lump_mass": 0.01}
    strain = {**nothing, "definition": "strain", "strain_radius": 2.5, "part_stretch": 1.5, "half_change": 0.35}
    bonds = {**nothing, "definition": "bonds", "break_by": "both", "break_strain": 0.3, "link_length": 1.5}
    rows = [strain, {**strain, "half_change": 0.45}, {**strain, "half_change": 0.45, "strain_radius": 1.5}]
    rows += [{**bonds, "core_fraction": core} for core in (0.3333, 0.5)] + [{**nothing, "definition": "grid"}]
    choices = pd.DataFrame(rows)
    holds = pd.DataFrame({"C1": [True, True, False, True, False, False], "C2": [True, False, False, False, True, True]})
    analysis = compose().question.analysis
    by_bonds = analysis.model_copy(update={"definition": "bonds"})
    assert [sensitivity.find_usual(choices, one) for one in (analysis, by_bonds)] == [0, 3]
    told = sensitivity.list_exceptions(choices, holds, analysis)
    assert told[1].splitlines() == ["- half change of volume 0.45: C2", "- the rule bonds: C2", "- the rule grid: C1"]
    assert sensitivity.list_exceptions(choices, holds, by_bonds)[1].splitlines()[0] == "- core rule 0.5: C1"


def test_rules_are_counted_apart():
    """How many settings each has, and which is the one used; each is as wide in the picture."""
    choices = pd.DataFrame({"definition": ["strain"] * 3 + ["bonds"] * 8 + ["grid", "damage"]})
    told = sensitivity.describe_rules(choices, compose().question.analysis)
    assert told.startswith("4 rules") and "strain (3, the rule used here), bonds (8), grid (1), damage (1)" in told
    places, groups = sensitivity._place_settings(choices, np.arange(13.0)[::-1])
    assert {name: len(rows) for name, rows in groups.items()} == {"strain": 3, "bonds": 8, "other rules": 2}
    assert places[:3].tolist() == pytest.approx([5 / 6, 1 / 2, 1 / 6])
    assert 1 < places[3:11].min() < places[3:11].max() < 2 < places[11:].min()


def test_what_has_vanished_is_in_no_lump_by_any_rule():
    """A square of which the right quarter has vanished: the rest is one lump by proximity, grid and damage."""
    line = np.arange(12.0)
    square = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    rest = np.where(square[:, :1] < 9, square, np.nan)
    found = classify(np.stack([square, rest]), release=0, grid_spacing=1.0, definition="bonds", particle_id="none")
    bonds = xr.Dataset(make_bond_variables(found.state.bonds, found.state.history, ""))
    table = scan_other_definitions(found.motion, bonds, found.analysis)
    lumps = table[table["link_length"].isna() | (table["link_length"] >= 1.0)].set_index("definition")["lump_fraction"]
    assert {*lumps.index} == {"proximity", "grid", "damage"}
    assert lumps.loc[["proximity", "grid"]].to_numpy() == pytest.approx(0.75)
    assert lumps.max() <= 0.75


@pytest.mark.nightly
def test_the_scan_in_the_report(small_run, tmp_path):
    """The same result at two pressures and in both arms: nothing grows under any definition, and all is written."""
    of_all = [*SMALL, f"store={tmp_path}/runs", f"reports={tmp_path}/reports", "experiment=fig5"]
    of_all.append("experiment.frames=[0,20,60]")
    runs = [
        Run(compose([*of_all, f"sintering={name}", f"pressure={p}"]))
        for name in ("paper", "none")
        for p in (2000, 3000)
    ]
    for run in runs:
        run.save(small_run, wall_seconds=2.0, seconds_per_frame=0.01)
    report = reported(runs, ["experiment=fig5"])
    table = pd.read_csv(report.evidence.folder / "sensitivity.csv")
    assert table["definition"].value_counts().to_dict() == {
        "bonds": 864, "strain": 100, "proximity": 12, "damage": 12, "grid": 4,
    }  # fmt: skip
    assert not table[["C1", "C5"]].to_numpy().any()
    assert (table["C2"] != table["C3"]).mean() > 0.99
    assert (table["C2"] == table["C4"]).all()
    assert (table["sintered 2000"] == table["unsintered 3000"]).all()
    assert table["sintered 2000"].nunique() > 10
    page = (report.evidence.folder / "index.md").read_text()
    assert "| bonds | all |  | 864 | 0 % |" in page and "| strain | all |  | 100 | 0 % |" in page
    assert "5 rules" in page and "strain (100, the rule used here)" in page
    curves = pd.read_csv(report.evidence.folder / "strains.csv", index_col="half_change")
    assert (curves.diff().dropna() >= -1e-9).all(axis=None) and curves.iloc[0].max() < curves.iloc[-1].min()
    assert {"specification.png", "strains.png"} <= {path.name for path in report.evidence.folder.iterdir()}


def test_claims_on_another_measure_are_not_scanned(small_run, tmp_path):
    """Claims of which none is about the mass in lumps: the report says so in place of the scan."""
    own = "claims.list=[{name: K, statement: s, paper: p, measure: powder_fraction, test: below, threshold: 0.5}]"
    of_all = [*SMALL, f"store={tmp_path}/runs", f"reports={tmp_path}/reports", "experiment=fig5", own]
    of_all.append("experiment.frames=[0,20,60]")
    runs = [Run(compose([*of_all, f"pressure={pressure}"])) for pressure in (2000, 3000)]
    for run in runs:
        run.save(small_run, wall_seconds=2.0, seconds_per_frame=0.01)
    page = (reported(runs, ["experiment=fig5"]).evidence.folder / "index.md").read_text()
    assert "Not scanned: no claim is about the mass in lumps of these runs." in page
