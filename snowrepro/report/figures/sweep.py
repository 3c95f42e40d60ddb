"""Any sweep: what varies in it, the numbers over what varies, the snow, and the sizes of its fragments."""

from collections.abc import Sequence

import pandas as pd

from ...evidence.collect import CollectedSweep
from ...evidence.gather import Evidence
from ...evidence.margins import list_margins
from ...quantities import add_unit
from ...store import states
from ...summary.columns import CASE_COLUMNS
from ...text import make_cells
from ..document import NO_RESULT, Block, FigureContent, Fold, Heading, Picture, Table, escape, format_code, join_names
from ..drawing.columns import (
    choose_colour,
    describe_cell,
    format_value,
    label_column,
    list_measures,
    list_steered,
    read_values,
)
from ..drawing.common import save_figure
from ..drawing.plot import Roles, describe_points, draw_measures, spans_far
from ..sections import influence, sizes, snow
from .kinds import FigureKind

RESULTS = "results.csv"
MOST_OPEN = 24  # rows of a table that stands open
MOST_CELLS = 200  # that are tabulated; of more there is the file alone
MOST_PICTURES = 6  # of responses, one for each setting
MOST_VALUES = 30  # of a setting that are listed
FEW_VALUES = 12  # of a sampled setting, of more the range is told
MOST_SETTINGS = 4  # of a cell that a sentence describes


def report(evidence: Evidence) -> FigureContent:
    """Show any sweep: tables of what varies and of the numbers, responses, the snow, and sizes of fragments."""
    sweep = evidence.sweep
    varied = _tabulate_varied(sweep)
    if not list_measures(sweep):
        return FigureContent(varied, NO_RESULT.verdict)
    make_cells(sweep.table).to_csv(evidence.folder / RESULTS, index=False, float_format="%.6g", lineterminator="\n")
    blocks = [
        *varied,
        *(influence.make_blocks(sweep, evidence.folder) if sweep.sample else []),
        *_draw_responses(evidence),
        *_tabulate_numbers(sweep),
        *snow.make_blocks(evidence),
        *sizes.make_blocks(evidence),
    ]
    agreement = influence.describe_agreement(sweep, list_margins(sweep)) if sweep.sample else ""
    return FigureContent(blocks, f"{_summarise(sweep)} {agreement}".rstrip())


def _tabulate_varied(sweep: CollectedSweep) -> list[Block]:
    """Tabulate the settings that vary with their values, and say what scene, pressure and seed all runs share."""
    values = {name: sweep.table[name].unique() for name in sweep.dims}
    rows = [
        {
            "setting": format_code(sweep.key_of(name)),
            "values": _list_values(values[name], is_sampled=name in sweep.factors),
            "count": len(values[name]),
        }
        for name in sweep.varied
    ]
    same = [f"{name} {format_value(values[name][0])}" for name in sweep.dims if name not in sweep.varied]
    table = Table(pd.DataFrame(rows)) if rows else "Nothing varies: this is one run."
    return [Heading("What varies"), table, *([f"The same in all runs: {escape(', '.join(same))}."] if same else [])]


def _list_values(values: Sequence[object], is_sampled: bool) -> str:
    """List the values of a setting; of many the first and the last, and of many sampled numbers the range."""
    numbers = pd.to_numeric(pd.Series(values), errors="coerce")
    if is_sampled and len(values) > FEW_VALUES and numbers.notna().all():
        return f"{numbers.min():.4g} to {numbers.max():.4g}"
    texts = [escape(format_value(value)) for value in values]
    if len(texts) > MOST_VALUES:
        texts = [*texts[: MOST_VALUES // 2], "...", *texts[-MOST_VALUES // 2 :]]
    return ", ".join(texts)


def _draw_responses(evidence: Evidence) -> list[Block]:
    """Draw the main measures over each setting that varies in numbers, a picture for each."""
    sweep, measures = evidence.sweep, list_measures(evidence.sweep)
    blocks: list[Block] = []
    for x in list_steered(sweep)[:MOST_PICTURES]:
        colour, key = choose_colour(sweep, x), sweep.key_of(x)
        file = f"over-{x}.png"
        save_figure(draw_measures(sweep, x, measures, colour), evidence.folder / file)
        names = ", ".join(label_column(sweep, measure) for measure in measures)
        scale = ", on a logarithmic scale" if spans_far(read_values(sweep, x)) else ""
        colours = f"; colours: {format_code(sweep.key_of(colour))}" if colour else ""
        rest = [sweep.key_of(name) for name in sweep.varied if name not in (x, colour, "seed")]
        apart = f"snowrepro plot SWEEP x={key} panel={rest[0]}" if rest else ""
        which = join_names([format_code(name) for name in rest], "and")
        lines = f" Each value of {which} has a line of its own; {format_code(apart)} draws them apart." if rest else ""
        if x in sweep.factors:
            lines = " A design sampled it together with others, so no line goes through the points."
        points = describe_points(sweep, Roles(x, measures[0], colour))
        caption = f"Results over {format_code(key)}{scale}{colours}.{lines} {points[0].upper()}{escape(points[1:])}."
        blocks.append(Picture(file, f"Panels over {key}: {names}.", caption, data=RESULTS))
    return [Heading("Results over what varies"), *blocks]


def _tabulate_numbers(sweep: CollectedSweep) -> list[Block]:
    """Tabulate the main measures of each cell: the mean over its seeds, and from where to where they go."""
    measures = list_measures(sweep)
    settings = [name for name in sweep.varied if name != "seed"] or ["pressure"]
    if (cells := sweep.table.groupby(settings, sort=False).ngroups) > MOST_CELLS:
        return [Heading("Numbers"), f"The numbers of all {cells} cells are in [{RESULTS}]({RESULTS})."]
    rows = []
    for _, cell in sweep.table.groupby(settings, sort=False):
        done = int((cell["state"] == states.DONE).sum())
        row = {_head_column(sweep, name): escape(format_value(cell[name].iloc[0])) for name in settings}
        numbers = {escape(label_column(sweep, name)): _format_spread(cell[name]) for name in measures}
        rows.append({**row, **numbers, "runs with a result": f"{done} of {len(cell)}"})
    seeds = len(sweep.table["seed"].unique())
    how = f"Means over up to {seeds} seeds, in brackets the lowest and the highest." if seeds > 1 else ""
    table = Table(pd.DataFrame(rows), how, RESULTS)
    return [Heading("Numbers"), Fold(f"All {len(rows)} cells", [table]) if len(rows) > MOST_OPEN else table]


def _head_column(sweep: CollectedSweep, name: str) -> str:
    """Write a setting as the head of a column: as one types it, with its unit."""
    unit = CASE_COLUMNS[name].format_unit([sweep.length_unit]) if name in CASE_COLUMNS else ""
    return escape(add_unit(sweep.key_of(name), unit))


def _format_spread(values: pd.Series) -> str:
    """Write the mean of numbers, and their range where they differ; a dash if there are none."""
    known = values.dropna().astype(float)
    if known.empty:
        return "-"
    mean, low, high = (_format_number(number) for number in (known.mean(), known.min(), known.max()))
    return mean if low == high else f"{mean} ({low} to {high})"


def _format_number(number: float) -> str:
    """Write a number that was measured: three decimals of a part, four digits of others, no decimals of thousands."""
    if abs(number) <= 1:
        return f"{number:.3f}"
    return f"{number:.4g}" if abs(number) < 1000 else f"{number:.0f}"


def _summarise(sweep: CollectedSweep) -> str:
    """Say from where to where the main measure goes, and in which cells."""
    measure = list_measures(sweep)[0]
    table = sweep.table.assign(cell=[describe_cell(sweep, row) for row in range(len(sweep.table))])
    means = table.groupby("cell", sort=False)[measure].mean().dropna()
    label = label_column(sweep, measure)
    name = f"{label[0].upper()}{label[1:]}"
    low, high = means.idxmin(), means.idxmax()
    if len(means) == 1 or means[low] == means[high]:
        return f"{name}: {_format_number(means.iloc[0])}."
    if len(sweep.varied) > MOST_SETTINGS:
        return f"{name}: from {_format_number(means[low])} to {_format_number(means[high])}, in {len(means)} cells."
    first, last = (f"{_format_number(means[cell])} ({cell})" for cell in (low, high))
    return f"{name}: from {first} to {last}."


FIGURE = FigureKind(report, takes_indenter=True)
