"""From a case to the laws that it chose."""

from typing import Any

from ..own_law import make_own_law
from ..settings.case import Case
from ..settings.laws import CamClay, ConstantRates, InstalledLaw, MaenoRates, Sand
from .cam_clay import CamClayMaterial, make_cam_clay
from .constant import ConstantSintering, make_constant_sintering
from .maeno import MaenoSintering, make_maeno_sintering
from .paper import PaperSintering, make_paper_sintering
from .sand import SandMaterial, make_sand
from .stomakhin import StomakhinMaterial, make_stomakhin

MaterialLaw = StomakhinMaterial | CamClayMaterial | SandMaterial | Any  # or somebody else's, with the same methods
SinteringLaw = PaperSintering | ConstantSintering | MaenoSintering | Any


def make_material(case: Case) -> MaterialLaw:
    """The material law of a case, with its numbers."""
    law = case.material.law
    if isinstance(law, CamClay):
        return make_cam_clay(case, law)
    if isinstance(law, Sand):
        return make_sand(case, law)
    if isinstance(law, InstalledLaw):
        return make_own_law("material", case, law)
    return make_stomakhin(case)


def make_sintering(case: Case) -> SinteringLaw:
    """The sintering law of a case, with its numbers."""
    law = case.sintering.law
    if isinstance(law, ConstantRates):
        return make_constant_sintering(case, law)
    if isinstance(law, MaenoRates):
        return make_maeno_sintering(case, law)
    if isinstance(law, InstalledLaw):
        return make_own_law("sintering", case, law)
    return make_paper_sintering(case)
