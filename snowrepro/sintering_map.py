"""Which mechanism of sintering acts, over density and stress at a temperature: the map of Maeno and Ebinuma."""

import numpy as np
import pandas as pd
import xarray as xr

from .errors import ConfigError
from .laws.maeno import MECHANISMS, make_maeno_sintering
from .mpm.solver import start_taichi
from .physics.firn import RHO_ICE
from .settings.case import Case
from .settings.laws import MaenoRates

DENSITIES = np.linspace(100.0, 900.0, 321)  # kg/m^3
STRESSES = np.logspace(1.0, 7.0, 241)  # Pa


def map_sintering(case: Case, densities: np.ndarray = DENSITIES, stresses: np.ndarray = STRESSES) -> xr.Dataset:
    """Map the mechanisms of a case's ``maeno`` law at its temperature and size of grains.

    ``densities`` [kg/m^3], ``stresses`` [Pa].  Returns, over (density, stress), ``mechanism``, the place in MECHANISMS
    of the one that acts, and ``rate`` [1/s], its rate in real snow; and ``rates`` of all, over (mechanisms, density,
    stress).  Raises ConfigError where the case has another law, or for what is no density or stress.
    """
    law = case.sintering.law
    if not isinstance(law, MaenoRates):
        raise ConfigError(f"a map shows the mechanisms of sintering=maeno, and the law is '{law.name}'")
    if not (np.all((densities > 0) & (densities < RHO_ICE)) and np.all(stresses > 0)):
        raise ConfigError(f"a map has densities above 0 and below that of ice, {RHO_ICE:g}, and stresses above 0")
    start_taichi(case.solver, threads=1)
    rho, sigma = (np.ascontiguousarray(each).ravel() for each in np.meshgrid(densities, stresses, indexing="ij"))
    flat = np.zeros((len(rho), len(MECHANISMS)))
    make_maeno_sintering(case, law).fill_rates(rho, sigma, flat)
    rates = flat.T.reshape(len(MECHANISMS), len(densities), len(stresses))
    settles = densities[:, None] < law.settles_below
    mechanism = np.where(settles, MECHANISMS.index("settling"), rates[:-1].argmax(axis=0))
    rate = np.take_along_axis(rates, mechanism[None], axis=0)[0]
    return _describe(law, densities, stresses, rates, mechanism.astype(np.int8), rate)


def tabulate(mapped: xr.Dataset) -> pd.DataFrame:
    """A map as a table: a row for each density and stress, the mechanism by its name."""
    table = mapped[["mechanism", "rate"]].to_dataframe()
    return table.assign(mechanism=[MECHANISMS[number] for number in table["mechanism"]])


def _describe(
    law: MaenoRates,
    densities: np.ndarray,
    stresses: np.ndarray,
    rates: np.ndarray,
    mechanism: np.ndarray,
    rate: np.ndarray,
) -> xr.Dataset:
    """Put a map into a Dataset with names and units."""
    place = ("density", "stress")
    meanings = " ".join(name.replace(" ", "_") for name in MECHANISMS)
    flags = {"flag_values": np.arange(len(MECHANISMS), dtype=np.int8), "flag_meanings": meanings}
    celsius = law.temperature - 273.15
    long_name = "rate of densification of real snow"
    return xr.Dataset(
        {
            "mechanism": (place, mechanism, {"long_name": "mechanism that acts", "units": "1", **flags}),
            "rate": (place, rate, {"long_name": long_name, "units": "s-1"}),
            "rates": (("mechanisms", *place), rates, {"long_name": f"{long_name}, by mechanism", "units": "s-1"}),
        },
        {
            "density": ("density", densities, {"long_name": "density", "units": "kg m-3"}),
            "stress": ("stress", stresses, {"long_name": "stress", "units": "Pa"}),
            "mechanisms": ("mechanisms", list(MECHANISMS), {"long_name": "mechanism", "units": "1"}),
        },
        {
            "title": f"Mechanisms of sintering at {celsius:.4g} °C, grains of {1e3 * law.grain:.3g} mm",
            "temperature": law.temperature,
            "grain": law.grain,
            "settles_below": law.settles_below,
        },
    )
