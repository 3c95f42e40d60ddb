"""``snowrepro classify``: lumps and powder of a run, or of any particles over time."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...errors import ConfigError, ExitCode
from ...store import files
from ...store import run as store_run
from ...summary import classify, row
from .. import candidates, screen
from ..arguments import add_store, complete_by

HELP = """\
A file needs 'position' (time, particle, axis), or 'x' and 'y' (time, particle); it may have 'mass', 'velocity', a
coordinate of frame numbers, and the attributes release_frame, grid_spacing and cell_mass.  A particle that is NaN
from some frame to the last has vanished.

examples:
  snowrepro classify ball-L-530-paper-paper-0-2f63b27e3e
  snowrepro classify other.nc --release 40 definition=proximity --frames all --out fragments
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Whose particles, by which settings, and where the fragments go."""
    data = parser.add_argument("data", help="id of a run in the store, or a NetCDF file")
    complete_by(data, candidates.any_of(candidates.list_runs, otherwise=candidates.list_files))
    overrides = parser.add_argument(
        "overrides", nargs="*", metavar="setting=value", help="of the analysis: conf/analysis"
    )
    complete_by(overrides, candidates.list_analysis_settings)
    add_store(parser)
    parser.add_argument("--release", type=int, metavar="FRAME", help="when bonds are laid, if the file does not say")
    parser.add_argument("--grid-spacing", type=float, metavar="LENGTH", help="likewise; default: from the particles")
    parser.add_argument("--frames", choices=("last", "all"), default="last", help="of which fragments are wanted")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="write fragments.csv, fragments.nc, measures.json")


def execute(options: argparse.Namespace) -> ExitCode:
    """Print the numbers of one run or file, and write its fragments if that is asked for."""
    if options.out:
        files.require_writable(options.out)
    settings = _read_settings(options.overrides)
    needs_fragments = (
        options.out or options.release is not None or options.grid_spacing is not None or options.frames == "all"
    )
    with store_run.open_run(options.data, options.store) as dataset:
        if "config" in dataset.attrs and not needs_fragments:
            analysis = classify.change_settings(classify.read_analysis(dataset), settings)
            screen.print_rows(row.summarise(dataset, analysis))
            return ExitCode.FINE
        classified = classify.classify(
            dataset,
            frames="all" if options.frames == "all" else None,
            release=options.release,
            grid_spacing=options.grid_spacing,
            **settings,
        )
        for line in classified.assumed:
            screen.say(f"assumed: {line}")
        screen.print_rows(classified.measures())
        if options.out:
            classify.write_classification(classified, options.out)
            print(options.out)
    return ExitCode.FINE


def _read_settings(words: Sequence[str]) -> dict[str, Any]:
    """Names and values of ``name=value``.  Raises ConfigError."""
    for word in words:
        if "=" not in word:
            raise ConfigError(f"'{word}' is not a setting: write name=value, for example break_strain=0.2")
    return dict(word.split("=", 1) for word in words)
