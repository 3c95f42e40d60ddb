"""The checks of a law: right laws pass, and each wrong one is told by the rule that it breaks."""

from dataclasses import dataclass
from typing import ClassVar

import pytest

from snowrepro.checks.finding import OK
from snowrepro.checks.laws import check_material
from snowrepro.compiler import ti
from snowrepro.composition.compose import compose
from snowrepro.laws.hencky import HenckyMaterial
from snowrepro.mpm import constants
from snowrepro.physics import hencky


@pytest.mark.parametrize("material", ["table1", "cam_clay", "sand"])
def test_the_laws_of_this_program_pass(material):
    findings = list(check_material(compose([f"material={material}"]).case))
    assert len(findings) == 6
    assert {finding.name: finding.measured for finding in findings if finding.state != OK} == {}


@ti.data_oriented
@dataclass(frozen=True)
class WrongMaterial(HenckyMaterial):
    """Hencky elasticity without yield, and one mistake."""

    mistake: str
    STATE: ClassVar = ()

    @ti.func
    def relax(self, F, R, state, mu, lam, xi):
        new = F
        if ti.static(self.mistake == "energy"):  # flow that stretches what is stretched
            new = F + 0.01 * (F - ti.Matrix([[1.0, 0.0], [0.0, 1.0]]))
        return new, state

    @ti.func
    def stress(self, F_E, R, mu, lam):
        tau = hencky.kirchhoff_stress(F_E, R, mu, lam)
        if ti.static(self.mistake == "observer"):
            tau[0, 0] *= 2.0
        elif ti.static(self.mistake == "jump"):
            tau *= ti.select(F_E.determinant() > 1.01, 0.9, 1.0)
        elif ti.static(self.mistake == "symmetry"):
            tau[0, 1] += 0.1 * tau[0, 0]
        elif ti.static(self.mistake == "work"):
            tau *= 2.0
        elif ti.static(self.mistake == "nan"):
            tau /= 0.0 * lam
        return tau

    @ti.func
    def stiffness(self, F_E, tau, mu, lam):
        return 0.5 * lam if ti.static(self.mistake == "stiffness") else hencky.stiffness(tau, mu, lam)


@pytest.mark.parametrize(
    ("mistake", "rule"),
    [
        ("none", ""),
        ("observer", "no matter who looks"),
        ("symmetry", "symmetric stress"),
        ("energy", "no energy by plastic flow"),
        ("work", "no work out of nothing"),
        ("stiffness", "tangent stiffness"),
        ("nan", "symmetric stress"),
        ("jump", "no jump of stress"),
    ],
)
def test_a_wrong_law_is_told_with_the_point(monkeypatch, mistake, rule):
    monkeypatch.setattr(constants, "make_material", lambda case: WrongMaterial(mistake))
    wrong = {finding.name: finding.note for finding in check_material(compose().case) if finding.state != OK}
    assert rule in wrong if rule else wrong == {}
    assert all("F_E = [" in note for note in wrong.values())
