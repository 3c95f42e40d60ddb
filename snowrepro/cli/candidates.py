"""Words that can stand in a command line: overrides, names of sweeps, ids of runs, files.

They are names of files alone, so that a shell that asks for them while someone types has them at once: nothing is
composed, and no result is opened.  Each function takes what argcomplete gives: the word as far as it is typed, and the
options so far.
"""

import argparse
import re
from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from .. import foreign
from ..errors import StoreError

# As composition.compose, store.run and sweep.record have them, which take seconds to import.
_PACKAGE = Path(__file__).resolve().parents[1]
BUILT_IN = _PACKAGE / "conf" if (_PACKAGE / "conf").is_dir() else _PACKAGE.parent / "conf"
OWN = Path("conf")  # the user's, in the working directory
OWN_EXPERIMENTS = Path("experiments")
OWN_LAWS = ("material", "sintering")  # groups that installed packages add to
SWEEPS, RECORD, WORK = "sweeps", "sweep.json", ".work"
SWEEP_NAME = re.compile(r"[\w=+~][\w.,=+~-]*")
TABLE = "results.csv"  # of a sweep: its first line has the names of the columns
ROLES = ("x", "y", "colour", "panel")  # of columns in a plot
NOT_PLOTTED = ("run_id", "state", "reason")
LONGEST_TABLE, LONGEST_LINE = 64 << 20, 64 << 10  # bytes

Lister = Callable[..., Iterable[str]]


def list_overrides(prefix: str, **_: Any) -> list[str]:
    """Overrides that begin so: keys with =, and after it the options of their folder in conf/."""
    key, equals, values = prefix.partition("=")
    options = _options_by_group()
    if not equals:
        return [f"{name}=" for name in sorted({*options, *_settings(Path("config.yaml")), "seeds"})]
    sign = key[: len(key) - len(key.lstrip("+"))]
    earlier = values[: values.rfind(",") + 1]  # shape=ball,star names two
    return [f"{key}={earlier}{name}" for name in options.get(key.removeprefix(sign), ())]


def list_analysis_settings(**_: Any) -> list[str]:
    """Settings of the analysis with =."""
    return [f"{name}=" for path in sorted((BUILT_IN / "analysis").glob("*.yaml")) for name in _settings(path)]


def list_experiments(**_: Any) -> list[str]:
    """Experiments."""
    return _options_by_group().get("experiment", [])


def list_sweeps(parsed_args: argparse.Namespace, **_: Any) -> list[str]:
    """Sweeps that the store remembers."""
    store = _store(parsed_args)
    names = (entry.name for entry in foreign.list_own(store / SWEEPS, store))
    return [name for name in names if SWEEP_NAME.fullmatch(name) and (store / SWEEPS / name / RECORD).exists()]


def list_plotted(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:
    """Roles of columns in a plot with =, and after it the columns of the sweep that is named."""
    role, equals, _value = prefix.partition("=")
    if not equals:
        return [f"{name}=" for name in (*ROLES, "store", "reports")]
    return [f"{role}={column}" for column in _read_columns(parsed_args)] if role in ROLES else []


def list_runs(parsed_args: argparse.Namespace, **_: Any) -> list[str]:
    """Ids of the runs that the store holds, works on, or was asked for."""
    store = _store(parsed_args)
    folders = {path.name for place in (store, store / WORK) for path in place.glob("[!.]*") if path.is_dir()}
    records = [store / SWEEPS / entry.name / RECORD for entry in foreign.list_own(store / SWEEPS, store)]
    names = folders.union(*map(_read_cells, records)) - {SWEEPS}
    return sorted(filter(foreign.is_plain_name, names))


def find_kinds(text: str) -> list[str]:
    """What a help lists, a word and its meaning a line."""
    return re.findall(r"^  (\w+)  ", text, re.MULTILINE)


def list_files(prefix: str, **_: Any) -> list[str]:
    """Files and folders whose paths begin so."""
    folder, slash, _name = prefix.rpartition("/")
    paths = sorted(Path(folder + slash or ".").glob("[!.]*"))
    return [f"{folder}{slash}{path.name}{'/' * path.is_dir()}" for path in paths]


def list_if_path(action: argparse.Action, prefix: str, **_: Any) -> list[str]:
    """Files for an argument that is a file or folder, and nothing for any other."""
    is_path = action.type is Path or action.metavar in ("FILE", "FOLDER") or action.dest == "store"
    return list_files(prefix) if is_path else []


def any_of(*listers: Lister, otherwise: Lister | None = None) -> Lister:
    """A function that lists what several list; and what ``otherwise`` lists, where none of that begins so."""

    def list_all(prefix: str, **context: Any) -> list[str]:
        words = [word for lister in listers for word in lister(prefix=prefix, **context)]
        if otherwise and not any(word.startswith(prefix) for word in words):
            words += otherwise(prefix=prefix, **context)
        return words

    return list_all


def _options_by_group() -> dict[str, list[str]]:
    """The options of each folder in conf/, the user's beside the built-in, by the folder's name."""
    names: dict[str, set[str]] = {}
    for conf in (BUILT_IN, OWN):
        # Not one glob: conf/experiment is a link, which ** does not follow.
        for path in (*conf.glob("*/*.yaml"), *conf.glob("*/*/*.yaml")):
            names.setdefault(path.parent.relative_to(conf).as_posix(), set()).add(path.stem)
    names.setdefault("experiment", set()).update(path.stem for path in OWN_EXPERIMENTS.glob("*.yaml"))
    for group in OWN_LAWS:
        names.setdefault(group, set()).update(point.name for point in entry_points(group=f"snowrepro.{group}"))
    return {group: sorted(stems) for group, stems in names.items()}


def _settings(path: Path) -> Iterator[str]:
    """The keys of a file of conf/ that hold a value."""
    text = (BUILT_IN / path).read_text(encoding="utf-8")
    yield from re.findall(r"^(\w+): +[^#\s]", text, re.MULTILINE)


def _store(options: argparse.Namespace) -> Path:
    """The store that the options name so far."""
    words = [word for word in getattr(options, "overrides", None) or () if word.startswith("store=")]
    named = words[-1].removeprefix("store=").strip("'\"") if words else None  # Hydra's grammar takes a second to load
    return Path(named or getattr(options, "store", None) or "runs")


def _read_columns(options: argparse.Namespace) -> list[str]:
    """The columns in the table of the sweep that the options name; none of what cannot be read."""
    store = _store(options)
    sweep = getattr(options, "sweep", None) or ""
    if not SWEEP_NAME.fullmatch(sweep) or not foreign.is_own_folder(store / SWEEPS / sweep, store):
        return []
    try:
        with foreign.open_plain(store / SWEEPS / sweep / TABLE, LONGEST_TABLE) as file:
            names = file.readline(LONGEST_LINE).decode("utf-8", "replace").strip().split(",")
    except (OSError, StoreError):
        return []
    return [name for name in names if re.fullmatch(r"\w+", name) and name not in NOT_PLOTTED]


def _read_cells(path: Path) -> list[str]:
    """The ids of the runs that a remembered sweep asked for; none of what cannot be read."""
    try:
        cells = foreign.read_json(path, 64 * foreign.MIB).get("cells")
    except (OSError, StoreError):
        return []
    return [run_id for run_id in cells.values() if isinstance(run_id, str)] if isinstance(cells, dict) else []
