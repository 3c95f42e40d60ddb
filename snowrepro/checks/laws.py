"""Checks of the laws of a case at points: each rule of ``rules`` as a finding, with the point where it breaks."""

from collections.abc import Iterator

from ..rules import Measured, try_material, try_sintering
from ..settings.case import Case
from .finding import Finding, check_bound


def check_material(case: Case) -> Iterator[Finding]:
    """Check the material law of a case; one finding for each rule."""
    yield from map(_find, try_material(case))


def check_sintering(case: Case) -> Iterator[Finding]:
    """Check the sintering law of a case; one finding for each rule; none where it does not act."""
    if case.sintering.enabled:
        yield from map(_find, try_sintering(case))


def _find(rule: Measured) -> Finding:
    """The finding of a rule, with the worst point where it is broken."""
    found = check_bound(0, rule.name, rule.value, rule.most, rule.of)
    note = rule.where if found.is_caught else ""
    return Finding(found.tier, found.name, found.state, found.measured, found.allowed, note)
