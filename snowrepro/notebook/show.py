"""``snowrepro.show``: a run, a sweep or fragments at a glance."""

import math
from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr

from ..analysis.lumps import Classification
from ..composition.compose import config_of
from ..evidence.collect import NOT_IN_SWEEP, sweep_table
from ..markup import make_paragraph, make_table
from ..report.film.panels import format_title
from ..store import states
from ..store.run import Run
from ..summary.outcome import describe_outcome
from ..summary.row import ALL_COLUMNS, summarise
from ..text import make_printable
from .named import find_sweep
from .shown import View
from .states import plot_state, read_run
from .tables import find_coordinates

WIDTH = 4.5  # of a picture [inches]
MOST_ROWS = 60  # of a sweep
MOST_LETTERS = 80  # of a reason
YES_OR_NO = " (1 yes, 0 no)"  # in the name of a column
# The numbers of a run that are shown, and those of a sweep with the words above them; those that there are.
NUMBERS = (
    "hardness_depth", "indentation_work", "lump_fraction", "crushed_fraction", "loose_fraction", "lumps",
    "largest_fragment", "settled", "impact_speed", "density_at_release", "young_at_release", "particles", "seconds",
)  # fmt: skip
SWEEP_NUMBERS = {
    "lump_fraction": "part of the mass in lumps",
    "crushed_fraction": "crushed",
    "loose_fraction": "loose",
    "lumps": "lumps",
    "hardness": "hardness",
}


def show(data: xr.Dataset | pd.DataFrame | Classification | str | Path, *, store: str | Path = "runs") -> View:
    """Return a run, a sweep or fragments at a glance: a notebook shows it as HTML, and ``print`` as text.

    ``data``: a run as ``simulate`` or ``open_run`` gives it, a sweep as ``open_sweep`` or ``sweep_table`` gives it,
    what ``classify`` gives, or the id, path or name of a run or sweep in ``store``.
    Raises ConfigError where there is neither a run nor a sweep of that name, StoreError where data is broken.
    """
    if isinstance(data, Classification):
        return View(data._repr_html_(), repr(data))
    if isinstance(data, pd.DataFrame):
        return _show_sweep("Sweep", data, find_coordinates(data, ["reason"]))
    if isinstance(data, xr.Dataset):
        return _show_grid(data) if {"state", "run_id"} <= {*data.variables} else _show_run(data)
    if not (name := find_sweep(data, store)):
        return _show_run(read_run(data, store))
    table = sweep_table(name, store)
    return _show_sweep(f"Sweep {name}", table, find_coordinates(table, ["reason"]))


def _show_run(dataset: xr.Dataset) -> View:
    """Show a run: what it is, what came out in a sentence, the last frame, and its main numbers."""
    run = Run(config_of(dataset))
    row = summarise(dataset)
    title = f"Run of snowrepro: {format_title([run], [])}"
    unit = run.case.reading.length_unit
    sentence = describe_outcome(row, unit)
    known = [name for name in NUMBERS if name in row and _format(row[name])]
    numbers = [_describe_number(name, row[name], unit) for name in known]
    about = f"{run.id}; seed {run.case.seed}, fidelity {run.case.fidelity.name}, {dataset.sizes['frame'] - 1} frames"
    picture = plot_state(dataset, "fragment", None, "", WIDTH)
    html = [
        make_paragraph(title, is_bold=True),
        make_paragraph(sentence),
        picture._repr_html_(),
        make_table([], numbers),
        make_paragraph(about),
    ]
    lines = [title, sentence, *(f"  {name}: {value}" for name, value in numbers), about]
    return View("".join(html), "\n".join(map(make_printable, lines)))


def _describe_number(name: str, value: Any, length_unit: str) -> tuple[str, str]:
    """Return what a number is, and its value with the unit."""
    column = ALL_COLUMNS[name]
    return column.long_name.removesuffix(YES_OR_NO), f"{_format(value)} {column.format_unit([length_unit])}".rstrip()


def _format(value: Any) -> str:
    """Return a value for people; nothing where there is none."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    if math.isnan(value):
        return ""
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def _show_grid(grid: xr.Dataset) -> View:
    """Show a sweep from its grid, without the cells that it did not ask for."""
    table = grid.to_dataframe().reset_index()
    table = table[table["state"] != NOT_IN_SWEEP].assign(reason="")
    return _show_sweep(f"Sweep {grid.attrs.get('sweep', '')}".strip(), table, [*grid.coords])


def _show_sweep(title: str, table: pd.DataFrame, coordinates: Sequence[Hashable]) -> View:
    """Show a sweep: how far it is, what varies, and a row for each run."""
    varied = [name for name in coordinates if len(table[name].unique()) > 1]
    numbers = [name for name in SWEEP_NUMBERS if name in table and table[name].notna().any()]
    counts = Counter(table["state"])
    sentence = f"{len(table)} run{'s' * (len(table) != 1)}: " + ", ".join(f"{counts[s]} {s}" for s in counts) + "."
    if varied:
        sentence += f" What varies: {', '.join(map(str, varied))}."
    shown = table.head(MOST_ROWS)
    header = [*map(str, varied), "state", *(SWEEP_NUMBERS[name] for name in numbers)]
    rows = [
        [*(_format(row[name]) for name in varied), _describe_state(row), *(_format(row[name]) for name in numbers)]
        for row in shown.to_dict("records")
    ]
    rest = len(table) - len(shown)
    note = f"and {rest} more runs: snowrepro.sweep_table has all" if rest else ""
    html = [make_paragraph(title, is_bold=True), make_paragraph(sentence), make_table(header, rows)]
    text = pd.DataFrame(rows, columns=header).to_string(index=False)
    lines = [*map(make_printable, (title, sentence)), "\n".join(map(make_printable, text.split("\n"))), note]
    return View("".join([*html, make_paragraph(note) if note else ""]), "\n".join(filter(None, lines)))


def _describe_state(row: Mapping[Hashable, Any]) -> str:
    """Return the state of a run, and why it has no result."""
    if row["state"] == states.DONE or not row["reason"]:
        return str(row["state"])
    return f"{row['state']}: {row['reason'][:MOST_LETTERS]}"
