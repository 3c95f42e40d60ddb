"""Tier 4: what the runs say of the paper's claims, beside what they said before."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from ..analysis import claims
from ..report.evidence import gathered
from ..sweep.plan import Plan
from .finding import CONTRADICTED, FAILED, NOT_MEASURED, OK, REGRESSED, Finding

KEYS = ["experiment", "fidelity", "seeds", "claim"]


def table(experiment: str, plan: Plan) -> pd.DataFrame:
    """The verdicts on an experiment's runs: a row a claim, with KEYS, verdict, and what was measured."""
    evidence = gathered(plan.configs, Path("."))
    over = [v for v in evidence.over_scenes if len(evidence.scenes) > 1]
    found = over or [v for scene in evidence.scenes for v in scene.verdicts]
    about = {"experiment": experiment, "fidelity": plan.configs[0].fidelity.name, "seeds": len(evidence.seeds)}
    return pd.DataFrame(
        [{**about, "claim": v.claim, "verdict": v.word, "numbers": v.way, "measured": v.measured} for v in found]
    )


def compare(found: pd.DataFrame, reference: pd.DataFrame) -> list[Finding]:
    """Each verdict beside the one before.

    A claim that was contradicted before may be again, and one that was not decided may be still; every change fails,
    for the better too: then the reference is to be renewed.
    """
    return [_compare(row, _before(row, reference)) for row in found.to_dict("records")]


def _before(row: dict, reference: pd.DataFrame) -> str | None:
    if reference.empty:
        return None
    own = reference[(reference[KEYS] == pd.Series({key: row[key] for key in KEYS})).all(axis=1)]
    return None if own.empty else str(own.iloc[0]["verdict"])


def _compare(row: dict, before: str | None) -> Finding:
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


def changes(before: pd.DataFrame, after: pd.DataFrame) -> Sequence[str]:
    """What a new reference changes, in words."""
    lines = []
    for row in after.to_dict("records"):
        old = _before(row, before)
        if old != row["verdict"]:
            place = ", ".join(str(row[key]) for key in KEYS)
            lines.append(f"{place}: {old or 'new'} -> {row['verdict']}")
    return lines or [f"{len(after)} verdicts, none changed"]
