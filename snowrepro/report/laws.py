"""Law against measurement: the paper's elasticity (Eqs. 7 and 8) and densification (Eq. 2) beside measured snow."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import cycle
from pathlib import Path

import numpy as np
import pandas as pd

from ..analysis import laws
from ..config import Config
from ..reference.snow import LAWS, MODULI, RATIOS, VISCOSITIES, Law
from .curves import Curve, draw
from .document import Block, Findings, Fold, Heading, Picture, Table, plain
from .evidence import Evidence, in_paper_order, opened

COLOURS = ("#0072B2", "#009E73", "#56B4E9", "#E69F00", "#CC79A7", "#7f4f24")  # of measured laws, and of runs
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)))
MARKERS = "os^Dv"  # of runs, by pressure
CLOUD = "#D55E00"
PAPER = {"color": "black", "lw": 2.2}
SHOWN = 120  # particles of a run in a picture
LIMIT = 0.5  # Poisson's ratio of what keeps its volume
MELTING = VISCOSITIES[0]
DENSITY = "density [kg/m³]"
TIMES = {0.1: "0.1 s", 1: "1 s", 10: "10 s", 60: "1 min", 600: "10 min", 3600: "1 h", 36000: "10 h"}

YOUNG = Picture(
    "young.png",
    "Young's modulus over density on a logarithmic axis: the paper's straight line, six measured laws, particles",
    "Measured laws, each in its range of density; the paper's law; some particles of each run at release, with E of "
    "Eq. 7 and, grey, with E hardened: times Eq. 1's factor, which is what the solver computes with.",
    "Eqs. 7 and 8",
    "young.csv",
)
POISSON = Picture(
    "poisson.png",
    "Poisson's ratio over density: the paper's law in two readings rises steadily, the measured ones are level bands",
    f"Measured means with one standard deviation. At {LIMIT} a material keeps its volume; beyond it, lambda of "
    "Sec. 3.2 is negative, so the runs are bounded at a cap.",
    "Eqs. 7 and 8",
    "poisson.csv",
)
GAIN = Picture(
    "densification.png",
    "Gain of density over time, both logarithmic: a solid curve for each run, and two of Crocus in the same colour",
    "Solid: mean over the particles of a run while it is pressed. Dashed and dotted: what Crocus gives for snow of the "
    "same initial density under a constant stress equal to the run's nominal pressure, up to the same density.",
    "Eq. 2",
    "densification.csv",
)
VISCOSITY = Picture(
    "viscosity.png",
    "Viscosity over density on a logarithmic axis: the paper's curve, and Crocus at 0 and -10 °C",
    "Eq. 2's first term says d rho/dt / rho = C1 sigma_m / rho_r: a viscosity of rho_r / C1. Crocus takes the "
    "overburden in the place of sigma_m.",
    "Eq. 2",
    "viscosity.csv",
)


@dataclass(frozen=True)
class Snow:
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


def report(evidence: Evidence) -> Findings:
    """Pictures of each law beside measurement, what they come to, and where each measured law is from."""
    config, folder = evidence.configs[0], evidence.folder
    sintered = [c for c in in_paper_order(evidence.of_first_seed) if c.sintering.enabled and c.pressure > 0]
    snows = [snow_of(c) for c in sintered if evidence.is_done(c)]
    pace = pd.DataFrame([_pace(snow) for snow in snows])
    verdict = sentence(config, pace)
    blocks = [
        "No measured fraction of lumps against pressing pressure is known to us: the paper's result itself cannot be "
        "set beside a measurement, only the laws that it is made of.",
        _units(config),
        *_about_modulus(config, snows, folder),
        *_about_ratio(config, snows, folder),
        *_about_density(config, snows, pace, folder),
        *_about_sources(folder),
    ]
    return Findings(blocks, verdict)


def snow_of(config: Config) -> Snow:
    """What a finished run holds of its laws."""
    release = config.loading.press_frames
    with opened(config) as dataset:
        at = dataset.sel(snapshot=release)
        particles = {name: at[name].values.astype(float) for name in ("density", "young", "poisson")}
        factor = laws.hardening_factor(at["hardening"].values.astype(float), at["J_P"].values.astype(float), config)
        time, mean = (dataset[name].values[: release + 1] for name in ("time", "mean_density"))
        return Snow(config.pressure, *particles.values(), factor, time, mean, float(at["von_mises"].mean()))


def sentence(config: Config, pace: pd.DataFrame) -> str:
    """How slope, level, Poisson's ratio and densification stand to measurement, in numbers."""
    within = " and from ".join(f"{low:.0f} to {high:.0f} kg/m³" for low, high in laws.slope_within(config))
    factors = laws.level(config)
    means = np.concatenate([law.value(np.array([law.low])) for law in RATIOS])
    return (
        f"The paper's slope of ln E over density, {laws.slope(config):.4f} m³/kg, lies within the measured ones "
        f"{f'from {within}' if within else 'nowhere'}; measured moduli are {_short(factors.min())} to "
        f"{_short(factors.max())} times the paper's (median {_short(factors.median())}); Poisson's ratio "
        f"{_passes(config)}, measured means lie between {means.min():.2f} and {means.max():.2f}; {_faster(pace)}."
    )


def _short(value: float) -> str:
    """Two significant digits; a dash for what is not known."""
    return f"{float(f'{value:.2g}'):,g}" if np.isfinite(value) else "-"


def _passes(config: Config) -> str:
    """Where the paper's Poisson's ratio becomes impossible, in both readings of Eq. 8."""
    read, printed = (laws.density_of_ratio(LIMIT, config, as_printed) for as_printed in (False, True))
    if not np.isfinite([read, printed]).all():
        return f"stays below {LIMIT} up to the largest density in one reading of Eq. 8 at least"
    return f"passes {LIMIT} at {read:.0f} kg/m³ (with Eq. 8 as printed: {printed:.0f})"


def _faster(pace: pd.DataFrame) -> str:
    """By how much the runs outpace Crocus at the melting point."""
    ratios = pace["times faster"].dropna() if len(pace) else pd.Series(dtype=float)
    if ratios.empty:
        return "no run says how its densification stands to measured snow"
    ends = dict.fromkeys([_short(ratios.min()), _short(ratios.max())])
    return f"the snow densifies {' to '.join(ends)} times as fast as Crocus has it at 0 °C under the same pressure"


def _pace(snow: Snow) -> dict[str, float]:
    """How fast a run densifies, beside Crocus under the nominal pressure."""
    start, end, duration = snow.density[0], snow.density[-1], snow.time[-1] - snow.time[0]
    needed = [laws.settling(law, snow.pressure, start, end)[0][-1] for law in VISCOSITIES]
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


def _units(config: Config) -> str:
    """What is taken as what, so that the paper's numbers have units at all."""
    reading = config.reading
    if reading.length_unit == "m":
        return f"Reading `{reading.name}`: lengths in m, so E, stresses and pressures are in Pa, densities in kg/m³."
    return (
        f"Reading `{reading.name}`: lengths are in cells of the grid. Table 1 prints E without a unit; here its number "
        "is read as Pa, densities as kg/m³, seconds as seconds. Pressures are nominal, those at the snow's centre, in "
        "the unit of E, and so are read as Pa with it. All comparisons of level and of pace hang on that; slopes and "
        "Poisson's ratio do not."
    )


def _measured(measured: Sequence[Law]) -> list[Curve]:
    """Each law in its own range."""
    curves = []
    for law, colour, dashes in zip(measured, COLOURS, DASHES, strict=False):
        rho = np.linspace(law.low, law.high, 100)
        curves.append(Curve(law.name, rho, law.at(rho), {"color": colour, "ls": dashes, "lw": 1.8}, law.spread))
    return curves


def _clouds(snows: Sequence[Snow], values: Sequence[np.ndarray], label: str, **style: str) -> list[Curve]:
    """Some of each run's particles at release, evenly over the order of density."""
    curves = []
    for snow, y, mark in zip(snows, values, cycle(MARKERS), strict=False):
        some = np.argsort(snow.rho, kind="stable")[np.linspace(0, len(y) - 1, min(SHOWN, len(y))).astype(int)]
        drawn = {"color": CLOUD, "marker": mark, "ls": "", "ms": 4.5, "alpha": 0.7, "zorder": 3} | style
        curves.append(Curve(f"{label}, pressed at {snow.pressure:g}", snow.rho[some], y[some], drawn))
    return curves


def _paper_densities(config: Config) -> np.ndarray:
    return np.linspace(config.material.rho, config.sintering.rho_max, 200)


def _about_modulus(config: Config, snows: Sequence[Snow], folder: Path) -> list[Block]:
    """Young's modulus over density."""
    rho = _paper_densities(config)
    curves = [
        Curve("the paper, Eqs. 7 and 8", rho, laws.youngs_modulus(rho, config), PAPER),
        *_measured(MODULI),
        *_clouds(snows, [snow.young for snow in snows], "E"),
        *_clouds(snows, [snow.hardened for snow in snows], "E hardened", markerfacecolor="none", color="#555555"),
    ]
    draw(curves, folder / YOUNG.file, DENSITY, "Young's modulus [Pa]", yscale="log")
    return [
        Heading("Young's modulus"),
        YOUNG,
        *([Table(_reached(snows), "Particles at release: median (5th to 95th percentile).")] if snows else []),
        f"Slope and level are compared at densities at which at least {laws.LEAST} laws were measured. Tests at low "
        "rates (Scapozza) include creep and come out lower than what is computed, elastically, on a measured "
        "microstructure (Köchle).",
    ]


def _reached(snows: Sequence[Snow]) -> pd.DataFrame:
    """What the particles of each run come to at release."""
    return pd.DataFrame(
        {
            "pressure": _short(snow.pressure),
            "density [kg/m³]": _spread(snow.rho, ".1f"),
            "E [MPa]": _spread(snow.young / 1e6, ".3g"),
            "factor of Eq. 1": _spread(snow.factor, ".3g"),
            "E hardened [MPa]": _spread(snow.hardened / 1e6, ".3g"),
        }
        for snow in snows
    )


def _spread(values: np.ndarray, digits: str) -> str:
    low, median, high = np.percentile(values, [5, 50, 95])
    return f"{median:{digits}} ({low:{digits}} to {high:{digits}})"


def _about_ratio(config: Config, snows: Sequence[Snow], folder: Path) -> list[Block]:
    """Poisson's ratio over density."""
    rho, cap = _paper_densities(config), config.reading.poisson_cap
    readings = {False: ("the paper, 3 - 2 rho_r in Eq. 8", "-"), True: ("the paper, Eq. 8 as printed", "--")}
    curves = [
        Curve(label, rho, laws.poissons_ratio(rho, config, as_printed), {**PAPER, "ls": dashes})
        for as_printed, (label, dashes) in readings.items()
    ]
    found = [laws.density_of_ratio(LIMIT, config, as_printed) for as_printed in readings]
    passed = np.array([density for density in found if np.isfinite(density)])
    marks = {"color": CLOUD, "marker": "X", "ls": "", "ms": 7, "zorder": 4}
    curves += [
        Curve(f"{LIMIT} is passed", passed, np.full_like(passed, LIMIT), marks),
        Curve(f"cap of the runs, {cap:g}", rho, np.full_like(rho, cap), {"color": "0.4", "lw": 1.2, "ls": DASHES[-1]}),
        *_measured(RATIOS),
        *_clouds(snows, [snow.poisson for snow in snows], "particles"),
    ]
    draw(curves, folder / POISSON.file, DENSITY, "Poisson's ratio [1]", ylim=(0.0, None))
    return [
        Heading("Poisson's ratio"),
        POISSON,
        "The measured ratios were found not to follow density. Eq. 8 prints 3 - rho_r where Eq. 7 has 3 - 2 rho_r: as "
        f"printed, the ratio starts at {laws.poissons_ratio(rho[0], config, as_printed=True):.3f} and not at its "
        f"initial value, {config.material.nu:g}. The runs have `{config.reading.poisson_denominator}`.",
    ]


def _about_density(config: Config, snows: Sequence[Snow], pace: pd.DataFrame, folder: Path) -> list[Block]:
    """Density over time, and Eq. 2's first term as a viscosity."""
    rho = _paper_densities(config)
    paper = laws.viscosity(rho, config)
    curves = [Curve("the paper, Eq. 2: rho_r / C1", rho, paper, PAPER), *_measured(VISCOSITIES)]
    draw(curves, folder / VISCOSITY.file, DENSITY, "viscosity [Pa s]", yscale="log")
    return [
        Heading("Densification"),
        *(_over_time(snows, pace, folder) if snows else []),
        VISCOSITY,
        f"At {rho[0]:g} kg/m³ Crocus at 0 °C is {_short(float(MELTING.at(rho[0])) / paper[0])} times as viscous as "
        "that term.",
        "Crocus is linear in stress and fitted to snow under its own weight. Creep tests found strain rates that grow "
        "with stress to the power 1.8 to 4; high loads on light snow, as here, are where that and Crocus part "
        "([EGUsphere 2025-4193](https://egusphere.copernicus.org/preprints/2025/egusphere-2025-4193), abstract).",
    ]


def _over_time(snows: Sequence[Snow], pace: pd.DataFrame, folder: Path) -> list[Block]:
    """The runs' densification beside that of Crocus."""
    _draw_gain(snows, folder / GAIN.file)
    pace.to_csv(folder / "pace.csv", index=False, float_format="%.6g", lineterminator="\n")
    shown = pace.map(_short).assign(**{"density at release": pace["density at release"].map("{:.1f}".format)})
    return [
        GAIN,
        Table(shown, "Pressures and stresses in the unit of E; densities in kg/m³.", "pace.csv"),
        "What is compared: the time of the pressing with the time that Crocus needs from the same initial to the same "
        "mean density. The pressure is that at the snow's centre, taken for the whole of it, and 0 °C is the warmest "
        "dry snow: both make Crocus fast. In the first frame there is no stress yet, and Eq. 2 densifies by its second "
        "term, C2 |b|, alone; later by stresses inside the snow, which may exceed the pressure by far (table).",
    ]


def _draw_gain(snows: Sequence[Snow], path: Path) -> None:
    """Each run's gain of density over time, and Crocus beside it in the same colour."""
    coloured = list(zip(snows, cycle(COLOURS), strict=False))
    curves = [
        Curve(
            f"run, {snow.pressure:g}",
            snow.time[1:],
            snow.density[1:] / snow.density[0] - 1.0,
            {"color": colour, "lw": 2.2},
        )
        for snow, colour in coloured
    ]
    for law, dashes in zip(VISCOSITIES, ("--", ":"), strict=True):
        for snow, colour in coloured:
            time, rho = laws.settling(law, snow.pressure, snow.density[0], snow.density[-1])
            style = {"color": colour, "lw": 1.6, "ls": dashes}
            curves.append(Curve(f"{law.name}, {snow.pressure:g}", time[1:], rho[1:] / rho[0] - 1.0, style))
    axes = {"xscale": "log", "yscale": "log", "xticks": list(TIMES), "xticklabels": list(TIMES.values())}
    draw(curves, path, "time since pressing began", "gain of density [1]", columns=1 + len(VISCOSITIES), **axes)


def _about_sources(folder: Path) -> list[Block]:
    """Each law's formula, range and reference, and how far it could be checked."""
    columns = [f.name for f in fields(Law) if f.name not in ("value", "source")]
    rows = [{name: getattr(law, name) for name in columns} for law in LAWS]
    sources = [{"reference": law.source.text, "doi": law.source.doi} for law in LAWS]
    table = pd.concat([pd.DataFrame(rows), pd.DataFrame(sources)], axis=1)
    table.to_csv(folder / "laws.csv", index=False, lineterminator="\n")
    text = table.assign(reference=[_cited(law) for law in LAWS], range=[f"{x.low:g} to {x.high:g}" for x in LAWS])
    for name in ("name", "quantity", "formula", "how", "checked"):
        text[name] = text[name].map(plain)
    return [
        Heading("The measured laws"),
        Table(
            text[["name", "quantity", "formula", "range", "reference"]].rename(columns={"range": DENSITY}),
            "rho in kg/m³; each law holds in its range of density and is drawn nowhere else.",
            "laws.csv",
        ),
        Fold(
            "How each was measured, and where its numbers were looked up",
            [
                "The measurers' own texts were not at hand but for abstracts: numbers that stand in one secondary "
                "source alone are marked so.",
                Table(text[["name", "how", "checked"]]),
            ],
        ),
    ]


def _cited(law: Law) -> str:
    doi = law.source.doi
    return plain(law.source.text) + (f" [doi:{doi}](https://doi.org/{doi})" if doi else "")
