"""The sections on runs in every report: missing ones, solver health, cost, origin, and settings."""

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

import pandas as pd
import yaml

from ...evidence.gather import Evidence, describe_run, read_origin, sort_as_in_paper
from ...mpm.ledger import BOUNDED, bounded
from ...quantities import add_unit
from ...store import states
from ...store.run import Run
from ...summary.row import ALL_COLUMNS
from ..document import Block, Fold, Section, Table, escape, escape_cell, format_list
from ..figures.kinds import find_figure

MOST_LISTED = 48  # runs in a table that stands open
# Columns of the summary that tell of the solver's health, and their heads.
HEALTH_COLUMNS = {
    "particles": "particles",
    "energy_unclosed": "energy unclosed",
    "poisson_capped": "ν capped",
    "density_capped": "ρ capped",
    "hardening_capped": "Eq. 1 capped",
    "hardening_floored": "Eq. 1 floored",
    "volume_bounded": "J_P bounded",
    "ended_inside": "inside floor",
}
RUN_COLUMNS = {"shape": "shape", "floor": "floor", "pressure": "pressure", "sintering": "sintering", "seed": "seed"}
MORE_COLUMNS = {"indenter": "indenter"}  # in experiments that have one
ALL_RUN_COLUMNS = {**RUN_COLUMNS, **MORE_COLUMNS}
MEASURE_COLUMNS = {
    "lump_fraction": "mass in lumps",
    "crushed_fraction": "crushed",
    "loose_fraction": "loose",
    "lumps": "lumps",
    "largest_fragment": "largest",
    "hardness": "hardness",
    "density_at_release": "density",
    "hardening_at_release": "ξ",
    "factor_at_release": "hardening factor",
    "settled": "settled",
}
SETTINGS_IN_COLUMNS = ("shape.", "floor.", "pressure ", "sintering.", "seed ")  # in columns of their own


def make_run_sections(evidences: Sequence[Evidence], folder: Path) -> list[Section]:
    """Make the sections on the runs of several experiments; none if nothing is simulated.

    ``folder``: of the report, from which links start.
    """
    simulated = [evidence for evidence in evidences if find_figure(evidence.experiment).needs_runs]
    if not simulated:
        return []
    table = pd.concat([evidence.table for evidence in simulated], ignore_index=True)
    if len(table):
        table = table.drop_duplicates()
    return [
        Section("missing", "Runs without a result", _list_missing_runs(simulated)),
        Section("health", "Solver health", _describe_health(table, simulated)),
        Section("cost", "Cost", _tabulate_cost(table, simulated)),
        Section("environment", "What made the runs", _tabulate_makers(simulated)),
        *(_make_run_list(evidence, folder, simulated) for evidence in simulated),
    ]


def _list_distinct_runs(evidences: Sequence[Evidence]) -> list[Run]:
    """List every run once, also if several experiments share it."""
    return list({run.folder: run for evidence in evidences for run in evidence.runs}.values())


def _list_done_runs(evidences: Sequence[Evidence]) -> list[Run]:
    """List every finished run once."""
    done = {run.folder: run for evidence in evidences for run in evidence.runs if evidence.is_done(run)}
    return list(done.values())


def _list_missing_runs(evidences: Sequence[Evidence]) -> list[Block]:
    """List the runs without a result by their state, with the reason.  No verdict counts them."""
    by_state: dict[str, dict[Path, str]] = {}
    for evidence in evidences:
        for run, standing in zip(evidence.runs, states.standings(evidence.runs), strict=True):
            if standing.state != states.DONE:
                name = ", ".join([describe_run(run), *_list_changes(run, evidence)])
                line = escape(f"{name}: {standing.reason}")
                by_state.setdefault(standing.state, {}).setdefault(run.folder, line)
    if not by_state:
        return [f"None: all {len(_list_distinct_runs(evidences))} runs that were asked for are done."]
    blocks: list[Block] = ["They are shown as missing wherever they belong, and no verdict counts them."]
    for state, lines in sorted(by_state.items()):
        head = f"{state.capitalize()}: {len(lines)}"
        text = format_list([f"**missing** ({state}): {line}" for line in lines.values()])
        blocks.append(Fold(head, [text]) if len(lines) > MOST_LISTED else text)
    return blocks


def _describe_health(table: pd.DataFrame, evidences: Sequence[Evidence]) -> list[Block]:
    """Report how much energy the ledgers leave unexplained, and how many particles had to be bounded."""
    if table.empty:
        return ["No run has a result."]
    heads = {name: head for name, head in HEALTH_COLUMNS.items() if name in table}
    text = (
        f"{_describe_unclosed(table)} {_describe_unsettled(table)} Capped, floored, bounded: the most "
        "particles in any frame at a bound that the reading adds to the paper's laws; all columns are in summary.csv."
    )
    rows = table[[name for name in ALL_RUN_COLUMNS if name in table]].rename(
        columns=_add_units(ALL_RUN_COLUMNS, evidences)
    )
    frame = pd.concat([rows.map(escape_cell), table[list(heads)].rename(columns=heads)], axis=1)
    lines = [f"{escape(describe_run(run))}: {_describe_bounds(run)}" for run in _list_done_runs(evidences)]
    summary = "What was bounded in each run, on how many particles at most, and since when"
    return [text, _fold_long_table("Every run", Table(frame), len(frame)), Fold(summary, [format_list(lines)])]


def _describe_unclosed(table: pd.DataFrame) -> str:
    """Say how much energy the ledgers leave without a cause."""
    worst = table.reindex(columns=["energy_unclosed"]).astype(float).max().iloc[0]
    if math.isnan(worst):
        return "How much energy has no cause was not recorded."
    return f"Of the energy turned over from the release on, the ledgers leave at most {worst:.1%} without a cause."


def _describe_unsettled(table: pd.DataFrame) -> str:
    """Say how many of the runs that fall still came apart, or were crushed, at their end."""
    settled = table["settled"].dropna() if "settled" in table else pd.Series(dtype=bool)
    if settled.empty:
        return "None of the runs falls, so whether they settled was not asked."
    return (
        f"{int((~settled.astype(bool)).sum())} of {len(settled)} runs that fall had not settled at their end: snow "
        "still came apart or was crushed."
    )


def _fold_long_table(head: str, table: Table, rows: int) -> Block:
    """Hide a table with more than MOST_LISTED rows behind the line ``head``."""
    return Fold(head, [table]) if rows > MOST_LISTED else table


def _describe_bounds(run: Run) -> str:
    """Say which quantities of a run were bounded, on how many particles and since when."""
    with run.open() as dataset:
        if not set(BOUNDED) <= set(dataset):
            return "not recorded"
        return "; ".join(map(escape, bounded(dataset))) or "nothing"


def _tabulate_cost(table: pd.DataFrame, evidences: Sequence[Evidence]) -> list[Block]:
    """Tabulate core-hours and the longest run, for each experiment and for all of several."""
    if table.empty:
        return ["No run has a result."]
    rows = [_make_cost_row(escape(e.experiment.title), e.table, len(e.runs)) for e in evidences]
    if len(rows) > 1:
        rows.append(_make_cost_row("all together, shared runs once", table, len(_list_distinct_runs(evidences))))
    return [Table(pd.DataFrame(rows))]


def _make_cost_row(name: str, table: pd.DataFrame, run_count: int) -> dict[str, str]:
    """Make one row of the table of costs.  ``table``: the rows of the finished runs."""
    seconds = table["seconds"] if len(table) else pd.Series([0.0])
    seconds_a_frame = table["seconds_per_frame"].mean() if "seconds_per_frame" in table else float("nan")
    return {
        "runs of": name,
        "done": f"{len(table)} of {run_count}",
        "core-hours": f"{seconds.sum() / 3600:.3f}",
        "longest [s]": f"{seconds.max():.0f}",
        "mean a frame [s]": "-" if math.isnan(seconds_a_frame) else f"{seconds_a_frame:.3f}",
    }


def _tabulate_makers(evidences: Sequence[Evidence]) -> list[Block]:
    """Tabulate with which versions, code and machines the runs were made."""
    counts: dict[tuple[str, ...], int] = {}
    for run in _list_done_runs(evidences):
        maker = read_origin(run)
        counts[maker] = counts.get(maker, 0) + 1
    rows = [[count, *map(escape, maker)] for maker, count in sorted(counts.items())]
    return [Table(pd.DataFrame(rows, columns=["runs", "versions", "code", "machine"]))]


def _make_run_list(evidence: Evidence, folder: Path, evidences: Sequence[Evidence]) -> Section:
    """Make the list of an experiment's runs with settings, numbers and files, and all settings of the first run."""
    first = evidence.runs[0].config.record()
    rows = [_make_run_row(run, evidence, folder) for run in sort_as_in_paper(evidence.runs)]
    frame = pd.DataFrame(rows).dropna(axis=1, how="all")
    table = Table(frame.astype(object).fillna("-"), data=(Path(evidence.path_from(folder)) / "summary.csv").as_posix())
    settings = yaml.safe_dump(first, sort_keys=False, allow_unicode=True).rstrip()
    blocks: list[Block] = [
        _fold_long_table(f"All {len(frame)} runs", table, len(frame)),
        Fold("All settings of the first run; the others differ in what the table says", [f"```yaml\n{settings}\n```"]),
    ]
    namesakes = [other for other in evidences if other.experiment.title == evidence.experiment.title]
    side = f" ({escape(evidence.folder.name).upper()})" if len(namesakes) > 1 else ""  # two sides of a comparison
    return Section(make_runs_anchor(evidence), f"Runs of {escape(evidence.experiment.title)}{side}", blocks)


def make_runs_anchor(evidence: Evidence) -> str:
    """Make the anchor of the section that lists the runs of an experiment."""
    return f"runs-{evidence.folder.name}"


def _make_run_row(run: Run, evidence: Evidence, folder: Path) -> dict[str, object]:
    """Make the row of one run in the list."""
    name = run.id
    row: dict[str, object] = {
        "run": _link_files(name, run, folder) if evidence.is_done(run) else f"**missing** {escape(name)}",
        "shape": escape(run.case.shape.name),
        "floor": escape(run.case.floor.name),
        add_unit("pressure", evidence.pressure_unit): f"{run.case.pressure:g}",
        "sintering": escape(run.case.sintering.name),
        "seed": run.case.seed,
        "other settings": escape("; ".join(_list_changes(run, evidence))) or None,
    }
    numbers = evidence.row(name)
    return row | {head: numbers.get(column) for column, head in _add_units(MEASURE_COLUMNS, [evidence]).items()}


def _add_units(heads: Mapping[str, str], evidences: Sequence[Evidence]) -> dict[str, str]:
    """Add the units to the heads of columns, which are given by the columns' names."""
    lengths = [unit for evidence in evidences for unit in evidence.length_units]
    return {name: add_unit(head, ALL_COLUMNS[name].format_unit(lengths)) for name, head in heads.items()}


def _list_changes(run: Run, evidence: Evidence) -> list[str]:
    """List the other settings that differ from the first run of the experiment, as "key before -> now"."""
    return [d for d in evidence.list_changes(run) if not d.startswith(SETTINGS_IN_COLUMNS)]


def _link_files(name: str, run: Run, folder: Path) -> str:
    """Format a run's id with links to its result and manifest; without links if a path is absolute."""
    if Path(run.store).is_absolute() or folder.is_absolute():
        return escape(name)
    path = quote(os.path.relpath(run.folder, folder))
    return f"{escape(name)} ([run.nc]({path}/run.nc), [manifest]({path}/manifest.json))"
