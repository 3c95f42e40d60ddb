"""``animate``: which runs are meant, and how far the drawing is."""

import argparse
import shlex
from collections.abc import Sequence
from pathlib import Path

from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from ..composition import config_of
from ..config import Config
from ..errors import ConfigError, ExitCode
from ..report.animation import Settings, Shown, animate
from ..store import runs, states
from ..store.files import require_writable
from ..sweep import record
from ..sweep.explain import config_of_run
from ..sweep.plan import split_store
from .screen import console
from .sweeps import asked_for


def animate_command(options: argparse.Namespace) -> ExitCode:
    """Write a moving picture of one run, or of several side by side."""
    shown = _asked_runs(options.overrides, options.store)
    settings = Settings(options.by, options.fps, options.speed, options.start, options.width)
    require_writable(options.out.parent)
    columns = (TextColumn("picture {task.completed:.0f}/{task.total:.0f}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("draw")
        animate(shown, settings, options.out, lambda done, count: bar.update(task, completed=done, total=count))
    print(options.out)
    return ExitCode.FINE


def _asked_runs(words: Sequence[str], store: str) -> list[Shown]:
    """The runs that words name, each once: ids, files and sweeps, or overrides.

    Raises ConfigError where a word names nothing, or no run of all has a result.
    """
    store, words = split_store(words, store)
    sweeps = record.names(store)
    if any("=" in word and word not in sweeps and not Path(word).exists() for word in words):
        shown = [_standing(config) for config in _planned(words, store, sweeps)]
    else:
        shown = [run for word in words for run in _named(word, store, sweeps)]
    if not any(run.path for run in shown):
        raise ConfigError(_how_to_make(shown, words, sweeps))
    return list({(runs.identify(run.config), run.path): run for run in shown}.values())


def _planned(words: Sequence[str], store: str, sweeps: Sequence[str]) -> Sequence[Config]:
    """The runs that overrides ask for, or a remembered sweep with further overrides."""
    if words[0] in sweeps:
        return record.plan_of(words[0], store, words[1:]).configs
    plan = asked_for([*words, record.store_override(store)], multirun=True)
    if not plan.needs_runs:
        raise ConfigError(f"experiment '{plan.configs[0].experiment.name}' has no runs to show")
    return plan.configs


def _named(word: str, store: str, sweeps: Sequence[str]) -> list[Shown]:
    """The run of a file or an id, or the runs of a sweep."""
    if word in sweeps:
        return [_standing(config) for config in record.plan_of(word, store).configs]
    if not Path(word).exists():
        return [_standing(config_of_run(word, store))]
    with runs.open_run(word) as dataset:
        return [Shown(config_of(dataset), Path(dataset.encoding["source"]))]


def _standing(config: Config) -> Shown:
    """A run of the store with its result, or the reason why it has none."""
    found = states.standing(config)
    if found.state == states.DONE:
        return Shown(config, runs.result_path(config))
    return Shown(config, None, found.reason if found.state == states.PENDING else f"{found.state}: {found.reason}")


def _how_to_make(shown: Sequence[Shown], words: Sequence[str], sweeps: Sequence[str]) -> str:
    """That nothing is there, why, and what makes it."""
    first = runs.identify(shown[0].config)
    if len(shown) == 1 and "=" not in words[0]:
        return f"run {first} has no result ({shown[0].reason}); 'snowrepro explain {first}' says more"
    there = f"none of the {len(shown)} runs has a result (of {first}: {shown[0].reason})"
    again = words if words[0] not in sweeps else [*record.read(words[0], shown[0].config.store).overrides, *words[1:]]
    return f"{there}; this makes them: snowrepro run {'-m ' * (len(shown) > 1)}{shlex.join(again)}"
