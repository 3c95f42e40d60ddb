"""``snowrepro classify``: lumps, crushed and loose snow of a run, or of any particles over time."""

import argparse
import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ... import text
from ...errors import ConfigError, DataError, ExitCode, StoreError
from ...store import files, find
from ...summary import classify, row
from .. import candidates, screen, single
from ..arguments import add_store, complete_by

HELP = """\
A NetCDF file needs 'position' (time, particle, axis), or 'x' and 'y' (time, particle), with the dimensions in any
order; it may have 'mass', 'velocity', 'id', 'time', a coordinate of frame numbers, and the attributes release_frame,
grid_spacing, cell and cell_mass.  A particle that is NaN from some frame to the last has vanished.  Where a variable or
dimension has another name, say it with the options below; the name 'none' says that the file has none.

examples:
  snowrepro classify ball-L-740-paper-paper-0-5ae7c16ddc
  snowrepro classify other.nc --release 40 definition=proximity --frames all --out fragments
  snowrepro classify drifters.nc --release 0 --position lon_m,lat_m --time-dimension obs --id none
"""
NAMED = {
    "--position": "variable with the positions, or one an axis: x,y or x,y,z",
    "--velocity": "likewise, with the velocities",
    "--id": "variable with the ids of the particles",
    "--mass": "variable with the masses, or the mass of each particle, a number",
    "--time": "variable with the times",
    "--time-dimension": "dimension along which time passes",
    "--particle-dimension": "dimension along which the particles are",
    "--group": "group of the file that has them",
}
NAMES = ("position", "velocity", "mass", "time", "time_dimension", "particle_dimension")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Whose particles, by which settings, and where the fragments go."""
    data = parser.add_argument("data", help="id of a run in the store (or its beginning or end), or a NetCDF file")
    complete_by(data, candidates.any_of(candidates.list_runs, otherwise=candidates.list_files))
    overrides = parser.add_argument(
        "overrides", nargs="*", metavar="setting=value", help="of the analysis: conf/analysis"
    )
    complete_by(overrides, candidates.list_analysis_settings)
    add_store(parser)
    parser.add_argument("--release", type=int, metavar="FRAME", help="when the snow is whole, if the file does not say")
    parser.add_argument("--grid-spacing", type=float, metavar="LENGTH", help="likewise; default: from the particles")
    parser.add_argument("--cell", type=float, metavar="LENGTH", help="likewise: over which strain is measured")
    parser.add_argument("--cell-mass", type=float, metavar="MASS", help="likewise: of unpressed snow in a cell")
    for option, help_text in NAMED.items():
        parser.add_argument(option, metavar="NAME", help=help_text)
    parser.add_argument("--frames", choices=("last", "all"), default="last", help="of which fragments are wanted")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="write fragments.csv, fragments.nc, measures.json")


def execute(options: argparse.Namespace) -> ExitCode:
    """Print the numbers of one run or file, and write its fragments if that is asked for."""
    if options.out:
        files.require_writable(options.out)
    settings = _read_settings(options.overrides)
    named = _read_names(options)
    lengths = {name: getattr(options, name) for name in ("release", "grid_spacing", "cell", "cell_mass")}
    needs_fragments = options.out or options.frames == "all" or any(value is not None for value in lengths.values())
    with _naming(options.data), find.open_particles(options.data, options.store, options.group) as dataset:
        if not (needs_fragments or named) and classify.is_whole_run(dataset):
            analysis = classify.change_settings(classify.read_analysis(dataset), settings)
            single.print_outcome(row.summarise(dataset, analysis), classify.read_length_unit(dataset))
            return ExitCode.FINE
        classified = classify.classify(
            dataset,
            frames="all" if options.frames == "all" else None,
            **lengths,
            **named,
            **settings,
        )
        for line in classified.assumed:
            screen.say(f"assumed: {line}")
        screen.print_rows(classified.measures())
        if options.out:
            classify.write_classification(classified, options.out)
            screen.show(options.out)
    return ExitCode.FINE


def _read_names(options: argparse.Namespace) -> dict[str, Any]:
    """Return the names of variables and dimensions that were given, and a mass if it is a number."""
    given = {"particle_id": options.id, **{name: getattr(options, name) for name in NAMES}}
    named: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    with contextlib.suppress(KeyError, ValueError):
        named["mass"] = float(named["mass"])
    return named


@contextlib.contextmanager
def _naming(data: str) -> Iterator[None]:
    """Put the name of the file before what is wrong in it."""
    try:
        yield
    except DataError as error:
        raise DataError(f"{text.make_printable(data)}: {error}") from error
    except (OSError, RuntimeError) as error:  # of NetCDF, from values that are damaged
        raise StoreError(f"{text.make_printable(data)} cannot be read: {error}") from error


def _read_settings(words: Sequence[str]) -> dict[str, Any]:
    """Names and values of ``name=value``, several values with commas between.  Raises ConfigError."""
    for word in words:
        if "=" not in word:
            raise ConfigError(f"'{word}' is not a setting: write name=value, for example break_strain=0.2")
    settings = dict(word.split("=", 1) for word in words)
    return {name: value.strip("[]").split(",") if "," in value else value for name, value in settings.items()}
