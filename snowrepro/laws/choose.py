"""From a case to the laws that it chose."""

from ..settings.case import Case
from .paper import PaperSintering, make_paper_sintering
from .stomakhin import StomakhinMaterial, make_stomakhin

MaterialLaw = StomakhinMaterial
SinteringLaw = PaperSintering


def make_material(case: Case) -> MaterialLaw:
    """The material law of a case, with its numbers."""
    return make_stomakhin(case)


def make_sintering(case: Case) -> SinteringLaw:
    """The sintering law of a case, with its numbers."""
    return make_paper_sintering(case)
