"""Laws of somebody else: of installed packages, found by their entry points, or passed to ``snowrepro.simulate``.

A package names its law under one of GROUPS.  Which package, which version and a digest of its source are written into
the configuration, and so into the id of a run.  The code of a package is run where its law is chosen, and not before.
"""

import dataclasses
import functools
import hashlib
import importlib.util
import inspect
import json
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from .compiler import is_of_another, name_compiler
from .errors import ConfigError
from .settings.base import MOST_LETTERS, Settings
from .settings.case import Case
from .settings.laws import InstalledLaw

GROUPS = {"material": "snowrepro.material", "sintering": "snowrepro.sintering"}
# What a law must have: see ``laws``.
PARTS = {
    "material": ("STATE", "relax", "factor", "stress", "stress_zz", "energy", "flow_work", "stiffness"),
    "sintering": ("advance",),
}
NAME = re.compile(r"[A-Za-z]\w{0,59}", re.ASCII)  # of an option
LETTERS = "letters from A to Z, digits and _, 60 at most, and begins with a letter"  # of NAME, in words
PASSED = "passed in Python"  # in place of a package
COMPILED = "__pycache__"
PLACE = re.compile(r'File "(?:.*[/\\])?([^/\\"]+)", (line \d+, in \w+)')  # of an error, as Python and Taichi say it
TRACED = "Traceback (most recent call last)"
MOST_SAID = 300  # letters of an error
_passed: dict[str, Any] = {}  # laws that were passed in this process, by their digests


@dataclass(frozen=True)
class OwnLaw:
    """What an entry point names.

    ``make``: a function of the case and of the parameters that returns the law, an object as ``laws`` describes it;
    ``parameters``: the settings that the law declares, numbers, texts, true or false.
    """

    make: Callable[[Case, Any], Any]
    parameters: type[Settings] = Settings


@functools.cache
def list_laws(kind: str) -> dict[str, tuple[EntryPoint, ...]]:
    """The entry points of the laws that installed packages offer, by their names; ``kind``: a key of GROUPS."""
    found: dict[str, tuple[EntryPoint, ...]] = {}
    for point in entry_points(group=GROUPS[kind]):
        if NAME.fullmatch(point.name):
            found[point.name] = (*found.get(point.name, ()), point)
    return dict(sorted(found.items()))


@functools.cache
def identify_law(kind: str, name: str) -> InstalledLaw:
    """A law as it is installed, without parameters.  Raises ConfigError where it is not, or two packages have it."""
    points = list_laws(kind).get(name, ())
    if not points:
        raise ConfigError(f"no installed package offers a {kind} law '{name}'")
    packages = sorted({name_package(point) for point in points})
    if len(points) > 1:
        raise ConfigError(f"several packages offer a {kind} law '{name}': {', '.join(packages)}; remove all but one")
    version = points[0].dist.version if points[0].dist else ""
    return InstalledLaw(name=name, package=packages[0], version=version, digest=_digest_package(points[0].module))


@functools.cache
def load_law(kind: str, name: str) -> OwnLaw:
    """What the entry point of an installed law names.  Runs the package's code.  Raises ConfigError."""
    installed = identify_law(kind, name)
    what = f"the {kind} law '{name}' of the package {installed.package}"
    try:
        law = list_laws(kind)[name][0].load()
    except Exception as error:
        raise ConfigError(f"{what} cannot be loaded: {type(error).__name__}: {error}") from error
    if not isinstance(law, OwnLaw) or not issubclass(law.parameters, Settings):
        raise ConfigError(f"{what} is no OwnLaw whose parameters are Settings: see docs/own-laws.md")
    return law


def make_own_law(kind: str, case: Case, law: InstalledLaw) -> Any:
    """The law of a case that is somebody else's, with its numbers.

    Raises ConfigError if it is not installed as the configuration says, or is no law.
    """
    make = _find_passed(kind, law) if law.package == PASSED else _find_installed(kind, law)
    with explain_errors(kind, law, "cannot be made"):
        made = make(case)
    missing = [part for part in PARTS[kind] if not hasattr(made, part)]
    if missing:
        raise ConfigError(f"{kind} law '{law.name}' has no {', '.join(missing)}: see docs/own-laws.md")
    if any(is_of_another(getattr(made, part)) for part in PARTS[kind]):
        raise ConfigError(
            f"{kind} law '{law.name}' is made for another compiler than {name_compiler()}: it needs 'from "
            "snowrepro.compiler import ti', which is the one that compiles"
        )
    try:
        hash(made)
    except TypeError as error:
        raise ConfigError(
            f"{kind} law '{law.name}': {error}: a law is a frozen dataclass of numbers, words and tuples"
        ) from error
    return made


@contextmanager
def explain_errors(kind: str, law: object, failure: str) -> Iterator[None]:
    """Within it the code of a law runs; where it goes wrong and the law is somebody else's, a ConfigError says which.

    ``failure``: what the law does then, in words.  A ConfigError is passed on.
    """
    try:
        yield
    except ConfigError:
        raise
    except Exception as error:
        if not isinstance(law, InstalledLaw):
            raise
        raise ConfigError(f"{kind} law '{law.name}' of {law.origin} {failure}: {_shorten(error)}") from error


def _shorten(error: Exception) -> str:
    """What an error says, in one line; of the compiler's the innermost place, and what is wrong there."""
    if isinstance(error, ValidationError):
        return str(error.errors()[0]["msg"])
    said, _, traced = str(error).partition(TRACED)
    behind_marks = re.split(r"(?m)^\s*\^+\s*$", said)[-1].strip().partition("\n")[0]
    what = traced.strip().rpartition("\n")[2].strip() if traced else behind_marks
    places = PLACE.findall(said)
    where = ", ".join(places[-1]) if places else type(error).__name__
    return f"{where}: {what}"[:MOST_SAID]


def describe_change(kind: str, law: InstalledLaw) -> str:
    """In what an installed law differs from that of a configuration; empty if it is the same."""
    try:
        installed = identify_law(kind, law.name)
    except ConfigError as error:
        return str(error)
    if installed.package != law.package:
        return f"it is of the package {installed.package} now"
    if installed.version != law.version:
        return f"version {law.version} -> {installed.version}"
    return "" if installed.digest == law.digest else f"its source changed, and its version {law.version} did not"


def find_own_law(kind: str, settings: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """What plain settings say of a law that is somebody else's; None where they have none."""
    section = settings.get(kind)
    law = section.get("law") if isinstance(section, Mapping) else None
    return law if isinstance(law, Mapping) and "package" in law else None


def find_changes(config: Mapping[str, Any]) -> list[str]:
    """What changed of the installed laws of a configuration, as it was written down with a result."""
    changes = []
    for kind in GROUPS:
        law = find_own_law(kind, config)
        if not law or law["package"] == PASSED:
            continue
        try:
            read = InstalledLaw.model_validate(law)
        except ValidationError:
            continue  # whoever opens the run says so
        if change := describe_change(kind, read):
            changes.append(f"{kind} law {read.name} of {read.package}: {change}")
    return changes


def name_packages(case: Case) -> list[str]:
    """The packages whose laws a case has, each with its version and what is of it."""
    laws = ((kind, getattr(case, kind).law) for kind in GROUPS)
    of: dict[str, list[str]] = {}
    for kind, law in laws:
        if isinstance(law, InstalledLaw):
            of.setdefault(law.origin, []).append(f"{kind} law {law.name}")
    return [f"{origin} ({', '.join(what)})" for origin, what in of.items()]


def pass_law(kind: str, law: Any) -> InstalledLaw:
    """Take a law that was passed in Python, and return what a configuration says of it.

    ``law``: the object, a function that makes it of a case, or an OwnLaw with the defaults of its parameters.  Raises
    ConfigError.
    """
    is_object = hasattr(law, PARTS[kind][-1]) and not inspect.isclass(law)
    if not (is_object or isinstance(law, OwnLaw) or inspect.isroutine(law)):
        raise ConfigError(f"{kind}: {law!r} is no law, and no function that makes one: see docs/own-laws.md")
    named = law.make if isinstance(law, OwnLaw) else law if inspect.isroutine(law) else type(law)
    parameters = _read_fields(kind, law)
    content = json.dumps([kind, _read_source(named), named.__qualname__, parameters], sort_keys=True)
    digest = hashlib.sha256(content.encode()).hexdigest()[:16]
    _passed[digest] = law
    name = re.sub(r"\W", "", named.__name__)[:MOST_LETTERS]
    return InstalledLaw(name=name, package=PASSED, version="", digest=digest, parameters=parameters)


def _find_installed(kind: str, law: InstalledLaw) -> Callable[[Case], Any]:
    """What makes an installed law of a case.  Raises ConfigError if it is not installed as the configuration says."""
    if change := describe_change(kind, law):
        raise ConfigError(
            f"{kind} law '{law.name}' of {law.package}: {change}; this run needs it as it was: install that, or "
            "ask for the run anew"
        )
    own = load_law(kind, law.name)
    return lambda case: own.make(case, own.parameters.model_validate(law.parameters))


def _find_passed(kind: str, law: InstalledLaw) -> Callable[[Case], Any]:
    """What makes the law of a case that was passed in this process.  Raises ConfigError if none was."""
    if law.digest not in _passed:
        raise ConfigError(f"{kind} law '{law.name}' was passed in Python, by another process: pass it to simulate")
    given = _passed[law.digest]
    if isinstance(given, OwnLaw):
        return lambda case: given.make(case, given.parameters())
    return given if inspect.isroutine(given) else lambda _: given


def require_plain(key: str, parameters: Mapping[str, Any]) -> None:
    """Check that the parameters of a law, under their ``key``, can be written down.  Raises ConfigError."""
    for name, value in parameters.items():
        if not isinstance(value, bool | int | float | str):
            raise ConfigError(f"{key}.{name}: a parameter is a number, a text, true or false (got {value!r})")


def _read_fields(kind: str, law: Any) -> dict[str, Any]:
    """The numbers and words of a law that is a dataclass, or the defaults of the parameters of an OwnLaw.

    Raises ConfigError.
    """
    if isinstance(law, OwnLaw):
        try:
            parameters = law.parameters().model_dump(mode="json")
        except ValidationError as error:
            wrong = ", ".join(str(item["loc"][0]) for item in error.errors() if item["loc"])
            raise ConfigError(f"{kind}: a law that is passed needs a default for each parameter: {wrong}") from error
        require_plain(f"{kind}.law.parameters", parameters)
        return parameters
    fields = dataclasses.fields(law) if dataclasses.is_dataclass(law) else ()
    values = {field.name: getattr(law, field.name) for field in fields}
    return {name: value for name, value in values.items() if isinstance(value, bool | int | float | str)}


def _read_source(named: Any) -> str:
    """The source of the module of a class or function; of itself where that has none, as in a notebook."""
    for part in (inspect.getmodule(named), named):
        try:
            return inspect.getsource(part)  # type: ignore[arg-type]
        except (OSError, TypeError):
            continue
    raise ConfigError(f"the source of {named.__qualname__} cannot be read, so it cannot be told from another law")


def name_package(point: EntryPoint) -> str:
    """The name of the package that has an entry point."""
    return point.dist.name if point.dist else "unknown"


def _digest_package(module: str) -> str:
    """The files of the package that a module is in, in one word, without running it; a single module is one file.

    What editors and systems leave behind is no part of it: see ``_is_left_behind``.
    """
    spec = importlib.util.find_spec(module.partition(".")[0])
    if spec is None:
        raise ConfigError(f"the package {module.partition('.')[0]} is named by an entry point, and is not there")
    roots = [Path(place) for place in spec.submodule_search_locations or ()]
    files = [(path.relative_to(root).as_posix(), path) for root in roots for path in root.rglob("*") if path.is_file()]
    if not roots and spec.origin:
        files = [(Path(spec.origin).name, Path(spec.origin))]
    whole = hashlib.sha256()
    for name, path in sorted(files):
        if not any(map(_is_left_behind, name.split("/"))):
            whole.update(f"{name}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return whole.hexdigest()[:16]


def _is_left_behind(name: str) -> bool:
    """Whether a file or folder of this name is compiled code, hidden, or what an editor keeps."""
    return name == COMPILED or name.startswith(".") or name.endswith("~")
