"""Laws and measurements: the paper's elasticity (Eqs. 7 and 8) and densification (Eq. 2) beside measured snow."""

from collections.abc import Sequence
from dataclasses import fields
from itertools import cycle
from pathlib import Path

import numpy as np
import pandas as pd

from ...evidence import laws
from ...evidence.gather import Evidence, sort_as_in_paper
from ...quantities import DENSITY as DENSITY_POWERS
from ...quantities import PRESSURE, format_powers
from ...reference.snow import LAWS, MODULI, RATIOS, VISCOSITIES, Law
from ...store.run import Run
from ...text import make_cells
from ..document import Block, FigureContent, Fold, Heading, Picture, Table, escape
from ..drawing.curves import Curve, draw_curves
from .kinds import FigureKind

COLOURS = ("#0072B2", "#009E73", "#56B4E9", "#E69F00", "#CC79A7", "#7f4f24")  # of measured laws, and of runs
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)))
MARKERS = "os^Dv"  # of runs, by pressure
CLOUD = "#D55E00"
PAPER = {"color": "black", "lw": 2.2}
SHOWN = 120  # particles of a run in a picture
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
    f"Measured means with one standard deviation. At {laws.LIMIT} a material keeps its volume; beyond it, λ of "
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
    "Eq. 2's first term says dρ/dt / ρ = C₁ σ_m / ρ_r: a viscosity of ρ_r / C₁. Crocus takes the overburden "
    "in the place of σ_m.",
    "Eq. 2",
    "viscosity.csv",
)


def report(evidence: Evidence) -> FigureContent:
    """Draw each law beside measurements, say how they compare, and where each measured law is from."""
    run, folder = evidence.runs[0], evidence.folder
    sintered = [
        run
        for run in sort_as_in_paper(evidence.first_seed_runs)
        if run.case.sintering.enabled and run.case.pressure > 0
    ]
    snows = [laws.read_snow(run) for run in sintered if evidence.is_done(run)]
    pace = pd.DataFrame([laws.measure_pace(snow) for snow in snows])
    verdict = laws.write_sentence(run.case, pace)
    blocks: list[Block] = [
        (
            "No measured fraction of lumps against pressing pressure is known to us: the paper's result itself cannot "
            "be set beside a measurement, only the laws that it is made of."
        ),
        _describe_units(run),
        *_compare_modulus(run, snows, folder),
        *_compare_ratio(run, snows, folder),
        *_compare_densification(run, snows, pace, folder),
        *_list_sources(folder),
    ]
    return FigureContent(blocks, verdict)


def _name_units(run: Run) -> str:
    """Name the units of stresses and densities of a run, and in which measured ones they are read."""
    stress, density = (format_powers(powers, [run.case.reading.length_unit]) for powers in (PRESSURE, DENSITY_POWERS))
    if run.case.reading.length_unit == "m":
        return f"{stress}, densities in {density}"
    return f"{stress}, read as Pa; densities in {density}, read as kg/m³"


def _describe_units(run: Run) -> str:
    """Explain which units the paper's numbers are read in."""
    reading = run.case.reading
    if reading.length_unit == "m":
        return f"Reading `{reading.name}`: lengths in m, so E, stresses and pressures are in {_name_units(run)}."
    return (
        f"Reading `{reading.name}`: lengths are in cells of the grid, so E, stresses and pressures are in "
        f"{_name_units(run)}: one cell is taken for one metre here, as Table 1 prints E without a unit. Pressures are "
        "nominal, those at the snow's centre. All comparisons of level and of pace hang on that; slopes and Poisson's "
        "ratio do not."
    )


def _make_law_curves(laws_measured: Sequence[Law]) -> list[Curve]:
    """Make a curve for each measured law, in its own range of density."""
    curves = []
    for law, colour, dashes in zip(laws_measured, COLOURS, DASHES, strict=False):
        rho = np.linspace(law.low, law.high, 100)
        curves.append(Curve(law.name, rho, law.at(rho), {"color": colour, "ls": dashes, "lw": 1.8}, law.spread))
    return curves


def _make_clouds(
    snows: Sequence[laws.SinteredSnow], values: Sequence[np.ndarray], label: str, **style: str
) -> list[Curve]:
    """Make a cloud of points for each run: some of its particles at release, evenly over the order of density.

    ``values``: (n,) for each of ``snows``; ``style``: changes of the points' look.
    """
    curves = []
    for snow, value, mark in zip(snows, values, cycle(MARKERS), strict=False):
        chosen = np.argsort(snow.rho, kind="stable")[np.linspace(0, len(value) - 1, min(SHOWN, len(value))).astype(int)]
        look = {"color": CLOUD, "marker": mark, "ls": "", "ms": 4.5, "alpha": 0.7, "zorder": 3} | style
        curves.append(Curve(f"{label}, pressed at {snow.pressure:g}", snow.rho[chosen], value[chosen], look))
    return curves


def _sample_densities(run: Run) -> np.ndarray:
    """Return evenly spaced densities of the paper's laws, (200,) [kg/m³]."""
    return np.linspace(run.case.material.rho, run.case.sintering.rho_max, 200)


def _compare_modulus(run: Run, snows: Sequence[laws.SinteredSnow], folder: Path) -> list[Block]:
    """Compare Young's modulus over density."""
    rho = _sample_densities(run)
    curves = [
        Curve("the paper, Eqs. 7 and 8", rho, laws.youngs_modulus(rho, run.case), PAPER),
        *_make_law_curves(MODULI),
        *_make_clouds(snows, [snow.young for snow in snows], "E"),
        *_make_clouds(snows, [snow.hardened for snow in snows], "E hardened", markerfacecolor="none", color="#555555"),
    ]
    draw_curves(curves, folder / YOUNG.file, DENSITY, "Young's modulus [Pa]", yscale="log")
    return [
        Heading("Young's modulus"),
        YOUNG,
        *([Table(_tabulate_release(snows), "Particles at release: median (5th to 95th percentile).")] if snows else []),
        (
            f"Slope and level are compared at densities at which at least {laws.LEAST} laws were measured. Tests at "
            "low rates (Scapozza) include creep and come out lower than what is computed, elastically, on a measured "
            "microstructure (Köchle)."
        ),
    ]


def _tabulate_release(snows: Sequence[laws.SinteredSnow]) -> pd.DataFrame:
    """Tabulate the state of each run's particles at release."""
    return pd.DataFrame(
        {
            "pressure": laws.format_short(snow.pressure),
            "density [kg/m³]": _format_spread(snow.rho, ".1f"),
            "E [MPa]": _format_spread(snow.young / 1e6, ".3g"),
            "factor of Eq. 1": _format_spread(snow.factor, ".3g"),
            "E hardened [MPa]": _format_spread(snow.hardened / 1e6, ".3g"),
        }
        for snow in snows
    )


def _format_spread(values: np.ndarray, digits: str) -> str:
    """Format the median of values with their 5th and 95th percentile.  ``digits``: a format, such as .1f."""
    low, median, high = np.percentile(values, [5, 50, 95])
    return f"{median:{digits}} ({low:{digits}} to {high:{digits}})"


def _compare_ratio(run: Run, snows: Sequence[laws.SinteredSnow], folder: Path) -> list[Block]:
    """Compare Poisson's ratio over density."""
    rho, cap = _sample_densities(run), run.case.reading.poisson_cap
    readings = {False: ("the paper, 3 - 2 ρ_r in Eq. 8", "-"), True: ("the paper, Eq. 8 as printed", "--")}
    curves = [
        Curve(label, rho, laws.poissons_ratio(rho, run.case, as_printed), {**PAPER, "ls": dashes})
        for as_printed, (label, dashes) in readings.items()
    ]
    densities = [laws.density_of_ratio(laws.LIMIT, run.case, as_printed) for as_printed in readings]
    limits = np.array([density for density in densities if np.isfinite(density)])
    marks = {"color": CLOUD, "marker": "X", "ls": "", "ms": 7, "zorder": 4}
    curves += [
        Curve(f"{laws.LIMIT} is passed", limits, np.full_like(limits, laws.LIMIT), marks),
        Curve(f"cap of the runs, {cap:g}", rho, np.full_like(rho, cap), {"color": "0.4", "lw": 1.2, "ls": DASHES[-1]}),
        *_make_law_curves(RATIOS),
        *_make_clouds(snows, [snow.poisson for snow in snows], "particles"),
    ]
    draw_curves(curves, folder / POISSON.file, DENSITY, "Poisson's ratio [1]", ylim=(0.0, None))
    return [
        Heading("Poisson's ratio"),
        POISSON,
        (
            "The measured ratios were found not to follow density. Eq. 8 prints 3 - ρ_r where Eq. 7 has 3 - 2 "
            f"ρ_r: as printed, the ratio starts at {laws.poissons_ratio(rho[0], run.case, as_printed=True):.3f} and "
            f"not at its initial value, {run.case.material.nu:g}. The runs have "
            f"`{run.case.reading.poisson_denominator}`."
        ),
    ]


def _compare_densification(
    run: Run, snows: Sequence[laws.SinteredSnow], pace: pd.DataFrame, folder: Path
) -> list[Block]:
    """Compare density over time, and the viscosity that Eq. 2's first term amounts to."""
    rho = _sample_densities(run)
    paper = laws.viscosity(rho, run.case)
    curves = [Curve("the paper, Eq. 2: ρ_r / C₁", rho, paper, PAPER), *_make_law_curves(VISCOSITIES)]
    draw_curves(curves, folder / VISCOSITY.file, DENSITY, "viscosity [Pa s]", yscale="log")
    ratio = laws.format_short(float(laws.MELTING.at(rho[0])) / paper[0])
    return [
        Heading("Densification"),
        *(_compare_over_time(run, snows, pace, folder) if snows else []),
        VISCOSITY,
        (f"At {rho[0]:g} kg/m³ Crocus at 0 °C is {ratio} times as viscous as that term."),
        (
            "Crocus is linear in stress and fitted to snow under its own weight. Creep tests found strain rates that "
            "grow with stress to the power 1.8 to 4; high loads on light snow, as here, are where that and Crocus "
            "part ([EGUsphere 2025-4193](https://egusphere.copernicus.org/preprints/2025/egusphere-2025-4193), "
            "abstract)."
        ),
    ]


def _compare_over_time(run: Run, snows: Sequence[laws.SinteredSnow], pace: pd.DataFrame, folder: Path) -> list[Block]:
    """Compare the runs' densification with that of Crocus."""
    _draw_gain(snows, folder / GAIN.file)
    make_cells(pace).to_csv(folder / "pace.csv", index=False, float_format="%.6g", lineterminator="\n")
    table = pace.map(laws.format_short).assign(
        **{"density at release": pace["density at release"].map("{:.1f}".format)}
    )
    return [
        GAIN,
        Table(table, f"Pressures and stresses in {_name_units(run)}.", "pace.csv"),
        (
            "What is compared: the time of the pressing with the time that Crocus needs from the same initial to the "
            "same mean density. The pressure is that at the snow's centre, taken for the whole of it, and 0 °C is the "
            "warmest dry snow: both make Crocus fast. In the first frame there is no stress yet, and Eq. 2 densifies "
            "by its second term, C₂ |b|, alone; later by stresses inside the snow, which may exceed the pressure by "
            "far (table)."
        ),
    ]


def _draw_gain(snows: Sequence[laws.SinteredSnow], path: Path) -> None:
    """Draw each run's gain of density over time, and that of Crocus in the same colour."""
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
            time, rho = laws.integrate_settling(law, snow.pressure, snow.density[0], snow.density[-1])
            style = {"color": colour, "lw": 1.6, "ls": dashes}
            curves.append(Curve(f"{law.name}, {snow.pressure:g}", time[1:], rho[1:] / rho[0] - 1.0, style))
    axes = {"xscale": "log", "yscale": "log", "xticks": list(TIMES), "xticklabels": list(TIMES.values())}
    draw_curves(curves, path, "time since pressing began", "gain of density [1]", columns=1 + len(VISCOSITIES), **axes)


def _list_sources(folder: Path) -> list[Block]:
    """List each law's formula, range and reference, and how far it could be checked."""
    columns = [field.name for field in fields(Law) if field.name not in ("value", "source")]
    rows = [{name: getattr(law, name) for name in columns} for law in LAWS]
    sources = [{"reference": law.source.text, "doi": law.source.doi} for law in LAWS]
    table = pd.concat([pd.DataFrame(rows), pd.DataFrame(sources)], axis=1)
    make_cells(table).to_csv(folder / "laws.csv", index=False, lineterminator="\n")
    text = table.assign(reference=[_cite(law) for law in LAWS], range=[f"{law.low:g} to {law.high:g}" for law in LAWS])
    for name in ("name", "quantity", "formula", "how", "checked"):
        text[name] = text[name].map(escape)
    return [
        Heading("The measured laws"),
        Table(
            text[["name", "quantity", "formula", "range", "reference"]].rename(columns={"range": DENSITY}),
            "ρ in kg/m³; each law holds in its range of density and is drawn nowhere else.",
            "laws.csv",
        ),
        Fold(
            "How each was measured, and where its numbers were looked up",
            [
                (
                    "The measurers' own texts were not at hand but for abstracts: numbers that stand in one secondary "
                    "source alone are marked so."
                ),
                Table(text[["name", "how", "checked"]]),
            ],
        ),
    ]


def _cite(law: Law) -> str:
    """Format the reference of a law."""
    doi = law.source.doi
    return escape(law.source.text) + (f" [doi:{doi}](https://doi.org/{doi})" if doi else "")


FIGURE = FigureKind(report)
