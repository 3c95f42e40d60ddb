"""Measured laws of snow over its density, each with the range in which it was measured.

Of the original papers only abstracts were at hand; ``checked`` says what a law was compared with.  That is mostly two
public programs: snow_models by B. Bergfeld (snow_models/mechanical_params.py, with pages and equations)
and SnowPyt-MechParams (methods/layer, commit 35cfb4f; its early versions hold other numbers under the same names).

Left out: Gerling et al. (2017), whose range of density was found nowhere, and Wautier et al. (2015), whose level is
that of an ice modulus that one has to choose.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

YOUNG, POISSON, VISCOSITY = "Young's modulus", "Poisson's ratio", "compactive viscosity"


@dataclass(frozen=True)
class Source:
    """The paper of a measurement: authors, year, title and journal; ``doi`` is empty where it is not known."""

    text: str
    doi: str = ""


@dataclass(frozen=True)
class Law:
    """A measured quantity as a function of density.

    ``formula``: in words, ρ in kg/m³; ``low``, ``high``: densities between which it was measured [kg/m^3];
    ``how``: kind of measurement, with temperature and rate where they matter; ``checked``: what it was compared with;
    ``value``: the formula at any density; ``spread``: one standard deviation [unit], 0 where none is known.
    """

    name: str
    quantity: str
    unit: str
    formula: str
    low: float
    high: float
    how: str
    source: Source
    checked: str
    value: Callable[[np.ndarray], np.ndarray] = field(repr=False)
    spread: float = 0.0

    def at(self, rho: np.ndarray | float) -> np.ndarray:
        """Return the quantity at densities ``rho`` [kg/m^3], in the same shape; NaN outside the law's range."""
        rho = np.asarray(rho, dtype=float)
        return np.where((self.low <= rho) & (rho <= self.high), self.value(rho), np.nan)


def scapozza(rho: np.ndarray) -> np.ndarray:
    """Young's modulus [Pa]: Scapozza (2004), page 96, Eq. 5-7."""
    return 0.1873e6 * np.exp(0.0149 * rho)


def sigrist(rho: np.ndarray) -> np.ndarray:
    """Young's modulus [Pa]: Sigrist (2006), page 76, Eq. 4.8."""
    return 1.89 * rho**2.94


def koechle_light(rho: np.ndarray) -> np.ndarray:
    """Young's modulus [Pa]: Köchle and Schneebeli (2014), Eq. 11, the fit to light snow."""
    return 6.1e3 * np.exp(0.0396 * rho)


def koechle_dense(rho: np.ndarray) -> np.ndarray:
    """Young's modulus [Pa]: Köchle and Schneebeli (2014), Eq. 12, the fit to dense snow."""
    return 6.0457e6 * np.exp(0.011 * rho)


def van_herwijnen(rho: np.ndarray) -> np.ndarray:
    """Young's modulus [Pa]: van Herwijnen et al. (2016), Eq. 8."""
    return 0.93 * rho**2.8


def bergfeld(rho: np.ndarray) -> np.ndarray:
    """Young's modulus [Pa]: Bergfeld et al. (2023), Eq. 4 and Appendix B."""
    return 6.5e9 * (rho / 918.0) ** 4.4


def crocus(rho: np.ndarray, below_melting: float) -> np.ndarray:
    """Viscosity [Pa s] of dry, fine-grained snow ``below_melting`` kelvin below 0 °C: Vionnet et al. (2012), Eq. 7."""
    return 7.62237e6 * (rho / 250.0) * np.exp(0.1 * below_melting + 0.023 * rho)


KOECHLE = Source(
    "Köchle, B. and Schneebeli, M. (2014): Three-dimensional microstructure and numerical calculation of elastic "
    "properties of alpine snow with a focus on weak layers. Journal of Glaciology 60(222)",
    "10.3189/2014JoG13J220",
)
SRIVASTAVA = Source(
    "Srivastava, P. K., Chandel, C., Mahajan, P. and Pankaj, P. (2016): Prediction of anisotropic elastic properties "
    "of snow from its microstructure. Cold Regions Science and Technology 125, 85-100"
)
VIONNET = Source(
    "Vionnet, V., Brun, E., Morin, S., Boone, A., Faroux, S., Le Moigne, P., Martin, E. and Willemet, J.-M. (2012): "
    "The detailed snowpack scheme Crocus and its implementation in SURFEX v7.2. Geoscientific Model Development 5, "
    "773-791",
    "10.5194/gmd-5-773-2012",
)
TOMOGRAPHY = "finite elements on X-ray tomography of natural snow, ice of 10 GPa: elastic, no creep"


def _make_modulus(
    name: str, formula: str, low: float, high: float, how: str, source: Source, checked: str,
    value: Callable[[np.ndarray], np.ndarray],
) -> Law:  # fmt: skip
    """Make a law of Young's modulus [Pa] between the densities ``low`` and ``high`` [kg/m^3]."""
    return Law(name, YOUNG, "Pa", formula, low, high, how, source, checked, value)


MODULI = (
    _make_modulus(
        "Scapozza 2004",
        "0.1873 MPa times exp(0.0149 ρ)",
        180.0,
        490.0,
        how="triaxial press, 1e-6 to 1e-3 /s, -18.5 to -1.9 °C",
        source=Source(
            "Scapozza, C. (2004): Entwicklung eines dichte- und temperaturabhängigen Stoffgesetzes zur Beschreibung "
            "des visko-elastischen Verhaltens von Schnee. Dissertation, ETH Zürich (title from memory)"
        ),
        checked="formula, range, rate and temperature in snow_models, the formula in a second program; weac has "
        "another law under the same name, 5.07 GPa (ρ / 917)^5.13",
        value=scapozza,
    ),
    _make_modulus(
        "Sigrist 2006",
        "1.89 Pa times ρ to the power 2.94",
        215.0,
        355.0,
        how="cylinders loaded at 100 Hz",
        source=Source(
            "Sigrist, C. (2006): Measurement of fracture mechanical properties of snow and application to dry snow "
            "slab avalanche release. Dissertation, ETH Zürich",
            "10.3929/ethz-a-005282374",
        ),
        checked="one secondary source alone: formula, range and frequency in snow_models",
        value=sigrist,
    ),
    _make_modulus(
        "Köchle 2014, light",
        "6.1 kPa times exp(0.0396 ρ)",
        150.0,
        250.0,
        how=TOMOGRAPHY,
        source=KOECHLE,
        checked="one secondary source alone: SnowPyt-MechParams; the abstract confirms a logarithmic fit in each of "
        "two ranges of density",
        value=koechle_light,
    ),
    _make_modulus(
        "Köchle 2014, dense",
        "6.0457 MPa times exp(0.011 ρ)",
        250.0,
        450.0,
        how=TOMOGRAPHY,
        source=KOECHLE,
        checked="as for light snow",
        value=koechle_dense,
    ),
    _make_modulus(
        "van Herwijnen 2016",
        "0.93 Pa times ρ to the power 2.8",
        100.0,
        350.0,
        how="bending of slabs, filmed while a saw cuts the layer below; ρ is the slab's mean",
        source=Source(
            "van Herwijnen, A., Gaume, J., Bair, E. H., Reuter, B., Birkeland, K. W. and Schweizer, J. (2016): "
            "Estimating the effective elastic modulus and specific fracture energy of snowpack layers from field "
            "experiments. Journal of Glaciology 62(236), 997-1007",
            "10.1017/jog.2016.90",
        ),
        checked="formula in snow_models and a second program, which gives the range, as a rough one; the abstract "
        "confirms a power law, and 0.08 to 34 MPa",
        value=van_herwijnen,
    ),
    _make_modulus(
        "Bergfeld 2023",
        "6.5 GPa times ρ / 918 to the power 4.4",
        110.0,
        363.0,
        how="bending of layered slabs, filmed while a saw cuts the layer below",
        source=Source(
            "Bergfeld, B., van Herwijnen, A., Bobillier, G., Rosendahl, P. L., Weißgraeber, P., Adam, V., Dual, J. and "
            "Schweizer, J. (2023): Temporal evolution of crack propagation characteristics in a weak snowpack layer: "
            "conditions of crack arrest and sustained propagation. Natural Hazards and Earth System Sciences 23, 293",
            "10.5194/nhess-23-293-2023",
        ),
        checked="formula in snow_models, by the first author; weac and SnowPyt-MechParams agree, with 917 for 918; "
        "range in SnowPyt-MechParams alone; the abstract confirms 0.5 to 50 MPa for slabs",
        value=bergfeld,
    ),
)


def _make_ratio(name: str, mean: float, spread: float, low: float, high: float, source: Source, checked: str) -> Law:
    """Make a law of Poisson's ratio that does not depend on density: its mean, and its spread over samples."""
    formula = f"{mean:g} at any density"
    return Law(
        name, POISSON, "1", formula, low, high, TOMOGRAPHY, source, checked, lambda rho: np.full_like(rho, mean), spread
    )


RATIOS = (
    _make_ratio(
        "Köchle 2014, rounded grains",
        0.171,
        0.026,
        100.0,
        500.0,
        KOECHLE,
        "one secondary source alone: SnowPyt-MechParams; the range is that of all samples",
    ),
    _make_ratio("Köchle 2014, faceted crystals", 0.130, 0.040, 100.0, 500.0, KOECHLE, "as for rounded grains"),
    _make_ratio("Köchle 2014, depth hoar", 0.087, 0.063, 100.0, 500.0, KOECHLE, "as for rounded grains"),
    _make_ratio(
        "Srivastava 2016, rounded grains",
        0.191,
        0.008,
        200.0,
        580.0,
        SRIVASTAVA,
        "one secondary source alone: SnowPyt-MechParams, which names another paper of the same authors and year (doi "
        "10.3189/2016AoG71A562); by its abstract that one followed a single snow, so the range cannot be its own",
    ),
)


def _make_crocus(name: str, below_melting: float) -> Law:
    """Make a law of viscosity from Crocus for dry snow ``below_melting`` kelvin below 0 °C."""
    return Law(
        name,
        VISCOSITY,
        "Pa s",
        f"7.62237e6 Pa s times ρ / 250 times exp(0.1 k + 0.023 ρ), k = {below_melting:g} kelvin below 0 °C",
        50.0,
        450.0,
        "fitted to the settling of alpine snow under its own weight; dry, fine grains",
        VIONNET,
        "formula, lowest density and how density follows in the model's own program (SURFEX: modd_snow_metamo, "
        "modd_snow_par, snow3lcompactn, where colder than -10 °C counts as -10 °C); the upper end is where another "
        "model, GEMB.jl, takes over with a law of firn",
        lambda rho: crocus(rho, below_melting),
    )


VISCOSITIES = (_make_crocus("Crocus, 0 °C", 0.0), _make_crocus("Crocus, -10 °C", 10.0))

LAWS = (*MODULI, *RATIOS, *VISCOSITIES)
