"""``snowrepro point``: lead one point along a path of strain, check its laws, or map the mechanisms of sintering."""

import argparse
import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import point, sintering_map
from ...checks import finding, laws, outputs
from ...composition import compose
from ...errors import ConfigError, ExitCode
from ...report.drawing import path as drawing
from ...report.drawing import plot
from ...report.drawing import sintering_map as map_drawing
from ...store import files
from .. import candidates, screen
from ..arguments import EXITS, add_folders, complete_by

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from ...settings.case import Case

WORDS = {"path": str, "strain": float, "steps": int}
HELP = f"""\
The functions are those that the solver runs; there is no grid, and nothing is put into a store.  Writes a table (.csv)
and a picture beside it.

  path     compression, isotropic, extension, shear or cycles (default: compression); or a table of strains: a .csv
           with columns xx, yy and xy, logarithmic, a row for each corner of the path
  strain   the greatest one, logarithmic; in shear the tangent of the angle (default: 0.2)
  steps    in all (default: 400)

examples:
  snowrepro point material=cam_clay path=compression
  snowrepro point material=sand path=cycles strain=0.05 --out sand.svg
  snowrepro point material=cam_clay path=strains.csv
  snowrepro point material=cam_clay --check
  snowrepro point --map sintering=maeno sintering.law.temperature=248.15

With --map the picture shows which mechanism of sintering=maeno acts, over density and stress at its temperature.

With --check the law is asked for what any law must do: a symmetric stress, the same for each observer, that does not
jump; no energy by plastic flow; no work out of nothing; no tangent stiffness above the declared one, on which the time
step rests.  The sintering law is tried too.

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which material and path, whether to check it, and where the picture goes."""
    words = parser.add_argument("overrides", nargs="*", help="path=, strain=, steps=, and the overrides of a run")
    complete_by(words, candidates.list_overrides)
    instead = parser.add_mutually_exclusive_group()
    instead.add_argument("--check", action="store_true", help="check the law in place of drawing a path")
    instead.add_argument("--map", action="store_true", help="map the mechanisms of sintering in place of a path")
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help=".png, .svg or .pdf (default: a .png in the folder of reports)"
    )
    add_folders(parser, writes_reports=True)


def execute(options: argparse.Namespace) -> ExitCode:
    """Draw a path or a map and write its table, or check the laws."""
    asked, overrides = _read_words(options.overrides)
    for word, is_asked in (("--check", options.check), ("--map", options.map)):
        if is_asked and asked:
            raise ConfigError(f"{word} has no path: leave out {', '.join(asked)}")
    config = compose.compose(overrides)
    if options.check:
        return _check(config.case)
    path = _make_path(**asked)
    name = "sintering_map" if options.map else f"{config.case.material.law.name}-{path.name}"
    out = options.out or Path(config.question.reports, "point", f"{name}.png")
    plot.read_format(out)
    if out.with_suffix(".csv").resolve() == Path(asked.get("path", "")).resolve():
        raise ConfigError(f"{out.with_suffix('.csv')} is the path itself: give the picture another name by --out")
    files.require_writable(out.parent)
    if options.map:
        mapped = sintering_map.map_sintering(config.case)
        _write(out, map_drawing.draw_map(mapped), sintering_map.tabulate(mapped))
    else:
        followed = point.follow_path(config.case, path)
        _write(out, drawing.draw_path(followed), followed.to_dataframe())
    return ExitCode.FINE


def _check(case: "Case") -> ExitCode:
    """Check the laws of a case, and show each finding as soon as it is there."""
    findings: list[finding.Finding] = []
    for each in itertools.chain(laws.check_material(case), laws.check_sintering(case)):
        findings.append(each)
        screen.show(*outputs.format_next(each, findings[:-1]))
    return finding.choose_exit_code(findings)


def _make_path(path: str = "compression", **asked: Any) -> "point.Path":
    """Make the path that was asked for by name, or read it.  Raises ConfigError."""
    if Path(path).suffix.lower() != ".csv":
        return point.make_path(path, **asked)
    if "strain" in asked:
        raise ConfigError(f"path={path} has its own strains: leave out strain=")
    return point.read_path(Path(path), **asked)


def _write(out: Path, figure: "Figure", table: "pd.DataFrame") -> None:
    """Write a picture, and its table beside it."""
    plot.save_plot(figure, out)
    place = out.with_suffix(".csv")
    with files.published(place) as partial:
        table.to_csv(partial)
    screen.show(place, out)


def _read_words(words: Sequence[str]) -> tuple[dict[str, Any], list[str]]:
    """What is said of the path, by name, and the words that are overrides.  Raises ConfigError for no number."""
    asked: dict[str, Any] = {}
    overrides = []
    for word in words:
        name, _, value = word.partition("=")
        if name not in WORDS:
            overrides.append(word)
            continue
        try:
            asked[name] = WORDS[name](value)
        except ValueError as error:
            raise ConfigError(f"'{word}': {name} is a number") from error
    return asked, overrides
