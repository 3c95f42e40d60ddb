"""``snowrepro animate``: an mp4 or gif of a run, or of several side by side."""

import argparse
import shlex
from collections.abc import Sequence
from pathlib import Path

from ...composition import compose, overrides
from ...errors import ConfigError, ExitCode
from ...report.figures import kinds
from ...report.film import animation
from ...store import files, find
from ...store import run as store_run
from ...sweep import explain, record
from ...sweep import plan as sweep_plan
from .. import candidates, plans, progress, screen
from ..arguments import add_folders, complete_by

HELP = """\
A run is the id of one (or its beginning or end), a run's file, or a remembered sweep by its name, or that of its
experiment; or overrides as for 'snowrepro run' name all runs.  Several are shown in a grid, in step by time; each panel
says what its run differs in, and one whose run has no result says why.

  snow        as the paper draws it
  fragment    each lump in a colour, crushed snow dark, loose snow sand, and the part of the mass in each
  density     density of Eq. 2
  J_P         plastic volume ratio
  damage      part of each particle's bonds that broke

examples:
  snowrepro animate ball-L-740-paper-paper-0-5ae7c16ddc
  snowrepro animate 2f63b27e3e --by damage --speed 0.25 --from 250 --out impact.gif
  snowrepro animate experiment=fig5 --out fig5.mp4
  snowrepro animate experiment=grid pressure=5900 sintering=paper --fps 8 --width 1600
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which runs, how they look, and where the film goes."""
    overrides = parser.add_argument("overrides", nargs="+", metavar="run", help="see below")
    complete_by(
        overrides,
        candidates.any_of(
            candidates.list_sweeps, candidates.list_overrides, candidates.list_runs, otherwise=candidates.list_files
        ),
    )
    parser.add_argument(
        "--out", type=Path, default=Path("animation.mp4"), metavar="FILE", help=".mp4 or .gif (default: %(default)s)"
    )
    parser.add_argument(
        "--by",
        choices=("snow", "fragment", "density", "J_P", "damage"),
        help="what colours show (default: fragment, and of one run beside it the snow)",
    )
    parser.add_argument("--speed", type=float, default=1.0, help="default: 1, as fast as the snow moved")
    parser.add_argument("--fps", type=float, help="pictures a second; default: every stored state once, at most 25")
    parser.add_argument(
        "--from", type=int, dest="start", metavar="FRAME", help="to begin with; default: late in the pressing"
    )
    parser.add_argument("--width", type=int, default=1080, metavar="PIXELS", help="default: %(default)s")
    add_folders(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Write a moving picture of one run, or of several side by side."""
    shown = _find_shown(options.overrides)
    settings = animation.AnimationSettings(options.by, options.fps, options.speed, options.start, options.width)
    files.require_writable(options.out.parent)
    with progress.build_bar("picture") as bar:
        task = bar.add_task("draw")
        animation.animate(
            shown, settings, options.out, lambda done, count: bar.update(task, completed=done, total=count)
        )
    screen.show(options.out)
    return ExitCode.FINE


def _find_shown(words: Sequence[str]) -> "list[animation.AnimatedRun]":
    """The runs that words name, each once: ids, files and sweeps, or overrides.

    Raises ConfigError where a word names nothing, or no run of all has a result.
    """
    store, words = sweep_plan.split_store(words)
    sweeps = record.list_sweeps(store)
    if any("=" in word and word not in sweeps and not Path(word).exists() for word in words):
        words[0] = record.find_sweep(words[0], store, words[1:]) or words[0]
        shown = [animation.look_up_run(run) for run in _plan_runs(words, store, sweeps)]
    else:
        words = [record.find_sweep(word, store) or word for word in words]
        shown = [each for word in words for each in _show_name(word, store, sweeps)]
    if not any(each.result for each in shown):
        raise ConfigError(_explain_nothing(shown, words, sweeps))
    return list({(each.run.id, each.result): each for each in shown}.values())


def _plan_runs(words: Sequence[str], store: str, sweeps: Sequence[str]) -> "Sequence[store_run.Run]":
    """The runs that overrides ask for, or a remembered sweep with further overrides."""
    if words[0] in sweeps:
        return record.plan_remembered(words[0], store, words[1:]).runs
    plan = plans.plan_overrides([*words, overrides.override_folder("store", store)], multirun=True)
    if plan.experiment and not kinds.needs_runs(plan.runs):
        raise ConfigError(f"experiment '{plan.experiment.name}' has no runs to show")
    return plan.runs


def _show_name(word: str, store: str, sweeps: Sequence[str]) -> "list[animation.AnimatedRun]":
    """The run of a file or an id, or the runs of a sweep."""
    if word in sweeps:
        return [animation.look_up_run(run) for run in record.plan_remembered(word, store).runs]
    if not Path(word).exists():
        return [animation.look_up_run(explain.run_named(word, store, or_sweep=True))]
    with find.open_run(word) as dataset:
        return [animation.AnimatedRun(store_run.Run(compose.config_of(dataset)), Path(dataset.encoding["source"]))]


def _explain_nothing(shown: "Sequence[animation.AnimatedRun]", words: Sequence[str], sweeps: Sequence[str]) -> str:
    """A line that says that no run has a result, why, and what makes it."""
    first = shown[0].run.id
    if len(shown) == 1 and "=" not in words[0]:
        return f"run {first} has no result ({shown[0].reason}); 'snowrepro explain {first}' says more"
    problem = f"none of the {len(shown)} runs has a result (of {first}: {shown[0].reason})"
    again = (
        words
        if words[0] not in sweeps
        else record.merge_overrides(record.read_record(words[0], shown[0].run.store).usable_overrides(), words[1:])
    )
    return f"{problem}; this makes them: snowrepro run {'-m ' * (len(shown) > 1)}{shlex.join(again)}"
