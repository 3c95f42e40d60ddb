"""The verdicts on the paper's claims: a table for the screen, and the section of a report that shows them."""

import textwrap
from collections.abc import Sequence

import pandas as pd

from ..analysis.calibration import BELOW, BEYOND, Crossing
from ..analysis.claims import INCONCLUSIVE, NOT_RUN, Scene, Verdict, interval
from .document import Block, Fold, Heading, Picture, Table, plain
from .evidence import Evidence
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


def section(evidence: Evidence) -> list[Block]:
    """Verdicts, the picture of what they rest on, the rules, and what is calibration; claims.json, claims.csv."""
    scenes = evidence.scenes
    shown = {scene.name: half_shown(evidence.halves[scene.name], scene) for scene in scenes}
    draw_response(scenes, evidence.halves, evidence.folder / "response.png", shown)
    write_records(evidence, shown)
    claims = evidence.configs[0].claims
    return [
        Heading("The claims"),
        *(_of_one(evidence, shown) if len(scenes) == 1 else _of_several(evidence)),
        Picture(
            "response.png",
            "Mass in lumps over pressure: seeds, means, rising fit and P50, with and without sintering.",
            "Points: seeds; bars: means; lines: rising fit over log pressure (isotonic regression); diamond: P50 with "
            "its interval, a bootstrap over seeds, which knows nothing of the curve between two pressures. Orange with "
            "sintering, grey without."
            + (" In the corner: claims that the numbers disagree with." if len(scenes) > 1 else ""),
            data="claims.csv",
        ),
        *_calibration(evidence),
        Fold(
            "The rules by which claims are decided",
            [f"Claims and rules are in conf/claims/{plain(claims.name)}.yaml.", *_rules(claims.alpha)],
        ),
    ]


def screen(evidence: Evidence) -> list[str]:
    """The verdicts in plain text."""
    head = f"{evidence.experiment.title}. {_seeds(evidence)}."
    if len(evidence.scenes) == 1:
        (scene,) = evidence.scenes
        half = f"{P50}: {half_shown(evidence.halves[scene.name], scene)}"
        return [head, "", *_rows_of([*scene.verdicts, *evidence.over_scenes]), "", half]
    frame = _by_scene(evidence)
    return [
        head,
        "",
        *frame.to_string(index=False, justify="left", formatters=_left(frame)).splitlines(),
        "* by calibration, no test; - the numbers disagree; P50: pressure where half of the mass is in lumps",
        "",
        *_rows_of(evidence.over_scenes),
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


def _seeds(evidence: Evidence) -> str:
    return f"Seeds {', '.join(map(str, evidence.seeds))}"


def _rows_of(verdicts: Sequence[Verdict]) -> list[str]:
    """Two lines a claim or more: the numbers and the verdict, the statement, what is against it."""
    lines = [f"{'claim':6} {'effect [interval]':40} {'seeds':5} {'p':8} verdict"]
    for v in verdicts:
        lines.append(f"{v.claim:6} {v.effect_shown or '-':40} {v.seeds or '-':<5} {_p(v):8} {v.shown}")
        tau = f" (Kendall's tau {interval(v.tau)})" if v.tau else ""
        for text in (v.statement + tau, f"against it: {'; '.join(v.disagrees)}" if v.disagrees else "", v.note):
            lines += textwrap.wrap(text, WIDTH, initial_indent=" " * 7, subsequent_indent=" " * 9)
    return lines


def _by_scene(evidence: Evidence) -> pd.DataFrame:
    """The words by scene and claim, marked where they are by calibration or the numbers disagree, and P50."""
    rows = []
    for scene in evidence.scenes:
        half = evidence.halves[scene.name].pressure
        marked = {v.claim: v.word + "*" * v.calibrated + "-" * (v.agrees is False) for v in scene.verdicts}
        rows.append({"scene": scene.name, **marked, "P50": pressure(half) if half else "-"})
    return pd.DataFrame(rows)


def _left(frame: pd.DataFrame) -> dict:
    return {name: f"{{:{max(map(len, (name, *frame[name])))}}}".format for name in frame}


def _p(verdict: Verdict) -> str:
    return "-" if verdict.p is None else f"{verdict.p:.2g}"


def _of_one(evidence: Evidence, shown: dict[str, str]) -> list[Block]:
    """The verdicts by one scene, and its P50."""
    (scene,) = evidence.scenes
    verdicts = [*scene.verdicts, *(v for v in evidence.over_scenes if v.word != NOT_RUN)]
    return [
        f"Snow and floor: {plain(scene.name)}. {_about(evidence)}",
        Table(_verdicts(verdicts), data="claims.csv"),
        f"{P50}: **{shown[scene.name]}**.",
    ]


def _of_several(evidence: Evidence) -> list[Block]:
    """The verdicts by all scenes together, and by each alone."""
    undecided = sum(v.word == INCONCLUSIVE for scene in evidence.scenes for v in scene.verdicts)
    return [
        Table(_verdicts(evidence.over_scenes), data="claims.csv"),
        f"Each scene alone (\\* by calibration, no test; - the numbers disagree; P50: pressure at which half of the "
        f"sintered mass is in lumps; {undecided} verdicts are inconclusive). {_about(evidence)}",
        Table(_by_scene(evidence).map(plain), data="claims.csv"),
    ]


def _about(evidence: Evidence) -> str:
    """What the numbers of a table of verdicts are."""
    return (
        f"{_seeds(evidence)}. Effects are mass fractions in lumps: highest less lowest pressure, or the mean nearest "
        "to the other side of 1/2. Seeds show numerical repeatability, not physical replication. All numbers: "
        "[claims.csv](claims.csv), [claims.json](claims.json)."
    )


def _rules(alpha: float) -> list[Block]:
    return [RULES.format(alpha=alpha, level=f"{1 - alpha:.0%}")]


def _verdicts(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    rows = [
        {
            "claim": v.claim,
            "statement": plain(v.statement),
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


def _calibration(evidence: Evidence) -> list[Block]:
    """What is calibration and what is prediction."""
    on = evidence.experiment.calibrated_on
    if not on:
        return []
    here = [v.claim for scene in evidence.scenes if scene.calibrated for v in scene.verdicts if v.calibrated]
    text = f"The paper prints no pressures. They were chosen on {' on '.join(on)}, by its sintered lumps alone."
    if here:
        text += f" So {', '.join(here)} are no test there; what is said of unsintered snow is one."
    if len(evidence.scenes) > bool(here):
        text += " All other scenes are prediction."
    return [text]
