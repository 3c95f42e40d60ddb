"""What the paper leaves open or prints inconsistently: what was chosen, and what other choices do to Figure 5."""

from collections.abc import Sequence
from functools import reduce
from pathlib import Path
from typing import Literal

import pandas as pd
import yaml
from pydantic import Field

from ..config import Config, Section
from .document import Block, Table
from .variants import Comparison, Variant, typed

FILE = Path(__file__).with_suffix(".yaml")
NOT_TRIED = "not tried"


class Entry(Section):
    """One choice; register.yaml says what its fields are."""

    name: str
    kind: Literal["left open", "inconsistent", "bound added", "deviation"]
    paper: str
    here: str
    keys: tuple[str, ...] = Field((), description="settings that make it")
    elsewhere: str = ""

    def tests(self, variants: Sequence[Variant]) -> list[Variant]:
        """The variants that make this choice otherwise, of which there is a run or was an attempt at one."""
        return [v for v in variants if v.was_tried and set(self.keys) & set(v.changes)]

    def chosen(self, config: Config) -> str:
        """The choice as it stands in a run's configuration, and why."""
        values = ", ".join(f"`{key}={typed(reduce(getattr, key.split('.'), config))}`" for key in self.keys)
        return f"{values}: {self.here}" if values else self.here


def entries() -> list[Entry]:
    """The register, in the order of its file."""
    return [Entry.model_validate(entry) for entry in yaml.safe_load(FILE.read_text(encoding="utf-8"))]


def section(comparison: Comparison, config: Config) -> list[Block]:
    """The register beside what was measured.

    ``comparison``: the variants of one experiment or of several with the same base; ``config``: the base's.
    """
    register = entries()
    frame = pd.DataFrame([_row(entry, comparison, config) for entry in register])
    return [_sentence(register, comparison), Table(frame, caption=_caption(comparison))]


def _row(entry: Entry, comparison: Comparison, config: Config) -> dict[str, str]:
    tests = entry.tests(comparison.changed)
    tried = [", ".join(f"`{variant.name}`" for variant in tests), entry.elsewhere]
    return {
        "choice": entry.name,
        "kind": entry.kind,
        "the paper": entry.paper,
        "here": entry.chosen(config),
        "alternatives tried": "; ".join(filter(None, tried)) or NOT_TRIED,
        "what they do to Figure 5": _effects(tests, comparison),
    }


def _effects(tests: Sequence[Variant], comparison: Comparison) -> str:
    """The effect of each alternative, named by its values where there are several."""
    if len(tests) < 2:
        return "".join(effect(variant, comparison) for variant in tests) or "-"
    values = [", ".join(map(typed, variant.changes.values())) for variant in tests]
    return " ".join(f"`{v}`: {effect(t, comparison)}." for v, t in zip(values, tests, strict=True))


def effect(variant: Variant, comparison: Comparison) -> str:
    """What a variant does to the claims and the lumps, in a few words."""
    parts, moves = [], comparison.moves(variant)
    for what, names in (("loses", comparison.lost(variant)), ("gains", comparison.gained(variant))):
        if names:
            parts.append(f"**{what} {' '.join(names)}**")
    if not parts and variant.held:
        parts.append("keeps all" if len(variant.held) == len(variant.verdicts) else f"keeps {' '.join(variant.held)}")
    if variant.unjudged:
        parts.append(f"{' '.join(variant.unjudged)} not judged, as runs are missing ({variant.unfinished})")
    if len(moves):
        at = moves.abs().idxmax()
        parts.append(f"lumps {moves[at]:+.2f} beyond the seeds at {at:g}")
    elif variant.lumps.notna().any():
        same = variant.lumps.equals(comparison.base.lumps)
        parts.append("the very same lumps" if same else "lumps as among the seeds")
    return "; ".join(parts)


def _sentence(register: Sequence[Entry], comparison: Comparison) -> str:
    """How many choices were tried, which of them move a claim, and under which runs are missing."""
    tests = {entry.name: entry.tests(comparison.changed) for entry in register}
    tried = [name for name, variants in tests.items() if variants]
    moving = [v for v in comparison.changed if comparison.lost(v) or comparison.gained(v)]
    moved = [entry.name for entry in register if any(set(v.changes) <= set(entry.keys) for v in moving)]
    moved += [f"`{v.name}` together" for v in moving if not any(set(v.changes) <= set(e.keys) for e in register)]
    short = [name for name in tried if any(variant.others for variant in tests[name])]
    parts = [
        f"Of {len(register)} choices {len(tried)} were also made otherwise on Figure 5",
        f"a claim is moved by {', '.join(moved)}" if moved else "none of them moves a claim",
    ]
    if short:
        parts.append(f"not every run has a result under other choices of {', '.join(short)}")
    return "; ".join(parts) + "."


def _caption(comparison: Comparison) -> str:
    """How to read the last column."""
    return " ".join(
        [
            "Claims that the numbers of one seed agree with.",
            *(f"{verdict.claim}: {verdict.statement}" for verdict in comparison.base.verdicts),
            "The pressures were chosen for the choices made here and kept for all others, so under another choice "
            "other pressures may bring back a lost C1, C2, C3 or C5.",
        ]
    )
