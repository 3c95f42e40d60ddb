"""What every report tells of its runs: what is missing, solver health, cost, what made them, and their settings."""

import os
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import yaml

from ..config import Config
from ..mpm.diagnostics import BOUNDED, bounded
from ..store import runs, states
from .document import Block, Fold, Section, Table, listed, plain
from .evidence import Evidence, in_paper_order, made_by, name_of, opened

MOST_LISTED = 48  # runs in a table that stands open
# Columns of the summary that tell of the solver's health, and their heads.
HEALTH = {
    "particles": "particles",
    "energy_unclosed": "energy unclosed",
    "poisson_capped": "nu capped",
    "density_capped": "rho capped",
    "hardening_capped": "Eq. 1 capped",
    "hardening_floored": "Eq. 1 floored",
    "volume_bounded": "J_P bounded",
    "ended_inside": "inside floor",
}
RUN = {"shape": "shape", "floor": "floor", "pressure": "pressure", "sintering": "sintering", "seed": "seed"}
MORE = {"indenter": "indenter"}  # in experiments that have one
TOLD = {**RUN, **MORE}
MEASURED = {
    "lump_fraction": "lumps [mass]",
    "lumps": "lumps [count]",
    "largest_fragment": "largest",
    "broken_bonds": "bonds broken",
    "hardness": "hardness",
    "density_at_release": "density",
    "hardening_at_release": "xi",
    "factor_at_release": "hardening factor",
    "settled": "settled",
}
SETTINGS_TOLD = ("shape.", "floor.", "pressure ", "sintering.", "seed ")  # in columns of their own


def about_runs(evidences: Sequence[Evidence], folder: Path) -> list[Section]:
    """The sections on runs; none where nothing is simulated.  ``folder``: of the report, for links."""
    simulated = [evidence for evidence in evidences if evidence.experiment.needs_runs]
    if not simulated:
        return []
    table = pd.concat([evidence.table for evidence in simulated], ignore_index=True)
    if len(table):
        table = table.drop_duplicates()
    return [
        Section("missing", "Runs without a result", _missing(simulated)),
        Section("health", "Solver health", _health(table, simulated)),
        Section("cost", "Cost", _cost(table, simulated)),
        Section("environment", "What made the runs", _environment(simulated)),
        *(_list_of_runs(evidence, folder, simulated) for evidence in simulated),
    ]


def _distinct(evidences: Sequence[Evidence]) -> list[Config]:
    """Every run once, as asked for."""
    return list({runs.run_dir(config): config for evidence in evidences for config in evidence.configs}.values())


def _done(evidences: Sequence[Evidence]) -> list[Config]:
    done = {runs.run_dir(c): c for evidence in evidences for c in evidence.configs if evidence.is_done(c)}
    return list(done.values())


def _missing(evidences: Sequence[Evidence]) -> list[Block]:
    """Every run that has no result, by state, with the reason.  None of them counts in any verdict."""
    found: dict[str, dict[Path, str]] = {}
    for evidence in evidences:
        for config, standing in zip(evidence.configs, states.standings(evidence.configs), strict=True):
            if standing.state != states.DONE:
                named = ", ".join([name_of(config), *_changes(config, evidence)])
                told = plain(f"{named}: {standing.reason}")
                found.setdefault(standing.state, {}).setdefault(runs.run_dir(config), told)
    if not found:
        return [f"None: all {len(_distinct(evidences))} runs that were asked for are done."]
    blocks: list[Block] = ["They are shown as missing wherever they belong, and no verdict counts them."]
    for state, names in sorted(found.items()):
        head = f"{state.capitalize()}: {len(names)}"
        text = listed([f"**missing** ({state}): {name}" for name in names.values()])
        blocks.append(Fold(head, [text]) if len(names) > MOST_LISTED else text)
    return blocks


def _health(table: pd.DataFrame, evidences: Sequence[Evidence]) -> list[Block]:
    """What the ledgers leave unexplained, and how many particles had to be bounded."""
    if table.empty:
        return ["No run has a result."]
    names = {name: head for name, head in HEALTH.items() if name in table}
    worst = table.reindex(columns=["energy_unclosed"]).astype(float).max().iloc[0]
    loose = int((~table["settled"].astype(bool)).sum()) if "settled" in table else 0
    text = (
        f"Of the energy that was turned over from the release on, the ledgers leave at most {worst:.1%} without a "
        f"cause. {loose} of {len(table)} runs had not settled at their end. Capped, floored, bounded: the most "
        "particles in any frame at a bound that the reading adds to the paper's laws; all columns are in summary.csv."
    )
    rows = table[[name for name in TOLD if name in table]].rename(columns=TOLD)
    shown = pd.concat([rows.map(_cell), table[list(names)].rename(columns=names)], axis=1)
    lines = [f"{plain(name_of(config))}: {_bounds(config)}" for config in _done(evidences)]
    since = "What was bounded in each run, on how many particles at most, and since when"
    return [text, _folded("Every run", Table(shown), len(shown)), Fold(since, [listed(lines)])]


def _cell(value: object) -> object:
    """Words from data as text; numbers as they are."""
    return plain(value) if isinstance(value, str) else value


def _folded(head: str, table: Table, rows: int) -> Block:
    return Fold(head, [table]) if rows > MOST_LISTED else table


def _bounds(config: Config) -> str:
    with opened(config) as dataset:
        if not set(BOUNDED) <= set(dataset):
            return "not recorded"
        return "; ".join(map(plain, bounded(dataset))) or "nothing"


def _cost(table: pd.DataFrame, evidences: Sequence[Evidence]) -> list[Block]:
    """Core-hours and the longest run, in all and by experiment."""
    if table.empty:
        return ["No run has a result."]
    rows = [_cost_of(plain(e.experiment.title), e.table, len(e.configs)) for e in evidences]
    rows.append(_cost_of("all together, shared runs once", table, len(_distinct(evidences))))
    return [Table(pd.DataFrame(rows))]


def _cost_of(name: str, table: pd.DataFrame, asked: int) -> dict[str, str]:
    seconds = table["seconds"] if len(table) else pd.Series([0.0])
    frame = table["seconds_per_frame"].mean() if "seconds_per_frame" in table else float("nan")
    return {
        "runs of": name,
        "done": f"{len(table)} of {asked}",
        "core-hours": f"{seconds.sum() / 3600:.3f}",
        "longest [s]": f"{seconds.max():.0f}",
        "mean a frame [s]": "-" if frame != frame else f"{frame:.3f}",
    }


def _environment(evidences: Sequence[Evidence]) -> list[Block]:
    """With which versions, code and machine the runs were made."""
    made: dict[tuple[str, ...], int] = {}
    for config in _done(evidences):
        maker = made_by(config)
        made[maker] = made.get(maker, 0) + 1
    rows = [[count, *map(plain, maker)] for maker, count in sorted(made.items())]
    return [Table(pd.DataFrame(rows, columns=["runs", "versions", "code", "machine"]))]


def _list_of_runs(evidence: Evidence, folder: Path, all_of_them: Sequence[Evidence]) -> Section:
    """Each run with its settings, numbers and folder in the store, and all settings of the first."""
    first = runs.plain(evidence.configs[0])
    rows = [_row(config, evidence, folder) for config in in_paper_order(evidence.configs)]
    frame = pd.DataFrame(rows).dropna(axis=1, how="all")
    table = Table(frame.astype(object).fillna("-"), data=os.path.join(evidence.seen_from(folder), "summary.csv"))
    settings = yaml.safe_dump(first, sort_keys=False, allow_unicode=True).rstrip()
    blocks: list[Block] = [
        _folded(f"All {len(frame)} runs", table, len(frame)),
        Fold("All settings of the first run; the others differ in what the table says", [f"```yaml\n{settings}\n```"]),
    ]
    namesakes = [other for other in all_of_them if other.experiment.title == evidence.experiment.title]
    which = f" ({plain(evidence.folder.name).upper()})" if len(namesakes) > 1 else ""  # two sides of a comparison
    return Section(runs_anchor(evidence), f"Runs of {plain(evidence.experiment.title)}{which}", blocks)


def runs_anchor(evidence: Evidence) -> str:
    """Where a report lists the runs of an experiment."""
    return f"runs-{evidence.folder.name}"


def _row(config: Config, evidence: Evidence, folder: Path) -> dict[str, object]:
    """One run in the list."""
    name = runs.identify(config)
    row: dict[str, object] = {
        "run": _link(name, config, folder) if evidence.is_done(config) else f"**missing** {name}",
        "shape": plain(config.shape.name),
        "floor": plain(config.floor.name),
        "pressure": f"{config.pressure:g}",
        "sintering": plain(config.sintering.name),
        "seed": config.seed,
        "other settings": plain("; ".join(_changes(config, evidence))) or None,
    }
    numbers = evidence.row(name)
    return row | {head: numbers.get(column) for column, head in MEASURED.items()}


def _changes(config: Config, evidence: Evidence) -> list[str]:
    """What else a run has otherwise than the first of its experiment, "key before -> now"."""
    return [d for d in evidence.changes(config) if not d.startswith(SETTINGS_TOLD)]


def _link(name: str, config: Config, folder: Path) -> str:
    """The run's id, with links to its result and manifest where both places are known from here alone."""
    if Path(config.store).is_absolute() or folder.is_absolute():
        return name
    way = os.path.relpath(runs.run_dir(config), folder)
    return f"{name} ([run.nc]({way}/run.nc), [manifest]({way}/manifest.json))"
