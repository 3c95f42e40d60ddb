"""An eye as witness: where a claim speaks of powder, and the picture shows snow in one piece, the report says so."""

from collections.abc import Sequence

import pandas as pd

from ...evidence.claims import ARMS_OF, JudgedScene
from ...settings.question import Claim
from ...summary.row import ARM

ONE_BODY = 0.95  # of the area that is covered, in the largest body
FEW = 0.05  # of the mass, loose


def describe_bodies(scenes: Sequence[JudgedScene], claims: Sequence[Claim]) -> list[str]:
    """Say for each claim of fewer lumps that the numbers agree with in how many of its runs an eye sees one body.

    Nothing where it sees several, or where snow came apart.
    """
    lines = []
    for claim in claims:
        if claim.test != "below" or claim.measure != "lump_fraction":
            continue
        agreeing = [scene for scene in scenes if scene.verdict(claim.name).agrees]
        runs = [select_runs(scene.table, claim) for scene in agreeing if len(scene.table)]
        table = pd.concat(runs).reindex(columns=["largest_seen", "loose_fraction"]) if runs else pd.DataFrame()
        whole = int(((table["largest_seen"] > ONE_BODY) & (table["loose_fraction"] < FEW)).sum()) if runs else 0
        if whole:
            how_many = f"{whole} of {len(table)} of these runs"
            lines.append(f"**{claim.name}**: an eye sees one body in {how_many}: crushed, not come apart.")
    return lines


def select_runs(table: pd.DataFrame, claim: Claim) -> pd.DataFrame:
    """Select the rows of the runs that a claim is about."""
    own = table[table[ARM].isin(ARMS_OF[claim.of])]
    pressures = {"every": own["pressure"], "lowest": [own["pressure"].min()], "highest": [own["pressure"].max()]}
    return own[own["pressure"].isin(pressures[claim.at])]
