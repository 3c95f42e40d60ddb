"""By how much the paper's claims hold at each point of a sample, or at each setting of a sweep over pressures."""

import numpy as np
import pandas as pd

from ..settings.question import Claim
from ..store import states
from .choices import list_judged
from .claims import judge_values, pair_values
from .collect import POINT, CollectedSweep

APART = ("pressure", "sintering", "seed")  # what a claim looks at together, and so is no setting that its margin is of


def list_margins(sweep: CollectedSweep) -> list[str]:
    """List the claims that have margins in a sweep: none unless it lists pressures and has both arms."""
    listed = set(sweep.varied).difference(sweep.factors)
    return [claim.name for claim in _list_claims(sweep)] if {"pressure", "sintering"} <= listed else []


def find_claim(sweep: CollectedSweep, name: str) -> Claim | None:
    """Find a claim that has margins in a sweep by its name; None if it is no such name."""
    if name not in list_margins(sweep):
        return None
    return next(claim for claim in _list_claims(sweep) if claim.name == name)


def read_margins(sweep: CollectedSweep, claim: Claim) -> pd.Series:
    """Read by how much a claim holds at each point, negative where the numbers disagree: see ``VerdictPart.margin``.

    A value for each row of the sweep's table: in the row of the first run of a point, NaN in all others, and where a
    run that the claim needs has no result.
    """
    table = sweep.table.assign(arm=[run.case.arm for run in sweep.runs])
    points = [POINT] if POINT in table else []
    places = [*points, *(name for name in sweep.varied if name not in (*sweep.factors, *APART))]
    alpha = sweep.runs[0].config.question.claims.alpha
    groups = table.groupby(places, sort=False) if places else [((), table)]
    margins = pd.Series(np.nan, table.index)
    for _, own in groups:
        missing = own.loc[own["state"] != states.DONE, ["arm", "pressure"]].itertuples(index=False, name=None)
        done = own[own["state"] == states.DONE]
        margin = judge_values(claim, alpha, pair_values(claim, done, list(missing))).margin
        margins[own.index[0]] = np.nan if margin is None else margin
    return margins


def _list_claims(sweep: CollectedSweep) -> list[Claim]:
    """List the claims of one scene that the sweep's runs are asked about."""
    return list_judged(sweep.runs[0].config.question.claims)
