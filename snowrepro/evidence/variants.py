"""A figure's runs with one choice changed at a time, and what each change does to its numbers and claims."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import pandas as pd

from ..settings.base import Settings
from ..store.run import Run
from ..store.states import PENDING, standing
from . import claims
from .gather import Evidence

Changes = Mapping[str, Any]  # value by key
CELL_SECTIONS = {"shape", "floor", "sintering"}  # sections whose name says which cell of the figure a run is
LEAST_MOVE = 0.005  # of the mass in lumps beyond the seeds; less is not reported


@dataclass(frozen=True)
class Variant:
    """A figure's runs with one change.

    ``changes``: value by key, where it differs from the base; ``pressures``: of its runs, rising; ``table``: rows of
    its finished runs; ``verdicts``: on its claims; ``others``: the states of its other runs.
    """

    changes: Changes
    pressures: Sequence[float]
    table: pd.DataFrame
    verdicts: Sequence[claims.Verdict]
    others: Sequence[str] = ()

    @property
    def name(self) -> str:
        """The change as one would type it on the command line."""
        return name_changes(self.changes)

    @property
    def is_seed(self) -> bool:
        """Whether it changes the seed alone, and so only the particles' random places."""
        return set(self.changes) <= {"seed"}

    @cached_property
    def lumps(self) -> pd.Series:
        """The mass in lumps with sintering, by pressure; NaN where there is no result."""
        return self._mean_lumps("sintered").reindex(self.pressures)

    @cached_property
    def unsintered_lumps(self) -> float:
        """The largest mass in lumps without sintering, of all pressures."""
        return float(self._mean_lumps("unsintered").max())

    @property
    def agreed_claims(self) -> list[str]:
        """The claims that the numbers agree with."""
        return [v.claim for v in self.verdicts if v.agrees]

    @property
    def unjudged_claims(self) -> list[str]:
        """The claims for which runs are missing."""
        return [v.claim for v in self.verdicts if v.agrees is None]

    @property
    def was_tried(self) -> bool:
        """Whether any of its runs was done or at least begun."""
        return len(self.table) > 0 or any(state != PENDING for state in self.others)

    @property
    def unfinished(self) -> str:
        """The number of runs without a result by state: '2 failed, 1 pending'; empty if there are none."""
        return ", ".join(f"{count} {state}" for state, count in Counter(self.others).items())

    def _mean_lumps(self, arm: str) -> pd.Series:
        """Return the mean mass in lumps of one arm by pressure."""
        return claims.select_arm(self.table, arm, "lump_fraction").mean()


@dataclass(frozen=True)
class Comparison:
    """Variants compared with the first of them, the base; a change counts where it exceeds the spread over seeds."""

    variants: Sequence[Variant]

    @property
    def base(self) -> Variant:
        """The variant without any change."""
        return self.variants[0]

    @property
    def changed_variants(self) -> list[Variant]:
        """The variants that change more than the seed."""
        return [variant for variant in self.variants if not variant.is_seed]

    @cached_property
    def spread(self) -> pd.DataFrame:
        """The least and the largest mass in lumps over the seeds, by pressure."""
        seeds = pd.concat([variant.lumps for variant in self.variants if variant.is_seed], axis=1)
        return pd.DataFrame({"least": seeds.min(axis=1), "most": seeds.max(axis=1)})

    def find_moves(self, variant: Variant) -> pd.Series:
        """Find by how much a variant's mass in lumps lies beyond that of all seeds, at the pressures where it does."""
        if variant.is_seed:
            return pd.Series(dtype=float)
        above = (variant.lumps - self.spread["most"]).clip(lower=0.0)
        below = (variant.lumps - self.spread["least"]).clip(upper=0.0)
        moves = (above + below).dropna()
        return moves[moves.abs() >= LEAST_MOVE]

    def measure_farthest_move(self, variant: Variant) -> float:
        """Return the largest move of a variant, without sign; 0 without one."""
        return float(self.find_moves(variant).abs().max()) if len(self.find_moves(variant)) else 0.0

    def list_lost_claims(self, variant: Variant) -> list[str]:
        """List the claims of the base that a variant's numbers disagree with."""
        agreed = self.base.agreed_claims
        return [c for c in agreed if c not in variant.agreed_claims and c not in variant.unjudged_claims]

    def list_gained_claims(self, variant: Variant) -> list[str]:
        """List the claims that a variant's numbers agree with and the base's do not."""
        agreed, unjudged = self.base.agreed_claims, self.base.unjudged_claims
        return [c for c in variant.agreed_claims if c not in agreed and c not in unjudged]


def name_changes(changes: Changes) -> str:
    """Name changes as one would type them on the command line; "base" if there are none."""
    return ", ".join(f"{key}={format_setting(value)}" for key, value in changes.items()) or "base"


def format_setting(value: Any) -> str:
    """Write the value of a setting as one would type it on the command line."""
    return str(list(value)).replace(" ", "") if isinstance(value, tuple) else str(value)


def compare_variants(evidence: Evidence) -> Comparison:
    """Group the runs of an experiment by the settings in which they differ from its first, and compare the groups."""
    groups: dict[tuple, list[Run]] = {}
    for run in evidence.runs:
        groups.setdefault(tuple(list_changes(run, evidence.runs[0]).items()), []).append(run)
    return Comparison([_make_variant(dict(changes), runs, evidence) for changes, runs in groups.items()])


def _make_variant(changes: Changes, runs: Sequence[Run], evidence: Evidence) -> Variant:
    """Make the variant of the runs that have the same changes."""
    done = [run.id for run in runs if evidence.is_done(run)]
    table = evidence.table[evidence.table["run_id"].isin(done)] if done else evidence.table.iloc[:0]
    return Variant(
        changes,
        sorted({run.case.pressure for run in runs}),
        table,
        claims.judge_claims(runs[0].config.question.claims, table, missing=evidence.list_missing(runs)),
        [standing(run).state for run in runs if not evidence.is_done(run)],
    )


def list_changes(run: Run, base: Run) -> dict[str, Any]:
    """List the settings of a run that differ from the base's, value by key, without what makes it another cell.

    Scene, sintering and pressure make the cell; but a floor of the same name in another place is a change.
    """
    own, usual = dict(run.case), dict(base.case)
    sections = [name for name in own if isinstance(own[name], Settings) and isinstance(usual[name], Settings)]
    changes = {
        f"{name}.{key}": value
        for name in sections
        if name not in CELL_SECTIONS or own[name].name == usual[name].name
        for key, value in own[name]
        if key != "name" and value != getattr(usual[name], key)
    }
    return changes | ({"seed": run.case.seed} if run.case.seed != base.case.seed else {})
