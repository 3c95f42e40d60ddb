"""A figure with grid and time step finer and finer, and other choices: which measures have a limit."""

import math
from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, ScalarFormatter

from ...evidence.gather import Evidence
from ...evidence.limits import (
    MEASURES,
    REFINED,
    STEP,
    Choice,
    Descent,
    compare_choices,
    count_outcomes,
    list_choices,
    list_descents,
    measure_reach,
)
from ...evidence.refinement import LEAST_STEP, SPACING
from ...text import make_cells
from ..document import NO_RESULT, Block, FigureContent, Heading, Picture, Table, escape
from ..drawing.common import choose_font, save_figure
from .kinds import FigureKind
from .refinement import COLOURS, describe_changes, format_steps, format_values, make_numbers, set_axis_of_spacing

SHORT = {SPACING: "dx", STEP: "cfl"}
NAMES = {SPACING: "Width of a cell", STEP: "CFL number"}
GETS_FINER = {SPACING: "As cells get narrower", STEP: "As the time step gets shorter"}
STYLES = (("o", "-"), ("s", "--"), ("^", ":"), ("x", "-."))  # marker and line of each choice
OWN_SCALE = "hardening_at_release"  # a measure whose values at two pressures share no axis
WIDE, NARROW = 9.2, 4.6  # width of the picture, and of that for a narrow screen [inches]
ROW = 1.9  # height of a row of panels [inches]


def report(evidence: Evidence) -> FigureContent:
    """Tabulate and draw what measures do as grid and time step get finer, with each set of other choices."""
    if evidence.table.empty:
        return NO_RESULT
    descents = list_descents(evidence)
    choices = list_choices(descents)
    _write_numbers(descents, evidence)
    for name, width in (("limits.png", WIDE), ("limits-narrow.png", NARROW)):
        draw_descents(descents, evidence, name, width)
    blocks: list[Block] = [
        _make_picture(evidence),
        Table(
            pd.DataFrame([_make_count_row(descents, along, choice) for along in REFINED for choice in choices]),
            "In how many sequences steps shrink, of those that were run. A sequence is one measure at one pressure.",
        ),
    ]
    for along in REFINED:
        own = [descent for descent in descents if descent.along == along]
        blocks += [Heading(GETS_FINER[along]), Table(_tabulate(own), _make_caption(own, evidence), "limits.csv")]
    return FigureContent(blocks, _summarise(descents))


def _make_caption(descents: Sequence[Descent], evidence: Evidence) -> str:
    """Make the caption of the table of sequences along one setting."""
    levels = ", ".join(f"{level:g}" for level in descents[0].trend.levels)
    seeds = " One seed, so how much of a step is chance is not known here." if len(evidence.seeds) == 1 else ""
    return (
        f"{NAMES[descents[0].along]} {levels}: the values, the steps between them, and what these say; with an order, "
        "the value extrapolated to 0 and its band, by Roache's rule for three grids. Up to "
        f"{LEAST_STEP:g} (hardening and strain: that part of the value) a step is none.{seeds}"
    )


def _summarise(descents: Sequence[Descent]) -> str:
    """Say in how many sequences steps shrink, and with which choices most of them do."""
    parts = []
    for along in REFINED:
        counts = count_outcomes([descent for descent in descents if descent.along == along])
        run = counts.total() - counts["not run"]
        parts.append(
            f"{GETS_FINER[along]}, steps shrink in {counts['shrink']} of {run} sequences; in {counts['do not shrink']} "
            f"they do not, or hardly; in {counts['none']} there are hardly any; {counts['not run']} were not run."
        )
    return " ".join([*parts, _count_by_choice(descents), _describe_reach(descents)])


def _describe_reach(descents: Sequence[Descent]) -> str:
    """Say by how much each other choice changes the mass in lumps, at most; nothing where none was run."""
    reached = {choice: measure_reach(descents, choice, "lump_fraction") for choice in list_choices(descents)[1:]}
    parts = [f"'{_describe(choice)}' {reach:.3f}" for choice, reach in reached.items() if not math.isnan(reach)]
    return f"Most that these change lumps, at the same cells and time step: {', '.join(parts)}." if parts else ""


def _count_by_choice(descents: Sequence[Descent]) -> str:
    """Say how many sequences have steps that shrink with each choice, of those that were run with every choice."""
    compared = compare_choices(descents)
    of = next(iter(compared.values())).total()
    if not of:
        return "No sequence was run with every choice."
    counted = "; ".join(f"{_describe(choice)}: {counts['shrink']}" for choice, counts in compared.items())
    return f"Of the {of} that were run with every choice, steps shrink in so many ({counted})."


def _describe(choice: Choice) -> str:
    """Describe a choice, in words where there are some."""
    return describe_changes(dict(choice))


def _write_numbers(descents: Sequence[Descent], evidence: Evidence) -> None:
    """Write a row for each sequence, in numbers."""
    rows = [
        {
            "finer": SHORT[its.along],
            SHORT[REFINED[its.along]]: its.held,
            "choices": _describe(its.choice),
            "pressure": its.pressure,
            "measure": its.measure,
            **make_numbers(its.trend, SHORT[its.along]),
        }
        for its in descents
    ]
    make_cells(pd.DataFrame(rows)).to_csv(
        evidence.folder / "limits.csv", index=False, float_format="%.6g", lineterminator="\n"
    )


def _make_count_row(descents: Sequence[Descent], along: str, choice: Choice) -> dict[str, str]:
    """Make the row of a choice: in how many sequences of each measure steps shrink, as one setting gets finer."""
    row = {"": GETS_FINER[along], "choices": escape(_describe(choice))}
    for measure, words in MEASURES.items():
        own = [its for its in descents if (its.along, its.choice, its.measure) == (along, choice, measure)]
        counts = count_outcomes(own)
        row[words] = f"{counts['shrink']} of {counts.total() - counts['not run']}"
    return row


def _tabulate(descents: Sequence[Descent]) -> pd.DataFrame:
    """Tabulate what sequences along one setting say: a row a measure, pressure and held value, a column a choice."""
    rows: dict[tuple, dict[str, str]] = {}
    for its in sorted(descents, key=lambda its: (list(MEASURES).index(its.measure), its.pressure, -its.held)):
        head = {
            "measure": MEASURES[its.measure],
            "pressure": f"{its.pressure:g}",
            NAMES[REFINED[its.along]]: f"{its.held:g}",
        }
        rows.setdefault(its.question, head)[escape(_describe(its.choice))] = _format_descent(its)
    return pd.DataFrame(rows.values()).fillna("not run")


def _format_descent(descent: Descent) -> str:
    """Format the values of a sequence, its steps, and what they say."""
    trend, digits = descent.trend, ".4g" if descent.measure == OWN_SCALE else ".3f"
    values = ", ".join(format_values(trend, digits))
    if trend.outcome == "not run":
        return values
    return f"{values}; steps {format_steps(trend, digits)}; {trend.words}"


def _make_picture(evidence: Evidence) -> Picture:
    """Make the picture of all sequences over cells, which is drawn already."""
    return Picture(
        "limits.png",
        "Each measure over the width of a cell: a row for each measure, a column for each pressure, a line for each "
        "time step and set of choices.",
        "Over the width of a cell [paper's cells], finer to the right: a row for each measure, a column for each "
        f"pressure [{evidence.pressure_unit}]. A colour for each time step (CFL number), a line style for each set of "
        "choices. Where a measure has a limit, lines get level to the right, and colours meet. A point that is missing "
        "was not run; lines that coincide hide each other. Hardening has a logarithmic scale of its own in each.",
        data="limits.csv",
        narrow="limits-narrow.png",
    )


def draw_descents(descents: Sequence[Descent], evidence: Evidence, name: str, width: float) -> None:
    """Draw the sequences over cells, a panel for each measure and pressure, in a picture ``width`` inches wide."""
    own = [descent for descent in descents if descent.along == SPACING]
    pressures = sorted({descent.pressure for descent in own})
    steps = sorted({descent.held for descent in own}, reverse=True)
    choices = list_choices(own)
    font = choose_font(width)
    figure = Figure(figsize=(width, ROW * len(MEASURES) + 1.2), layout="constrained")
    axes = figure.subplots(len(MEASURES), len(pressures), sharex=True, squeeze=False)
    for row, measure in zip(axes, MEASURES, strict=True):
        if measure != OWN_SCALE:
            _share_scale(row)
        row[0].set_ylabel(MEASURES[measure], fontsize=font)
        for ax in row:
            ax.tick_params(labelsize=font)
    for its in own:
        marker, line = STYLES[choices.index(its.choice) % len(STYLES)]
        colour = COLOURS[steps.index(its.held) % len(COLOURS)]
        ax = axes[list(MEASURES).index(its.measure), pressures.index(its.pressure)]
        ax.plot(its.trend.levels, its.trend.values, marker + line, color=colour, ms=4, lw=1, mfc="none")
    for ax in axes[list(MEASURES).index(OWN_SCALE)]:
        _set_log_scale(ax)
    for column, pressure in enumerate(pressures):
        set_axis_of_spacing(axes[-1, column], "", own[0].trend.levels)
        axes[-1, column].set_xlabel("width of a cell", fontsize=font)
        axes[0, column].set_title(f"pressure {pressure:g}", fontsize=font)
    figure.legend(
        handles=_make_legend(steps, choices),
        loc="outside lower center",
        ncols=2 if width == WIDE else 1,
        frameon=False,
        fontsize=font,
    )
    figure.align_ylabels(axes[:, 0])
    save_figure(figure, evidence.folder / name)


def _set_log_scale(ax: Axes) -> None:
    """Set a logarithmic scale with numbers that are read at a glance, also where all values are close."""
    ax.set_yscale("log")
    low, high = ax.get_ylim()
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)) if high > 5 * low else MaxNLocator(4))
    ax.yaxis.set_major_formatter(ScalarFormatter())
    ax.yaxis.set_minor_formatter(NullFormatter())


def _share_scale(row: Sequence[Axes]) -> None:
    """Let the panels of a row share the scale of the first."""
    for ax in row[1:]:
        ax.sharey(row[0])
        ax.tick_params(labelleft=False)


def _make_legend(steps: Sequence[float], choices: Sequence[Choice]) -> list[Line2D]:
    """Make the entries of the legend: colours of time steps, then line styles of choices."""
    colours = [
        Line2D([], [], color=colour, lw=3, label=f"CFL number {step:g}")
        for step, colour in zip(steps, COLOURS, strict=False)
    ]
    styles = [
        Line2D([], [], color="black", marker=marker, ls=line, mfc="none", ms=4, lw=1, label=_describe(choice))
        for choice, (marker, line) in zip(choices, STYLES, strict=False)
    ]
    gap = [Line2D([], [], ls="none", label=" ")] * (len(styles) - len(colours))  # so that each has a column of its own
    return colours + gap + styles


FIGURE = FigureKind(report)
