"""The checks of a law: right laws pass, and each wrong one is told by the rule that it breaks."""

import re
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from snowrepro.checks.finding import OK
from snowrepro.checks.laws import check_material
from snowrepro.compiler import ti
from snowrepro.composition.compose import compose
from snowrepro.laws.hencky import HenckyMaterial
from snowrepro.mpm import constants
from snowrepro.physics import hencky


@pytest.mark.parametrize("words", ["material=table1", "material=cam_clay", "material=sand solver.precision=f32"])
def test_the_laws_of_this_program_pass(words):
    """Whatever the precision of a run is."""
    findings = list(check_material(compose(words.split()).case))
    assert len(findings) == 6
    assert {finding.name: finding.measured for finding in findings if finding.state != OK} == {}


SHELL = -0.05  # a logarithm of volume that points pass on their way


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
        elif ti.static(self.mistake == "shell"):
            if ti.abs(ti.log(F_E.determinant()) - SHELL) < 1e-3:
                tau /= 0.0 * lam
        elif ti.static(self.mistake == "skew shell"):
            if ti.abs(ti.log(F_E.determinant()) - SHELL) < 1e-3:
                tau[0, 1] += 0.1 * tau[0, 0]
        elif ti.static(self.mistake == "far"):
            tau += 20.0 * lam * ti.min(ti.log(F_E.determinant()) + 0.5, 0.0) * ti.Matrix([[1.0, 0.0], [0.0, 1.0]])
        return tau

    @ti.func
    def stiffness(self, F_E, tau, mu, lam):
        declared = hencky.stiffness(tau, mu, lam)
        if ti.static(self.mistake == "stiffness"):
            declared = 0.5 * lam
        elif ti.static(self.mistake == "negative"):
            declared = -lam
        return declared


@pytest.mark.parametrize(
    ("mistake", "rule"),
    [
        ("none", ""),
        ("observer", "no matter who looks"),
        ("symmetry", "symmetric stress"),
        ("energy", "no energy by plastic flow"),
        ("work", "no work out of nothing"),
        ("stiffness", "tangent stiffness"),
        ("negative", "tangent stiffness"),
        ("far", "tangent stiffness"),
        ("nan", "symmetric stress"),
        ("jump", "no jump of stress"),
    ],
)
def test_a_wrong_law_is_told_with_the_point(monkeypatch, mistake, rule):
    monkeypatch.setattr(constants, "make_material", lambda case: WrongMaterial(mistake))
    wrong = {finding.name: finding.note for finding in check_material(compose().case) if finding.state != OK}
    assert rule in wrong if rule else wrong == {}
    assert all("F_E = [" in note for note in wrong.values())


@pytest.mark.parametrize("mistake", ["shell", "skew shell", "observer"])
def test_the_point_is_shown_as_it_was_when_the_rule_broke(monkeypatch, mistake):
    """On the way, not where it ends; and not as turned for another observer."""
    monkeypatch.setattr(constants, "make_material", lambda case: WrongMaterial(mistake))
    wrong = {finding.name: finding.note for finding in check_material(compose().case) if finding.state != OK}
    note = wrong["no matter who looks" if mistake == "observer" else "symmetric stress"]
    F_E = np.array(re.search(r"F_E = \[(.*?)\]", note)[1].split(", "), dtype=float).reshape(2, 2)
    if mistake == "observer":
        assert abs(np.arctan2(F_E[1, 0] - F_E[0, 1], F_E.trace())) < 0.5
    else:
        assert np.log(np.linalg.det(F_E)) == pytest.approx(SHELL, abs=0.01)
