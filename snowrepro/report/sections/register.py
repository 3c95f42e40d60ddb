"""The register of choices: what the paper leaves open or contradicts, what was chosen, and what other choices do.

The choices are in register.yaml; their effect is that on Figure 5.
"""

from collections.abc import Sequence
from functools import reduce
from pathlib import Path
from typing import Literal

import pandas as pd
import yaml
from pydantic import Field

from ...evidence.claims import list_calibrated_claims
from ...evidence.variants import Comparison, Variant, format_setting
from ...settings.base import Settings
from ...settings.question import Claims
from ...store.run import Run
from ..document import Block, Table, join_names

FILE = Path(__file__).with_suffix(".yaml")
NOT_TRIED = "not tried"
CALIBRATED = "{claims by calibration}"  # in register.yaml


class Entry(Settings):
    """One choice; register.yaml says what its fields mean."""

    name: str
    kind: Literal["left open", "inconsistent", "bound added", "deviation"]
    paper: str
    here: str
    keys: tuple[str, ...] = Field((), description="settings that make it")
    elsewhere: str = ""

    def find_alternatives(self, variants: Sequence[Variant]) -> list[Variant]:
        """Find the variants that make this choice otherwise and were tried, with success or not."""
        return [v for v in variants if v.was_tried and set(self.keys) & set(v.changes)]

    def describe_choice(self, run: Run) -> str:
        """Describe the choice as a run's configuration has it, and why it was made."""
        values = ", ".join(f"`{key}={format_setting(reduce(getattr, key.split('.'), run.case))}`" for key in self.keys)
        reason = self.here.replace(CALIBRATED, join_names(list_calibrated_claims(run.config.question.claims), "and"))
        return f"{values}: {reason}" if values else reason


def read_entries() -> list[Entry]:
    """Read the register, in the order of its file."""
    return [Entry.model_validate(entry) for entry in yaml.safe_load(FILE.read_text(encoding="utf-8"))]


def make_blocks(comparison: Comparison, run: Run) -> list[Block]:
    """Make the table of choices beside what was measured.

    ``comparison``: the variants of one experiment, or of several with the same base; ``run``: any run of the base.
    """
    register = read_entries()
    frame = pd.DataFrame([_make_row(entry, comparison, run) for entry in register])
    return [
        _summarise(register, comparison),
        Table(frame, caption=_make_caption(comparison, run.config.question.claims)),
    ]


def _make_row(entry: Entry, comparison: Comparison, run: Run) -> dict[str, str]:
    """Make the row of one choice."""
    variants = entry.find_alternatives(comparison.changed_variants)
    alternatives = [", ".join(f"`{variant.name}`" for variant in variants), entry.elsewhere]
    return {
        "choice": entry.name,
        "kind": entry.kind,
        "the paper": entry.paper,
        "here": entry.describe_choice(run),
        "alternatives tried": "; ".join(filter(None, alternatives)) or NOT_TRIED,
        "what they do to Figure 5": _describe_effects(variants, comparison),
    }


def _describe_effects(variants: Sequence[Variant], comparison: Comparison) -> str:
    """Describe the effect of each alternative, with its values if there are several."""
    if len(variants) < 2:
        return "".join(describe_effect(variant, comparison) for variant in variants) or "-"
    values = [", ".join(map(format_setting, variant.changes.values())) for variant in variants]
    return " ".join(
        f"`{value}`: {describe_effect(variant, comparison)}." for value, variant in zip(values, variants, strict=True)
    )


def describe_effect(variant: Variant, comparison: Comparison) -> str:
    """Describe in a few words what a variant does to the claims and the lumps."""
    if comparison.base.table.empty and len(variant.table):
        return "run, but Figure 5 itself is not: nothing to compare with"
    parts, moves = [], comparison.find_moves(variant)
    lost, gained = comparison.list_lost_claims(variant), comparison.list_gained_claims(variant)
    for verb, claims in (("loses", lost), ("gains", gained)):
        if claims:
            parts.append(f"**{verb} {' '.join(claims)}**")
    if not parts and variant.agreed_claims:
        keeps_all = len(variant.agreed_claims) == len(variant.verdicts)
        parts.append("keeps all" if keeps_all else f"keeps {' '.join(variant.agreed_claims)}")
    if variant.unjudged_claims:
        parts.append(f"{' '.join(variant.unjudged_claims)} not judged, as runs are missing ({variant.unfinished})")
    if len(moves):
        pressure = moves.abs().idxmax()
        parts.append(f"lumps {moves[pressure]:+.2f} beyond the seeds at {pressure:g}")
    elif variant.lumps.notna().any():
        is_same = variant.lumps.equals(comparison.base.lumps)
        parts.append("the very same lumps" if is_same else "lumps as among the seeds")
    return "; ".join(parts)


def _summarise(register: Sequence[Entry], comparison: Comparison) -> str:
    """Say how many choices were tried otherwise, which of them move a claim, and which lack runs."""
    alternatives = {entry.name: entry.find_alternatives(comparison.changed_variants) for entry in register}
    tried = [name for name, variants in alternatives.items() if variants]
    if not tried or comparison.base.table.empty:
        why = "no run of other choices is in this store" if not tried else "the runs of Figure 5 itself are not there"
        return f"**Not tried here**: what other choices than these {len(register)} would do to Figure 5; {why}."
    moving = [
        variant
        for variant in comparison.changed_variants
        if comparison.list_lost_claims(variant) or comparison.list_gained_claims(variant)
    ]
    moved = [entry.name for entry in register if any(set(variant.changes) <= set(entry.keys) for variant in moving)]
    moved += [
        f"`{variant.name}` together"
        for variant in moving
        if not any(set(variant.changes) <= set(entry.keys) for entry in register)
    ]
    incomplete = [name for name in tried if any(variant.others for variant in alternatives[name])]
    parts = [
        f"Of {len(register)} choices {len(tried)} were also made otherwise on Figure 5",
        f"a claim is moved by {', '.join(moved)}" if moved else "no claim that was judged is moved",
    ]
    if incomplete:
        parts.append(f"not every run has a result under other choices of {', '.join(incomplete)}")
    return "; ".join(parts) + "."


def _make_caption(comparison: Comparison, claims: Claims) -> str:
    """Explain the last column."""
    return " ".join(
        [
            "Claims that the numbers of one seed agree with.",
            *(f"{verdict.claim}: {verdict.statement}" for verdict in comparison.base.verdicts),
            (
                "The pressures were chosen for the choices made here and kept for all others, so under another choice "
                f"other pressures may bring back a lost {join_names(list_calibrated_claims(claims), 'or')}."
            ),
        ]
    )
