"""Two sweeps, versions or readings side by side: what differs first, then verdicts, numbers and pictures."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from ..analysis.claims import INCONCLUSIVE, Scene, Verdict
from ..store.files import require_writable
from ..sweep.collect import collect
from ..sweep.differences import SweepDifferences, compare_sweeps
from ..sweep.plan import Plan
from ..sweep.record import shortened, unseeded
from .about import about_runs
from .document import (
    Block,
    Document,
    Findings,
    Fold,
    Heading,
    Pair,
    Picture,
    Section,
    Table,
    code,
    flat,
    listed,
    moved,
    plain,
)
from .drawing import SINTERED, UNSINTERED, save
from .evidence import Evidence
from .page import Part, draw, write_document_to

SIDES = ("A", "B")
MOST_DRAWN = 40  # cells in the picture of differences
MOST_LISTED = 30  # changed settings
COLOURS = {"A": UNSINTERED, "B": SINTERED}


def write_comparison(first: Plan, second: Plan) -> Path:
    """Compare two sweeps of an experiment from their stores alone; returns the page.

    Raises ConfigError where their cells cannot be matched, and StoreError where the report cannot be written.
    """
    names = [unseeded(plan.overrides) for plan in (first, second)]
    folder = Path(first.configs[0].reports) / shortened("-against-".join(names))
    require_writable(folder)
    found = compare_sweeps(collect(first), collect(second))
    sides = zip((first, second), SIDES, strict=True)
    parts = [draw(plan.configs, plan.overrides, folder / side.lower()) for plan, side in sides]
    evidences = [part.evidence for part in parts]
    sections = [
        Section("summary", "Summary", _summary(parts, names, found)),
        Section("verdicts", "Verdicts", [Table(_verdict_table(_verdicts(*evidences)))]),
        Section("numbers", "Numbers", _numbers(found, folder)),
        Section("pictures", "Pictures", _pictures(*(part.findings for part in parts))),
        *about_runs(evidences, folder),
    ]
    return write_document_to(Document(f"{names[0]} beside {names[1]}", sections), folder)


def _summary(parts: Sequence[Part], names: Sequence[str], found: SweepDifferences) -> list[Block]:
    """What the two are, what was asked for otherwise, and which verdicts change."""
    told = [f"**{side}** is {code(name)}: {plain(part.findings.verdict)} Redo: {code(part.redo)}"
            for side, name, part in zip(SIDES, names, parts, strict=True)]  # fmt: skip
    blocks: list[Block] = [listed(told), Heading("What changes in the verdicts")]
    verdicts = _verdicts(*(part.evidence for part in parts))
    changed = [_sentence(where, a, b) for where, a, b in verdicts if a.word != b.word or a.agrees != b.agrees]
    blocks.append(listed(changed) if changed else f"Nothing: {len(verdicts)} verdicts are the same word in both.")
    blocks.append(Heading("What was asked for otherwise"))
    settings = [f"{code(line)}" for line in found.config]
    if len(settings) > MOST_LISTED:
        return [*blocks, Fold(f"{len(settings)} settings (A -> B)", [listed(settings)])]
    return [*blocks, f"Settings, A -> B:\n\n{listed(settings)}" if settings else "No setting of the runs differs."]


def _verdicts(a: Evidence, b: Evidence) -> list[tuple[str, Verdict, Verdict]]:
    """The verdicts that both have, with the scene that they are of; changed ones first."""
    if not a.experiment.is_judged or not b.experiment.is_judged:
        return []
    pairs = [("all scenes", v, w) for v in a.over_scenes for w in b.over_scenes if v.claim == w.claim]
    pairs += [found for scene in a.scenes for found in _of_scene(scene, b.scenes)]
    return sorted(pairs, key=lambda pair: (pair[1].word == pair[2].word, pair[1].agrees == pair[2].agrees))


def _of_scene(scene: Scene, others: Sequence[Scene]) -> list[tuple[str, Verdict, Verdict]]:
    other = next((other for other in others if other.name == scene.name), None)
    if other is None:
        return []
    return [(scene.name, v, w) for v in scene.verdicts for w in other.verdicts if v.claim == w.claim]


def _sentence(where: str, a: Verdict, b: Verdict) -> str:
    """A verdict that is another one in B."""
    told = [f"{side} **{v.word}** ({_number(v)})" for side, v in zip(SIDES, (a, b), strict=True)]
    return f"**{plain(a.claim)}**, {plain(where)}: {'; '.join(told)}."


def _number(verdict: Verdict) -> str:
    """What a verdict rests on; for one that decides nothing, which way it points."""
    way = f"; the numbers {verdict.way}" if verdict.word == INCONCLUSIVE else ""
    return plain((verdict.effect_shown or verdict.measured) + way)


def _verdict_table(verdicts: Sequence[tuple[str, Verdict, Verdict]]) -> pd.DataFrame:
    """A row a verdict: its words and numbers in A and B."""
    rows = [
        {
            "claim": plain(a.claim),
            "scene": plain(where),
            **{side: f"**{plain(v.shown)}**" for side, v in zip(SIDES, (a, b), strict=True)},
            **{f"{side}, effect": _number(v) for side, v in zip(SIDES, (a, b), strict=True)},
        }
        for where, a, b in verdicts
    ]
    return pd.DataFrame(rows, columns=["claim", "scene", *SIDES, *(f"{side}, effect" for side in SIDES)])


def _numbers(found: SweepDifferences, folder: Path) -> list[Block]:
    """Each cell's measure in A and B, the largest differences first."""
    cells = found.cells.reindex(found.cells["difference"].abs().sort_values(ascending=False, kind="stable").index)
    cells.to_csv(folder / "differences.csv", index=False, float_format="%.6g", lineterminator="\n")
    dims = [str(name) for name in cells.columns[: cells.columns.get_loc("measure")]]
    table = Table(cells.map(_cell), data="differences.csv")
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
    for text, lacking in (
        ("Cells without a result on one side, or with other kinds of result", found.lacking),
        ("Cells of A alone", found.only_a),
        ("Cells of B alone", found.only_b),
    ):
        if len(lacking):
            blocks += [f"**{text}: {len(lacking)}.** They are compared with nothing.", Table(lacking.map(_cell))]
    return blocks or ["The two have no cell in common."]


def _cell(value: object) -> object:
    return plain(value) if isinstance(value, str) else value


def draw_differences(cells: pd.DataFrame, dims: Sequence[str], path: Path) -> None:
    """A line a cell, from A to B; ``cells``: as ``SweepDifferences`` has them, those to show first."""
    shown = cells.head(MOST_DRAWN)
    figure = Figure(figsize=(8.0, 0.24 * len(shown) + 1.1), layout="constrained")
    ax = figure.subplots()
    rows = range(len(shown))
    ax.hlines(rows, shown["a"], shown["b"], color="0.75", lw=1.5, zorder=1)
    for side, mark in zip(SIDES, "os", strict=True):
        ax.plot(shown[side.lower()], rows, mark, color=COLOURS[side], ms=5, label=side, zorder=2)
    varied = [dim for dim in dims if cells[dim].nunique() > 1] or list(dims)
    named = shown[varied].to_dict("records")
    labels = [", ".join(f"{dim} {_short(value)}" for dim, value in row.items()) for row in named]
    ax.set_yticks(rows, labels, fontsize=7)
    ax.set(ylim=(len(shown) - 0.5, -0.5), xlabel=" or ".join(sorted(set(shown["measure"]))).replace("_", " "))
    ax.grid(axis="x", color="0.92", lw=0.6)
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=9)
    save(figure, path)


def _short(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _pictures(a: Findings, b: Findings) -> list[Block]:
    """Pictures of the same name side by side."""
    others = {block.file: block for block in flat(b.blocks) if isinstance(block, Picture)}
    return [
        Pair(SIDES, (moved(block, "a"), moved(others[block.file], "b")))
        for block in flat(a.blocks)
        if isinstance(block, Picture) and block.file in others
    ]
