"""What choices do to a figure: one changed at a time, beside the spread of random places."""

from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from .document import NOTHING, Findings, Picture, Table
from .drawing import save
from .evidence import Evidence
from .variants import Comparison, Variant, compared

COLOURS = ("#56B4E9", "#E69F00", "#D55E00")  # of the pressures, rising
UNSINTERED = "0.45"
# What a change moves.
FLIPPED = "claims are moved by"
MOVED = "only numbers, beyond the range of the seeds, by"
STILL = "nothing beyond that range by"
UNJUDGED = "not judged, as runs are missing:"


def report(evidence: Evidence) -> Findings:
    """Each variant's lumps and claims beside the base's, with the spread over seeds as the yardstick."""
    if evidence.table.empty:
        return NOTHING
    comparison = compared(evidence)
    frame = pd.DataFrame([_row(variant, comparison) for variant in comparison.variants])
    frame.to_csv(evidence.folder / "convergence.csv", index=False, float_format="%.6g", lineterminator="\n")
    draw(comparison, evidence)
    verdict = _verdict(comparison)
    picture = Picture(
        "convergence.png",
        "Mass in lumps at the three pressures, a line for each variant, beside the range over the seeds.",
        "Dots: mass in lumps with sintering, a colour for each pressure; crosses: the most of any pressure without "
        "sintering. Bands: the range over the seeds, that is over the particles' random places alone. The line at "
        "one half is where lumps become more than powder. First row: the run as everywhere else in these reports.",
        data="convergence.csv",
    )
    blocks = [
        picture,
        Table(frame, data="convergence.csv"),
        "Claims that the numbers agree with (one seed a variant decides none): C1 lumps grow with pressure, "
        "C2 powder at the lowest, C3 lumps at the highest, C4 powder "
        "without sintering, C5 the effect of sintering grows. Moves: pressures at which the variant lies outside the "
        "range of the seeds, by how much beyond it. The pressures were chosen on runs like the base, so "
        "a variant that moves C1 to C3 says how far the choice of pressures hangs on it. Unclosed: energy without a "
        "cause from the release on, part of what was turned over.",
    ]
    return Findings(blocks, verdict)


def _row(variant: Variant, comparison: Comparison) -> dict[str, Any]:
    """Lumps, claims and cost of one variant."""
    own = variant.table
    held = " ".join(variant.held) or "none"
    return {
        "variant": variant.name,
        **{f"{pressure:g}": lumps for pressure, lumps in variant.lumps.items()},
        "unsintered": variant.loose,
        "claims": f"{held}; not judged: {' '.join(variant.unjudged)}" if variant.unjudged else held,
        "without result": variant.unfinished,
        "particles": int(own["particles"].max()) if len(own) else 0,
        "substeps": int(own["substeps"].mean()) if len(own) else 0,
        "seconds": own["seconds"].mean(),
        "unclosed": own["energy_unclosed"].mean(),
        "moves": ", ".join(f"{by:+.2f} at {pressure:g}" for pressure, by in comparison.moves(variant).items()),
    }


def _verdict(comparison: Comparison) -> str:
    """Which changes move a claim, and which only the numbers, the farthest first."""
    seeds = [variant.held for variant in comparison.variants if variant.is_seed]
    kept = comparison.base.held
    parts = [f"Of {len(seeds)} seeds {sum(s == kept for s in seeds)} give the claims of the base ({' '.join(kept)})"]
    told = [_told(variant, comparison) for variant in sorted(comparison.changed, key=comparison.farthest, reverse=True)]
    for what in (FLIPPED, MOVED, STILL, UNJUDGED):
        names = [name for kind, name in told if kind == what]
        if names:
            parts.append(f"{what} {', '.join(names)}")
    return "; ".join(parts) + "."


def _told(variant: Variant, comparison: Comparison) -> tuple[str, str]:
    """What a change moves, and its name with what or how far."""
    flips = [f"-{c}" for c in comparison.lost(variant)] + [f"+{c}" for c in comparison.gained(variant)]
    if flips:
        return FLIPPED, f"{variant.name} ({', '.join(flips)})"
    if variant.unjudged:
        part = f" ({' '.join(variant.unjudged)})" if len(variant.unjudged) < len(variant.verdicts) else ""
        return UNJUDGED, variant.name + part
    moves = comparison.moves(variant)
    return (MOVED, f"{variant.name} ({max(moves, key=abs):+.2f})") if len(moves) else (STILL, variant.name)


def draw(comparison: Comparison, evidence: Evidence) -> None:
    """A line for each variant, a dot for each pressure, the seeds' range as bands."""
    variants = comparison.variants
    places = range(len(variants))
    figure = Figure(figsize=(8.5, 0.34 * len(variants) + 1.4), layout="constrained")
    ax = figure.subplots()
    for colour, (pressure, band) in zip(COLOURS, comparison.spread.iterrows(), strict=False):
        ax.axvspan(band["least"], band["most"], color=colour, alpha=0.18, lw=0)
        values = [variant.lumps[pressure] for variant in variants]
        ax.plot(values, places, "o", color=colour, label=f"pressure {pressure:g}, sintered", zorder=3)
    ax.plot([v.loose for v in variants], places, "x", color=UNSINTERED, label="not sintered, the most")
    ax.axvline(0.5, color="0.4", lw=0.8, ls=":")
    ax.set(xlim=(-0.03, 1.03), ylim=(len(variants) - 0.5, -0.5), xlabel="mass in lumps [1]")
    ax.set_yticks(places, [variant.name.replace(", ", "\n") for variant in variants], fontsize=8)
    ax.grid(axis="y", color="0.92", lw=0.6)
    figure.legend(loc="outside upper center", ncols=4, frameon=False, fontsize=8)
    save(figure, evidence.folder / "convergence.png")
