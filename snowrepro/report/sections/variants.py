"""What the variants of a study change, in words; the words are in variants.yaml."""

import functools
from collections.abc import Mapping
from pathlib import Path

import yaml

from ...evidence.variants import Changes, Comparison, Variant, name_changes

FILE = Path(__file__).with_suffix(".yaml")


@functools.cache
def read_words() -> Mapping[str, str]:
    """Read the words of changes, by the change as one would type it."""
    return yaml.safe_load(FILE.read_text(encoding="utf-8"))


def describe_change(changes: Changes) -> str:
    """Describe the changes of a variant: in words where there are some, else as one would type them."""
    if not changes:
        return "as in Figure 5"
    if set(changes) == {"seed"}:
        return f"other random places, seed {changes['seed']}"
    return read_words().get(name_changes(changes), name_changes(changes))


def describe_claims(variant: Variant, comparison: Comparison) -> str:
    """Describe which claims a variant's numbers lose and gain, beside the base; in Markdown."""
    if not variant.changes:
        return f"agrees with {' '.join(variant.agreed_claims) or 'none'}" if len(variant.table) else ""
    lost, gained = comparison.list_lost_claims(variant), comparison.list_gained_claims(variant)
    parts = [f"**{verb} {' '.join(names)}**" for verb, names in (("loses", lost), ("gains", gained)) if names]
    if variant.unjudged_claims:
        parts.append(f"{' '.join(variant.unjudged_claims)} not judged")
    return "; ".join(parts) or "the same"


def describe_missing(variant: Variant) -> str:
    """Say what became of a variant's runs without a result: "failed", "failed or timed out"; empty if all are done."""
    names = {"pending": "not run"}
    return " or ".join(dict.fromkeys(names.get(state, state) for state in variant.others))
