"""What choices do to a figure: one changed at a time, beside the spread of random places."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ..analysis import claims
from ..config import Config
from ..store import runs
from .drawing import save
from .evidence import Evidence, Findings, markdown

COLOURS = ("#56B4E9", "#E69F00", "#D55E00")  # of the pressures, rising
UNSINTERED = "0.45"
UNJUDGED = "runs are missing"
VARIED = ("reading", "loading", "solver", "fidelity")  # sections of a run's configuration


def report(evidence: Evidence) -> Findings:
    """Each variant's lumps and claims beside the base's, with the spread over seeds as the yardstick."""
    base = evidence.configs[0]
    variants: dict[str, list[Config]] = {}
    for config in evidence.configs:
        variants.setdefault(label(config, base), []).append(config)
    table = evidence.table.set_index("run_id")
    rows = [_row(name, configs, table, evidence) for name, configs in variants.items()]
    spread = _spread(rows)
    for row in rows:
        row["beyond"] = pd.Series(dtype=float) if _is_seed(row) else _beyond(row["lumps"], spread)
        row["moves"] = ", ".join(f"{by:+.2f} at {pressure:g}" for pressure, by in row["beyond"].items())
    frame = pd.DataFrame(rows).drop(columns=["lumps", "beyond"])
    frame.to_csv(evidence.folder / "convergence.csv", index=False, float_format="%.6g", lineterminator="\n")
    draw(rows, spread, evidence)
    verdict = _verdict(rows)
    lines = [
        f"**{verdict}**",
        "",
        "![Mass in lumps of each variant at the three pressures](convergence.png)",
        "",
        "Dots: mass in lumps with sintering, a colour for each pressure; crosses: the most of any pressure without "
        "sintering. Bands: the range over the seeds, that is over the particles' random places alone. The line at "
        "one half is where lumps become more than powder. First row: the run as everywhere else in these reports.",
        "",
        *markdown(frame),
        "",
        "Claims that the numbers agree with (one seed a variant decides none): C1 lumps grow with pressure, "
        "C2 powder at the lowest, C3 lumps at the highest, C4 powder "
        "without sintering, C5 the effect of sintering grows. Moves: pressures at which the variant lies outside the "
        "range of the seeds, by how much beyond it. The pressures were chosen on the base's scene and fidelity, so "
        "a variant that moves C1 to C3 says how far the choice of pressures hangs on it. Unclosed: energy without a "
        "cause from the release on, part of what was turned over.",
    ]
    return Findings(lines, verdict)


def label(config: Config, base: Config) -> str:
    """What a run changes of the base, beside its pressure and sintering: 'solver.cfl=0.2', or 'base'."""
    changed = [
        f"{key}={value}"
        for (key, value), (_, usual) in zip(_settings(config), _settings(base), strict=True)
        if value != usual
    ]
    return ", ".join(changed) or "base"


def _settings(config: Config) -> list[tuple[str, Any]]:
    """What variants choose: everything that decides a run, but for its scene and what is compared in it."""
    values = [(f"{name}.{key}", value) for name in VARIED for key, value in getattr(config, name) if key != "name"]
    return [*values, ("seed", config.seed)]


def _row(name: str, configs: Sequence[Config], table: pd.DataFrame, evidence: Evidence) -> dict[str, Any]:
    """Lumps, claims and cost of one variant."""
    done = [runs.identify(c) for c in configs if evidence.is_done(c)]
    own = table.loc[done] if done else table.iloc[:0]
    sintered = own[own["sintering"] == "paper"].set_index("pressure")["lump_fraction"].sort_index()
    loose = own[own["sintering"] == "none"]["lump_fraction"]
    held = " ".join(v.claim for v in claims.judge(configs[0].claims, own) if v.agrees)
    pressures = sorted({config.pressure for config in configs})
    return {
        "variant": name,
        **{f"{p:g}": float(sintered.get(p, np.nan)) for p in pressures},
        "unsintered": float(loose.max()) if len(loose) else float("nan"),
        "claims": UNJUDGED if evidence.lost(configs) else held or "none",
        "particles": int(own["particles"].max()) if len(own) else 0,
        "substeps": int(own["substeps"].mean()) if len(own) else 0,
        "seconds": float(own["seconds"].mean()),
        "unclosed": float(own["energy_unclosed"].mean()),
        "lumps": sintered,
    }


def _is_seed(row: dict[str, Any]) -> bool:
    """Whether a variant differs by its random places alone."""
    return row["variant"] == "base" or (row["variant"].startswith("seed=") and "," not in row["variant"])


def _spread(rows: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """Least and most lumps over the seeds, by pressure."""
    seeds = pd.concat([row["lumps"] for row in rows if _is_seed(row)], axis=1)
    return pd.DataFrame({"least": seeds.min(axis=1), "most": seeds.max(axis=1)})


def _beyond(lumps: pd.Series, spread: pd.DataFrame) -> pd.Series:
    """How far a variant's lumps lie beyond those of all seeds, by pressure, where they do."""
    above = (lumps - spread["most"]).clip(lower=0.0)
    below = (lumps - spread["least"]).clip(upper=0.0)
    beyond = (above + below).dropna()
    return beyond[beyond.abs() >= 0.005]


def _verdict(rows: Sequence[dict[str, Any]]) -> str:
    """Which changes move a claim, and which only the numbers."""
    base, changed = rows[0], [row for row in rows if not _is_seed(row) and row["claims"] != UNJUDGED]
    kept = base["claims"]
    seeds = [row["claims"] for row in rows if _is_seed(row)]
    flips = [f"{row['variant']} ({_difference(kept, row['claims'])})" for row in changed if row["claims"] != kept]
    moved = [row for row in changed if len(row["beyond"]) and row["claims"] == kept]
    moved.sort(key=lambda row: -row["beyond"].abs().max())
    numbers = [f"{row['variant']} ({max(row['beyond'], key=abs):+.2f})" for row in moved]
    still = [row["variant"] for row in changed if not len(row["beyond"]) and row["claims"] == kept]
    parts = [f"Of {len(seeds)} seeds {sum(s == kept for s in seeds)} give the claims of the base ({kept})"]
    for what, names in (
        ("claims are moved by", flips),
        ("only numbers, beyond the range of the seeds, by", numbers),
        ("nothing beyond that range by", still),
        ("not judged, as runs are missing:", [row["variant"] for row in rows if row["claims"] == UNJUDGED]),
    ):
        if names:
            parts.append(f"{what} {', '.join(names)}")
    return "; ".join(parts) + "."


def _difference(kept: str, now: str) -> str:
    """Claims lost and gained."""
    lost, gained = sorted(set(kept.split()) - set(now.split())), sorted(set(now.split()) - set(kept.split()) - {"none"})
    return ", ".join([*(f"-{c}" for c in lost), *(f"+{c}" for c in gained)])


def draw(rows: Sequence[dict[str, Any]], spread: pd.DataFrame, evidence: Evidence) -> None:
    """A line for each variant, a dot for each pressure, the seeds' range as bands."""
    figure = Figure(figsize=(8.5, 0.34 * len(rows) + 1.4), layout="constrained")
    ax = figure.subplots()
    for colour, (pressure, band) in zip(COLOURS, spread.iterrows(), strict=False):
        ax.axvspan(band["least"], band["most"], color=colour, alpha=0.18, lw=0)
        values = [row["lumps"].get(pressure, np.nan) for row in rows]
        ax.plot(values, range(len(rows)), "o", color=colour, label=f"pressure {pressure:g}, sintered", zorder=3)
    loose = [row["unsintered"] for row in rows]
    ax.plot(loose, range(len(rows)), "x", color=UNSINTERED, label="not sintered, the most")
    ax.axvline(0.5, color="0.4", lw=0.8, ls=":")
    ax.set(xlim=(-0.03, 1.03), ylim=(len(rows) - 0.5, -0.5), xlabel="mass in lumps [1]")
    ax.set_yticks(range(len(rows)), [row["variant"] for row in rows])
    ax.grid(axis="y", color="0.92", lw=0.6)
    figure.legend(loc="outside upper center", ncols=4, frameon=False, fontsize=8)
    save(figure, evidence.folder / "convergence.png")
