"""Pressures chosen anew: which claims hold at each three of the pressures that were run, at each place of a table.

The paper prints no pressures.  So a claim can hold at a place if it holds at any three of them; all of them in favour
of the paper.  One seed agrees or disagrees; nothing is REPRODUCED so.
"""

from collections.abc import Sequence
from itertools import combinations

import pandas as pd

from ..settings.case import ARMS
from ..settings.question import Claim, Claims
from .claims import ARMS_OF, check_agreement

LUMPS = "lump_fraction"
CHOICE = ("low", "middle", "high")  # pressures, as many as the paper has
# All claims at once: those on the mass in lumps, and those on loose snow too.
BY_LUMPS, BY_BOTH = "by lumps", "by loose snow too"


def list_judged(claims: Claims) -> list[Claim]:
    """List the claims that choices are judged by: those of one scene."""
    return [claim for claim in claims.list if claim.test != "scenes"]


def judge_choices(claims: Claims, table: pd.DataFrame, place: Sequence[str]) -> pd.DataFrame:
    """Judge the claims for each three of the pressures that were run, at each place.

    ``table``: a row for each run, with arm, pressure and the claims' measures; ``place``: its columns that say where
    pressures are chosen.  Columns of the result: ``place``, CHOICE, and for each claim, and BY_LUMPS and BY_BOTH,
    whether the means over seeds agree; <NA> where a run that it needs has no result.
    """
    own = list_judged(claims)
    means = {measure: _spread_means(table, measure, place) for measure in {claim.measure for claim in own}}
    judged = [
        pd.DataFrame(
            dict(zip(CHOICE, choice, strict=True))
            | {claim.name: _judge_choice(claim, means[claim.measure], choice) for claim in own}
        )
        for choice in combinations(sorted(table["pressure"].unique()), len(CHOICE))
    ]
    names = [claim.name for claim in own]
    choices = pd.concat(judged).reset_index() if judged else pd.DataFrame(columns=[*place, *CHOICE, *names])
    known = choices[names].notna().all(axis=1)
    by_lumps = [claim.name for claim in own if claim.measure == LUMPS]
    together = {BY_LUMPS: by_lumps, BY_BOTH: names}
    return choices.assign(**{name: _hold_together(choices[each], known) for name, each in together.items()})


def _spread_means(table: pd.DataFrame, measure: str, place: Sequence[str]) -> pd.DataFrame:
    """Spread the means of a measure over (arm, pressure), a row for each place; NaN without a result."""
    values = table.astype({measure: float}).pivot_table(
        index=list(place), columns=["arm", "pressure"], values=measure, sort=False
    )
    own = table[list(place)].drop_duplicates()
    places = pd.MultiIndex.from_frame(own) if len(place) > 1 else pd.Index(own[place[0]])
    columns = pd.MultiIndex.from_product([ARMS, sorted(table["pressure"].unique())], names=["arm", "pressure"])
    return values.reindex(index=places, columns=columns)


def _judge_choice(claim: Claim, means: pd.DataFrame, choice: Sequence[float]) -> pd.Series:
    """Judge a claim at some pressures, for each place."""
    own = means.loc[:, [(arm, pressure) for arm in ARMS_OF[claim.of] for pressure in choice]]
    return check_agreement(claim, own).astype("boolean").mask(own.isna().any(axis=1))


def _hold_together(held: pd.DataFrame, known: pd.Series) -> pd.Series:
    """Return for each choice whether all of some claims hold; <NA> where a run of either arm has no result.

    Also if one of them is lost without it: else the choices that are known would be those that lose claims.
    """
    return held.eq(True).all(axis=1).astype("boolean").where(known)


def count_holding(holds: pd.Series) -> str:
    """Count the choices that hold, of those that are known: "3 of 56"."""
    return f"{int(holds.fillna(False).sum())} of {int(holds.notna().sum())}"
