"""Two sweeps side by side: what differs, then verdicts, numbers and pictures."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from ...evidence.claims import INCONCLUSIVE, JudgedScene, Verdict
from ...evidence.collect import collect_sweep
from ...evidence.differences import SweepDifferences, compare_sweeps
from ...evidence.gather import Evidence
from ...store.files import require_no_links, require_writable
from ...sweep.plan import Plan
from ...sweep.record import name_without_seeds, shorten_name
from ...text import make_cells
from ..document import (
    Block,
    Document,
    FigureContent,
    Fold,
    Heading,
    Pair,
    Picture,
    Section,
    Table,
    escape,
    escape_cell,
    format_code,
    format_list,
    relocate_picture,
    walk_blocks,
)
from ..drawing.common import SINTERED, UNSINTERED, own_style, save_figure
from ..figures.kinds import find_figure
from .about import make_run_sections
from .page import ExperimentReport, draw_experiment, write_document

SIDES = ("A", "B")
MOST_DRAWN = 40  # cells in the picture of differences
MOST_LISTED = 30  # changed settings
COLOURS = {"A": UNSINTERED, "B": SINTERED}


@own_style()
def write_comparison(first: Plan, second: Plan) -> Path:
    """Write the comparison of two sweeps from their stores alone; returns the page.

    Raises ConfigError where their cells cannot be matched, and StoreError where the report cannot be written.
    """
    names = [name_without_seeds(plan.overrides) for plan in (first, second)]
    folder = Path(first.runs[0].config.question.reports) / shorten_name("-against-".join(names))
    require_no_links(folder)
    require_writable(folder)
    differences = compare_sweeps(collect_sweep(first), collect_sweep(second))
    sides = zip((first, second), SIDES, strict=True)
    reports = [draw_experiment(plan, folder / side.lower()) for plan, side in sides]
    evidences = [report.evidence for report in reports]
    verdicts = _pair_verdicts(*evidences)
    sections = [
        Section("summary", "Summary", _summarise(reports, names, differences)),
        *([Section("verdicts", "Verdicts", [Table(_tabulate_verdicts(verdicts))])] if verdicts else []),
        Section("numbers", "Numbers", _compare_numbers(differences, folder)),
        Section("pictures", "Pictures", _pair_pictures(*(report.content for report in reports))),
        *make_run_sections(evidences, folder),
    ]
    return write_document(Document(f"{names[0]} beside {names[1]}", sections), folder)


def _summarise(reports: Sequence[ExperimentReport], names: Sequence[str], differences: SweepDifferences) -> list[Block]:
    """Say what the two sweeps are, which verdicts change and which settings differ."""
    lines = [f"**{side}** is {format_code(name)}: {escape(report.content.verdict)} Redo: {format_code(report.command)}"
            for side, name, report in zip(SIDES, names, reports, strict=True)]  # fmt: skip
    verdicts = _pair_verdicts(*(report.evidence for report in reports))
    blocks = [format_list(lines), *_describe_changes(verdicts), Heading("What was asked for otherwise")]
    settings = [f"{format_code(line)}" for line in differences.config]
    if len(settings) > MOST_LISTED:
        return [*blocks, Fold(f"{len(settings)} settings (A -> B)", [format_list(settings)])]
    return [*blocks, f"Settings, A -> B:\n\n{format_list(settings)}" if settings else "No setting of the runs differs."]


def _describe_changes(verdicts: Sequence[tuple[str, Verdict, Verdict]]) -> list[Block]:
    """Describe the verdicts that are others in B; nothing where none was judged.

    One with the same numbers as another one on both sides is not described twice.
    """
    if not verdicts:
        return []
    verdicts = [(where, a, b) for where, a, b in verdicts if not (a.same_as and a.same_as == b.same_as)]
    changed = [_describe_change(where, a, b) for where, a, b in verdicts if a.word != b.word or a.agrees != b.agrees]
    same = f"Nothing: {len(verdicts)} verdicts are the same word in both."
    return [Heading("What changes in the verdicts"), format_list(changed) if changed else same]


def _pair_verdicts(a: Evidence, b: Evidence) -> list[tuple[str, Verdict, Verdict]]:
    """Pair the verdicts that both sides have, as (scene, A, B); changed ones come first."""
    if not all(find_figure(side.experiment).is_judged for side in (a, b)):
        return []
    pairs = [("all scenes", v, w) for v in a.over_scenes for w in b.over_scenes if v.claim == w.claim]
    pairs += [pair for scene in a.scenes for pair in _pair_scene_verdicts(scene, b.scenes)]
    return sorted(pairs, key=lambda pair: (pair[1].word == pair[2].word, pair[1].agrees == pair[2].agrees))


def _pair_scene_verdicts(scene: JudgedScene, others: Sequence[JudgedScene]) -> list[tuple[str, Verdict, Verdict]]:
    """Pair the verdicts on one scene of A with those on the same scene of B."""
    other = next((other for other in others if other.name == scene.name), None)
    if other is None:
        return []
    return [(scene.name, v, w) for v in scene.verdicts for w in other.verdicts if v.claim == w.claim]


def _describe_change(where: str, a: Verdict, b: Verdict) -> str:
    """Describe a verdict that is another one in B."""
    sides = [f"{side} **{v.word}** ({_format_effect(v)})" for side, v in zip(SIDES, (a, b), strict=True)]
    return f"**{escape(a.claim)}**, {escape(where)}: {'; '.join(sides)}."


def _format_effect(verdict: Verdict) -> str:
    """Format the number that a verdict rests on; an inconclusive one also says which way it points."""
    direction = f"; the numbers {verdict.direction}" if verdict.word == INCONCLUSIVE else ""
    return escape((verdict.effect_text or verdict.measured) + direction)


def _tabulate_verdicts(verdicts: Sequence[tuple[str, Verdict, Verdict]]) -> pd.DataFrame:
    """Tabulate words and numbers of each verdict in A and B."""
    rows = [
        {
            "claim": escape(a.claim),
            "scene": escape(where),
            **{side: f"**{escape(v.label)}**" for side, v in zip(SIDES, (a, b), strict=True)},
            **{f"{side}, effect": _format_effect(v) for side, v in zip(SIDES, (a, b), strict=True)},
        }
        for where, a, b in verdicts
    ]
    return pd.DataFrame(rows, columns=["claim", "scene", *SIDES, *(f"{side}, effect" for side in SIDES)])


def _compare_numbers(differences: SweepDifferences, folder: Path) -> list[Block]:
    """Compare the main measure of each cell in A and B, the largest differences first; writes differences.csv."""
    cells = differences.cells.reindex(
        differences.cells["difference"].abs().sort_values(ascending=False, kind="stable").index
    )
    make_cells(cells).to_csv(folder / "differences.csv", index=False, float_format="%.6g", lineterminator="\n")
    dims = [str(name) for name in cells.columns[: cells.columns.get_loc("measure")]]
    table = Table(cells.map(escape_cell), data="differences.csv")
    blocks: list[Block] = []
    if len(cells):
        draw_differences(cells, dims, folder / "differences.png")
        most = f"the {MOST_DRAWN} largest" if len(cells) > MOST_DRAWN else "all"
        picture = Picture(
            "differences.png",
            "The main measure of each cell in A and in B, a line from one to the other, the largest difference on top.",
            f"Mass in lumps (in hardness tests: hardness) of each cell: A grey, B orange; {most} of {len(cells)} cells "
            "by size of the difference.",
            data="differences.csv",
        )
        blocks = [picture, Fold("Every cell", [table]) if len(cells) > MOST_DRAWN else table]
    for text, cells_left_out in (
        ("Cells without a result on one side, or with other kinds of result", differences.lacking),
        ("Cells of A alone", differences.only_a),
        ("Cells of B alone", differences.only_b),
    ):
        if len(cells_left_out):
            blocks += [
                f"**{text}: {len(cells_left_out)}.** They are compared with nothing.",
                Table(cells_left_out.map(escape_cell)),
            ]
    return blocks or ["The two have no cell in common."]


def draw_differences(cells: pd.DataFrame, dims: Sequence[str], path: Path) -> None:
    """Draw one line for each cell, from A to B.  ``cells``: as in ``SweepDifferences``, in the order of drawing."""
    drawn = cells.head(MOST_DRAWN)
    figure = Figure(figsize=(8.0, 0.24 * len(drawn) + 1.1), layout="constrained")
    ax = figure.subplots()
    rows = range(len(drawn))
    ax.hlines(rows, drawn["a"], drawn["b"], color="0.75", lw=1.5, zorder=1)
    for side, mark in zip(SIDES, "os", strict=True):
        ax.plot(drawn[side.lower()], rows, mark, color=COLOURS[side], ms=5, label=side, zorder=2)
    varied = [dim for dim in dims if len(cells[dim].dropna().unique()) > 1] or list(dims)
    coordinates = drawn[varied].to_dict("records")
    labels = [", ".join(f"{dim} {_format_coordinate(value)}" for dim, value in row.items()) for row in coordinates]
    ax.set_yticks(rows, labels, fontsize=8)
    ax.set(ylim=(len(drawn) - 0.5, -0.5), xlabel=" or ".join(sorted(set(drawn["measure"]))).replace("_", " "))
    ax.grid(axis="x", color="0.92", lw=0.6)
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=9)
    save_figure(figure, path)


def _format_coordinate(value: object) -> str:
    """Format the value of a coordinate."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def _pair_pictures(a: FigureContent, b: FigureContent) -> list[Block]:
    """Put pictures of the same file name side by side."""
    others = {block.file: block for block in walk_blocks(b.blocks) if isinstance(block, Picture)}
    return [
        Pair(SIDES, (relocate_picture(block, "a"), relocate_picture(others[block.file], "b")))
        for block in walk_blocks(a.blocks)
        if isinstance(block, Picture) and block.file in others
    ]
