"""Tier 4: the verdicts on the paper's claims, compared with those of the reference."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from ..evidence import claims
from ..evidence.gather import gather_evidence
from ..sweep.plan import Plan
from .finding import CONTRADICTED, FAILED, NOT_MEASURED, OK, REGRESSED, Finding

KEYS = ["experiment", "fidelity", "seeds", "claim"]


def tabulate_verdicts(experiment: str, plan: Plan) -> pd.DataFrame:
    """Tabulate the verdicts on an experiment's runs: a row for each claim, with KEYS, verdict and measured numbers."""
    evidence = gather_evidence(plan.runs, Path())
    over_scenes = [v for v in evidence.over_scenes if len(evidence.scenes) > 1]
    judged = over_scenes or [v for scene in evidence.scenes for v in scene.verdicts]
    about = {"experiment": experiment, "fidelity": plan.runs[0].case.fidelity.name, "seeds": len(evidence.seeds)}
    return pd.DataFrame(
        [{**about, "claim": v.claim, "verdict": v.word, "numbers": v.direction, "measured": v.measured} for v in judged]
    )


def compare_with_reference(table: pd.DataFrame, reference: pd.DataFrame) -> list[Finding]:
    """Compare each verdict with that of the reference; a finding for each.

    Every change fails, also one for the better: then the reference is to be renewed.  A claim that was contradicted, or
    undecided, may be so again.
    """
    return [_compare_verdict(row, _find_reference(row, reference)) for row in table.to_dict("records")]


def _find_reference(row: dict, reference: pd.DataFrame) -> str | None:
    """Find the verdict of the reference on the same claim of the same runs; None if there is none."""
    if reference.empty:
        return None
    rows = reference[(reference[KEYS] == pd.Series({key: row[key] for key in KEYS})).all(axis=1)]
    return None if rows.empty else str(rows.iloc[0]["verdict"])


def _compare_verdict(row: dict, before: str | None) -> Finding:
    """Compare a verdict with the one before."""
    name = f"{row['claim']} in {row['experiment']}, {row['fidelity']}, {row['seeds']} seeds"
    word, allowed = row["verdict"], before or ""
    if word == claims.NOT_RUN:
        state = FAILED
    elif word == before:
        state = OK
    elif word == claims.CONTRADICTED:
        state = CONTRADICTED
    else:
        state = REGRESSED if before else NOT_MEASURED
    note = row["measured"] if before else f"{row['measured']}; the reference does not have it"
    return Finding(4, name, state, word, allowed, note)


def describe_changes(before: pd.DataFrame, after: pd.DataFrame) -> Sequence[str]:
    """Describe what a new reference changes, a line for each verdict."""
    lines = []
    for row in after.to_dict("records"):
        old = _find_reference(row, before)
        if old != row["verdict"]:
            place = ", ".join(str(row[key]) for key in KEYS)
            lines.append(f"{place}: {old or 'new'} -> {row['verdict']}")
    return lines or [f"{len(after)} verdicts, none changed"]
