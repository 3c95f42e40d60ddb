"""Figures 5 and 6: rows of runs over columns of frames, and the verdict on the claims."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ..analysis import claims
from ..analysis.fragments import Fragments, bond_histories, classify_frames, fragments_of
from ..config import Config
from .drawing import SNOW, column_title, crop, draw_snow, draw_stage, fragment_colours, save
from .evidence import Evidence, Findings, in_paper_order, judged_scenes, markdown, opened

SCAN_STRAINS = (0.2, 0.25, 0.3, 0.4, 0.5)
SCAN_CORES = (0.25, 0.3333, 0.5)
PANEL = 2.3  # width of a panel [inches]


@dataclass(frozen=True)
class Row:
    """One row of a strip: its label, and by frame its particles' places (n, 2) and fragments."""

    label: str
    places: dict[int, np.ndarray]  # empty if the run is missing
    fragments: dict[int, Fragments]


def report(evidence: Evidence) -> Findings:
    """The paper's figure, the same by fragment, the claims, and whether they hang on the definition of a lump."""
    experiment, first = evidence.experiment, evidence.configs[0]
    rows = [_row(config, evidence) for config in in_paper_order(evidence.configs)]
    draw_strip(rows, experiment.frames, first, evidence.folder / "strip.png", by_fragment=False)
    draw_strip(rows, experiment.frames, first, evidence.folder / "fragments.png", by_fragment=True)
    scenes = judged_scenes(evidence)
    verdict = " ".join(claims.sentence(scene.table, scene.verdicts) for scene in scenes)
    lines = [
        f"**Verdict.** {verdict}",
        "",
        '"More lumps than powder" is read as: more than half of the mass is in lumps. '
        "Means over seeds; the numbers are the mass fraction in lumps. conf/claims/paper.yaml says by which rule each "
        f"claim is decided. One seed decides nothing: `snowrepro claims experiment={experiment.name} seeds=3` does.",
        "",
        *(line for scene in scenes for line in _verdict_table(scene)),
        f"![Snow at {len(experiment.frames)} times, a row for each pressure, first with and then without sintering]"
        "(strip.png)",
        "",
        "The runs in the paper's order and colours: pressure rises downwards, first with sintering, then without.",
        "",
        "![The same, coloured by fragment: lumps in colours, powder in grey](fragments.png)",
        "",
        "The same by fragment, from release on: each lump has a colour and keeps it, powder is grey.",
        "",
        "## Does the verdict hang on what counts as broken?",
        "",
        "Mass fraction in lumps by run (pressure, sintering, seed) for other break strains and core fractions; the "
        f"verdict uses {first.analysis.break_strain:g} / {first.analysis.core_fraction:.2g} and both signs. "
        "Stretch only, crush only: with bonds that break by one sign alone.",
        "",
        *_scan(evidence),
    ]
    return Findings(lines, verdict)


def _verdict_table(scene: claims.Scene) -> list[str]:
    """A row a claim: what was measured, how it was decided, and what is against it."""
    heads = ["claim", "statement", "measured", "seeds", "verdict", "against it", "note"]
    rows = [
        [v.claim, v.statement, v.measured, v.seeds, v.shown, "; ".join(v.disagrees) or "-", v.note or "-"]
        for v in scene.verdicts
    ]
    return [f"Snow and floor: {scene.name}.", "", *markdown(pd.DataFrame(rows, columns=heads)), ""]


def draw_strip(rows: Sequence[Row], frames: Sequence[int], config: Config, path: Path, by_fragment: bool) -> None:
    """Draw rows of runs over columns of frames; coloured as the paper's figure, or by fragment."""
    width, height = crop(config)
    figure = Figure(figsize=(PANEL * len(frames) + 1.35, PANEL * height / width * len(rows) + 0.45))
    figure.set_facecolor("white")
    grid = figure.subplots(len(rows), len(frames), squeeze=False)
    figure.subplots_adjust(
        left=1.3 / figure.get_figwidth(),
        right=0.998,
        bottom=0.004,
        top=1 - 0.42 / figure.get_figheight(),
        wspace=0.02,
        hspace=0.03,
    )
    for row, axes in zip(rows, grid, strict=True):
        colours = None
        for frame, ax in zip(frames, axes, strict=True):
            draw_stage(ax, config)
            if not row.places:
                ax.text(0.5, 0.5, "missing", transform=ax.transAxes, ha="center", color="white")
                continue
            colour = SNOW
            if by_fragment and frame in row.fragments:
                colour = colours = fragment_colours(row.fragments[frame], colours)
            draw_snow(ax, config, row.places[frame], PANEL * 72 / width, colour)
        axes[0].set_ylabel(row.label, rotation=0, ha="right", va="center", fontsize=9, labelpad=8)
    for frame, ax in zip(frames, grid[0], strict=True):
        ax.set_title(column_title(frame, config), fontsize=9)
    save(figure, path)


def _row(config: Config, evidence: Evidence) -> Row:
    arm = "sintering" if config.sintering.enabled else "no sintering"
    label = f"pressure {config.pressure:g}\n{arm}"
    if not evidence.is_done(config):
        return Row(label, {}, {})
    frames = evidence.experiment.frames
    later = [frame for frame in frames if frame >= config.loading.press_frames]
    with opened(config) as dataset:
        fragments = classify_frames(dataset, later, config.analysis) if later else []
        places = {frame: dataset["position"].sel(snapshot=frame).values for frame in frames}
    return Row(label, places, {f.frame: f for f in fragments})


def _scan(evidence: Evidence) -> list[str]:
    """Lump fraction of every run for other definitions of a broken bond, and the claims that then hold."""
    settings = {f"{s:g} / {c:.2g}": {"break_strain": s, "core_fraction": c} for s in SCAN_STRAINS for c in SCAN_CORES}
    settings |= {f"{sign} only": {"break_by": sign} for sign in ("stretch", "crush")}
    ordered = in_paper_order(evidence.configs)
    by_run = [_lumps(config, evidence, settings.values()) for config in ordered]
    judged = ordered[0].claims
    of_lumps = judged.model_copy(update={"list": tuple(c for c in judged.list if c.measure == "lump_fraction")})
    rows, held_by = [], Counter()
    for name, fractions in zip(settings, zip(*by_run, strict=True), strict=True):
        known = [
            {"sintering": c.sintering.name, "pressure": c.pressure, "seed": c.seed, "lump_fraction": fraction}
            for c, fraction in zip(ordered, fractions, strict=True)
            if fraction is not None
        ]
        verdicts = claims.judge(of_lumps, pd.DataFrame(known), False, evidence.lost(ordered))
        held = [v.claim for v in verdicts if v.agrees]
        held_by.update(held)
        shown = ["missing" if fraction is None else f"{fraction:.2f}" for fraction in fractions]
        rows.append([name, *shown, " ".join(held) or "none"])
    names = [f"{c.pressure:g}, {c.sintering.name}, seed {c.seed}" for c in ordered]
    heads = ["break strain / core fraction", *names, "claims that the numbers agree with"]
    counts = ", ".join(f"{claim} in {count}" for claim, count in sorted(held_by.items())) or "no claim in any"
    return [*markdown(pd.DataFrame(rows, columns=heads)), "", f"Of these {len(settings)} definitions: {counts}."]


def _lumps(config: Config, evidence: Evidence, changes: Iterable[dict[str, Any]]) -> list[float | None]:
    """Lump fraction of a run under each change of the analysis's settings; None if the run is missing."""
    settings = [config.analysis.model_copy(update=change) for change in changes]
    if not evidence.is_done(config):
        return [None for _ in settings]
    with opened(config) as dataset:
        end = int(dataset["snapshot"][-1])
        bonds, histories = bond_histories(dataset, [end], config.analysis.link_length)
        return [fragments_of(dataset, end, bonds, histories[end], analysis).lump_fraction for analysis in settings]
