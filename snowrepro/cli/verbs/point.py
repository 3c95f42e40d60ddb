"""``snowrepro point``: lead one point of a material along a path of strain, and check its law."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ... import point
from ...checks import finding, laws, outputs
from ...composition import compose
from ...errors import ConfigError, ExitCode
from ...report.drawing import path as drawing
from ...report.drawing import plot
from ...store import files
from .. import candidates, screen
from ..arguments import EXITS, add_folders, complete_by

WORDS = {"path": str, "strain": float, "steps": int}
HELP = f"""\
The functions are those that the solver runs; there is no grid, and nothing is put into a store.  Writes a table (.csv)
and a picture beside it.

  path     compression, isotropic, extension, shear or cycles (default: compression)
  strain   the greatest one, logarithmic; in shear the tangent of the angle (default: 0.2)
  steps    (default: 400)

examples:
  snowrepro point material=cam_clay path=compression
  snowrepro point material=sand path=cycles strain=0.05 --out sand.svg
  snowrepro point material=cam_clay --check

With --check the law is asked for what any law must do: a symmetric stress, the same for each observer, that does not
jump; no energy by plastic flow; no work out of nothing; no tangent stiffness above the declared one, on which the time
step rests.  The sintering law is tried too.

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which material and path, whether to check it, and where the picture goes."""
    words = parser.add_argument("overrides", nargs="*", help="path=, strain=, steps=, and the overrides of a run")
    complete_by(words, candidates.list_overrides)
    parser.add_argument("--check", action="store_true", help="check the law in place of drawing a path")
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help=".png, .svg or .pdf (default: a .png in the folder of reports)"
    )
    add_folders(parser, writes_reports=True)


def execute(options: argparse.Namespace) -> ExitCode:
    """Draw a path and write its table, or check the law."""
    asked, overrides = _read_words(options.overrides)
    config = compose.compose(overrides)
    if options.check:
        findings = []
        for each in (*laws.check_material(config.case), *laws.check_sintering(config.case)):
            findings.append(each)
            screen.show(*outputs.format_next(each, findings[:-1]))
        return finding.choose_exit_code(findings)
    path = point.Path(**asked)
    name = f"{config.case.material.law.name}-{path.name}.png"
    out = options.out or Path(config.question.reports, "point", name)
    plot.read_format(out)
    files.require_writable(out.parent)
    dataset = point.follow_path(config.case, path)
    plot.save_plot(drawing.draw_path(dataset), out)
    table = out.with_suffix(".csv")
    with files.published(table) as partial:
        dataset.to_dataframe().to_csv(partial)
    screen.show(table, out)
    return ExitCode.FINE


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
            asked["name" if name == "path" else name] = WORDS[name](value)
        except ValueError as error:
            raise ConfigError(f"'{word}': {name} is a number") from error
    return asked, overrides
