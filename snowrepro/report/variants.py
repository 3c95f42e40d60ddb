"""The same figure under one changed choice at a time: what each change did to its numbers and claims."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import pandas as pd

from ..analysis import claims
from ..config import Config
from ..store import runs
from ..store.states import PENDING, standing
from .evidence import Evidence

VARIED = ("reading", "loading", "solver", "fidelity")  # sections of a run's configuration
LEAST_MOVE = 0.005  # in lumps beyond the seeds; less is not told


@dataclass(frozen=True)
class Variant:
    """A figure's runs under one change.

    ``changes``: value by key, where it differs from the base; ``pressures``: that were asked for, rising;
    ``table``: the summary of its finished runs; ``verdicts``: on its claims; ``others``: how its other runs stand.
    """

    changes: Mapping[str, Any]
    pressures: Sequence[float]
    table: pd.DataFrame
    verdicts: Sequence[claims.Verdict]
    others: Sequence[str] = ()

    @property
    def name(self) -> str:
        """What it changes, as one would type it."""
        return ", ".join(f"{key}={typed(value)}" for key, value in self.changes.items()) or "base"

    @property
    def is_seed(self) -> bool:
        """Whether it differs by the particles' random places alone."""
        return set(self.changes) <= {"seed"}

    @cached_property
    def lumps(self) -> pd.Series:
        """Mass in lumps with sintering, by pressure; NaN where there is no result."""
        return self._lumps("sintered").reindex(self.pressures)

    @cached_property
    def loose(self) -> float:
        """The most lumps of any pressure without sintering."""
        return float(self._lumps("unsintered").max())

    @property
    def held(self) -> list[str]:
        """Claims that the numbers agree with."""
        return [v.claim for v in self.verdicts if v.agrees]

    @property
    def unjudged(self) -> list[str]:
        """Claims for which runs are missing."""
        return [v.claim for v in self.verdicts if v.agrees is None]

    @property
    def was_tried(self) -> bool:
        """Whether any of its runs was done or at least begun."""
        return len(self.table) > 0 or any(state != PENDING for state in self.others)

    @property
    def unfinished(self) -> str:
        """Runs without a result, by how they stand: '2 failed, 1 pending'; empty if there are none."""
        return ", ".join(f"{count} {state}" for state, count in Counter(self.others).items())

    def _lumps(self, arm: str) -> pd.Series:
        return claims.arm_of(self.table, arm, "lump_fraction").mean()


@dataclass(frozen=True)
class Comparison:
    """Variants beside the first of them, the base, with the spread over seeds as the yardstick."""

    variants: Sequence[Variant]

    @property
    def base(self) -> Variant:
        """The run as it is everywhere else."""
        return self.variants[0]

    @property
    def changed(self) -> list[Variant]:
        """The variants that are no seeds."""
        return [variant for variant in self.variants if not variant.is_seed]

    @cached_property
    def spread(self) -> pd.DataFrame:
        """Least and most lumps over the seeds, by pressure."""
        seeds = pd.concat([variant.lumps for variant in self.variants if variant.is_seed], axis=1)
        return pd.DataFrame({"least": seeds.min(axis=1), "most": seeds.max(axis=1)})

    def moves(self, variant: Variant) -> pd.Series:
        """How far a variant's lumps lie beyond those of all seeds, by pressure, where they do."""
        if variant.is_seed:
            return pd.Series(dtype=float)
        above = (variant.lumps - self.spread["most"]).clip(lower=0.0)
        below = (variant.lumps - self.spread["least"]).clip(upper=0.0)
        moves = (above + below).dropna()
        return moves[moves.abs() >= LEAST_MOVE]

    def farthest(self, variant: Variant) -> float:
        """The largest of a variant's moves, without sign."""
        return float(self.moves(variant).abs().max()) if len(self.moves(variant)) else 0.0

    def lost(self, variant: Variant) -> list[str]:
        """Claims of the base that a variant's numbers disagree with."""
        return [c for c in self.base.held if c not in variant.held and c not in variant.unjudged]

    def gained(self, variant: Variant) -> list[str]:
        """Claims that a variant's numbers agree with and the base's do not."""
        return [c for c in variant.held if c not in self.base.held and c not in self.base.unjudged]


def typed(value: Any) -> str:
    """A setting as one would type it."""
    return str(list(value)).replace(" ", "") if isinstance(value, tuple) else str(value)


def compared(evidence: Evidence) -> Comparison:
    """The runs of an experiment by what they change of its first."""
    groups: dict[tuple, list[Config]] = {}
    for config in evidence.configs:
        groups.setdefault(tuple(_changes(config, evidence.configs[0]).items()), []).append(config)
    return Comparison([_variant(dict(changes), configs, evidence) for changes, configs in groups.items()])


def _variant(changes: Mapping[str, Any], configs: Sequence[Config], evidence: Evidence) -> Variant:
    """What became of the runs with the same changes."""
    done = [runs.identify(config) for config in configs if evidence.is_done(config)]
    table = evidence.table[evidence.table["run_id"].isin(done)] if done else evidence.table.iloc[:0]
    return Variant(
        changes,
        sorted({config.pressure for config in configs}),
        table,
        claims.judge(configs[0].claims, table, missing=evidence.lost(configs)),
        [standing(config).state for config in configs if not evidence.is_done(config)],
    )


def _changes(config: Config, base: Config) -> dict[str, Any]:
    """The settings of a run that differ from the base's, beside its scene and what is compared in it."""
    pairs = zip(_settings(config), _settings(base), strict=True)
    return {key: value for (key, value), (_, usual) in pairs if value != usual}


def _settings(config: Config) -> list[tuple[str, Any]]:
    """Everything that decides a run, but for scene, sintering and pressure."""
    values = [(f"{name}.{key}", value) for name in VARIED for key, value in getattr(config, name) if key != "name"]
    return [*values, ("seed", config.seed)]
