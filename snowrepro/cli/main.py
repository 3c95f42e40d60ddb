"""Entry point: the commands, what they take, and how each ends."""

import argparse
import importlib
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from ..errors import ExitCode, SnowreproError

DEFAULT_SEEDS = 3  # of claims
EXITS = "exit codes: 0 fine, 2 bad input (config, folder), 3 runs failed, 130 interrupted"
CHECK_HELP = """\
Does the program still give what it gave, and what it promises?

  tier 0  invariances: same bits twice, after a restart, mirrored, in other units, ...; needs no reference
  tier 1  fingerprints: the bits of short runs; other bits, or a platform without a fingerprint, go on to tier 2
  tier 2  short horizon: the same numbers, within what rounding was measured to do
  tier 3  ensemble: Figures 5 and 6, coarse, several seeds, pair by pair beside the reference's
  tier 4  the paper's claims: the same verdicts

Writes check.json, check.xml (JUnit) and check.md (for a pull request).  What was computed is kept: stopped, the same
command goes on.

examples:
  snowrepro check                       all tiers, at a size for continuous integration
  snowrepro check --tier 0,1,2          a minute or two
  snowrepro check --full                more seeds, and Figure 5 at the paper's fidelity
  snowrepro check --mutants             do the tiers notice defects, and leave harmless changes alone?

exit codes: 0 fine, 1 regressed or contradicted, 2 bad input, 3 runs failed, 4 incomplete or nothing measured,
130 interrupted
"""
BLESS_HELP = f"""\
Makes the references of 'snowrepro check' anew with this code, shows what changes, and keeps a log of it.  Refuses code
that differs from the clone's last commit.

examples:
  snowrepro bless --reason "Eq. 9 weighs an update by its time, see the log of that commit"
  snowrepro bless --tier 1 --reason "fingerprints of macOS on arm64"

{EXITS}
"""
RUN_HELP = f"""\
A run or sweep that was stopped in whatever way goes on where it was; what is done is not done again.  Several
calls at once, on one machine or many, share the work.  seeds=N is short for seed=0,..,N-1.

examples:
  snowrepro run shape=ball floor=L pressure=2000 sintering=paper fidelity=preview
  snowrepro run -m pressure=500,2000 sintering=paper,none
  snowrepro run experiment=fig5
  snowrepro run experiment=grid hydra.launcher.workers=4 hydra.launcher.time_limit_minutes=30
  snowrepro run experiment=grid hydra/launcher=ray
  snowrepro run experiment=grid rerun=[code]       again, what was made by other code

{EXITS}
"""
PLAN_HELP = """\
Says without running anything what 'snowrepro run' with the same words would run, why, and how long it would take.

examples:
  snowrepro plan experiment=grid seeds=3
  snowrepro plan experiment=grid rerun=[code,environment] --list
  snowrepro plan experiment=grid --sbatch grid.sh     a job array for Slurm; then: sbatch grid.sh
"""
STATUS_HELP = """\
Without a name: every sweep that the store remembers.

examples:
  snowrepro status
  snowrepro status grid
  snowrepro status experiment=grid fidelity=preview store=/shared/runs
"""
RETRY_HELP = f"""\
A run that diverged is not run again by itself, as it would diverge again.  This runs what failed or took too long.

examples:
  snowrepro retry grid
  snowrepro retry grid hydra.launcher.time_limit_minutes=60
  snowrepro retry ball-L-530-paper-paper-0-2f63b27e3e

{EXITS}
"""
DIFF_HELP = """\
What differs between two runs, or two sweeps cell by cell: configuration, code, environment, results.

examples:
  snowrepro diff ball-L-530-paper-paper-0-2f63b27e3e ball-L-530-paper-paper-1-0b9a8e9d2c
  snowrepro diff fig5 fig5,fidelity=preview
"""
REDO_HELP = """\
RUN is the id of one in the store (or its beginning or end), its folder, or its manifest.json alone, which says all that
is needed.  The run is simulated again into a store of its own, by this program; called again, it goes on where it was
stopped, and does not repeat what is redone unless the code or the environment has changed.  It is compared with run.nc
where that is beside the manifest, and with the checksums of the arrays in the manifest.

examples:
  snowrepro redo 2f63b27e3e
  snowrepro redo manifest.json
  snowrepro redo /shared/runs/ball-L-530-paper-paper-0-2f63b27e3e --into elsewhere

exit codes: 0 the same bits, 1 not the same bits, 2 bad input (no such run, broken manifest), 3 the run failed,
4 redone, but nothing to compare with, 130 interrupted
"""
CLEAN_HELP = """\
Shows what could go and how much room it takes; asks before it removes what is named (scraps if nothing is).

  scraps        what killed processes left behind of runs that are done, and the trash
  failed        records and last good states of runs that failed
  unfinished    checkpoints of runs that were stopped
  broken        results that are not as they were written
  unused        results that no remembered sweep asks for
  launchers     logs and scripts of Hydra's launchers
"""
REPORT_HELP = f"""\
Runs nothing.  Writes index.html, one file that needs nothing beside it, with index.md and report.json, into
reports/paper/ or reports/<name of the sweep>/, with every seed that the sweep was asked for with.

examples:
  snowrepro report                         the whole paper
  snowrepro report fidelity=preview        the same from coarse runs
  snowrepro report fig5
  snowrepro report fig5 seeds=3 store=/shared/runs
  snowrepro report fig5 --against fig5,reading=si           two sweeps side by side, differences first
  snowrepro report fig5 --against fig5 --against-store ../before/runs      two versions

{EXITS}
"""
CRATE_HELP = f"""\
Copies the runs with their manifests and logs, the tables of the sweep and its report, as it stands, into a folder of
their own, with ro-crate-metadata.json (Process Run Crate 0.5): which run made which file, when, with what, and which
failed.  Under which licence and by whom is not known to the store: state it.  snowrepro reads the folder's runs/.

examples:
  snowrepro crate fig5 --license CC-BY-4.0
  snowrepro crate fig5 --agent "Ada Snow" --orcid 0000-0002-1825-0097 --out upload/fig5
  snowrepro crate 2f63b27e3e                one run

{EXITS}
"""
CLASSIFY_HELP = """\
A file needs 'position' (time, particle, axis), or 'x' and 'y' (time, particle); it may have 'mass', 'velocity', a
coordinate of frame numbers, and the attributes release_frame, grid_spacing and cell_mass.  A particle that is NaN
from some frame to the last has vanished.

examples:
  snowrepro classify ball-L-530-paper-paper-0-2f63b27e3e
  snowrepro classify other.nc --release 40 definition=proximity --frames all --out fragments
"""
ANIMATE_HELP = """\
A run is the id of one (or its beginning or end), a run's file, or the name of a remembered sweep; or overrides as for
'snowrepro run' name all runs.  Several are shown in a grid, in step by time; each panel says what its run differs in,
and one whose run has no result says why.

  snow        as the paper draws it
  fragment    lumps in colours, powder in grey, and the part of the mass in lumps
  density     density of Eq. 2
  J_P         plastic volume ratio
  damage      part of each particle's bonds that broke

examples:
  snowrepro animate ball-L-530-paper-paper-0-2f63b27e3e
  snowrepro animate 2f63b27e3e --by damage --speed 0.25 --from 250 --out impact.gif
  snowrepro animate experiment=fig5 --out fig5.mp4
  snowrepro animate experiment=grid pressure=3300 sintering=paper --fps 8 --width 1600
"""
CLAIMS_HELP = f"""\
Runs the experiment with the seeds 0 to N - 1, as far as it is not done, and judges the paper's claims by the
rules of conf/claims: a table here; pictures, claims.json and claims.csv in reports/<experiment>/claims/.

examples:
  snowrepro claims experiment=fig5
  snowrepro claims experiment=grid seeds=5 fidelity=preview

{EXITS.replace("fine,", "fine, whatever the verdicts,")}
"""


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point; exits with an ``ExitCode``."""
    parser = _parser()
    options, more = parser.parse_known_args(arguments)
    if more and ("overrides" not in options or any(text.startswith("-") for text in more)):
        parser.error(f"unrecognized arguments: {' '.join(more)}")
    if more:
        options.overrides += more  # argparse stops at an option between overrides
    from .screen import say  # rich and what the commands need are not loaded to show a help

    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a batch system's end is as orderly as Ctrl-C
    try:
        code = options.command(options)
        sys.stdout.flush()
    except BrokenPipeError:  # whoever read, has read enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = ExitCode.FINE
    except KeyboardInterrupt:
        say("interrupted; what was finished is kept, the same command goes on from there")
        code = ExitCode.INTERRUPTED
    except SnowreproError as error:
        say(f"error: {error}")
        code = error.exit_code
    sys.exit(int(code))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="snowrepro", description='Reproduce "Snow Simulation Considering Pressure Sintering".'
    )
    commands = parser.add_subparsers(required=True, metavar="command")
    for add in (_add_sweeps, _add_reports, _add_checks, _add_stored, _add_looking):
        add(commands)
    return parser


def _add(
    commands: argparse._SubParsersAction, name: str, function: str, text: str, more: str = ""
) -> argparse.ArgumentParser:
    """A command with its help and what follows it; ``function`` is "module.name" in this package."""
    module, called = function.split(".")
    command = commands.add_parser(
        name, help=text, description=text, epilog=more, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    command.set_defaults(
        command=lambda options: getattr(importlib.import_module(f".{module}", __package__), called)(options)
    )
    return command


def _add_sweeps(commands: argparse._SubParsersAction) -> None:
    """Commands on what is to be run."""
    overrides = "Hydra overrides; 'snowrepro config' shows what there is"
    several = "the overrides name several runs"
    sweep = "name of a remembered sweep, or the overrides that make one"

    run = _add(commands, "run", "sweeps.run_command", "simulate one run, a sweep or an experiment", RUN_HELP)
    run.add_argument("-m", "--multirun", action="store_true", help=several)
    run.add_argument(
        "--part", metavar="I/N", help="only every N-th run from the I-th on, and no report: for job arrays"
    )
    run.add_argument("overrides", nargs="*", help=overrides)

    claims = _add(
        commands, "claims", "sweeps.claims_command", "decide the paper's claims by an experiment with several seeds",
        CLAIMS_HELP,
    )  # fmt: skip
    claims.add_argument(
        "overrides", nargs="*", help=f"experiment=..., seeds=N (default: {DEFAULT_SEEDS}) and other overrides"
    )
    claims.set_defaults(default_seeds=DEFAULT_SEEDS)

    plan = _add(commands, "plan", "sweeps.plan_command", "say what would be run, why, and how long it takes", PLAN_HELP)
    plan.add_argument("-m", "--multirun", action="store_true", help=several)
    plan.add_argument("--list", action="store_true", help="every run with its reason")
    plan.add_argument("--verify", action="store_true", help="read all results, and not just their sizes and times")
    plan.add_argument("--sbatch", type=Path, metavar="FILE", help="write a job array for Slurm")
    plan.add_argument(
        "--tasks", type=int, default=1000, metavar="N", help="of the array, at most (default: %(default)s)"
    )
    plan.add_argument("overrides", nargs="*", help=sweep)

    status = _add(commands, "status", "sweeps.status_command", "how far sweeps are", STATUS_HELP)
    status.add_argument("-m", "--multirun", action="store_true", help=several)
    status.add_argument("--list", action="store_true", help="every run with its state")
    status.add_argument("--verify", action="store_true", help="read all results, and not just their sizes and times")
    status.add_argument("overrides", nargs="*", help=sweep)

    retry = _add(commands, "retry", "sweeps.retry_command", "run again what failed", RETRY_HELP)
    retry.add_argument("-m", "--multirun", action="store_true", help=several)
    retry.add_argument("overrides", nargs="+", help=f"id of a run, {sweep}; and settings of the launcher")


def _add_reports(commands: argparse._SubParsersAction) -> None:
    """What is told of runs that are there."""
    report = _add(
        commands, "report", "reports.report_command", "one page with verdicts, pictures and data, from the store alone",
        REPORT_HELP,
    )  # fmt: skip
    report.add_argument("--against", metavar="B", help="a second experiment or sweep, to set beside the first")
    report.add_argument("--against-store", metavar="FOLDER", help="where the runs of B are (default: the same store)")
    report.add_argument(
        "overrides", nargs="*", help="experiment or name of a remembered sweep (default: the paper); overrides"
    )

    crate = _add(
        commands, "crate", "reports.crate_command", "a folder to publish: a sweep's files, and how each was made",
        CRATE_HELP,
    )  # fmt: skip
    crate.add_argument("sweep", metavar="SWEEP", help="name of a remembered sweep, or id of a run")
    crate.add_argument("--out", type=Path, metavar="FOLDER", help="a new one (default: <SWEEP>-crate)")
    crate.add_argument("--license", metavar="ID", help="of what is published: an SPDX identifier or a URL")
    crate.add_argument("--agent", metavar="NAME", help="who made the runs")
    crate.add_argument("--orcid", metavar="ID", help="of whoever that is")
    _add_store(crate)


def _add_checks(commands: argparse._SubParsersAction) -> None:
    """Commands on whether results are what they were."""
    check = _add(commands, "check", "checks.check_command", "are results what they were, and as promised?", CHECK_HELP)
    check.add_argument("--full", action="store_true", help="more seeds, and Figure 5 at the paper's fidelity")
    check.add_argument(
        "--mutants",
        action="store_true",
        help="show deliberate defects and harmless changes of the program to the tiers",
    )
    check.add_argument(
        "--out", type=Path, metavar="FOLDER",
        help="of the files that are written (default: reports/check, of --mutants reports/mutants)",
    )  # fmt: skip
    _add_asked(check)

    bless = _add(commands, "bless", "checks.bless_command", "renew the references of check", BLESS_HELP)
    bless.add_argument("--reason", metavar="TEXT", help="why they change; goes into the log")
    bless.add_argument("--full", action="store_true", help="also what only a full check compares with")
    _add_asked(bless)


def _add_asked(command: argparse.ArgumentParser) -> None:
    """What ``check`` looks at, and ``bless`` renews."""
    command.add_argument("--tier", action="append", metavar="N", help="only these tiers, such as 0,1 (default: all)")
    command.add_argument(
        "--only", action="append", metavar="NAME", help="a short run of tiers 1 and 2, or a figure of tiers 3 and 4"
    )
    command.add_argument("--workers", type=int, default=0, metavar="N", help="processes at a time (default: all cores)")
    command.add_argument(
        "--baseline", type=Path, default=Path("reports/baseline"), metavar="FOLDER",
        help="that keeps the references (default: %(default)s)",
    )  # fmt: skip
    command.add_argument(
        "--store", default="check-runs", metavar="FOLDER", help="that keeps the runs (default: %(default)s)"
    )


def _add_stored(commands: argparse._SubParsersAction) -> None:
    """Commands on what the store holds."""
    explain = _add(
        commands, "explain", "stored.explain_command", "why a run is done, stale, failed or not run; its log"
    )
    explain.add_argument("run", help="id of a run, or its beginning or end")
    _add_store(explain)

    diff = _add(commands, "diff", "stored.diff_command", "what differs between two runs or two sweeps", DIFF_HELP)
    diff.add_argument("a", metavar="A", help="id or path of a run, or name of a sweep")
    diff.add_argument("b", metavar="B", help="likewise")
    _add_store(diff)

    redo = _add(commands, "redo", "stored.redo_command", "do a run again from its manifest: same bits?", REDO_HELP)
    redo.add_argument("run", metavar="RUN", help="id or folder of a run, or a manifest")
    redo.add_argument(
        "--into", default="redone", metavar="FOLDER", help="store of the redone run (default: %(default)s)"
    )
    _add_store(redo)

    clean = _add(commands, "clean", "stored.clean_command", "remove what is not needed from the store", CLEAN_HELP)
    clean.add_argument("kinds", nargs="*", metavar="kind", help="see below")
    clean.add_argument("--yes", action="store_true", help="do not ask")
    _add_store(clean)


def _add_looking(commands: argparse._SubParsersAction) -> None:
    """Commands on one run or configuration."""
    show = _add(commands, "config", "looking.config_command", "print the configuration that the overrides give")
    show.add_argument("overrides", nargs="*")

    classify = _add(
        commands, "classify", "looking.classify_command", "lumps and powder of a run, or of any particles over time",
        CLASSIFY_HELP,
    )  # fmt: skip
    classify.add_argument("data", help="id of a run in the store, or a NetCDF file")
    classify.add_argument("overrides", nargs="*", metavar="setting=value", help="of the analysis: conf/analysis")
    _add_store(classify)
    classify.add_argument("--release", type=int, metavar="FRAME", help="when bonds are laid, if the file does not say")
    classify.add_argument("--grid-spacing", type=float, metavar="LENGTH", help="likewise; default: from the particles")
    classify.add_argument("--frames", choices=("last", "all"), default="last", help="of which fragments are wanted")
    classify.add_argument("--out", type=Path, metavar="FOLDER", help="write fragments.csv, fragments.nc, measures.json")

    animate = _add(
        commands, "animate", "animate.animate_command", "an mp4 or gif of a run, or of several side by side",
        ANIMATE_HELP,
    )  # fmt: skip
    animate.add_argument("overrides", nargs="+", metavar="run", help="see below")
    animate.add_argument(
        "--out", type=Path, default=Path("animation.mp4"), metavar="FILE", help=".mp4 or .gif (default: %(default)s)"
    )
    animate.add_argument(
        "--by",
        choices=("snow", "fragment", "density", "J_P", "damage"),
        help="what colours show (default: fragment, and of one run beside it the snow)",
    )
    animate.add_argument("--speed", type=float, default=1.0, help="default: 1, as fast as the snow moved")
    animate.add_argument("--fps", type=float, help="pictures a second; default: every stored state once, at most 25")
    animate.add_argument(
        "--from", type=int, dest="start", metavar="FRAME", help="to begin with; default: late in the pressing"
    )
    animate.add_argument("--width", type=int, default=1080, metavar="PIXELS", help="default: %(default)s")
    _add_store(animate)


def _add_store(command: argparse.ArgumentParser) -> None:
    command.add_argument("--store", default="runs", help="folder that keeps the runs (default: %(default)s)")
