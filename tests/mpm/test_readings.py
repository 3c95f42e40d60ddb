"""Every switch of the reading acts: the other way of reading gives another run, in the way it says."""

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.run import simulate
from tests.conftest import SMALL


def run(*overrides):
    return simulate(compose([*SMALL, "pressure=3000", *overrides]))


@pytest.mark.parametrize(
    ("switch", "changes"),
    [
        ("reading.press=radial_constant", "position"),
        ("reading.press=shell", "position"),
        ("reading.press=two_sides", "position"),
        ("reading.press_ramp=10", "position"),
        ("reading.press_damping=5", "velocity"),
        ("reading.release=rest", "velocity"),
        ("reading.external_force=per_particle", "density"),
        ("reading.cadence=substep", "hardening"),
        ("reading.hardening_growth=per_time", None),
        ("reading.density_changes=moduli_and_volume", "position"),
        ("reading.poisson_denominator=as_printed", "poisson"),
        ("reading.plane=stress_zz_zero", "von_mises"),
        ("reading.hardening_exponent=[0,1]", "position"),
        ("reading.initial_volume=sampled", "position"),
        ("reading.softening_length=1", "position"),
        ("reading.contact=coulomb", "position"),
        ("reading.contact=penalty", "position"),
        ("reading.friction=0.1", "position"),
        ("reading.gravity=20", "position"),
    ],
)
def test_each_switch_acts(small_run, switch, changes):
    """The named quantity differs from the default reading's; per_time is the same where updates are frames."""
    other = run(switch)
    if changes is None:
        np.testing.assert_array_equal(other.position.values, small_run.position.values)
    else:
        assert not np.array_equal(other[changes].values, small_run[changes].values)
    assert np.isfinite(other.position.values).all()


def test_per_time_tames_the_substep_cadence():
    """Eq. 9 once a substep grows xi many times faster, unless it is scaled by time."""
    often = run("reading.cadence=substep")
    scaled = run("reading.cadence=substep", "reading.hardening_growth=per_time")
    assert often.mean_hardening[20] - 5 > 1.5 * (scaled.mean_hardening[20] - 5)


def test_unsintered_snow_may_stay_unpressed():
    """not_pressed: rows without sintering feel no force; nothing moves before release."""
    still = run("sintering=none", "reading.unsintered=not_pressed")
    assert float(still.top_speed[:20].max()) == 0
    assert float(still.top_speed[-1]) > 0
    assert float(run("sintering=none").top_speed[:20].max()) > 0


def test_sintering_off_freezes_the_laws():
    """Without sintering density, moduli and xi keep Table 1's values to the end."""
    plain = run("sintering=none")
    for name, value in (("density", 100), ("young", 1.4e5), ("poisson", 0.2), ("hardening", 5)):
        assert (plain[name] == np.float32(value)).all()


def test_laws_are_frozen_after_release(small_run):
    """Density, moduli and xi change while pressed and not at all from the release on."""
    for name in ("density", "young", "hardening"):
        values = small_run[name].sel(snapshot=slice(20, None)).values
        assert (values == values[0]).all()
        assert (small_run[name].sel(snapshot=20) > small_run[name].sel(snapshot=0)).any()


def test_si_is_the_same_scene_in_metres():
    """Lengths in metres, the paper's particle mass at its own fidelity, and a run that goes through."""
    run_si = run("reading=si", "loading.press_frames=4", "loading.frames=8")
    assert run_si.position.attrs["units"] == "m"
    assert float(run_si.position.max()) < 3
    assert float(run_si.mass[0]) == pytest.approx(4 * 0.01, rel=1e-3)  # preview: four of the paper's
