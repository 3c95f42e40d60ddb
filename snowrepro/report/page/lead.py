"""The top of a report: which runs there are, the verdict on each claim, and the reproduced figure."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest

import pandas as pd

from ...evidence.answer import HOLDS, NOT, ONLY_IF, OPEN, Answer, answer_claims
from ...evidence.claims import (
    NOT_RUN,
    STATES,
    Count,
    JudgedScene,
    Verdict,
    format_interval,
    list_calibrated_claims,
)
from ...evidence.fitted import fit_readings
from ...evidence.gather import Evidence
from ...quantities import DENSITY, PRESSURE, format_powers
from ...settings.case import Case
from ...settings.question import Claim
from ...store import states
from ..document import Block, Heading, Picture, Section, Table, escape, format_code, format_list, join_names
from ..figures.kinds import find_figure
from ..sections.variants import describe_change

FITTED = "fitted"  # the picture of the experiment that tries readings
ELSEWHERE = "Judged on its own page, as it reads the paper otherwise"
WITHOUT_CHANGES = "What is said to be calibrated, or printed in the paper, is so without these changes."
SHOWN_ABOVE = "The first picture of this section is at the top of the report."


def make_lead(
    evidences: Sequence[Evidence], sections: Sequence[Section], not_run: Sequence[str] = ()
) -> tuple[Section, list[Section]]:
    """Make the first section of a report, the summary.

    ``not_run``: titles of experiments that are in ``sections`` without a run.  Returns the summary and the other
    sections; the picture that moved into the summary is replaced there by a sentence.
    """
    judged = list_judged(evidences)
    anchor = (judged or evidences)[0].experiment.name
    chosen = next(section for section in sections if section.anchor == anchor)
    picture = next((block for block in chosen.blocks if isinstance(block, Picture)), None)
    blocks: list[Block] = [describe_runs(evidences)]
    if changed := list_changed_settings(chosen.command):
        named = ", ".join(map(format_code, changed))
        blocks.append(f"**Changed** of the experiment's own settings: {named}. {WITHOUT_CHANGES}")
    if len(sections) > 1:
        blocks += [
            *make_columns(judged, find_losing_readings(evidences)),
            format_list(describe_scope(evidences, not_run)),
        ]
    if judged:
        blocks += [Heading("The claims"), format_list(describe_claims(judged))]
    if picture:
        blocks.append(picture)
    first = Section("summary", "Summary", blocks, command=chosen.command, runs=chosen.runs)
    others = [_take_picture_out(section, picture) if section is chosen else section for section in sections]
    return first, others


def list_judged(evidences: Sequence[Evidence]) -> list[Evidence]:
    """List the experiments that claims are judged by, in the reading of the first: another one is another question."""
    judged = [evidence for evidence in evidences if find_figure(evidence.experiment).is_judged]
    return [evidence for evidence in judged if _name_reading(evidence) == _name_reading(judged[0])]


def _name_reading(evidence: Evidence) -> str:
    """Return the name of the reading that an experiment begins with."""
    return evidence.runs[0].case.reading.name


def find_losing_readings(evidences: Sequence[Evidence]) -> dict[str, list[str]]:
    """Find the readings under which claims are lost, in words by the claim; none where no reading was tried so."""
    tried = [each for each in evidences if each.experiment.picture == FITTED and not each.table.empty]
    return {
        name: [describe_change(changes) for changes in readings]
        for evidence in tried
        for name, readings in fit_readings(evidence).list_lost().items()
    }


def make_columns(judged: Sequence[Evidence], lost: Mapping[str, Sequence[str]]) -> list[Block]:
    """Make the answer in three columns, a claim in each cell, and name the claims that nothing decides.

    ``judged``: the experiments that claims are judged by; without any there is nothing to answer.  ``lost``: by the
    names of claims, the readings under which they are lost.
    """
    if not judged:
        return []
    answers = answer_claims(judged, lost)
    cells = {name: [_write_answer(each) for each in answers if each.column == name] for name in (HOLDS, ONLY_IF, NOT)}
    table = pd.DataFrame([*zip_longest(*cells.values(), fillvalue="")], columns=[*cells])
    caption = (
        "By the words of the verdicts, and by the readings of the paper that were tried on one scene with pressures of "
        "their own. Holds: reproduced in every scene judged, not only by the choice of its pressures, and lost under "
        "no reading. Does not hold: contradicted, and reproduced nowhere. Holds only if: all else that is "
        "reproduced somewhere. That readings count was added, as the stricter rule, when their results were known."
    )
    blocks: list[Block] = [Table(table, caption)] if len(table) else []
    undecided = [each.claim.name for each in answers if each.column == OPEN]
    return [*blocks, f"Not decided: {escape(join_names(undecided, 'and'))}."] if undecided else blocks


def _write_answer(answer: Answer) -> str:
    """Write a claim with the scenes that put it into its column."""
    return f"**{escape(answer.claim.name)}.** {escape(answer.claim.statement)} *{escape(answer.why)}*"


def list_changed_settings(command: str) -> list[str]:
    """List the overrides by which the command of an experiment changes what its file says of runs.

    Seeds, fidelity and how runs are started are no such change.  Empty for a command without an experiment's file.
    """
    words = [word for word in shlex.split(command)[2:] if not word.startswith("-")]
    if not any(word.startswith("experiment=") for word in words):
        return []
    return [word for word in words if not word.startswith(("experiment=", "seed=", "fidelity=", "hydra"))]


def describe_scope(evidences: Sequence[Evidence], not_run: Sequence[str]) -> list[str]:
    """Say what a report on several experiments tests, what it only fits, what was not run, and what all of it assumes.

    ``not_run``: titles.
    """
    kinds: dict[str, list[str]] = {"Tested": [], "Fitted": [], ELSEWHERE: [], "Shown, not judged": []}
    judged = list_judged(evidences)
    for evidence in evidences:
        kinds[_find_kind(evidence, judged)].append(escape(evidence.experiment.title))
    kinds["Not run here"] = [escape(title) for title in not_run]
    lines = [f"**{kind}**: {'; '.join(titles)}." for kind, titles in kinds.items() if titles]
    if not kinds["Tested"]:
        lines.insert(0, "**Tested**: nothing.")
    if kinds["Fitted"]:
        by_choice = join_names(list_calibrated_claims(evidences[0].runs[0].config.question.claims), "and")
        lines.append(
            f"**Fitted** means that the pressures were chosen on this scene: {by_choice} hold there by choice."
        )
    assumed = "pressures, gravity, time step, grid, shapes and more"
    return [*lines, f"**Assumed**: all that [the paper leaves open](#choices): {assumed}."]


def _find_kind(evidence: Evidence, judged: Sequence[Evidence]) -> str:
    """Find whether an experiment tests claims, is fitted to them, does so in another reading, or is only shown."""
    if not find_figure(evidence.experiment).is_judged:
        return "Shown, not judged"
    if all(evidence is not each for each in judged):
        return ELSEWHERE
    return "Fitted" if all(scene.calibrated for scene in evidence.scenes) else "Tested"


def describe_runs(evidences: Sequence[Evidence]) -> str:
    """Say how many runs there are, how many are missing, and of which reading and fidelity they are."""
    runs = {
        run.id: run for evidence in evidences if find_figure(evidence.experiment).needs_runs for run in evidence.runs
    }
    if not runs:
        return "Nothing is simulated for this."
    counts: dict[str, int] = {}
    for standing in states.standings(list(runs.values())):
        counts[standing.state] = counts.get(standing.state, 0) + 1
    done = counts.pop(states.DONE, 0)
    missing = "".join(f"; **{count} {state}**" for state, count in counts.items())
    cases = [run.case for run in runs.values()]
    readings = dict.fromkeys(format_code(case.reading.name) for case in cases)
    fidelities = dict.fromkeys(format_code(case.fidelity.name) for case in cases)
    return (
        f"{done} of {len(runs)} runs are done{missing}. Reading {', '.join(readings)}, fidelity "
        f"{', '.join(fidelities)}. {_explain_units(cases[0]) if len(readings) == 1 else ''}".rstrip()
    )


def _explain_units(case: Case) -> str:
    """Explain what the numbers of pressures and densities mean, in a case's reading."""
    length = case.reading.length_unit
    pressure, density = (format_powers(powers, [length]) for powers in (PRESSURE, DENSITY))
    grid = (
        "cells of the paper's grid" if length == "cell" else f"{length}; a cell of the grid is {case.reading.cell:g} m"
    )
    return (
        f"The snow is two-dimensional. Lengths are in {grid}. So pressures are in {pressure}, like the initial Young's "
        f"modulus of {case.material.E:,.0f}, and densities in {density}, {case.material.rho:g} at the start."
    )


def describe_claims(judged: Sequence[Evidence]) -> list[str]:
    """Describe each claim with the verdicts on it, tests before calibration."""
    claims = judged[0].runs[0].config.question.claims
    lines = []
    for claim in claims.list:
        sentences = sorted((order, text) for evidence in judged for order, text in _describe_claim(claim, evidence))
        if sentences:
            lines.append(
                f"**{escape(claim.name)}.** {escape(claim.statement)} " + " ".join(text for _, text in sentences)
            )
    return lines


def _describe_claim(claim: Claim, evidence: Evidence) -> list[tuple[int, str]]:
    """Describe what one experiment says of a claim, as (rank in the order of sentences, sentence)."""
    where = evidence.experiment.figure or evidence.experiment.title
    if claim.test == "scenes":
        verdicts = [v for v in evidence.over_scenes if v.claim == claim.name and v.word != NOT_RUN]
        return [(1, f"**{v.word}**: {escape(v.measured)}. {escape(v.note)}".rstrip()) for v in verdicts]
    if len(evidence.scenes) == 1:
        (scene,) = evidence.scenes
        verdict = scene.verdict(claim.name)
        return [(2 if verdict.calibrated else 0, _describe_verdict(claim, verdict, scene, where))]
    counts = [count for v in evidence.over_scenes for count in v.counts if count.claim == claim.name]
    return [(1, _describe_count(count)) for count in counts]


def _describe_count(count: Count) -> str:
    """Say on how many shapes a claim holds by its numbers, and on which it does not."""
    if not count.by_shape:
        return f"**{NOT_RUN}** in all other scenes."
    against = [shape.shape for shape in count.by_shape if not shape.holds]
    but = f", not on {escape(join_names(against, 'and'))}" if against else ""
    return f"On other scenes the numbers agree with {escape(count.words)}{but}."


def _describe_verdict(claim: Claim, verdict: Verdict, scene: JudgedScene, where: str) -> str:
    """Describe a verdict with the number that it rests on."""
    place = f"{escape(where)}, {escape(scene.name)}"
    if verdict.word == NOT_RUN:
        return f"**{NOT_RUN}**, {place}: {escape(verdict.note)}."
    if verdict.same_as:
        return f"The same numbers as {escape(verdict.same_as)}, {place}: unsintered snow is the same at every pressure."
    number = f" {verdict.measured}"
    if verdict.effect:
        change = ", smallest change from" if claim.test == "rises" else ""
        number = f"{change} {verdict.effect_of}: {format_interval(verdict.effect)}"
        if not verdict.effect.is_of_equals:
            number += f", {verdict.seeds} seed{'s' * (verdict.seeds != 1)}"
    disagreement = "" if verdict.direction == "agree" else "; the numbers disagree"
    beside = f" ({verdict.beside})" if verdict.beside else ""
    measure = f"mass {STATES[claim.measure]}" if claim.measure in STATES else claim.measure.replace("_", " ")
    remark = verdict.label.removeprefix(verdict.word)
    return f"**{verdict.word}**{remark}, {place}: {measure}{escape(number + beside)}{disagreement}."


def _take_picture_out(section: Section, picture: Picture | None) -> Section:
    """Return the section without ``picture``; a sentence behind the pictures that follow it says where it is.

    A heading that had this picture alone goes with it, and then there is no sentence.
    """
    blocks = [block for block in section.blocks if block is not picture]
    if picture:
        behind = list(section.blocks).index(picture)
        neighbours = blocks[max(behind - 1, 0) : behind + 1]
        if neighbours and all(isinstance(block, Heading) for block in neighbours):
            del blocks[behind - 1]
            return replace(section, blocks=blocks)
        while behind < len(blocks) and isinstance(blocks[behind], Picture):
            behind += 1
        blocks.insert(behind, SHOWN_ABOVE)
    return replace(section, blocks=blocks)
