"""The verdicts on disk and on the screen, from a store with numbers as wanted and no snow."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

from snowrepro.composition.compose import compose
from snowrepro.evidence.claims import JudgedScene, judge_claims
from snowrepro.evidence.gather import gather_evidence
from snowrepro.report.figures.strip import Row
from snowrepro.report.page.lead import describe_scope, list_judged, make_columns
from snowrepro.report.sections.claims import format_for_screen
from snowrepro.report.sections.witness import describe_bodies
from snowrepro.store.run import Run
from snowrepro.summary.row import ARM
from snowrepro.sweep.plan import make_claims_plan, make_plan
from tests.report.reports import PRESSURES, fill, paper_like, reported


@pytest.fixture
def judged(tmp_path, monkeypatch):
    """Judge an experiment with these lumps; returns its report and claims.json."""
    monkeypatch.setattr("snowrepro.report.figures.grid._draw_sheets", lambda _: [])  # these runs have no snow
    monkeypatch.setattr(
        "snowrepro.report.figures.strip._make_row", lambda run, _: Row(f"{run.case.pressure:g}", {}, {}, {})
    )
    monkeypatch.setattr("snowrepro.report.page.page.embed_runs", lambda *_: None)
    for module in ("broken", "specification"):
        monkeypatch.setattr(f"snowrepro.report.sections.{module}.make_blocks", lambda _: [])

    def judge(*overrides: str, seeds: int = 3, lumps: Callable[[Run], float | None] = paper_like):
        folders = [f"store={tmp_path}/runs", f"reports={tmp_path}/reports"]
        plan = fill(make_claims_plan([*overrides, PRESSURES, *folders], seeds), lumps)
        report = reported(plan.runs, plan.overrides)
        return report, json.loads((report.evidence.folder / "claims.json").read_text())

    return judge


def test_an_eye_is_asked_where_a_claim_speaks_of_powder():
    """Runs that look whole are counted, of claims that agree; snow that came apart, or is seen in pieces, is not."""
    claims = compose().question.claims.list
    rows = [
        (*numbers, seed)
        for numbers in (
            ("sintered", 340, 0.2, 0.5, 0.1), ("sintered", 3300, 0.8, 1.0, 0.0),
            ("unsintered", 340, 0.0, 1.0, 0.0), ("unsintered", 3300, 0.1, 0.99, 0.2),
        )
        for seed in range(3)
    ]  # fmt: skip
    table = pd.DataFrame(rows, columns=[ARM, "pressure", "lump_fraction", "largest_seen", "loose_fraction", "seed"])
    scene = JudgedScene("ball", "L", table, False, judge_claims(compose().question.claims, table, False, []))
    told = "**C4**: an eye sees one body in 3 of 6 of these runs: crushed, not come apart."
    assert describe_bodies([scene], claims) == [told]
    assert describe_bodies([replace(scene, table=table.drop(columns="largest_seen"))], claims) == []
    more = table.assign(lump_fraction=0.7)
    judged_so = judge_claims(compose().question.claims, more, False, [])
    assert describe_bodies([replace(scene, table=more, verdicts=judged_so)], claims) == []


def test_one_scene_on_disk(judged, tmp_path):
    """Verdicts, numbers by cell, P50, the claims as they stood, and no folder of this machine."""
    report, record = judged("experiment=fig6")
    assert report.evidence.folder == tmp_path / "reports" / f"fig6,{PRESSURES}"
    found = {p.name for p in report.evidence.folder.iterdir()}
    assert {"index.html", "index.md", "response.png", "claims.json", "claims.csv"} <= found
    (scene,) = record["scenes"]
    assert {v["claim"]: v["word"] for v in scene["verdicts"]} == dict.fromkeys(
        ["C1", "C2", "C2-loose", "C3", "C4", "C4-loose", "C5"], "REPRODUCED"
    )
    assert not any(v["calibrated"] for v in scene["verdicts"])
    assert [v["same_as"] for v in scene["verdicts"]] == [*[""] * 6, "C1"]
    cell, loose = (c for c in scene["cells"] if (c["arm"], c["pressure"]) == ("sintered", 530.0))
    assert (cell["measure"], loose["measure"]) == ("lump_fraction", "loose_fraction")
    assert cell["seeds"] == pytest.approx({"0": 0.52, "1": 0.53, "2": 0.54})
    assert cell["mean"] == pytest.approx(0.53)
    assert scene["P50"] == {
        "low": 340.0, "high": 530.0, "seeds": 3, "note": "", "shown": "340 to 530, in all 3 seeds"
    }  # fmt: skip
    content = json.dumps(record["claims"]["content"], sort_keys=True, separators=(",", ":"))
    assert record["claims"]["sha256"] == hashlib.sha256(content.encode()).hexdigest()
    assert len(record["runs"]) == 18 and all(run["done"] for run in record["runs"])
    assert [sorted(maker) for maker in record["provenance"]] == [["git_state", "versions"]]
    table = pd.read_csv(report.evidence.folder / "claims.csv").set_index("claim")
    assert table.loc["C1", "margin"] == pytest.approx(0.28)
    assert table.loc["C6", "verdict"] == "NOT RUN"
    page = (report.evidence.folder / "index.md").read_text()
    assert page.index("| C1 |") < page.index("response.png") < page.index("The rules by which")
    assert f"snowrepro run experiment=fig6 {PRESSURES} seed=0,1,2" in page
    lead = page.replace("Fig\\.", "Fig.").replace("\\.", ".").replace("\\(", "(").replace("\\)", ")")
    told = "mass in lumps, smallest change from 530 to 3300: 0.28 in all 3 seeds (crushed 0.00, 0.00, 0.00)."
    statement = "With sintering, lumps grow with every step of the pressure."
    assert f"**C1.** {statement} **REPRODUCED**, Fig. 6, star on stair3: {told}" in lead
    assert "The same numbers as C1, Fig. 6, star on stair3: unsintered snow is the same at every pressure." in lead
    for name in ("index.html", "index.md", "report.json", "claims.json", "claims.csv"):
        assert str(tmp_path) not in (report.evidence.folder / name).read_text()
    assert (
        (np.abs(imread(report.evidence.folder / "response.png")[..., :3] - [0xD5 / 255, 0x5E / 255, 0]) < 0.02)
        .all(-1)
        .any()
    )


def test_the_screen_is_readable(judged):
    """No line is wider than a terminal; each claim has statement, effect, seeds and verdict."""
    report, _ = judged("experiment=fig5")
    lines = format_for_screen(report.evidence)
    assert max(map(len, lines)) <= 100
    text = "\n".join(lines)
    assert "REPRODUCED (by calibration, no test)" in text.split("C1 ")[1].splitlines()[0]
    assert "0.28 in all 3 seeds, 530 to 3300" in text
    assert "0.21 [0.19, 0.23], at 340" in text
    assert "none in 3 seeds, at 340" in text
    assert "With sintering, lumps grow with every step of the pressure." in text
    assert "the same numbers as C1, counts once" in text.split("C5 ")[1]
    assert text.split("C4 ")[1].splitlines()[0].endswith(" REPRODUCED")
    assert lines[-2].startswith("P50, the pressure at which half")
    assert " ".join(lines[-2:]).endswith("340 to 530, in all 3 seeds")


@pytest.mark.nightly
def test_same_store_same_bytes(judged):
    """Whether runs were there already or not."""
    first, record = judged("experiment=fig5")
    kept = {p.name: p.read_bytes() for p in first.evidence.folder.iterdir()}
    again, other = judged("experiment=fig5", lumps=lambda _: None)
    assert kept == {p.name: p.read_bytes() for p in again.evidence.folder.iterdir()}
    assert record == other


def test_a_missing_run_is_not_run_and_named(judged):
    """C1 and C5 need it, C2 to C4 do not; there is no P50."""
    report, record = judged(
        "experiment=fig6",
        lumps=lambda run: (
            None if (run.case.pressure, run.case.seed, run.case.arm) == (530, 2, "sintered") else paper_like(run)
        ),
    )
    words = {v["claim"]: v["word"] for v in record["scenes"][0]["verdicts"]}
    assert [name for name, word in words.items() if word == "NOT RUN"] == ["C1", "C5"]
    assert record["scenes"][0]["P50"]["low"] is None
    assert [run["done"] for run in record["runs"]].count(False) == 1
    page = (report.evidence.folder / "index.md").read_text()
    assert "**missing** (pending): star on stair3, 530, paper, seed 2: never run" in page
    assert "no result at 530" in "\n".join(format_for_screen(report.evidence))


def test_all_runs_missing(judged):
    """Nothing to draw, nothing to judge, no traceback."""
    report, record = judged("experiment=fig6", lumps=lambda _: None)
    assert {v["word"] for v in record["scenes"][0]["verdicts"]} == {"NOT RUN"}
    assert (report.evidence.folder / "response.png").exists()


def grid(run: Run) -> float:
    """As in the paper; stars fall on a triangle with more lumps at the lowest pressure than at the next.

    Ball on square is ball on L again, and all others have a little more in lumps.
    """
    if not run.case.sintering.enabled:
        return 0.0
    if (run.case.shape.name, run.case.floor.name, run.case.pressure) == ("star", "triangle", 340):
        return 0.6
    again = run.case.shape.name == "ball" and run.case.floor.name in ("L", "square")
    return paper_like(run) + (0.0 if again else 0.05)


SEEN = (("fig6", "pressure=300,740,5900"), ("seen", "pressure=420,1300,8600"))
GRID = ["experiment=grid", "shape=ball,star", "floor=L,square,triangle"]


def test_scenes_are_judged_together(judged):
    """By shape, of which there are too few; the scene that disagrees is named, and that which is the calibrated one."""
    report, record = judged(*GRID, lumps=grid, seeds=2)
    c6, loose = record["over_scenes"]
    assert (c6["word"], c6["agrees"], c6["left_out"]) == ("INCONCLUSIVE", True, ["ball on square"])
    counts = {c["claim"]: (c["against"], [(s["shape"], s["agree"], s["scenes"]) for s in c["by_shape"]])
              for c in c6["counts"]}  # fmt: skip
    assert counts["C1"] == counts["C2"] == (["star on triangle"], [("ball", 1, 1), ("star", 2, 3)])
    assert counts["C3"] == counts["C4"] == ([], [("ball", 1, 1), ("star", 3, 3)])
    assert "C5" not in counts and "C5: the same numbers as another claim in every scene" in c6["note"]
    calibrated = [scene for scene in record["scenes"] if scene["calibrated"]]
    assert [(s["shape"], s["floor"]) for s in calibrated] == [("ball", "L")]
    odd = record["scenes"][-1]
    assert (odd["shape"], odd["floor"]) == ("star", "triangle")
    assert odd["P50"]["shown"] == "below 340, in all 2 seeds"
    assert [v["word"] for v in odd["verdicts"]][1] == "CONTRADICTED"
    lines = format_for_screen(report.evidence)
    assert max(map(len, lines)) <= 100
    assert " yes*" in next(line for line in lines if line.startswith("ball on L "))
    assert " no-" in next(line for line in lines if line.startswith("star on triangle"))
    assert "C2 on 2 of 2 shapes (3 of 4" in "\n".join(lines)
    page = (report.evidence.folder / "index.md").read_text()
    assert "2 of 3 (-0.10 to +0.24)" in page and "They are no blind prediction" in page
    assert [count["claim"] for count in loose["counts"]] == ["C2-loose", "C4-loose"]
    assert len(pd.read_csv(report.evidence.folder / "claims.csv")) == 2 + 6 * 7


def test_one_seed_counts_scenes_and_decides_none(judged):
    """Counts by shape, the scenes that disagree by name, C6's word."""
    report, _ = judged(*GRID, seeds=1, lumps=grid)
    assert "C2 on 2 of 2 shapes (3 of 4 scenes)" in report.content.verdict
    assert report.content.verdict.endswith("C6-loose: INCONCLUSIVE.")
    page = (report.evidence.folder / "index.md").read_text()
    row = next(line for line in page.splitlines() if line.startswith("| C2 |"))
    assert row.endswith("| 1 of 1 (+0.25 to +0.25) | 2 of 3 (-0.10 to +0.25) | 2 of 2 shapes | star on triangle |")


def test_a_ladder_of_the_calibration_is_calibrated(tmp_path):
    """Its own sintered runs chose the pressures; without unsintered runs C4 and C5 are not run."""
    plan = make_plan(["experiment=calibration", f"store={tmp_path}"], multirun=True)
    fill(plan, lambda run: float(np.interp(np.log(run.case.pressure), [4, 8.5], [0, 1])))
    (scene,) = gather_evidence(plan.runs, tmp_path).scenes
    verdicts = {v.claim: v for v in scene.verdicts}
    assert verdicts["C1"].label == "REPRODUCED (by calibration, no test)"
    assert verdicts["C4"].word == verdicts["C5"].word == "NOT RUN"


def test_a_grid_without_runs_claims_nothing(judged):
    """No scene counts for a claim or against it, and the first lines say so."""
    report, _ = judged(*GRID, lumps=lambda _: None)
    first = (report.evidence.folder / "index.md").read_text().split("![")[0]
    assert first.count("**NOT RUN** in all other scenes.") == 7
    assert "0 of 18 runs" not in first and "0 of 108 runs are done; **108 pending**" in first


def test_the_answer_has_three_columns(judged, tmp_path):
    """Of the two experiments with numbers like the paper's; C6 needs other scenes, and is named below the columns."""
    reports = [judged(f"experiment={name}", PRESSURES)[0] for name in ("fig5", "fig6")]
    table, undecided = make_columns([report.evidence for report in reports], {})
    cells = {column: [text for text in table.frame[column] if text] for column in table.frame}
    names = {column: [text.partition(".**")[0].lstrip("*") for text in texts] for column, texts in cells.items()}
    assert names == {
        "holds": ["C1", "C2", "C2-loose", "C3", "C4", "C4-loose", "C5"],
        "holds only if": [],
        "does not hold": [],
    }
    assert cells["holds"][0].endswith("*on Fig. 6, star on stair3; by choice of the pressures on Fig. 5, ball on L*")
    assert undecided == "Not decided: C6 and C6-loose."
    table, undecided = make_columns([judged("experiment=fig5", lumps=lambda run: 0.9)[0].evidence], {})
    against = [text.partition(".**")[0].lstrip("*") for text in table.frame["does not hold"] if text]
    assert against == ["C2", "C2-loose", "C4", "C4-loose"] and table.frame["holds only if"][0].startswith("**C3.**")
    assert undecided == "Not decided: C1, C5, C6 and C6-loose."  # a step of none is neither up nor down
    assert make_columns([], {}) == []


def test_another_reading_does_not_answer_for_the_first(judged):
    """Figure 6 in the nearest reading has verdicts, which stand on its own page."""
    first, seen = (judged(f"experiment={name}", pressure)[0].evidence for name, pressure in SEEN)
    assert list_judged([first, seen]) == [first] and list_judged([seen]) == [seen]
    scope = describe_scope([first, seen], [])
    assert any("on its own page" in line and "keeps most of the paper" in line for line in scope)
