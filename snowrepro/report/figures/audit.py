"""The paper's equations by themselves: eight places where they contradict themselves or leave something open.

Nothing is simulated.  What each does to Figure 5 is tried by other experiments, whose commands the page has.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...composition.compose import compose
from ...composition.experiments import read_experiments
from ...evidence.audit import Finding, audit_model
from ...evidence.gather import Evidence
from ...evidence.variants import list_changes
from ...store.run import Run
from ...text import make_cells
from ..document import FigureContent, Picture, Table
from ..drawing.common import choose_font, save_figure
from ..sections.variants import describe_change
from .ablation import name_variant
from .kinds import FigureKind

LOOKS = (("#0072B2", "-"), ("#D55E00", "--"), ("#009E73", "-."), ("#CC79A7", (0, (5, 1))), ("#E69F00", ":"),
         ("#555555", "-"))  # colour and dashes of a panel's lines, in turn  # fmt: skip
WIDE, NARROW = 9.2, 4.6  # width of the picture, and of that for a narrow screen [inches]
ROW = 3.1  # height of a row of panels [inches]


@dataclass(frozen=True)
class Item:
    """One place in the paper.

    ``finding``: its name; ``paper``: what is printed; ``number``: what that comes to, a template of the finding's
    numbers; ``short``: the same for the verdict; ``x``, ``y``: labels of the panel's axes; ``axes``: their further
    properties; ``legend``: its place; ``experiment`` and ``variants``: what tries it on Figure 5, all of the experiment
    if there are none; ``note``: what else is to be said of Figure 5.
    """

    finding: str
    title: str
    paper: str
    number: str
    short: str
    x: str
    y: str
    axes: Mapping[str, Any] = field(default_factory=dict)
    legend: str = "upper left"
    experiment: str = "readings"
    variants: tuple[str, ...] = ()
    note: str = ""

    @property
    def command(self) -> str:
        """The command that runs what tries it beside Figure 5 as it is."""
        chosen = f" variant={','.join(('base', *self.variants))}" if self.variants else ""
        return f"snowrepro run experiment={self.experiment}{chosen}"


DENSITY, RATIO = "density [kg/m³]", "Poisson's ratio ν"
ITEMS = (
    Item(
        finding="start",
        title="Eq. 8 against Eq. 7",
        paper="Eq. 8: ν_max = ν₀ / √(ρ_r / (3 - ρ_r)); Eq. 7: ν = ν_max √(ρ_r / (3 - 2 ρ_r)). The denominators differ.",
        number="ν starts at **{start:.3f}**, not at ν₀ = {nu_0:g}.",
        short="ν starts at {start:.3f}, not at {nu_0:g}",
        x=DENSITY,
        y=RATIO,
        variants=("reading_poisson_printed",),
    ),
    Item(
        finding="lambda",
        title="Eqs. 7 and 8: λ without a value",
        paper='Sec. 3.2: "we compute μ and λ using [...] λ = ν E / ((1 + ν) (1 - 2 ν))".',
        number=(
            "ν passes 0.5 at **{density:.0f} kg/m³** (Eq. 8 as printed: {density_printed:.0f}) and is {largest:.2f} "
            "({largest_printed:.2f}) at ρ_max. At 0.5 λ has no value, beyond it λ is negative."
        ),
        short="ν passes 0.5 at {density:.0f} kg/m³, where λ has no value",
        x=DENSITY,
        y="λ / E",
        axes={"ylim": (-20, 20)},
        legend="upper right",
        variants=("reading_poisson_cap_30", "reading_poisson_cap_49"),
        note="The runs stop ν at a cap.",
    ),
    Item(
        finding="density",
        title="Eq. 2 has no bound, C₁ no unit",
        paper=(
            'Eq. 2: ρ + Δt ρ [C₁ σ_m / ρ_r + C₂ ‖b‖]; ρ_max is called "maximum density", but only divides in Eq. 6. '
            "Table 1: C₁ = 5 × 10⁻⁷, without a unit."
        ),
        number=(
            "Under a constant stress of {highest:g} ρ_max is passed after **{seconds:.0f} s**, under {lowest:g} after "
            "{longest:,.0f} s; within the {pressed:g} s of pressing it takes {stress:,.0f}. The same snow told in SI, "
            "with a cell of {cell:g} m and the density as printed, has C₁ = {C1_in_SI:.3g} Pa⁻¹ s⁻¹: {times:,.0f} "
            "times the printed number."
        ),
        short="ρ_max is no bound of Eq. 2, and is passed after {seconds:.0f} s under a stress of {highest:g}",
        x="time under a constant stress [s]",
        y=DENSITY,
        axes={"xscale": "log"},
        experiment="ablation",
        variants=("no_C1",),
        note="The runs stop at ρ_max and count what gets there (`density_capped`). No run has another bound.",
    ),
    Item(
        finding="updates",
        title="Eq. 9 has no time step",
        paper=(
            'Eq. 9: ξ + C₄ σ_m + C₅ ‖b‖, once for each n; Sec. 3.1: "n is frame number"; Sec. 3.4: between steps 3 '
            "and 4, which are done in every time step."
        ),
        number=(
            "ξ after 1 s under {stress:g}: {long:.0f}, **{own:.0f}** and {short:.0f} with frames of {long_frame:g}, "
            "{frame:g} and {short_frame:g} s. Once in every time step: {substep:.0f} with those of soft snow "
            "({substeps:.0f} a second), {capped:.0f} with those of snow at the cap ({capped_substeps:.0f})."
        ),
        short="ξ after a second under {stress:g} is {own:.0f} or {capped:.0f}, by how often Eq. 9 acts",
        x="time under a constant stress [s]",
        y="ξ",
        axes={"yscale": "log", "ylim": (4, 3e4)},
        variants=("frame_10ms", "frame_30ms", "reading_substep", "reading_per_time"),
    ),
    Item(
        finding="energy",
        title="E grows in strained snow",
        paper=(
            'Sec. 3.4: "After computing the node force in step 3, we update density [...], elasticity [...] and '
            'plasticity": of snow that is strained by then.'
        ),
        number=(
            "At the same strain the elastic energy is **{E_2:.1f}**, {E_3:.0f} and {E_4:.0f} times as large at "
            "{rho_2:.0f}, {rho_3:.0f} and {rho_4:.0f} kg/m³ by E alone; with ν (up to {nu_cap:g}) {held_2:.1f}, "
            "{held_3:.0f} and {held_4:.0f} times with sideways held, {all_sides_2:.1f}, {all_sides_3:.0f} "
            "and {all_sides_4:.0f} from all sides. No term gives this energy: it is put in."
        ),
        short="energy at the same strain is {E_2:.1f} times as large at {rho_2:.0f} kg/m³",
        x=DENSITY,
        y="energy over that at first",
        axes={"yscale": "log"},
        experiment="energy",
        note="The ledger of each run has what sintering puts in.",
    ),
    Item(
        finding="cap",
        title="Eq. 1 has no cap",
        paper="Eq. 1: exp(ξ (1 - J_P)). Legacy Taichi stops the factor at e⁵; the paper does not say so.",
        number=(
            "With ξ after {updates:.0f} updates under {lowest:g} ({xi_low:.0f}) the factor passes {cap:.0f} at J_P = "
            "{J_P_low:.3f}, under {highest:g} ({xi_high:.0f}) at **{J_P_high:.3f}**. Without a cap it would be "
            "{factor_low:.0f} and {factor_high:.0e} at J_P = {J_P:g}; with ξ = {xi:g} of Table 1 {factor_first:.1f}."
        ),
        short="Eq. 1's factor passes the cap of {cap:.0f} at J_P = {J_P_high:.3f} under {highest:g}",
        x="plastic volume ratio J_P",
        y="factor of Eq. 1",
        axes={"yscale": "log", "ylim": (0.7, 1e14), "xlim": (0.8, 1.0), "xticks": (0.8, 0.85, 0.9, 0.95, 1.0)},
        variants=("reading_exponent_8", "reading_exponent_widest"),
    ),
    Item(
        finding="units",
        title="Mass and units",
        paper="Table 1: m = 0.01 kg, ρ = 100 kg/m³, E₀ = 1.4 × 10⁵ without a unit; no grid is printed.",
        number=(
            "m / ρ is {volume:g} m² at unit depth, so with {per_cell:.0f} particles in each a cell is {cell:g} m wide. "
            "The snow's weight over stiffness, ρ g D / E₀, is {grid:.3f} in grid units and {si:.5f} in SI: beside "
            "gravity the same E₀ is **{times:.0f}** times as soft in grid units. With cells of {equal_cell:.2f} m they "
            "would be equal."
        ),
        short="beside gravity the same E₀ is {times:.0f} times as soft in grid units as in SI",
        x="width of a cell in SI [m]",
        y="ρ g D / E₀",
        axes={"xscale": "log", "yscale": "log"},
        legend="lower right",
        variants=("reading_si",),
    ),
    Item(
        finding="plane",
        title="Von Mises stress in 2D",
        paper='Eqs. 3 to 5 have σ_zz, σ_yz and σ_zx; Table 1: "used in 2D examples". Nothing says what σ_zz is in 2D.',
        number=(
            "Compressed from all sides, σ_m by plane strain is {all_sides_first:.2f} of that with σ_zz = 0 at "
            "ν = {nu_0:g}, **{all_sides_last:.2f}** at ν = {nu_cap:g}; with sideways held "
            "{held_first:.2f} and {held_last:.2f}."
        ),
        short="σ_m by plane strain is {all_sides_first:.1f} to {all_sides_last:.1f} of that with σ_zz = 0",
        x=RATIO,
        y="σ_m: plane strain / σ_zz = 0",
        axes={"ylim": (0, 1.05)},
        legend="upper right",
        variants=("reading_stress_zz_zero",),
    ),
)


def report(evidence: Evidence) -> FigureContent:
    """Draw a panel for each place, and tabulate what is printed, what it comes to and what tries it on Figure 5."""
    pressures = sorted({run.case.pressure for run in evidence.runs})
    findings = audit_model(evidence.runs[0].case, pressures)
    _write_numbers(findings, evidence)
    for name, columns in (("audit.png", 2), ("audit-narrow.png", 1)):
        draw_findings(findings, evidence, name, columns)
    picture = Picture(
        "audit.png",
        "Eight panels, one for each place in the paper: what its equations give over density, time, J_P or ν.",
        "From Table 1 and the equations alone. Points: where the numbers of the table are read. 2: lines are broken "
        f"off where λ has no value. 3 and 6: a line for each of Figure 5's pressures [{evidence.pressure_unit}], in 3 "
        "as the constant stress, in 6 by ξ after as many updates as the pressing has frames. 4: with soft snow the "
        "line of every time step hides that of the shortest frames. 5: bends where ν reaches its cap.",
        "Eqs. 1 to 9",
        "audit.csv",
        "audit-narrow.png",
    )
    rows = [
        {
            "place": f"{number}. {item.title}",
            "the paper": item.paper,
            "what it comes to": _fill(item.number, findings[item.finding]),
            "what tries it on Figure 5": _describe_trial(item),
        }
        for number, item in enumerate(ITEMS, 1)
    ]
    caption = (
        f"Stresses in {evidence.pressure_unit}, held constant, and b left out: with b Eqs. 2 and 9 go faster. Figure 5 "
        "is not run here: the last column has what tries it, and the command that runs just that beside Figure 5 as it "
        "is. The pages of those experiments have the results."
    )
    shorts = [_fill(item.short, findings[item.finding]) for item in ITEMS]
    return FigureContent(
        [picture, Table(pd.DataFrame(rows), caption, "numbers.csv")], f"As printed, {'; '.join(shorts)}."
    )


def _fill(template: str, finding: Finding) -> str:
    """Fill a template with a finding's numbers; powers of ten as the register has them: 7e25."""
    return template.format(**finding.numbers).replace("e+", "e")


def _describe_trial(item: Item) -> str:
    """Say what tries a place on Figure 5, in words, and by which command."""
    if item.experiment == "readings":
        base, *others = (Run(compose([f"experiment={item.experiment}", f"variant={name}"])) for name in
                         ("base", *item.variants))  # fmt: skip
        words = [describe_change(list_changes(run, base)) for run in others]
    else:
        words = [name_variant(name) for name in item.variants] or [read_experiments()[item.experiment]["title"]]
    return " ".join(filter(None, [f"{item.experiment}: {'; '.join(words)}.", item.note, f"`{item.command}`"]))


def _write_numbers(findings: Mapping[str, Finding], evidence: Evidence) -> None:
    """Write all numbers, and all that is drawn, as CSV."""
    numbers = [
        {"place": place, "name": name, "value": value}
        for place, finding in findings.items()
        for name, value in finding.numbers.items()
    ]
    drawn = [
        pd.DataFrame({"place": place, "line": label, "x": x, "y": y})
        for place, finding in findings.items()
        for label, (x, y) in finding.lines.items()
    ]
    for name, table in (("numbers.csv", pd.DataFrame(numbers)), ("audit.csv", pd.concat(drawn).dropna())):
        make_cells(table).to_csv(evidence.folder / name, index=False, float_format="%.6g", lineterminator="\n")


def draw_findings(findings: Mapping[str, Finding], evidence: Evidence, name: str, columns: int) -> None:
    """Draw a panel for each place, in so many columns."""
    rows, width = -(-len(ITEMS) // columns), WIDE if columns > 1 else NARROW
    figure = Figure(figsize=(width, ROW * rows), layout="constrained")
    font = choose_font(width)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for number, (ax, item) in enumerate(zip(panels, ITEMS, strict=True), 1):
        ax.set(**item.axes)
        _draw_panel(ax, findings[item.finding], font)
        ax.legend(fontsize=font - 1, frameon=False, handlelength=2.2, labelspacing=0.25, loc=item.legend)
        ax.set_title(f"{number}. {item.title}", fontsize=font + 1, loc="left")
        ax.set_xlabel(item.x, fontsize=font)
        ax.set_ylabel(item.y, fontsize=font)
    save_figure(figure, evidence.folder / name)


def _draw_panel(ax: Axes, finding: Finding, font: float) -> None:
    """Draw the lines, levels and points of a finding."""
    for (label, (x, y)), (colour, dashes) in zip(finding.lines.items(), cycle(LOOKS), strict=False):
        ax.plot(
            *(np.where(np.isfinite(each), each, np.nan) for each in (x, y)),
            label=label,
            color=colour,
            ls=dashes,
            lw=1.8,
        )
    for label, level in finding.levels.items():
        ax.axhline(level, color="black", lw=1.0, ls=(0, (1, 1)), label=label)
    for place in (each for each in finding.points if np.isfinite(each).all()):
        ax.plot(*place, "o", color="black", ms=4, zorder=3)
    ax.tick_params(labelsize=font)
    ax.grid(color="0.92", lw=0.6)


FIGURE = FigureKind(report, needs_runs=False)
