"""The paper's laws as functions of density, stress and strain, compared with measured ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.integrate import cumulative_trapezoid

from ..physics.maxima import maximum_moduli
from ..reference.snow import MODULI, RATIOS, VISCOSITIES, Law
from ..settings.case import Case
from ..store.run import Run

LEAST = 2  # measured laws: fewer make no range
LIMIT = 0.5  # Poisson's ratio of what keeps its volume
MELTING = VISCOSITIES[0]
STEPS = 400  # of density, over which time is summed
Values = float | np.ndarray  # one, or many (n,)


def youngs_modulus(rho: np.ndarray, case: Case) -> np.ndarray:
    """Eqs. 7 and 8: Young's modulus before hardening [unit of E] at densities ``rho`` (n,)."""
    E_max, _ = _maxima(case, as_printed=False)
    return E_max * np.exp(case.sintering.C3 * (1.0 - rho / case.sintering.rho_max))


def poissons_ratio(rho: np.ndarray, case: Case, as_printed: bool) -> np.ndarray:
    """Eqs. 7 and 8: Poisson's ratio [1] at densities ``rho`` (n,), without the reading's cap."""
    rho_r = rho / case.sintering.rho_max
    return _maxima(case, as_printed)[1] * np.sqrt(rho_r / (3.0 - 2.0 * rho_r))


def density_of_ratio(nu: float, case: Case, as_printed: bool) -> float:
    """The density at which Eqs. 7 and 8 reach a Poisson's ratio; infinite if none up to rho_max does."""
    nu_max = _maxima(case, as_printed)[1]
    rho_r = 3.0 * nu**2 / (nu_max**2 + 2.0 * nu**2)
    return rho_r * case.sintering.rho_max if rho_r <= 1.0 else float("inf")


def _maxima(case: Case, as_printed: bool) -> tuple[float, float]:
    """Eq. 8: the largest Young's modulus [unit of E] and Poisson's ratio [1], as read or as printed."""
    material, sintering = case.material, case.sintering
    return maximum_moduli(material.E, material.nu, material.rho / sintering.rho_max, sintering.C3, as_printed)


def viscosity(rho: np.ndarray, case: Case) -> np.ndarray:
    """Eq. 2's first term as a viscosity [unit of E times s]: d rho/dt / rho = sigma_m / viscosity."""
    rho_r, C1 = np.asarray(rho) / case.sintering.rho_max, case.sintering.C1
    return rho_r / C1 if C1 else np.full_like(rho_r, np.inf)


def densification_time(rho: Values, stress: float, case: Case) -> np.ndarray:
    """Eq. 2's first term: time [s] from the initial density to ``rho`` under a constant ``stress`` [unit of E].

    rho / viscosity is the same at all densities, so density grows by as much in each second.
    """
    return (rho - case.material.rho) * viscosity(np.asarray(rho), case) / (rho * stress)


def hardening_coefficient(stress: float, updates: Values, case: Case) -> np.ndarray:
    """Eq. 9 without b: xi after so many ``updates`` under a constant ``stress`` [unit of E]."""
    return case.material.xi + np.asarray(updates) * case.sintering.C4 * stress


def hardening_exponent(xi: Values, J_P: Values, case: Case) -> np.ndarray:
    """Eq. 1: the exponent of the factor on the moduli, without the reading's bounds."""
    return xi * (1.0 - J_P) * np.where(np.asarray(J_P) > 1.0, case.softening, 1.0)


def hardening_factor(xi: np.ndarray, J_P: np.ndarray, case: Case) -> np.ndarray:
    """Eq. 1: the factor on the moduli, its exponent bounded as in the run."""
    return np.exp(np.clip(hardening_exponent(xi, J_P, case), *case.reading.hardening_exponent))


def lame_parameters(E: np.ndarray, nu: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sec. 3.2: (mu, lambda) in the unit of E, of Young's moduli and Poisson's ratios, all (n,)."""
    return E / (2.0 * (1.0 + nu)), nu * E / ((1.0 + nu) * (1.0 - 2.0 * nu))


def elastic_energy(strain: tuple[float, float], mu: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """Energy of small principal strains in the plane, for each unit of volume [unit of E], (n,)."""
    x, y = strain
    return mu * (x**2 + y**2) + 0.5 * lam * (x + y) ** 2


def von_mises_stress(strain: tuple[float, float], mu: np.ndarray, lam: np.ndarray, plane_strain: bool) -> np.ndarray:
    """Eqs. 3 to 5 of small principal strains in the plane [unit of E], (n,); without plane strain sigma_zz is 0."""
    along = lam * (strain[0] + strain[1])
    xx, yy = (2.0 * mu * part + along for part in strain)
    zz = along if plane_strain else 0.0
    return np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2))


def tabulate_laws(laws: Sequence[Law]) -> pd.DataFrame:
    """Tabulate measured laws: a row for each density [kg/m^3], a column for each law, NaN outside its range."""
    rho = np.arange(min(law.low for law in laws), max(law.high for law in laws) + 1.0)
    return pd.DataFrame({law.name: law.at(rho) for law in laws}, index=pd.Index(rho, name="density"))


def differentiate_laws(table: pd.DataFrame) -> pd.DataFrame:
    """Differentiate tabulated laws: d ln(law) / d rho [m^3/kg], in the same shape."""

    def differentiate(column: pd.Series) -> pd.Series:
        """Differentiate one law, where it has values."""
        known = column.dropna()
        return pd.Series(np.gradient(np.log(known), known.index), known.index)

    return table.apply(differentiate).reindex(table.index)


def select_comparable(table: pd.DataFrame) -> pd.DataFrame:
    """Select the rows in which at least LEAST laws have a value."""
    return table[table.notna().sum(axis=1) >= LEAST]


def find_spans(holds: pd.Series) -> list[tuple[float, float]]:
    """Find first and last density of each stretch of neighbouring rows that are true."""
    stretch = (holds != holds.shift()).cumsum()
    return [(rows.index[0], rows.index[-1]) for _, rows in holds.groupby(stretch) if rows.iloc[0]]


def integrate_settling(law: Law, stress: float, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Compute the times [s] at which snow of a measured viscosity has densities from ``start`` to ``end`` [kg/m^3].

    d rho/dt = rho stress / viscosity under a constant ``stress`` [Pa], as in Crocus; NaN outside the law's range.
    Returns times and densities, both (n,).
    """
    rho = np.geomspace(start, end, STEPS)
    return cumulative_trapezoid(law.at(rho) / (stress * rho), rho, initial=0.0), rho


def slope_of_paper(case: Case) -> float:
    """Return the paper's d ln E / d rho [m^3/kg], the same at every density."""
    return -case.sintering.C3 / case.sintering.rho_max


def find_slope_spans(case: Case) -> list[tuple[float, float]]:
    """Find the stretches of density [kg/m^3] in which the paper's slope of ln E lies among the measured ones."""
    measured = select_comparable(differentiate_laws(tabulate_laws(MODULI)))
    return find_spans((measured.min(axis=1) <= slope_of_paper(case)) & (slope_of_paper(case) <= measured.max(axis=1)))


def compare_levels(case: Case) -> pd.Series:
    """Compute measured over the paper's modulus, by density [kg/m^3] and law, where there are enough laws."""
    measured = select_comparable(tabulate_laws(MODULI))
    ratios = measured.div(youngs_modulus(measured.index.to_numpy(), case), axis=0)
    long = ratios.melt(var_name="law", value_name="ratio", ignore_index=False)
    return long.set_index("law", append=True)["ratio"].dropna()


@dataclass(frozen=True)
class SinteredSnow:
    """Sintered snow of one run.

    ``rho``, ``young``, ``poisson``, ``factor`` (n,): particles at release, with Eq. 1's factor; ``time`` [s] and
    ``density`` (frames + 1,): the mean over all particles while pressed; ``stress``: mean sigma_m at release.
    """

    pressure: float
    rho: np.ndarray
    young: np.ndarray
    poisson: np.ndarray
    factor: np.ndarray
    time: np.ndarray
    density: np.ndarray
    stress: float

    @property
    def hardened(self) -> np.ndarray:
        """Young's modulus times Eq. 1's factor (n,)."""
        return self.young * self.factor


def read_snow(run: Run) -> SinteredSnow:
    """Read from a finished run what its laws made of the snow."""
    release = run.case.loading.press_frames
    with run.open() as dataset:
        release_state = dataset.sel(snapshot=release)
        names = ("density", "young", "poisson", "hardening", "J_P")
        rho, young, poisson, xi, J_P = (release_state[name].values.astype(float) for name in names)
        time, mean_density = (dataset[name].values[: release + 1] for name in ("time", "mean_density"))
        factor, stress = hardening_factor(xi, J_P, run.case), float(release_state["von_mises"].mean())
        return SinteredSnow(run.case.pressure, rho, young, poisson, factor, time, mean_density, stress)


def write_sentence(case: Case, pace: pd.DataFrame) -> str:
    """Write how slope, level, Poisson's ratio and densification compare with measurements.

    ``pace``: rows of ``measure_pace``.
    """
    within = " and from ".join(f"{low:.0f} to {high:.0f} kg/m³" for low, high in find_slope_spans(case))
    factors = compare_levels(case)
    means = np.concatenate([law.value(np.array([law.low])) for law in RATIOS])
    return (
        f"The paper's slope of ln E over density, {slope_of_paper(case):.4f} m³/kg, lies within the measured ones "
        f"{f'from {within}' if within else 'nowhere'}; measured moduli are {format_short(factors.min())} to "
        f"{format_short(factors.max())} times the paper's (median {format_short(factors.median())}); Poisson's ratio "
        f"{_describe_limit(case)}, measured means lie between {means.min():.2f} and {means.max():.2f}; "
        f"{_describe_pace(pace)}."
    )


def _describe_limit(case: Case) -> str:
    """Describe from which density on the paper's Poisson's ratio is impossible, in both readings of Eq. 8."""
    as_read, as_printed_density = (density_of_ratio(LIMIT, case, as_printed) for as_printed in (False, True))
    if not np.isfinite([as_read, as_printed_density]).all():
        return f"stays below {LIMIT} up to the largest density in one reading of Eq. 8 at least"
    return f"passes {LIMIT} at {as_read:.0f} kg/m³ (with Eq. 8 as printed: {as_printed_density:.0f})"


def _describe_pace(pace: pd.DataFrame) -> str:
    """Describe by how much the runs densify faster than Crocus at the melting point."""
    ratios = pace["times faster"].dropna() if len(pace) else pd.Series(dtype=float)
    if ratios.empty:
        return "no run says how its densification stands to measured snow"
    ends = dict.fromkeys([format_short(ratios.min()), format_short(ratios.max())])
    return f"the snow densifies {' to '.join(ends)} times as fast as Crocus has it at 0 °C under the same pressure"


def measure_pace(snow: SinteredSnow) -> dict[str, float]:
    """Measure how fast a run densifies, beside Crocus under the nominal pressure; by name, with units."""
    start, end, duration = snow.density[0], snow.density[-1], snow.time[-1] - snow.time[0]
    needed = [integrate_settling(law, snow.pressure, start, end)[0][-1] for law in VISCOSITIES]
    first = (snow.density[1] / start - 1.0) / (snow.time[1] - snow.time[0])
    return {
        "pressure": snow.pressure,
        "density at release": end,
        "mean von Mises stress at release": snow.stress,
        "pressed [s]": duration,
        **{f"{law.name} [s]": time if end > start else np.nan for law, time in zip(VISCOSITIES, needed, strict=True)},
        "times faster": needed[0] / duration if end > start else np.nan,
        "times faster in the first frame": first / (snow.pressure / float(MELTING.at(start))),
    }


def format_short(value: float) -> str:
    """Write a number with two significant digits; a dash where it is not known."""
    return f"{float(f'{value:.2g}'):,g}" if np.isfinite(value) else "-"
