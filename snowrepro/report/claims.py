"""Write the verdicts on the paper's claims: a table for the screen, index.md, response.png, claims.json, claims.csv."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from ..analysis.calibration import BELOW, BEYOND, Crossing, half_pressure
from ..analysis.claims import INCONCLUSIVE, Scene, Verdict, arm_of, interval, judge_scenes
from ..config import Config
from ..store.files import require_writable
from ..store.states import standing
from .evidence import Evidence, gathered, judged_scenes, markdown, name_of, origin
from .page import report_folder
from .records import write_records
from .response import draw_response

WIDTH = 100  # of a line on the screen
P50 = "P50, the pressure at which half of the sintered mass is in lumps"

RULES = """\
* Seeds are blocks: the same ones at every pressure. A seed changes the particles' random places alone, so seeds show
  numerical repeatability, not physical replication. One seed decides nothing.
* Intervals are Student's over seeds, two-sided, at {level}.
* **Rises**. REPRODUCED: Page's L for the order of the pressures has p of at most {alpha:g}, and the interval
  of the effect, highest less lowest pressure, lies above the threshold. CONTRADICTED: that interval lies below it, or
  a step between neighbouring pressures falls for certain (Bonferroni over steps). Kendall's tau, within a seed, mean
  over seeds, with a bootstrap over seeds, stands beside it and decides nothing.
* **Below, above**. REPRODUCED: the interval lies on the claimed side at every pressure named.
  CONTRADICTED: at one of them it lies on the other side (Bonferroni over pressures). The effect shown is the mean
  nearest to the other side.
* **Scenes**. A scene counts for a claim or against it by its means over seeds. REPRODUCED: every claim has more
  than the threshold's share of the scenes (exact binomial test, Holm over the claims). CONTRADICTED: one has less.
* Else INCONCLUSIVE; NOT RUN where a run is missing. Where the rules for both are met, CONTRADICTED stands."""


@dataclass(frozen=True)
class Judgement:
    """What was decided of an experiment's runs.  ``halves``: P50 of each scene by its name."""

    evidence: Evidence
    scenes: Sequence[Scene]
    over: Sequence[Verdict]
    halves: dict[str, Crossing]


@dataclass(frozen=True)
class ClaimsReport:
    """Where the verdicts were written, and the same for the screen."""

    folder: Path
    lines: list[str]


def write_claims(configs: Sequence[Config], overrides: Sequence[str]) -> ClaimsReport:
    """Judge the claims by the runs in the store and write it down; runs that are missing are not stood in for."""
    folder = report_folder(configs[0], configs[0].experiment) / "claims"
    require_writable(folder)
    evidence, claims = gathered(configs, folder), configs[0].claims
    scenes = judged_scenes(evidence)
    halves = {scene.name: _half(scene, claims.alpha) for scene in scenes}
    judgement = Judgement(evidence, scenes, judge_scenes(claims, scenes), halves)
    shown = {scene.name: half_shown(halves[scene.name], scene) for scene in scenes}
    draw_response(scenes, halves, folder / "response.png", shown)
    write_records(evidence, scenes, judgement.over, halves, shown)
    page = [*_page(judgement), *origin(evidence, "claims", overrides)]
    (folder / "index.md").write_text("\n".join(page).rstrip() + "\n", encoding="utf-8")
    return ClaimsReport(folder, screen(judgement))


def screen(judgement: Judgement) -> list[str]:
    """The verdicts in plain text."""
    evidence, scenes, over = judgement.evidence, judgement.scenes, judgement.over
    head = f"{evidence.experiment.title}. {_seeds(evidence)}."
    if len(scenes) == 1:
        (scene,) = scenes
        half = f"{P50}: {half_shown(judgement.halves[scene.name], scene)}"
        return [head, "", *_rows_of([*scene.verdicts, *over]), "", half]
    frame = _by_scene(judgement)
    return [
        head,
        "",
        *frame.to_string(index=False, justify="left", formatters=_left(frame)).splitlines(),
        "* by calibration, no test; - the numbers disagree; P50: pressure where half of the mass is in lumps",
        "",
        *_rows_of(over),
    ]


def half_shown(half: Crossing, scene: Scene) -> str:
    """P50 and its interval, or why there is none."""
    if half.pressure is None:
        return half.note
    if half.low is None or half.high is None:
        return f"{pressure(half.pressure)}, one seed"
    pressures = scene.table.loc[scene.table["sintering"] != "none", "pressure"]
    low = f"below {pressures.min():g}" if half.low == BELOW else pressure(half.low)
    high = f"above {pressures.max():g}" if half.high == BEYOND else pressure(half.high)
    return f"{pressure(half.pressure)} [{low}, {high}]"


def pressure(value: float) -> str:
    """Three digits, and whole from 100 on."""
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def _half(scene: Scene, alpha: float) -> Crossing:
    """P50 of the sintered runs, by the seeds that have every pressure."""
    lost = sorted({p for sintering, p in scene.missing if sintering != "none"})
    if lost:
        return Crossing(note=f"no result at {', '.join(f'{p:g}' for p in lost)}")
    return half_pressure(arm_of(scene.table, "sintered", "lump_fraction").dropna(), alpha)


def _seeds(evidence: Evidence) -> str:
    return f"Seeds {', '.join(map(str, sorted({config.seed for config in evidence.configs})))}"


def _rows_of(verdicts: Sequence[Verdict]) -> list[str]:
    """Two lines a claim or more: the numbers and the verdict, the statement, what is against it."""
    lines = [f"{'claim':6} {'effect [interval]':40} {'seeds':5} {'p':8} verdict"]
    for v in verdicts:
        lines.append(f"{v.claim:6} {v.effect_shown or '-':40} {v.seeds or '-':<5} {_p(v):8} {v.shown}")
        tau = f" (Kendall's tau {interval(v.tau)})" if v.tau else ""
        for text in (v.statement + tau, f"against it: {'; '.join(v.disagrees)}" if v.disagrees else "", v.note):
            lines += textwrap.wrap(text, WIDTH, initial_indent=" " * 7, subsequent_indent=" " * 9)
    return lines


def _by_scene(judgement: Judgement) -> pd.DataFrame:
    """The words by scene and claim, marked where they are by calibration or the numbers disagree, and P50."""
    rows = []
    for scene in judgement.scenes:
        half = judgement.halves[scene.name].pressure
        marked = {v.claim: v.word + "*" * v.calibrated + "-" * (v.agrees is False) for v in scene.verdicts}
        rows.append({"scene": scene.name, **marked, "P50": pressure(half) if half else "-"})
    return pd.DataFrame(rows)


def _left(frame: pd.DataFrame) -> dict:
    return {name: f"{{:{max(map(len, (name, *frame[name])))}}}".format for name in frame}


def _p(verdict: Verdict) -> str:
    return "-" if verdict.p is None else f"{verdict.p:.2g}"


def _page(judgement: Judgement) -> list[str]:
    """Verdicts first, then the picture, the rules, and what is calibration and what prediction."""
    evidence, scenes = judgement.evidence, judgement.scenes
    claims = evidence.configs[0].claims
    lines = [f"# Claims by {evidence.experiment.name}: {evidence.experiment.title}", ""]
    if len(scenes) == 1:
        (scene,) = scenes
        half = f"{P50}: **{half_shown(judgement.halves[scene.name], scene)}**."
        lines += [*markdown(_verdicts([*scene.verdicts, *judgement.over])), "", half, ""]
    else:
        lines += [*markdown(_verdicts(judgement.over)), "", *_scene_table(judgement)]
    lines += [
        f"{_seeds(evidence)}. Effects are mass fractions in lumps: highest less lowest pressure, or the mean nearest "
        "to the other side of 1/2. All numbers: [claims.csv](claims.csv), [claims.json](claims.json).",
        "",
        "![Mass in lumps over pressure: seeds, means, rising fit, P50](response.png)",
        "",
        "Points: seeds; bars: means; lines: rising fit over log pressure (isotonic regression); diamond: P50 with its "
        "interval, a bootstrap over seeds, which knows nothing of the curve between two pressures. Orange with "
        "sintering, grey without. Seeds show numerical repeatability, not physical replication.",
        "",
        "## The rules",
        "",
        f"Claims and rules are in conf/claims/{claims.name}.yaml.",
        "",
        *RULES.format(alpha=claims.alpha, level=f"{1 - claims.alpha:.0%}").splitlines(),
        "",
        "## What is calibration and what is prediction",
        "",
        *_calibration(judgement),
        "",
    ]
    missing = [config for config in evidence.configs if not evidence.is_done(config)]
    lines += [f"- **missing**: {name_of(c)}: {standing(c).reason}" for c in missing]
    return [*lines, ""] if missing else lines


def _verdicts(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    rows = [
        {
            "claim": v.claim,
            "statement": v.statement,
            "measured": v.measured,
            "effect [interval]": v.effect_shown or "-",
            "seeds": v.seeds,
            "p": _p(v),
            "tau [interval]": interval(v.tau) if v.tau else "-",
            "verdict": f"**{v.shown}**",
            "against it": "; ".join(v.disagrees) or "-",
            "note": v.note or "-",
        }
        for v in verdicts
    ]
    return pd.DataFrame(rows)


def _scene_table(judgement: Judgement) -> list[str]:
    undecided = sum(v.word == INCONCLUSIVE for scene in judgement.scenes for v in scene.verdicts)
    return [
        "Each scene alone (\\* by calibration, no test; - the numbers disagree; P50: pressure at which half of the "
        f"sintered mass is in lumps; {undecided} verdicts are inconclusive):",
        "",
        *(line.replace("*", "\\*") for line in markdown(_by_scene(judgement))),
        "",
    ]


def _calibration(judgement: Judgement) -> list[str]:
    on = judgement.evidence.experiment.calibrated_on
    if not on:
        return ["No scene is named that the pressures were chosen by."]
    here = [v.claim for scene in judgement.scenes if scene.calibrated for v in scene.verdicts if v.calibrated]
    text = f"The paper prints no pressures. They were chosen on {' on '.join(on)}, by its sintered lumps alone."
    if here:
        text += f" So {', '.join(here)} are no test there; what is said of unsintered snow is one."
    if len(judgement.scenes) > bool(here):
        text += " All other scenes are prediction."
    return [text]
