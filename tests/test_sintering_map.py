"""The map of the mechanisms of sintering: the fastest acts, snow below a density settles, and how it is drawn."""

import numpy as np
import pandas as pd
import pytest

from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.laws.maeno import MECHANISMS
from snowrepro.physics import firn
from snowrepro.report.drawing.sintering_map import draw_map
from snowrepro.sintering_map import map_sintering, tabulate

DENSITIES, STRESSES = np.array([300.0, 540.0, 560.0, 700.0, 850.0]), np.logspace(1, 7, 121)


def map_with(*overrides: str):
    return map_sintering(compose(["sintering=maeno", *overrides]).case, DENSITIES, STRESSES)


def names_at(mapped, density: float) -> list[str]:
    """The mechanisms that act from the lowest stress to the highest, each once."""
    numbers = mapped.mechanism.sel(density=density).values
    return [MECHANISMS[number] for number in numbers[np.r_[True, np.diff(numbers) != 0]]]


def test_the_fastest_mechanism_acts():
    """Its rate is that of the map, and above the density of settling none is faster."""
    mapped = map_with()
    assert names_at(mapped, 300) == names_at(mapped, 540) == ["settling"]
    expected = ["diffusion through the lattice", "sliding of grain boundaries", "dislocation creep"]
    assert names_at(mapped, 560) == names_at(mapped, 850) == expected
    firm = mapped.sel(density=slice(550, None))
    assert firm.rate.equals(firm.rates.drop_sel(mechanisms="settling").max("mechanisms"))
    assert (mapped.rate.diff("stress") > 0).all()


def test_sliding_gives_way_to_creep_where_their_formulas_cross():
    """Wilkinson and Ashby's of n = 1.625 and 3.74, in plain Python: one stress at each density."""
    mapped = map_with()
    A = firn.sliding_constant(263.15, 1e-3), firn.dislocation_constant(263.15)
    n = firn.SLIDING_POWER, firn.DISLOCATION_POWER
    for density in (560.0, 700.0, 850.0):
        pores = 1 - density / 917
        factors = [2 * a * pores * (2 / m / (1 - pores ** (1 / m))) ** m for a, m in zip(A, n, strict=True)]
        crossing = 1e6 * (factors[0] / factors[1]) ** (1 / (n[1] - n[0]))
        acts = mapped.mechanism.sel(density=density) == MECHANISMS.index("dislocation creep")
        step = STRESSES[1] / STRESSES[0]
        assert crossing < float(mapped.stress[acts].min()) < crossing * step


def test_boundaries_let_matter_through_in_the_finest_grains_alone():
    """D_b delta / D_l is 0.24 micrometres at -10 C, with Coble's factors: no grain of snow is so small."""
    small = map_with("sintering.law.grain=2.3e-7", "sintering.law.settles_below=0")
    assert names_at(small, 700)[0] == "diffusion along grain boundaries"
    assert names_at(map_with("sintering.law.grain=2.5e-7"), 700)[0] == "diffusion through the lattice"


def test_it_is_a_table_and_a_picture():
    mapped = map_with("sintering.law.temperature=248.15")
    table = tabulate(mapped)
    assert table.loc[(300.0, STRESSES[0]), "mechanism"] == "settling" and len(table) == mapped.mechanism.size
    figure = draw_map(mapped)
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    assert shown == [name for name in MECHANISMS if name != "diffusion along grain boundaries"]
    assert figure.axes[0].get_title() == "Mechanisms of sintering at -25 °C, grains of 1 mm"
    assert figure.axes[0].get_xlabel() == "density [kg/m³]"


def test_another_law_has_no_map():
    with pytest.raises(ConfigError, match="shows the mechanisms of sintering=maeno, and the law is 'paper'"):
        map_sintering(compose([]).case)
    with pytest.raises(ConfigError, match="densities above 0 and below that of ice, 917"):
        map_sintering(compose(["sintering=maeno"]).case, np.array([950.0]), STRESSES)


@pytest.mark.slow
def test_the_command_writes_the_map(snowrepro, tmp_path):
    done = snowrepro("point", "--map", "sintering=maeno", "--out", "map.svg")
    assert done.returncode == 0, done.stderr
    assert set(pd.read_csv(tmp_path / "map.csv").columns) == {"density", "stress", "mechanism", "rate"}
    assert (tmp_path / "map.svg").stat().st_size > 1000
    refused = snowrepro("point", "--map", "sintering=maeno", "path=shear")
    assert refused.returncode == 2 and "--map has no path: leave out" in refused.stderr
