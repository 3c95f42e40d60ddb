"""The verdicts on the paper's claims, as text for the screen and as a section of a report."""

import textwrap
from collections.abc import Sequence

import pandas as pd

from ...evidence.calibration import BELOW, BEYOND, Crossing
from ...evidence.claims import INCONCLUSIVE, NOT_RUN, JudgedScene, Verdict, format_interval
from ...evidence.gather import Evidence
from ...settings.case import ARMS
from ...summary.row import ARM
from ..document import Block, Fold, Heading, Picture, Table, escape
from .records import write_claims
from .response import draw_response
from .witness import describe_bodies

WIDTH = 100  # of a line on the screen
P50 = "P50, the pressure at which half of the sintered mass is in lumps [{unit}]"

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


def make_blocks(evidence: Evidence) -> list[Block]:
    """Make the verdicts, the picture that they rest on, the rules, and what is calibration.

    Writes response.png, claims.json and claims.csv into the report's folder.
    """
    scenes = evidence.scenes
    half_pressures = {scene.name: format_half_pressure(evidence.half_pressures[scene.name], scene) for scene in scenes}
    path, unit = evidence.folder / "response.png", evidence.pressure_unit
    draw_response(scenes, evidence.half_pressures, path, unit, half_pressures)
    write_claims(evidence, half_pressures)
    claims = evidence.runs[0].config.question.claims
    return [
        Heading("The claims"),
        *(_describe_one_scene(evidence, half_pressures) if len(scenes) == 1 else _describe_several_scenes(evidence)),
        *describe_bodies(scenes, claims.list),
        Picture(
            "response.png",
            "Mass in lumps over pressure: seeds, means, rising fit and P50, with and without sintering.",
            "Points: seeds; bars: means; lines: rising fit over log pressure (isotonic regression); diamond: P50 with "
            "its interval, a bootstrap over seeds, which knows nothing of the curve between two pressures. Orange with "
            "sintering, grey without."
            + (" In the corner: claims that the numbers disagree with." if len(scenes) > 1 else ""),
            data="claims.csv",
        ),
        *_describe_calibration(evidence),
        Fold(
            "The rules by which claims are decided",
            [f"Claims and rules are in conf/claims/{escape(claims.name)}.yaml.", *_format_rules(claims.alpha)],
        ),
    ]


def format_for_screen(evidence: Evidence) -> list[str]:
    """Format the verdicts as lines of plain text."""
    head = f"{evidence.experiment.title}. {_format_seeds(evidence)}. Pressures are in {evidence.pressure_unit}."
    if len(evidence.scenes) == 1:
        (scene,) = evidence.scenes
        half_pressure = format_half_pressure(evidence.half_pressures[scene.name], scene)
        half = f"{P50.format(unit=evidence.pressure_unit)}: {half_pressure}"
        return [head, "", *_format_verdicts([*scene.verdicts, *evidence.over_scenes]), "", half]
    frame = _tabulate_by_scene(evidence)
    return [
        head,
        "",
        *frame.to_string(index=False, justify="left", formatters=_align_left(frame)).splitlines(),
        "* by calibration, no test; - the numbers disagree",
        P50.format(unit=evidence.pressure_unit),
        "",
        *_format_verdicts(evidence.over_scenes),
    ]


def format_half_pressure(half: Crossing, scene: JudgedScene) -> str:
    """Format P50 and its interval, or say why there is none."""
    if half.pressure is None:
        return half.note
    if half.low is None or half.high is None:
        return f"{format_pressure(half.pressure)}, one seed"
    pressures = scene.table.loc[scene.table[ARM] == ARMS[0], "pressure"]
    low = f"below {pressures.min():g}" if half.low == BELOW else format_pressure(half.low)
    high = f"above {pressures.max():g}" if half.high == BEYOND else format_pressure(half.high)
    return f"{format_pressure(half.pressure)} [{low}, {high}]"


def format_pressure(value: float) -> str:
    """Format a pressure with three digits, from 100 on without decimals."""
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def _format_seeds(evidence: Evidence) -> str:
    """Format the seeds that were asked for."""
    return f"Seeds {', '.join(map(str, evidence.seeds))}"


def _format_verdicts(verdicts: Sequence[Verdict]) -> list[str]:
    """Format verdicts as lines: numbers and verdict, the statement, and what is against it."""
    lines = [f"{'claim':6} {'effect [interval]':40} {'seeds':5} {'p':8} verdict"]
    for verdict in verdicts:
        effect, seeds = verdict.effect_text or "-", verdict.seeds or "-"
        lines.append(f"{verdict.claim:6} {effect:40} {seeds:<5} {_format_p(verdict):8} {verdict.label}")
        tau = f" (Kendall's tau {format_interval(verdict.tau)})" if verdict.tau else ""
        for text in (
            verdict.statement + tau,
            f"against it: {'; '.join(verdict.disagrees)}" if verdict.disagrees else "",
            verdict.note,
        ):
            lines += textwrap.wrap(text, WIDTH, initial_indent=" " * 7, subsequent_indent=" " * 9)
    return lines


def _tabulate_by_scene(evidence: Evidence) -> pd.DataFrame:
    """Tabulate the verdicts by scene and claim, and P50.

    A star marks a verdict by calibration, a minus one that the numbers disagree with.
    """
    rows = []
    for scene in evidence.scenes:
        half = evidence.half_pressures[scene.name].pressure
        words = {
            verdict.claim: verdict.word + "*" * verdict.calibrated + "-" * (verdict.agrees is False)
            for verdict in scene.verdicts
        }
        rows.append({"scene": scene.name, **words, "P50": format_pressure(half) if half else "-"})
    return pd.DataFrame(rows)


def _align_left(frame: pd.DataFrame) -> dict:
    """Make formatters for ``DataFrame.to_string`` that align all columns left."""
    return {name: f"{{:{max(map(len, (name, *frame[name])))}}}".format for name in frame}


def _format_p(verdict: Verdict) -> str:
    """Format a p-value; a dash without one."""
    return "-" if verdict.p is None else f"{verdict.p:.2g}"


def _describe_one_scene(evidence: Evidence, half_pressures: dict[str, str]) -> list[Block]:
    """Describe the verdicts by one scene, and its P50."""
    (scene,) = evidence.scenes
    verdicts = [*scene.verdicts, *(verdict for verdict in evidence.over_scenes if verdict.word != NOT_RUN)]
    return [
        f"Snow and floor: {escape(scene.name)}. {_explain_numbers(evidence)}",
        Table(_tabulate_verdicts(verdicts), data="claims.csv"),
        f"{P50.format(unit=evidence.pressure_unit)}: **{half_pressures[scene.name]}**.",
    ]


def _describe_several_scenes(evidence: Evidence) -> list[Block]:
    """Describe the verdicts by all scenes together, and by each scene alone."""
    words = [verdict.word for scene in evidence.scenes for verdict in scene.verdicts]
    open_verdicts = f"{words.count(INCONCLUSIVE)} verdicts are inconclusive, {words.count(NOT_RUN)} not run"
    return [
        Table(_tabulate_verdicts(evidence.over_scenes), data="claims.csv"),
        (
            "Each scene alone (\\* by calibration, no test; - the numbers disagree; "
            f"{P50.format(unit=evidence.pressure_unit)}; {open_verdicts}). "
            f"{_explain_numbers(evidence)}"
        ),
        Table(_tabulate_by_scene(evidence).map(escape), data="claims.csv"),
    ]


def _explain_numbers(evidence: Evidence) -> str:
    """Explain what the numbers in a table of verdicts are."""
    return (
        f"{_format_seeds(evidence)}. Effects are mass fractions in lumps: highest less lowest pressure, or the mean "
        "nearest to the other side of 1/2. Seeds show numerical repeatability, not physical replication. All numbers: "
        "[claims.csv](claims.csv), [claims.json](claims.json)."
    )


def _format_rules(alpha: float) -> list[Block]:
    """Format the rules by which claims are decided.  ``alpha``: the error that a verdict may have."""
    return [RULES.format(alpha=alpha, level=f"{1 - alpha:.0%}")]


def _tabulate_verdicts(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """Tabulate verdicts with their numbers, one row for each."""
    rows = [
        {
            "claim": verdict.claim,
            "statement": escape(verdict.statement),
            "measured": verdict.measured,
            "effect [interval]": verdict.effect_text or "-",
            "seeds": verdict.seeds,
            "p": _format_p(verdict),
            "τ [interval]": format_interval(verdict.tau) if verdict.tau else "-",
            "verdict": f"**{verdict.label}**",
            "against it": "; ".join(verdict.disagrees) or "-",
            "note": verdict.note or "-",
        }
        for verdict in verdicts
    ]
    return pd.DataFrame(rows)


def _describe_calibration(evidence: Evidence) -> list[Block]:
    """Say what is calibration and what is prediction."""
    calibrated_on = evidence.experiment.calibrated_on
    if not calibrated_on:
        return []
    claims = [
        verdict.claim
        for scene in evidence.scenes
        if scene.calibrated
        for verdict in scene.verdicts
        if verdict.calibrated
    ]
    text = (
        f"The paper prints no pressures. They were chosen on {' on '.join(calibrated_on)}, by its sintered lumps alone."
    )
    if claims:
        text += f" So {', '.join(claims)} are no test there; what is said of unsintered snow is one."
    if len(evidence.scenes) > bool(claims):
        text += " All other scenes are prediction."
    return [text]
