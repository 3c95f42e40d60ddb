"""The verdicts on the paper's claims, as text for the screen and as a section of a report."""

import textwrap
from collections.abc import Mapping, Sequence

import pandas as pd

from ...evidence.calibration import Crossing
from ...evidence.claims import (
    CONTRADICTED,
    INCONCLUSIVE,
    LEAST_SEEDS,
    NOT_RUN,
    REPRODUCED,
    Verdict,
)
from ...evidence.gather import Evidence
from ...evidence.scenes import LEAST_SHAPES
from ..document import Block, Fold, Heading, Picture, Table, escape
from .records import write_claims
from .response import draw_response
from .witness import describe_bodies

WIDTH = 100  # of a line on the screen
# Of verdicts, in a table on the screen.
SHORT = {REPRODUCED: "yes", CONTRADICTED: "no", INCONCLUSIVE: "open", NOT_RUN: "not run"}
P50 = "P50, the pressure at which half of the sintered mass is in lumps [{unit}]"

RULES = """\
* Seeds are blocks: the same ones at every pressure. A seed changes the particles' random places alone, so seeds show
  numerical repeatability, not physical replication. One seed decides nothing.
* Intervals are Student's over seeds at {level}, so each end alone is wrong with a chance of {alpha:g}. Those of mass
  fractions are cut at 0 and 1, which changes no verdict. Where all seeds are equal there is none, and their value
  decides.
* **Below, above**. REPRODUCED: the whole interval lies on the claimed side of the threshold at every pressure named.
  CONTRADICTED: at one of them it lies on the other side (Bonferroni over pressures).
* **Rises**. The same for every step between neighbouring pressures, taken seed by seed: each lies above the threshold,
  or one of them below it. So a flat or falling step anywhere is no rise.
* As every part must hold, the chance of a wrong REPRODUCED is at most {alpha:g} where seeds are normal:
  benchmarks/claims.md has it simulated. The effect shown is that of the part nearest to the other side.
* A claim about powder is judged twice: as what is in no lump, and as what came loose. What is crushed is neither a
  lump nor loose, and stands beside.
* Where unsintered snow is the same at every pressure, a rise of what sintering adds has the same numbers as the rise
  of sintered snow. Then it is named so and counts once.
* **Scenes**. A claim holds on a shape if the means agree in more than the threshold's share of its scenes.
  REPRODUCED: every claim holds on every shape. CONTRADICTED: one holds on none. Scenes of a shape are no independent
  trials, so there is no p, and {shapes} shapes are needed. Scenes that give the same as the calibrated one are left
  out.
* Else INCONCLUSIVE; NOT RUN where a run is missing. Where the rules for both are met, CONTRADICTED stands."""


def make_blocks(evidence: Evidence) -> list[Block]:
    """Make the verdicts, the picture that they rest on, the rules, and what is calibration.

    Writes response.png, claims.json and claims.csv into the report's folder.
    """
    scenes = evidence.scenes
    half_pressures = {scene.name: format_half_pressure(evidence.half_pressures[scene.name]) for scene in scenes}
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
            "Mass in lumps over pressure, with and without sintering: seeds, means, and the pressures around P50.",
            "Points: seeds; bars: means, joined by lines that say nothing of what is between; black: the two pressures "
            "between which half is in lumps in every seed. Orange with sintering, grey without."
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
        half_pressure = format_half_pressure(evidence.half_pressures[scene.name])
        half = textwrap.wrap(f"{P50.format(unit=evidence.pressure_unit)}: {half_pressure}", WIDTH)
        return [head, "", *_format_verdicts([*scene.verdicts, *evidence.over_scenes]), "", *half]
    frame = tabulate_by_scene(evidence, SHORT)
    return [
        head,
        "",
        *frame.to_string(index=False, justify="left", formatters=_align_left(frame)).splitlines(),
        "yes: reproduced; no: contradicted; open: inconclusive",
        "* by calibration, no test; - the numbers disagree",
        P50.format(unit=evidence.pressure_unit),
        "",
        *_format_verdicts(evidence.over_scenes),
    ]


def format_half_pressure(half: Crossing) -> str:
    """Format the bracket of P50, or say why there is none."""
    if half.note:
        return half.note
    seeds = "one seed" if half.seeds == 1 else f"in all {half.seeds} seeds"
    return f"{format_bracket(half)}, {seeds}"


def format_bracket(half: Crossing) -> str:
    """Format the pressures between which P50 is; a dash where they are not known."""
    if half.low is None:
        return "-" if half.high is None else f"below {half.high:g}"
    return f"above {half.low:g}" if half.high is None else f"{half.low:g} to {half.high:g}"


def _format_seeds(evidence: Evidence) -> str:
    """Format the seeds that were asked for; where they are too few to reproduce a claim, how many are needed."""
    text = f"Seed{'s' * (len(evidence.seeds) > 1)} {', '.join(map(str, evidence.seeds))}"
    if len(evidence.seeds) >= LEAST_SEEDS:
        return text
    return f"{text}: too few for REPRODUCED, which needs at least {LEAST_SEEDS}, more where numbers vary much"


def _format_verdicts(verdicts: Sequence[Verdict]) -> list[str]:
    """Format verdicts as lines: numbers and verdict, the statement, and what is against it."""
    lines = [f"{'claim':9} {'effect [interval]':40} {'seeds':5} verdict"]
    for verdict in verdicts:
        effect, seeds = verdict.effect_text or "-", verdict.seeds or "-"
        lines.append(f"{verdict.claim:9} {effect:40} {seeds:<5} {verdict.label}")
        for text in (
            verdict.statement,
            verdict.measured if verdict.counts else "",
            verdict.beside,
            f"against it: {'; '.join(verdict.disagrees)}" if verdict.disagrees else "",
            _format_note(verdict),
        ):
            lines += textwrap.wrap(text, WIDTH, initial_indent=" " * 7, subsequent_indent=" " * 9)
    return lines


def tabulate_by_scene(evidence: Evidence, short: Mapping[str, str] | None = None) -> pd.DataFrame:
    """Tabulate the verdicts by scene and claim, and P50.  ``short``: other words for them.

    A star marks a verdict by calibration, a minus one that the numbers disagree with.
    """
    rows = []
    for scene in evidence.scenes:
        words = {
            verdict.claim: f"= {verdict.same_as}"
            if verdict.same_as
            else (short or {}).get(verdict.word, verdict.word)
            + "*" * verdict.calibrated
            + "-" * (verdict.agrees is False)
            for verdict in scene.verdicts
        }
        rows.append({"scene": scene.name, **words, "P50": format_bracket(evidence.half_pressures[scene.name])})
    return pd.DataFrame(rows)


def _align_left(frame: pd.DataFrame) -> dict:
    """Make formatters for ``DataFrame.to_string`` that align all columns left."""
    return {name: f"{{:{max(map(len, (name, *frame[name])))}}}".format for name in frame}


def _format_note(verdict: Verdict) -> str:
    """Format the note of a verdict, and which claim has the same numbers."""
    same = f"the same numbers as {verdict.same_as}, counts once" if verdict.same_as else ""
    return "; ".join(filter(None, [same, verdict.note]))


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
    words = [verdict.word for scene in evidence.scenes for verdict in scene.verdicts if not verdict.same_as]
    open_verdicts = f"{words.count(INCONCLUSIVE)} verdicts are inconclusive, {words.count(NOT_RUN)} not run"
    return [
        Table(_tabulate_verdicts(evidence.over_scenes), data="claims.csv"),
        (
            "Each scene alone (\\* by calibration, no test; - the numbers disagree; "
            f"{P50.format(unit=evidence.pressure_unit)}; {open_verdicts}). "
            f"{_explain_numbers(evidence)}"
        ),
        Table(tabulate_by_scene(evidence).map(escape), data="claims.csv"),
    ]


def _explain_numbers(evidence: Evidence) -> str:
    """Explain what the numbers in a table of verdicts are."""
    return (
        f"{_format_seeds(evidence)}. The effect is that of the pressure, or the step between two, which is nearest to "
        "the other side of the threshold. Height lost is of the middle nine tenths of the mass; it is negative where "
        "pieces fell deeper than the rest. Seeds show numerical repeatability, not physical replication. All numbers: "
        "[claims.csv](claims.csv), [claims.json](claims.json)."
    )


def _format_rules(alpha: float) -> list[Block]:
    """Format the rules by which claims are decided.  ``alpha``: the error that a verdict may have."""
    return [RULES.format(alpha=alpha, level=f"{1 - 2 * alpha:.0%}", shapes=LEAST_SHAPES)]


def _tabulate_verdicts(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """Tabulate verdicts with their numbers, one row for each."""
    rows = [
        {
            "claim": verdict.claim,
            "statement": escape(verdict.statement),
            "measured": verdict.measured,
            "effect [interval]": verdict.effect_text or "-",
            "seeds": verdict.seeds,
            "verdict": f"**{verdict.label}**",
            "beside it": verdict.beside or "-",
            "against it": "; ".join(verdict.disagrees) or "-",
            "note": _format_note(verdict) or "-",
        }
        for verdict in verdicts
    ]
    return pd.DataFrame(rows)


def _describe_calibration(evidence: Evidence) -> list[Block]:
    """Say what is calibration and what is a test."""
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
        text += (
            " On all other scenes the pressures are taken over. They are no blind prediction: rules and measure were "
            "changed after runs of them were seen."
        )
    return [text]
