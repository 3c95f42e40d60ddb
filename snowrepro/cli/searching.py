"""Searches over the store: which runs are asked for next, running them, and what was found."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..composition.hydra_private import is_range
from ..errors import ConfigError, RunsFailed
from ..evidence.search import Search, ask_next, read_answer
from ..store.run import Run
from ..summary.row import ALL_COLUMNS, read_row
from ..sweep import record
from ..sweep.factors import Factor, read_factor
from ..sweep.plan import Plan, make_plan, parse_overrides, split_seeds, with_seeds
from ..text import offer_names
from .scenes import build_scenes
from .screen import show
from .sweeping import describe_sweep, run_missing, write_table


@dataclass
class _Cell:
    """One search: the overrides that tell it from the others, and the measure by value as far as it is known."""

    words: list[str]
    known: dict[float, float] = field(default_factory=dict)

    def plan(self, search: Search, values: Sequence[float]) -> Plan:
        """Plan the runs of some values."""
        return make_plan([*self.words, f"{search.factor.key}={','.join(map(repr, values))}"], multirun=True)


def require_numbers(measure: str) -> None:
    """Raise ConfigError where a measure is no column of numbers, with the name that is probably meant."""
    numbers = [name for name, column in ALL_COLUMNS.items() if not column.is_text]
    if measure not in numbers:
        raise ConfigError(f"measure: '{measure}' is no column of numbers; {offer_names(measure, numbers)}")


def split_range(overrides: Sequence[str]) -> tuple[Factor, list[str]]:
    """Split the one range from the other overrides, in which seeds=N is written out.  Raises ConfigError."""
    seeds, words = split_seeds(overrides)
    ranges = [each for each in parse_overrides(words) if is_range(each)]
    if len(ranges) != 1:
        given = ", ".join(str(each.input_line) for each in ranges) or "none"
        raise ConfigError(f"a search goes along one range, as in 'pressure=log(200,6000)' (got {given})")
    others = [word for word in words if word != str(ranges[0].input_line)]
    key = ranges[0].get_key_element()
    if fixed := [word for word in others if word.lstrip("+").partition("=")[0] == key]:
        raise ConfigError(f"a search goes along '{key}', so leave out '{fixed[0]}'")
    return read_factor(ranges[0]), with_seeds(others, seeds) if seeds else others


def run_searches(search: Search, measure: str, words: Sequence[str]) -> None:
    """Run all searches that overrides without the range name, round by round; print what each found.

    Raises RunsFailed at the end if a value has no result.
    """
    cells = _list_cells(search, words)
    while asked := [(cell, values) for cell in cells if (values := ask_next(search, cell.known))]:
        plans = [cell.plan(search, values) for cell, values in asked]
        _run(plans, words)
        for (cell, values), plan in zip(asked, plans, strict=True):
            for value in values:
                runs = [each.run for each in plan.planned if _read_value(each.overrides, search) == value]
                cell.known[value] = _measure(runs, measure)
    for cell in cells:
        _print_answer(search, measure, cell)
    without = sum(math.isnan(each) for cell in cells for each in cell.known.values())
    if without:
        raise RunsFailed(
            f"{without} values have no result: a run failed (see 'snowrepro status' of the sweeps above), or runs have "
            f"no '{measure}'"
        )


def _list_cells(search: Search, words: Sequence[str]) -> list[_Cell]:
    """List the searches: one for each combination of what else is listed, but for seeds."""
    whole = make_plan([*words, f"{search.factor.key}={search.factor.place(0.0)!r}"], multirun=True)
    left = [word for word in words if word.startswith(("hydra", "seed="))]  # of all cells
    own = (f"{search.factor.key}=", "seed=")
    cells = [tuple(text for text in planned.overrides if not text.startswith(own)) for planned in whole.planned]
    return [_Cell([*cell, *left]) for cell in dict.fromkeys(cells)]


def _run(plans: Sequence[Plan], words: Sequence[str]) -> None:
    """Run what is not done of several plans at once.  Raises ConfigError, RunsFailed, StoreError."""
    together = Plan(tuple(planned for plan in plans for planned in plan.planned), True, tuple(words))
    build_scenes(together)
    if not all(run.is_done() for run in together.runs):
        run_missing(together, is_whole=False)


def _read_value(overrides: Sequence[str], search: Search) -> float:
    """Read the value of the setting that is searched from the overrides of a run."""
    return next(float(text.partition("=")[2]) for text in overrides if text.startswith(f"{search.factor.key}="))


def _measure(runs: Sequence[Run], measure: str) -> float:
    """Measure runs that differ in their seeds alone: their mean; NaN if one has no result."""
    if not all(run.is_done() for run in runs):
        return math.nan
    return float(np.mean([float(read_row(run).get(measure, math.nan)) for run in runs]))


def _print_answer(search: Search, measure: str, cell: _Cell) -> None:
    """Print what a search found, and remember its runs as a sweep."""
    plan = cell.plan(search, sorted(cell.known))
    record.write_record(plan)
    write_table(plan)
    answer, case = read_answer(search, cell.known), plan.runs[0].case
    key, target = search.factor.key, search.target if isinstance(search.target, str) else f"{search.target:g}"
    bracket = f"between {answer.low:.6g} and {answer.high:.6g}"
    if math.isnan(answer.value):
        found = ": nothing found"
    elif answer.value in cell.known:
        found = f" at {key} {answer.value:.6g}, {bracket}"
    else:
        found = f" {bracket} of {key}, by a straight line at {answer.value:.4g}"
    show(
        f"{case.shape.name} on {case.floor.name}, {case.sintering.name}: {measure} {target}{found}; "
        f"{len(cell.known)} values{'; ' * bool(answer.note)}{answer.note}"
    )
    show(*describe_sweep(plan))
