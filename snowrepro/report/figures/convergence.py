"""The effect of choices on a figure: one changed at a time, compared with the effect of random places."""

import math
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from ...evidence.claims import list_calibrated_claims
from ...evidence.gather import Evidence
from ...evidence.variants import Comparison, Variant, compare_variants
from ...quantities import add_unit
from ...settings.question import Claims
from ...text import make_cells
from ..document import NO_RESULT, Block, FigureContent, Fold, Picture, Table, escape, format_code, join_names
from ..drawing.common import save_figure
from ..sections.variants import describe_change, describe_claims, describe_missing
from .kinds import FigureKind

COLOURS = ("#56B4E9", "#E69F00", "#D55E00")  # of the pressures, rising
UNSINTERED = "0.45"
# Kinds of effects that a change has, as they stand in the verdict.
CLAIMS_MOVED = "claims are moved by"
NUMBERS_MOVED = "only numbers, beyond the range of the seeds, by"
NOTHING_MOVED = "nothing beyond that range by"
NOT_JUDGED = "not judged, as runs failed or are missing:"


def report(evidence: Evidence) -> FigureContent:
    """Compare lumps and claims of each variant with the base; the range over seeds is the yardstick."""
    if evidence.table.empty:
        return NO_RESULT
    comparison = compare_variants(evidence)
    frame = pd.DataFrame([_make_row(variant, comparison) for variant in comparison.variants])
    make_cells(frame).to_csv(evidence.folder / "convergence.csv", index=False, float_format="%.6g", lineterminator="\n")
    draw_variants(comparison, evidence)
    shown = pd.DataFrame([_make_shown_row(variant, comparison) for variant in comparison.variants])
    verdict = _summarise(comparison)
    picture = Picture(
        "convergence.png",
        "Mass in lumps at the three pressures, a line for each variant, beside the range over the seeds.",
        "Dots: mass in lumps with sintering, a colour for each pressure; crosses: the most of any pressure without "
        "sintering. Bands: the range over the seeds, that is over the particles' random places alone. The line is "
        "at one half, half of the mass is in lumps. First row: the run as everywhere else in these reports.",
        data="convergence.csv",
    )
    blocks: list[Block] = [
        picture,
        Table(shown, f"Mass in lumps, with sintering by pressure [{evidence.pressure_unit}], without at most."),
        Fold("The same with particles, substeps and time", [Table(frame, data="convergence.csv")]),
        _explain_columns(comparison, evidence.runs[0].config.question.claims),
    ]
    return FigureContent(blocks, verdict)


def _explain_columns(comparison: Comparison, claims: Claims) -> str:
    """Explain the columns of the table, with the claims as their file states them."""
    statements = " ".join(
        f"{escape(verdict.claim)}: {escape(verdict.statement)}" for verdict in comparison.base.verdicts
    )
    calibrated = join_names(list_calibrated_claims(claims), "or")
    return (
        "Mass in lumps with sintering, by pressure, and the most of any pressure without. Claims: those that the "
        f"numbers agree with (one seed a variant decides none). {statements} Beyond the seeds: pressures at "
        "which the variant lies outside the range of the seeds, by how much. The pressures were chosen on "
        f"runs like the base, so a variant that moves {calibrated} says how far the choice of pressures "
        "hangs on it. Unclosed: energy without a cause from the release on, part of what was "
        "turned over."
    )


def _make_shown_row(variant: Variant, comparison: Comparison) -> dict[str, Any]:
    """Make the row of a variant that a page shows: in words, and with what became of runs without a result."""
    missing = describe_missing(variant)
    moves = ", ".join(f"{move:+.2f} at {pressure:g}" for pressure, move in comparison.find_moves(variant).items())
    return {
        "what was changed": escape(describe_change(variant.changes)),
        **{
            f"at {pressure:g}": missing if math.isnan(lumps) else f"{lumps:.2f}"
            for pressure, lumps in variant.lumps.items()
        },
        "without sintering": missing if math.isnan(variant.unsintered_lumps) else f"{variant.unsintered_lumps:.2f}",
        "claims": describe_claims(variant, comparison),
        "beyond the seeds": moves or "-",
        "setting": format_code(variant.name) if variant.changes else "-",
    }


def _make_row(variant: Variant, comparison: Comparison) -> dict[str, Any]:
    """Make the row of a variant: lumps, claims and cost."""
    table = variant.table
    claims = " ".join(variant.agreed_claims) or "none"
    return {
        "variant": variant.name,
        **{f"{pressure:g}": lumps for pressure, lumps in variant.lumps.items()},
        "unsintered": variant.unsintered_lumps,
        "claims": f"{claims}; not judged: {' '.join(variant.unjudged_claims)}" if variant.unjudged_claims else claims,
        "without result": variant.unfinished,
        "particles": int(table["particles"].max()) if len(table) else 0,
        "substeps": int(table["substeps"].mean()) if len(table) else 0,
        "seconds": table["seconds"].mean(),
        "unclosed": table["energy_unclosed"].mean(),
        "moves": ", ".join(
            f"{distance:+.2f} at {pressure:g}" for pressure, distance in comparison.find_moves(variant).items()
        ),
    }


def _summarise(comparison: Comparison) -> str:
    """Say which changes move a claim, and which only numbers; those that move most come first."""
    claims_of_seeds = [variant.agreed_claims for variant in comparison.variants if variant.is_seed]
    base_claims = comparison.base.agreed_claims
    if comparison.base.table.empty:
        return "The base, Figure 5 itself, has no result: nothing says what the changes do."
    same, held = claims_of_seeds.count(base_claims), " ".join(base_claims) or "none"
    parts = [f"Of {len(claims_of_seeds)} seeds {same} give the claims of the base ({held})"]
    if len(claims_of_seeds) == 1:
        parts = [f"The base agrees with these claims: {held}; it has one seed, so what chance does is not known"]
    changes = [
        _describe_change(variant, comparison)
        for variant in sorted(comparison.changed_variants, key=comparison.measure_farthest_move, reverse=True)
    ]
    for effect in (CLAIMS_MOVED, NUMBERS_MOVED, NOTHING_MOVED, NOT_JUDGED):
        names = [name for its_effect, name in changes if its_effect == effect]
        if names:
            parts.append(f"{effect} {', '.join(names)}")
    return "; ".join(parts) + "."


def _describe_change(variant: Variant, comparison: Comparison) -> tuple[str, str]:
    """Describe the effect of a change: its kind, and the variant's name with what moves or how far."""
    name = describe_change(variant.changes)
    flips = [f"-{claim}" for claim in comparison.list_lost_claims(variant)]
    flips += [f"+{claim}" for claim in comparison.list_gained_claims(variant)]
    if flips:
        return CLAIMS_MOVED, f"{name} ({', '.join(flips)})"
    if variant.unjudged_claims:
        which = (
            f" ({' '.join(variant.unjudged_claims)})" if len(variant.unjudged_claims) < len(variant.verdicts) else ""
        )
        return NOT_JUDGED, name + which
    moves = comparison.find_moves(variant)
    return (NUMBERS_MOVED, f"{name} ({max(moves, key=abs):+.2f})") if len(moves) else (NOTHING_MOVED, name)


def draw_variants(comparison: Comparison, evidence: Evidence) -> None:
    """Draw a line for each variant, a dot for each pressure, and the range over seeds as bands."""
    variants = comparison.variants
    rows = range(len(variants))
    figure = Figure(figsize=(5.2, 0.44 * len(variants) + 1.6), layout="constrained")
    ax = figure.subplots()
    for colour, (pressure, band) in zip(COLOURS, comparison.spread.iterrows(), strict=False):
        ax.axvspan(band["least"], band["most"], color=colour, alpha=0.18, lw=0)
        values = [variant.lumps[pressure] for variant in variants]
        ax.plot(values, rows, "o", color=colour, label=f"{pressure:g}, sintered", zorder=3)
    ax.plot(
        [variant.unsintered_lumps for variant in variants], rows, "x", color=UNSINTERED, label="not sintered, the most"
    )
    ax.axvline(0.5, color="0.4", lw=0.8, ls=":")
    ax.set(xlim=(-0.03, 1.03), ylim=(len(variants) - 0.7, -0.7), xlabel="mass in lumps")
    ax.set_yticks([])
    for row, variant in zip(rows, variants, strict=True):
        ax.text(
            0.0, row - 0.2, describe_change(variant.changes), va="bottom", fontsize=9
        )  # so narrow that a phone shows all
        ax.axhline(row + 0.3, color="0.92", lw=0.6)
        if missing := _describe_gaps(variant):
            ax.text(1.02, row - 0.2, missing, va="bottom", ha="right", fontsize=9, color="0.4")  # beside no dot
    title = add_unit("pressure", evidence.pressure_unit)
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=9, title=title, title_fontsize=9)
    save_figure(figure, evidence.folder / "convergence.png")


def _describe_gaps(variant: Variant) -> str:
    """Say at which pressures a variant has no result, and why; empty if it has all."""
    gaps = [f"{pressure:g}" for pressure, lumps in variant.lumps.items() if math.isnan(lumps)]
    if not gaps:
        return ""
    where = "" if len(gaps) == len(variant.lumps) else f"{', '.join(gaps)}: "
    return where + describe_missing(variant)


FIGURE = FigureKind(report)
