"""The command line: ``snowrepro run``, ``claims``, ``config`` and ``classify``."""

import argparse
import contextlib
import logging
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from .composition import CONF_DIR, compose_raw, config_of, own_options
from .config import Config
from .errors import ConfigError, ExitCode, RunsFailed, SnowreproError
from .sweep.plan import Plan, make_claims_plan, make_plan

console = Console(stderr=True, highlight=False)

RUN_HELP = """\
examples:
  snowrepro run shape=ball floor=L pressure=2000 sintering=paper fidelity=preview
  snowrepro run -m pressure=500,2000 sintering=paper,none
  snowrepro run experiment=fig5

exit codes: 0 fine, 2 bad input (config, folder), 3 runs failed, 130 interrupted
"""


CLASSIFY_HELP = """\
A file needs 'position' (time, particle, axis), or 'x' and 'y' (time, particle); it may have 'mass', 'velocity', a
coordinate of frame numbers, and the attributes release_frame, grid_spacing and cell_mass.  A particle that is NaN
from some frame to the last has vanished.

examples:
  snowrepro classify ball-L-530-paper-paper-0-2f63b27e3e
  snowrepro classify other.nc --release 40 definition=proximity --frames all --out fragments
"""
CLAIMS_HELP = """\
Runs the experiment with the seeds 0 to N - 1, as far as it is not done, and judges the paper's claims by the
rules of conf/claims: a table here; pictures, claims.json and claims.csv in reports/<experiment>/claims/.

examples:
  snowrepro claims experiment=fig5
  snowrepro claims experiment=grid seeds=5 fidelity=preview

exit codes: 0 fine, whatever the verdicts, 2 bad input (config, folder), 3 runs failed, 130 interrupted
"""
DEFAULT_SEEDS = 3


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point; exits with an ``ExitCode``."""
    parser = _parser()
    options, more = parser.parse_known_args(arguments)
    if more and ("overrides" not in options or any(text.startswith("-") for text in more)):
        parser.error(f"unrecognized arguments: {' '.join(more)}")
    if more:
        options.overrides += more  # argparse stops at an option between overrides
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a batch system's end is as orderly as Ctrl-C
    try:
        code = options.command(options)
        sys.stdout.flush()
    except BrokenPipeError:  # whoever read, has read enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = ExitCode.FINE
    except KeyboardInterrupt:
        _say("interrupted; what was finished is kept, the same command goes on from there")
        code = ExitCode.INTERRUPTED
    except SnowreproError as error:
        _say(f"error: {error}")
        code = error.exit_code
    sys.exit(int(code))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="snowrepro", description='Reproduce "Snow Simulation Considering Pressure Sintering".'
    )
    commands = parser.add_subparsers(required=True, metavar="command")

    run = commands.add_parser(
        "run", help="simulate one run, a sweep or an experiment", epilog=RUN_HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    run.add_argument("-m", "--multirun", action="store_true", help="the overrides name several runs")
    run.add_argument("overrides", nargs="*", help="Hydra overrides; 'snowrepro config' shows what there is")
    run.set_defaults(command=run_command)

    judge = commands.add_parser(
        "claims", help="decide the paper's claims by an experiment with several seeds", epilog=CLAIMS_HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    judge.add_argument(
        "overrides", nargs="*", help=f"experiment=..., seeds=N (default: {DEFAULT_SEEDS}) and other Hydra overrides"
    )
    judge.set_defaults(command=claims_command)

    show = commands.add_parser("config", help="print the configuration that the overrides give")
    show.add_argument("overrides", nargs="*")
    show.set_defaults(command=config_command)

    classify = commands.add_parser(
        "classify", help="lumps and powder of a run, or of any particles over time", epilog=CLASSIFY_HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    classify.add_argument("data", help="id of a run in the store, or a NetCDF file")
    classify.add_argument("overrides", nargs="*", metavar="setting=value", help="of the analysis: conf/analysis")
    classify.add_argument("--store", default="runs", help="folder that keeps the runs (default: %(default)s)")
    classify.add_argument("--release", type=int, metavar="FRAME", help="when bonds are laid, if the file does not say")
    classify.add_argument("--grid-spacing", type=float, metavar="LENGTH", help="likewise; default: from the particles")
    classify.add_argument("--frames", choices=("last", "all"), default="last", help="of which fragments are wanted")
    classify.add_argument("--out", type=Path, metavar="FOLDER", help="write fragments.csv, fragments.nc, measures.json")
    classify.set_defaults(command=classify_command)

    film = commands.add_parser("film", help="an mp4 of a run, beside it coloured by fragment")
    film.add_argument("run", help="id of a run in the store, or path of its file")
    film.add_argument("--store", default="runs", help="folder that keeps the runs (default: %(default)s)")
    film.add_argument("--out", type=Path, metavar="FILE", help="default: film.mp4 beside the run's file")
    film.set_defaults(command=film_command)
    return parser


def run_command(options: argparse.Namespace) -> ExitCode:
    """Validate everything, run what is not done, then report from the store."""
    plan = make_plan(options.overrides, options.multirun)
    from .store import runs

    _check_scenes(plan)
    if not plan.needs_runs:
        return _report_sweep(plan)
    if plan.is_sweep:
        _run_missing(plan)
        return _report_sweep(plan)
    runs.require_writable(plan.configs[0].store)
    _run_one(plan.configs[0], runs.is_done(plan.configs[0]))
    return ExitCode.FINE


def claims_command(options: argparse.Namespace) -> ExitCode:
    """Run what is not done of an experiment with several seeds, then judge the claims from the store."""
    seeds, overrides = _split_seeds(options.overrides)
    plan = make_claims_plan(overrides, seeds)
    from .report.claims import write_claims

    _check_scenes(plan)
    _run_missing(plan)
    report = write_claims(plan.configs, [*overrides, f"seeds={seeds}"])
    print("\n".join(report.lines))
    print(f"report: {report.folder / 'index.md'}")
    return _require_results(plan)


def config_command(options: argparse.Namespace) -> ExitCode:
    """Print the composed configuration as YAML."""
    from omegaconf import OmegaConf

    plan = make_plan(options.overrides, False)
    print(OmegaConf.to_yaml(compose_raw(plan.overrides), resolve=True), end="")
    return ExitCode.FINE


def classify_command(options: argparse.Namespace) -> ExitCode:
    """Print the numbers of one run or file, and write its fragments if that is asked for."""
    from .analysis.classify import classify, with_settings, write
    from .analysis.motion import own_analysis
    from .analysis.summary import summarise
    from .store.runs import open_run, require_writable

    if options.out:
        require_writable(options.out)
    settings = _settings(options.overrides)
    with open_run(options.data, options.store) as dataset:
        asked = (
            options.out or options.release is not None or options.grid_spacing is not None or options.frames == "all"
        )
        if "config" in dataset.attrs and not asked:
            _print_rows(summarise(dataset, with_settings(own_analysis(dataset), settings)))
            return ExitCode.FINE
        frames = "all" if options.frames == "all" else None
        found = classify(dataset, frames=frames, release=options.release, grid_spacing=options.grid_spacing, **settings)
        for line in found.assumed:
            _say(f"assumed: {line}")
        _print_rows(found.measures())
        if options.out:
            write(found, options.out)
            print(options.out)
    return ExitCode.FINE


def film_command(options: argparse.Namespace) -> ExitCode:
    """Write a film of one run."""
    from .report.film import film
    from .store.runs import open_run

    with open_run(options.run, options.store) as dataset:
        path = options.out or Path(dataset.encoding["source"]).with_name("film.mp4")
        film(dataset, config_of(dataset), path, quiet=not console.is_terminal)
    print(path)
    return ExitCode.FINE


def _settings(texts: Sequence[str]) -> dict[str, str]:
    """Names and values of ``name=value``.  Raises ConfigError."""
    for text in texts:
        if "=" not in text:
            raise ConfigError(f"'{text}' is not a setting: write name=value, for example break_strain=0.2")
    return dict(text.split("=", 1) for text in texts)


def _split_seeds(overrides: Sequence[str]) -> tuple[int, list[str]]:
    """The number after seeds=, and the other overrides.  Raises ConfigError where it is none."""
    given = [text.removeprefix("seeds=") for text in overrides if text.startswith("seeds=")]
    others = [text for text in overrides if not text.startswith("seeds=")]
    if len(given) > 1 or not all(text.isdecimal() and text.isascii() for text in given):
        raise ConfigError(f"seeds: should be one whole number of at least 1 (got {', '.join(given)})")
    return int(given[0]) if given else DEFAULT_SEEDS, others


def _run_missing(plan: Plan) -> None:
    """Run what is not done of a sweep."""
    from .store import runs

    runs.require_writable(plan.configs[0].store)
    done = [runs.is_done(config) for config in plan.configs]
    _say(f"{len(done)} runs, {sum(done)} of them done, store '{plan.configs[0].store}'")
    if not all(done):
        started = time.monotonic()
        _launch(plan)
        _say_cost(plan, len(done) - sum(done), time.monotonic() - started)


def _check_scenes(plan: Plan) -> None:
    """Build each different scene once.  Raises ConfigError where one cannot be."""
    from .scene.build import build_scene

    def scene(config: Config) -> tuple:
        return config.shape, config.floor, config.fidelity, config.reading, config.indenter

    for config in {scene(config): config for config in plan.configs}.values():
        build_scene(config)


def _say_cost(plan: Plan, computed: int, wall_seconds: float) -> None:
    """How long a sweep took, and how much computing is in its results."""
    from .analysis.summary import row_of
    from .store import runs
    from .sweep.table import clock

    seconds = sum(row_of(config)["seconds"] for config in plan.configs if runs.is_done(config))
    _say(f"wall time {clock(wall_seconds)} for {computed} runs; {seconds / 3600:.3f} core-hours in all runs asked for")


def _run_one(config: Config, done: bool) -> None:
    """Run one case in this process with a progress bar."""
    from .analysis.summary import row_of
    from .run import run

    if done:
        _say("this run is done")
    else:
        logging.getLogger("snowrepro").addHandler(_console_log())
    columns = (TextColumn("frame {task.completed:.0f}/{task.total:.0f}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=done or not console.is_terminal) as bar:
        task = bar.add_task("run", total=config.frames)
        path = run(config, lambda progress: bar.update(task, completed=progress.frame))
    _print_rows(row_of(config))
    print(path)


def _launch(plan: Plan) -> None:
    """Hand the sweep to Hydra, whose launcher runs the jobs; the store says afterwards what became of them."""
    import hydra

    from .run import run_raw

    command, sys.argv = sys.argv, ["snowrepro", "--multirun", *plan.overrides, *own_options()]
    sweep_log = Path(plan.configs[0].store) / "sweep.log"
    try:
        # Hydra prints a traceback for a failed job and exits; the table and the store tell it better.
        with open(sweep_log, "w") as noise, contextlib.redirect_stderr(noise):
            hydra.main(version_base="1.3", config_path=str(CONF_DIR), config_name="config")(run_raw)()
    except SystemExit:
        pass
    finally:
        sys.argv = command


def _report_sweep(plan: Plan) -> ExitCode:
    """Write the experiment's report, or list the runs of a plain sweep.  Raises RunsFailed if any is missing."""
    from .report.page import write_report
    from .store import runs

    if plan.configs[0].experiment:
        report = write_report(plan.configs, plan.overrides)
        print(f"verdict: {report.verdict}")
        print(f"report: {report.folder / 'index.md'}")
    else:
        for config in plan.configs:
            if runs.is_done(config):
                _print_line(config)
    return _require_results(plan)


def _require_results(plan: Plan) -> ExitCode:
    """Fine if every run has a result.  Raises RunsFailed with the reasons if one has none."""
    from .store import runs

    missing = [config for config in plan.configs if plan.needs_runs and not runs.is_done(config)]
    if missing:
        reasons = "; ".join(f"{runs.identify(c)}: {runs.failure(c) or 'it ended early'}" for c in missing)
        count = f"{len(missing)} of {len(plan.configs)} runs have no result"
        raise RunsFailed(f"{count} (more in {Path(plan.configs[0].store) / 'sweep.log'}): {reasons}")
    return ExitCode.FINE


def _print_line(config: Config) -> None:
    """One run of a sweep in one line."""
    from .analysis.summary import row_of

    row = row_of(config)
    found = f"hardness {row['hardness']:.4g}" if config.indenter else f"mass in lumps {row['lump_fraction']:.3f}"
    print(f"{row['run_id']}: {found}")


def _print_rows(row: dict) -> None:
    """Name and value a line; floats in five digits, whole numbers with separators."""
    width = max(len(name) for name in row)
    for name, value in row.items():
        form = ".5g" if isinstance(value, float) else "," if type(value) is int else ""
        print(f"{name:{width}}  {value:{form}}")


def _console_log() -> logging.Handler:
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(message)s"))
    handler.addFilter(lambda record: record.levelno < logging.ERROR)  # errors are told once, at the end
    return handler


def _say(text: str) -> None:
    console.print(text, markup=False, soft_wrap=True)
