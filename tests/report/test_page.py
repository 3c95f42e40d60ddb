"""The report of an experiment from a store."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Text

from snowrepro.composition.compose import compose
from snowrepro.evidence.claims import JudgedScene
from snowrepro.evidence.gather import Evidence
from snowrepro.evidence.hardness import pair_falls_with_tests
from snowrepro.report.document import Table
from snowrepro.report.drawing.common import DPI, LEAST_LETTERS, PAGE
from snowrepro.report.drawing.states import CRUSHED, LOOSE, LUMPS, colour_fragments
from snowrepro.report.figures import convergence, grid
from snowrepro.report.page.lead import list_changed_settings
from snowrepro.report.page.markdown import FIRST_FOLDED, MOST_FOLDED
from snowrepro.run import simulate
from snowrepro.settings.case import ARMS
from snowrepro.settings.question import Experiment
from snowrepro.store.run import Run
from snowrepro.summary.row import ARM
from snowrepro.sweep.plan import make_plan
from tests.analysis.pictures import ball, classified
from tests.configs import carrying, changed
from tests.conftest import QUICK, SMALL
from tests.report.reports import reported

PAGES = {"index.html", "index.md", "report.json"}


@pytest.fixture
def stored(small_run, small_config, tmp_path):
    """A store with one of the two runs of a small experiment; returns both."""
    folders = [
        f"store={tmp_path}/runs",
        f"reports={tmp_path}/reports",
        "experiment=fig5",
        "experiment.frames=[0,20,60]",
    ]
    runs = [Run(compose([*SMALL, *folders, f"sintering={name}", "pressure=3000"])) for name in ("paper", "none")]
    runs[0].save(small_run, wall_seconds=2.0, seconds_per_frame=0.01)
    return runs


def of(experiment: Experiment, run: Run, **settings) -> Run:
    """The same run as one of another experiment."""
    return Run(changed(run.config, experiment=experiment, **settings))


def test_report_shows_runs_and_what_is_missing(stored):
    """Pictures, a row a run, the verdict first, and a missing run as missing."""
    report = reported(stored, ["experiment=fig5", "store=/somewhere/of/mine"])
    page = (report.evidence.folder / "index.md").read_text()
    assert "/somewhere" not in page
    assert page.index("**C4.**") < page.index("strip.png")
    assert "| C4 |" in page
    assert "NOT RUN" in page.split("| C4 |")[1].splitlines()[0]
    c3 = page.split("| C3 |")[1].splitlines()[0]
    assert "INCONCLUSIVE (pressures calibrated here)" in c3 and "one seed decides nothing; the numbers" in c3
    assert "**missing** (pending): ball on L, 3000, none, seed 0: never run" in page
    assert "snowrepro run experiment=fig5" in page
    assert len(pd.read_csv(report.evidence.folder / "summary.csv")) == 1
    for name in ("strip.png", "fragments.png"):
        pixels = imread(report.evidence.folder / name)[..., :3]
        assert (np.abs(pixels - [0x30 / 255, 0x7A / 255, 0x78 / 255]).max(axis=-1) < 0.01).mean() > 0.02  # the floor
    assert {"survival.png", "states.png", "states.csv"} <= {path.name for path in report.evidence.folder.iterdir()}
    assert "Not scanned: runs are missing" in page


def test_the_three_states_over_time(stored):
    """From the release on, on clusters: whole at first, and at the end nearly what the particles say."""
    folder = reported(stored).evidence.folder
    course, row = pd.read_csv(folder / "states.csv"), pd.read_csv(folder / "summary.csv").iloc[0]
    assert course[["lump", "crushed", "loose"]].sum(axis=1).to_numpy() == pytest.approx(1.0, abs=2e-4)
    assert (course["time"].iloc[0], course["lump"].iloc[0]) == (0.0, pytest.approx(1.0, abs=0.005))
    assert course["lump"].iloc[-1] == pytest.approx(row["lump_fraction"], abs=0.03)
    assert course["broken"].iloc[-1] == pytest.approx(row["broken_bonds"], abs=1e-4)


def test_letters_are_legible(stored, monkeypatch):
    """On a screen of 1280, where a page shrinks wide pictures, none is smaller than 11 pixels."""
    smallest, save = {}, Figure.savefig

    def measure(figure: Figure, path, **options) -> None:
        shrunk = min(1.0, PAGE / (figure.get_figwidth() * DPI))
        shown = [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]
        smallest[path.name] = min(text.get_fontsize() for text in shown) * DPI / 72 * shrunk
        save(figure, path, **options)

    monkeypatch.setattr(Figure, "savefig", measure)
    reported(stored)
    assert {"strip.png", "strip-narrow.png", "response.png", "survival.png"} <= set(smallest)
    assert {name: size for name, size in smallest.items() if size < LEAST_LETTERS - 0.01} == {}


def test_same_store_same_bytes(stored):
    """Drawing twice gives the same files."""
    first = {p.name: p.read_bytes() for p in reported(stored).evidence.folder.iterdir()}
    second = {p.name: p.read_bytes() for p in reported(stored).evidence.folder.iterdir()}
    assert first == second


def test_lumps_keep_the_colour_of_their_ancestor():
    """One lump splits in two, which crumble and change places in the order of mass: the heir keeps the colour."""
    x = ball("preview")
    right, rim = x[:, 0] > -3, np.abs(x[:, 1]) > 12
    split = x + right[:, None] * [20.0, 0.0]
    worn = split + (right & rim)[:, None] * np.random.default_rng(0).uniform(-9, 9, x.shape)
    found = classified(x, split, worn, fidelity="preview", frames="all")
    assert [f.lumps for f in found.fragments] == [1, 2, 2]
    whole, halves, after = colour_fragments(found)
    assert set(whole) == {LUMPS[0]}
    core = np.abs(x[:, 1]) < 8
    for colours in (halves, after):
        assert (colours[right & core & (x[:, 0] > 2)] == LUMPS[0]).all()
        assert (colours[~right & core & (x[:, 0] < -8)] == LUMPS[1]).all()
    assert np.isin(after[right & rim], [CRUSHED, LOOSE]).mean() > 0.9
    assert found.last.label[~right & core & (x[:, 0] < -8)].max() == 0, "the other half is now the heavier one"


@pytest.mark.parametrize(
    ("experiment", "files", "told"),
    [
        ("fig2", {"shapes.png", "shapes.csv"}, "star 22,076"),
        ("fig3", {"floors.png", "floors.csv"}, "stair1, stair2, stair3"),
        ("table1", {"table1.csv"}, "12 of 13 parameters"),
    ],
)
def test_scenes_and_parameters_need_no_runs(tmp_path, experiment, files, told):
    """Figures 2 and 3 and Table 1 come from the configuration alone, and the store is not touched."""
    plan = make_plan([f"experiment={experiment}", f"store={tmp_path}/runs", f"reports={tmp_path}/reports"], False)
    report = reported(plan.runs, plan.overrides)
    assert told in report.content.verdict
    assert {p.name for p in report.evidence.folder.iterdir()} == PAGES | files
    assert not (tmp_path / "runs").exists()


def test_the_parameters_are_compared_with_what_is_used(tmp_path):
    """A value that is not the paper's is marked; in SI the particle's mass is the paper's."""
    plan = make_plan(["experiment=table1", "material.E=1e5", "reading=si", f"reports={tmp_path}"], False)
    table = pd.read_csv(reported(plan.runs).evidence.folder / "table1.csv").set_index("parameter")
    assert list(table.index[table["same"] != "yes"]) == ["E_0"]
    assert table.loc["E_0", "used"] == 1e5


def test_the_setting_shows_force_and_gravity(stored, small_config):
    """Figure 4: red arrows around the pressed snow on the left, a blue one on the right."""
    setting = Experiment(name="fig4", title="setting", picture="setting", frames=(8, 40))
    report = reported([of(setting, stored[0])])
    pixels = imread(report.evidence.folder / "setting.png")[..., :3]
    left, right = np.array_split(pixels, 2, axis=1)
    red, blue = np.array([0xD6, 0x27, 0x28]) / 255, np.array([0x1F, 0x4F, 0xD8]) / 255

    def count(part, colour):
        return int((np.abs(part - colour).max(axis=-1) < 0.05).sum())

    assert count(left, red) > 100 and count(left, blue) == 0
    assert count(right, blue) > 30 and count(right, red) == 0


def test_timings_stand_beside_the_papers(stored):
    """Table 2: particles, seconds and substeps of the run, and what is missing."""
    timings = Experiment(name="table2", title="timings", picture="timings")
    star = Run(compose([*SMALL, "scene=star_on_square", f"store={stored[0].store}"]))
    report = reported([of(timings, run) for run in (stored[0], star)])
    ball, star_row = pd.read_csv(report.evidence.folder / "table2.csv", dtype=str).to_dict("records")
    assert ball["particles (paper)"] == "8,151" and ball["s/frame (paper)"] == "0.25"
    assert ball["particles"] == "2,038"
    assert float(ball["s/frame"]) == 0.01
    assert float(ball["substeps"]) > 1
    assert star_row["particles"] == "missing" and star_row["s/frame (paper)"] == "0.51"


def test_the_grid_counts_claims_over_scenes(stored):
    """A scene with one run, one without: sheets and curves are drawn, and no claim is counted that was not tested."""
    study = Experiment(name="grid", title="grid", picture="grid", calibrated_on=("ball", "L"))
    other = Run(compose([*SMALL, "floor=square", "pressure=3000", f"store={stored[0].store}"]))
    report = reported([of(study, run) for run in (*stored, other)])
    page = (report.evidence.folder / "index.md").read_text()
    assert "C1 not run" in report.content.verdict
    assert {p.name for p in report.evidence.folder.iterdir()} == {
        "summary.csv", "heatmap.png", "scenes.csv", "response.png", "claims.csv", "claims.json",
        "sintered-3000.png", "unsintered-3000.png", *PAGES,
    }  # fmt: skip
    assert "**missing** (pending): ball on square, 3000, paper, seed 0" in page
    assert "missing" in page.split("| ball | square |")[1].splitlines()[0]
    assert "core-hours" in page


def test_the_heat_map_leaves_out_only_what_is_missing():
    """A scene without one of its sintered runs still has its other pressures; the most without sintering needs all."""
    rows = [{ARM: arm, "pressure": p, "seed": 0, "lump_fraction": 0.1} for arm in ARMS for p in (340.0, 3300.0)]
    whole = JudgedScene("ball", "L", pd.DataFrame(rows), False, [], [])
    part = JudgedScene("star", "L", pd.DataFrame(rows[1:3]), False, [], [(ARMS[0], 340.0), (ARMS[1], 3300.0)])
    panels = grid._list_panels([whole, part])
    assert panels["with sintering, pressure 340"] == {("ball", "L"): 0.1}
    assert panels["with sintering, pressure 3300"] == {("ball", "L"): 0.1, ("star", "L"): 0.1}
    assert panels["without sintering, the most of any pressure"] == {("ball", "L"): 0.1}


def test_the_ledger_is_drawn_and_told(stored):
    """Each stage of the run that is there: parts of the turnover, and how much has no cause."""
    energy = Experiment(name="energy", title="energy", picture="energy")
    report = reported([of(energy, run) for run in stored])
    assert {p.name for p in report.evidence.folder.iterdir()} == PAGES | {"summary.csv", "energy.csv", "energy.png"}
    pressed, falling = pd.read_csv(report.evidence.folder / "energy.csv").to_dict("records")
    assert (pressed["stage"], falling["stage"]) == ("pressed", "falling")
    assert pressed["gravity_work"] == 0 < falling["gravity_work"]
    assert 0 < falling["unclosed"] < 0.02
    parts = sum(abs(value) for name, value in falling.items() if name.endswith("_work"))
    assert 0.9 < parts <= 1 + 1e-5  # what causes gave and took again in the stage is not in the sums
    assert f"{falling['unclosed']:.1%} from the release on" in report.content.verdict
    assert "At pressure 3000 kg cell⁻¹ s⁻² sintering" in report.content.verdict


def test_convergence_tells_what_moves_beyond_the_seeds(tmp_path):
    """Built numbers: what moves a claim, what a number, what nothing, and what is missing."""
    lumps = {  # with sintering at 340 and 3300; the seeds span 0.20 to 0.25 and 0.80 to 0.90
        "seed=0": (0.20, 0.80),
        "seed=1": (0.25, 0.90),
        "solver.cfl=0.2": (0.55, 0.85),
        "fidelity.dx=2": (0.22, 0.95),
        "solver.precision=f32": (0.21, 0.85),
        "solver.transfer=mls": (0.21, None),
    }
    experiment = Experiment(name="convergence", title="convergence", picture="convergence")
    asked, rows, missing = [], [], set()
    for change, values in lumps.items():
        for name in ("paper", "none"):
            for pressure, value in zip((340, 3300), values, strict=True):
                run = of(experiment, Run(compose([change, f"pressure={pressure}", f"sintering={name}"])))
                asked.append(run)
                row = {"run_id": run.id, ARM: run.case.arm, "sintering": name, "pressure": float(pressure)}
                row |= {"seed": run.case.seed}
                part = (value or 0.0) if name == "paper" else 0.01
                row |= {"lump_fraction": part, "loose_fraction": 1 - part, "particles": 10, "substeps": 5}
                if value is None:
                    missing.add(row["run_id"])
                else:
                    rows.append({**row, "seconds": 1.0, "energy_unclosed": 0.01})
    evidence = Evidence(experiment, asked, pd.DataFrame(rows), tmp_path, frozenset(missing))
    content = convergence.report(evidence)
    assert "Of 2 seeds 2 give the claims of the base (C1 C2 C2-loose C3 C4 C4-loose C5)" in content.verdict
    assert "claims are moved by half the time step (-C2, -C2-loose);" in content.verdict
    assert "only numbers, beyond the range of the seeds, by twice the grid spacing (+0.05);" in content.verdict
    assert "nothing beyond that range by single precision;" in content.verdict
    assert content.verdict.endswith(
        "not judged, as runs failed or are missing: another transfer, MLS (C1 C3 C4 C4-loose C5)."
    )
    (shown,) = [b for b in content.blocks if isinstance(b, Table)]
    of_mls = shown.frame.set_index("what was changed").loc["another transfer, MLS"]
    assert of_mls["at 3300"] == "not run" and of_mls["at 340"] == "0.21"
    assert of_mls["claims"] == "C1 C3 C4 C4-loose C5 not judged"
    table = pd.read_csv(tmp_path / "convergence.csv").set_index("variant")
    assert list(table.index)[:2] == ["base", "seed=1"]
    assert table.loc["solver.cfl=0.2", "moves"] == "+0.30 at 340"
    assert table.loc["fidelity.dx=2.0", "moves"] == "+0.05 at 3300"
    assert pd.isna(table.loc["solver.precision=f32", "moves"])
    assert (tmp_path / "convergence.png").exists()


def test_lumps_are_set_beside_hardness(stored):
    """One snow with its fall and its test, another with neither: pictures, a row, and no verdict on so little."""
    study = Experiment(name="hardness", title="hardness", picture="hardness")
    tested = Run(compose([*QUICK, f"store={stored[0].store}"]))
    tested.save(simulate(tested.config), wall_seconds=3.0)
    report = reported([of(study, run) for run in (*stored, tested)])
    assert report.content.verdict.startswith("Too few runs")
    page = (report.evidence.folder / "index.md").read_text()
    assert "ball on L, 3000, paper, seed 0, indented: " in page
    assert "**missing** (pending): ball on L, 3000, none, seed 0: never run" in page
    table = pd.read_csv(report.evidence.folder / "summary.csv")
    assert table["indenter"].notna().tolist() == [False, True]
    assert table["hardness"].notna().tolist() == [False, True]
    assert table["lump_fraction"].notna().tolist() == [True, False]
    (row,) = pair_falls_with_tests(report.evidence.table).reset_index().to_dict("records")
    assert (row["hardness"], row["lump_fraction"]) == pytest.approx(
        (table["hardness"][1], table["lump_fraction"][0]), rel=1e-5
    )
    assert {p.name for p in report.evidence.folder.glob("*.png")} == {"curves.png", "measures.png", "scatter.png"}


def test_falls_without_any_test_of_hardness_are_a_report_too(stored):
    """As in a store where the falls of Figure 5 came first."""
    study = Experiment(name="hardness", title="hardness", picture="hardness")
    report = reported([of(study, run) for run in stored])
    assert report.content.verdict.startswith("Too few runs")
    assert {p.name for p in report.evidence.folder.glob("*.png")} == {"curves.png", "measures.png", "scatter.png"}


def test_finer_grids_have_steps_and_an_order(stored, small_run, tmp_path):
    """Three grids of which two have the same result: a step that is none; the third is missing, until it is there."""
    study = Experiment(name="refinement", title="refinement", picture="refinement")
    runs = []
    for dx in (2.0, 1.0, 0.5):
        config = compose([*SMALL, f"fidelity.dx={dx}", "pressure=3000", f"store={tmp_path}/runs"])
        runs.append(of(study, Run(config), reports=f"{tmp_path}/reports"))
    for run in runs[:2]:
        run.save(carrying(small_run, run.config), wall_seconds=2.0, seconds_per_frame=0.01)
    report = reported(runs)
    assert "from cells of 2 to 1" not in report.content.verdict
    table = pd.read_csv(report.evidence.folder / "refinement.csv").set_index(["sintering", "measure"])
    assert table.loc[("sintered", "lump_fraction"), "words"] == "not all were run"
    assert {"refinement.png", "ends.png"} <= {path.name for path in report.evidence.folder.iterdir()}
    finest = carrying(small_run, runs[2].config)
    runs[2].save(finest, wall_seconds=2.0, seconds_per_frame=0.01)
    report = reported(runs)
    assert "from cells of 1 to 0.5, 0 of 3 shares of the mass move by more than 0.05" in report.content.verdict
    table = pd.read_csv(report.evidence.folder / "refinement.csv").set_index(["sintering", "measure"])
    assert table.loc[("sintered", "flattening_end"), "words"] == "hardly moves"


@pytest.mark.parametrize(
    "experiment",
    [
        *(
            pytest.param(name, marks=pytest.mark.nightly)
            for name in ("fig4", "table2", "grid", "readings", "energy", "ablation", "map")
        ),
        "fig5",
        "laws",
        "calibration",
        "convergence",
        "refinement",
        "limits",
        "hardness",
    ],
)
def test_no_result_at_all_is_a_report_too(tmp_path, experiment):
    """Where every run failed or none was made, the page says so and names each; in Markdown the first of many."""
    plan = make_plan([f"experiment={experiment}", f"store={tmp_path}/runs", f"reports={tmp_path}/reports"], True)
    folder = reported(plan.runs, plan.overrides).evidence.folder
    page = (folder / "index.md").read_text()
    assert f"0 of {len(plan.runs)} runs are done" in page
    count = len(plan.runs)
    assert page.count("**missing** (pending)") == (count if count <= MOST_FOLDED else FIRST_FOLDED)
    assert (folder / "index.html").read_text().count("</strong> (pending)") >= count
    assert "REPRODUCED**" not in page and "CONTRADICTED**" not in page


@pytest.mark.parametrize(
    ("command", "settings"),
    [
        ("snowrepro run experiment=fig5 seed=0,1 fidelity=preview", []),
        ("snowrepro run experiment=fig5 sintering.C4=0.002 'material.E=1e5'", ["sintering.C4=0.002", "material.E=1e5"]),
        ("snowrepro run experiment=fig5 pressure=340 hydra.launcher.workers=2 hydra/launcher=ray", ["pressure=340"]),
        ("snowrepro run -m pressure=340,3300", []),
    ],
)
def test_what_was_changed_of_an_experiment(command, settings):
    """Seeds and fidelity change no setting of it, and a sweep without an experiment has none to change."""
    assert list_changed_settings(command) == settings
