"""The grid of all scenes: which claims the numbers agree with where, lumps over pressure, and how the snow ends."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.figure import Figure

from ..analysis.claims import Scene, Verdict, judge_scenes
from ..analysis.classify import classify
from ..config import Claims, Config
from .drawing import crop, draw_snow, draw_stage, fragment_colours, save
from .evidence import Evidence, Findings, judged_scenes, markdown, opened
from .response import disagreed, draw_response

PANEL = 1.75  # width of a panel [inches]


def report(evidence: Evidence) -> Findings:
    """Counts of the claims over scenes, curves, contact sheets, and a row a scene."""
    scenes, claims = judged_scenes(evidence), evidence.configs[0].claims
    over = judge_scenes(claims, scenes)
    shapes = list(dict.fromkeys(scene.shape for scene in scenes))
    floors = list(dict.fromkeys(scene.floor for scene in scenes))
    draw_response(scenes, {}, evidence.folder / "curves.png")
    sheets = _draw_sheets(shapes, floors, evidence)
    verdict = _sentence(over)
    calibrated = evidence.experiment.calibrated_on
    chosen_on = f"The pressures were chosen on {' on '.join(calibrated)}, which is not counted. " if calibrated else ""
    lines = [
        f"**Verdict.** {verdict}",
        "",
        *(line for v in over for line in _counts(claims, v)),
        f"{chosen_on}Numbers agree or not by their means over the seeds; p is that of an exact binomial "
        "test for agreement in more scenes than not. What a scene says alone needs several seeds: "
        f"`snowrepro claims experiment={evidence.experiment.name} seeds=3`. Lumps are mass fractions.",
        "",
        "![Mass in lumps over pressure, a panel a scene](curves.png)",
        "",
        "Mass in lumps over pressure: with sintering (orange) and without (grey). "
        "In the corner: claims that the numbers disagree with.",
        "",
        *sheets,
        "## Scenes",
        "",
        *markdown(_by_scene(scenes)),
        "",
        *_cost(evidence),
    ]
    return Findings(lines, verdict)


def _sentence(over: Sequence[Verdict]) -> str:
    """What the numbers agree with, and the claims over scenes."""
    parts = [f"Scenes beside the calibrated one whose numbers agree: {v.measured}; {v.claim}: {v.word}." for v in over]
    return " ".join(parts) or "No claim is made over scenes."


def _counts(claims: Claims, verdict: Verdict) -> list[str]:
    """What a claim over scenes rests on: a row for each claim that it counts."""
    statements = {claim.name: claim.statement for claim in claims.list}
    rows = [
        [c.claim, statements[c.claim], f"{c.holds} of {c.scenes}", f"{c.p:.2g}", ", ".join(c.against) or "none"]
        for c in verdict.counts
    ]
    heads = ["claim", "statement", "numbers agree in", "p (Holm)", "they disagree on"]
    verdict_line = f"**{verdict.claim}: {verdict.word}.** {verdict.statement}"
    return [f"{verdict_line} {verdict.note}".rstrip(), "", *markdown(pd.DataFrame(rows, columns=heads)), ""]


def _by_scene(scenes: Sequence[Scene]) -> pd.DataFrame:
    """Lump fractions of each scene by arm and pressure, and the claims that fail."""
    rows = []
    for scene in scenes:
        row = {"shape": scene.shape, "floor": scene.floor}
        for name, label in (("paper", "sintered"), ("none", "unsintered")):
            arm = scene.table[scene.table["sintering"] == name] if len(scene.table) else scene.table
            for pressure, part in arm.groupby("pressure") if len(arm) else ():
                row[f"{label}, {pressure:g}"] = f"{part['lump_fraction'].mean():.2f}"
        row["unsettled"] = int((~scene.table["settled"]).sum()) if len(scene.table) else 0
        row["disagrees with"] = disagreed(scene) or "-"
        rows.append(row)
    return pd.DataFrame(rows).fillna("missing")


def _cost(evidence: Evidence) -> list[str]:
    if not len(evidence.table):
        return []
    seconds = evidence.table["seconds"]
    return [
        f"{len(seconds)} runs took {seconds.sum() / 3600:.2f} core-hours in all, the longest {seconds.max():.0f} s.",
        "",
    ]


def _draw_sheets(shapes: list[str], floors: list[str], evidence: Evidence) -> list[str]:
    """A contact sheet of final states for the lowest and highest pressure of each arm."""
    pressures = sorted({c.pressure for c in evidence.configs})
    lines = []
    for enabled, arm in ((True, "sintered"), (False, "unsintered")):
        for pressure in dict.fromkeys((pressures[0], pressures[-1])):
            chosen = [c for c in evidence.configs if c.sintering.enabled == enabled and c.pressure == pressure]
            if not chosen:
                continue
            name = f"{arm}-{pressure:g}.png"
            _draw_sheet(chosen, shapes, floors, evidence, name)
            lines += [
                f"![Last frame of every {arm} scene at pressure {pressure:g}]({name})",
                "",
                f"Last frame, {arm}, pressure {pressure:g}: lumps in colours, powder in grey.",
                "",
            ]
    return lines


def _draw_sheet(configs: Sequence[Config], shapes: list[str], floors: list[str], evidence: Evidence, name: str) -> None:
    """Last frames by fragment, a row a shape, a column a floor; the highest scene of a row sets its height."""
    heights = [max(crop(c)[1] / crop(c)[0] for c in configs if c.shape.name == shape) for shape in shapes]
    size = (PANEL * len(floors) + 0.4, PANEL * sum(heights) + 0.4)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(shapes), len(floors), squeeze=False, gridspec_kw={"height_ratios": heights})
    for config in configs:
        ax = grid[shapes.index(config.shape.name), floors.index(config.floor.name)]
        draw_stage(ax, config)
        ax.set_ylim(0, heights[shapes.index(config.shape.name)] * crop(config)[0])
        if not evidence.is_done(config):
            ax.text(0.5, 0.5, "missing", transform=ax.transAxes, ha="center", color="white")
            continue
        with opened(config) as dataset:
            colours = fragment_colours(classify(dataset, config.analysis).fragments)[0]
            places = dataset["position"][-1].values
        draw_snow(ax, config, places, PANEL * 72 / crop(config)[0], colours)
    for floor, ax in zip(floors, grid[0], strict=True):
        ax.set_title(floor, fontsize=9)
    for shape, ax in zip(shapes, grid[:, 0], strict=True):
        ax.set_ylabel(shape, fontsize=9)
    save(figure, evidence.folder / name)
