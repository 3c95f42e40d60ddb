"""What a reader sees first: what was run, the verdict on each claim in a sentence, and the paper's figure redone."""

from collections.abc import Sequence

from ..analysis.claims import NOT_RUN, Count, Scene, Verdict, interval
from ..config import Claim
from ..store import runs, states
from .document import Block, Heading, Picture, Section, code, listed, plain
from .evidence import Evidence

SHOWN_ABOVE = "This picture is shown at the top of the page."


def lead(evidences: Sequence[Evidence], sections: Sequence[Section]) -> tuple[Section, list[Section]]:
    """The first section of a report, and the others without the picture that went into it."""
    judged = [evidence for evidence in evidences if evidence.experiment.is_judged]
    shown = (judged or evidences)[0].experiment.name
    chosen = next(section for section in sections if section.anchor == shown)
    picture = next((block for block in chosen.blocks if isinstance(block, Picture)), None)
    blocks: list[Block] = [what_was_run(evidences)]
    if judged:
        blocks += [Heading("The claims"), listed(claim_lines(judged))]
    if picture:
        blocks.append(picture)
    first = Section("summary", "Summary", blocks, redo=chosen.redo, runs=chosen.runs)
    rest = [_without(section, picture) if section is chosen else section for section in sections]
    return first, rest


def what_was_run(evidences: Sequence[Evidence]) -> str:
    """How many runs there are and are missing, of which kind."""
    configs = {runs.identify(c): c for e in evidences if e.experiment.needs_runs for c in e.configs}
    if not configs:
        return "Nothing is simulated for this."
    counted: dict[str, int] = {}
    for standing in states.standings(list(configs.values())):
        counted[standing.state] = counted.get(standing.state, 0) + 1
    done = counted.pop(states.DONE, 0)
    lacking = "".join(f"; **{count} {state}**" for state, count in counted.items()) or ", none is missing"
    first = next(iter(configs.values()))
    return (
        f"{done} of {len(configs)} runs are done{lacking}. Reading {code(first.reading.name)}, fidelity "
        f"{code(first.fidelity.name)}."
    )


def claim_lines(judged: Sequence[Evidence]) -> list[str]:
    """Each claim with what the runs say of it, tests before calibration."""
    claims = judged[0].configs[0].claims
    lines = []
    for claim in claims.list:
        found = sorted((order, text) for evidence in judged for order, text in _told(claim, evidence))
        if found:
            lines.append(f"**{plain(claim.name)}.** {plain(claim.statement)} " + " ".join(text for _, text in found))
    return lines


def _told(claim: Claim, evidence: Evidence) -> list[tuple[int, str]]:
    """What one experiment says of a claim, with its rank among others."""
    where = evidence.experiment.figure or evidence.experiment.title
    if claim.test == "scenes":
        found = [v for v in evidence.over_scenes if v.claim == claim.name and v.word != NOT_RUN]
        found_on = f"{len([scene for scene in evidence.scenes if not scene.calibrated])} other scenes"
        return [(1, f"**{v.word}** by {found_on}: the numbers agree with {plain(v.measured)}.") for v in found]
    if len(evidence.scenes) == 1:
        (scene,) = evidence.scenes
        verdict = scene.verdict(claim.name)
        return [(2 if verdict.calibrated else 0, _sentence(claim, verdict, scene, where))]
    counts = [count for v in evidence.over_scenes for count in v.counts if count.claim == claim.name]
    return [(1, _counted(count)) for count in counts]


def _counted(count: Count) -> str:
    """In how many scenes the numbers agree with a claim."""
    if not count.scenes:
        return f"**{NOT_RUN}** in all other scenes."
    return f"The numbers agree in {count.holds} of {count.scenes} other scenes."


def _sentence(claim: Claim, verdict: Verdict, scene: Scene, where: str) -> str:
    """A verdict with the number that it rests on."""
    at = f"{plain(where)}, {plain(scene.name)}"
    if verdict.word == NOT_RUN:
        return f"**{NOT_RUN}**, {at}: {plain(verdict.note)}."
    seeds = f"{verdict.seeds} seed{'s' * (verdict.seeds != 1)}"
    number = verdict.measured
    if verdict.effect:
        change = "change from " if claim.test == "rises" else ""
        number = f"{change}{verdict.effect_of}: {interval(verdict.effect)}"
    way = "" if verdict.way == "agree" else "; the numbers disagree"
    measure = "mass in lumps" if claim.measure == "lump_fraction" else claim.measure.replace("_", " ")
    beside = verdict.shown.removeprefix(verdict.word)
    return f"**{verdict.word}**{beside}, {at}: {measure} {plain(number)}, {seeds}{way}."


def _without(section: Section, picture: Picture | None) -> Section:
    blocks = [SHOWN_ABOVE if block is picture and picture else block for block in section.blocks]
    return Section(section.anchor, section.title, blocks, section.says, section.redo, section.runs)
