"""What is wrong with a configuration, in one line that names the key and the right names."""

import difflib
import functools
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

import yaml
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from ..own_law import GROUPS, LETTERS, NAME
from ..settings.config import PARTS

MOST_NAMED = 4  # keys that may be meant
LEAST_LIKE = 0.8  # of two whole keys, of which one may be meant by the other
DRAWING = ("kind", "path", "fill_rule", "file", "region", "width")  # keys of an outline that is read from a drawing


def explain(item: Mapping[str, Any]) -> str:
    """One pydantic error as 'key: what is wrong (got value)'."""
    keys = item["loc"][item["loc"][:1] in [(part,) for part in PARTS] :]  # users know nothing of the parts
    # A law's own keys stand behind the name of the law.
    where = ".".join(
        str(key) for before, key in zip(("", *keys), keys, strict=False) if before != "law" or key == "name"
    )
    if item["type"] == "extra_forbidden":
        return _no_such_key(where)
    message = re.sub(r"^Value error, |^Input ", "", item["msg"])
    value = "" if isinstance(item["input"], dict) else f" (got {item['input']!r})"
    is_yaml_boolean = item["type"] == "string_type" and isinstance(item["input"], bool)  # on, off, yes, no
    remedy = ': write it in quotes, as in name: "off"' if is_yaml_boolean else ""
    return f"{where}{': ' * bool(where)}{message}{value}{remedy}"


def one_message(error: Exception) -> str:
    """Hydra's message on one line, with the right names when a key was wrong."""
    said = next((text for each in list_causes(error) if (text := str(each).strip())), type(error).__name__)
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    text = " ".join(lines)
    evaluated = re.search(r"\w+ while evaluating '[^']*': (.+?) See https://", text)
    if evaluated:  # a function such as range(...) was given what it does not take
        return evaluated[1]
    choice = re.search(
        r"Could not find '([^/']+)/([^']*)' Available options in '[^']+': (.*?)( Config search path|$)", text
    )
    if choice:
        is_misnamed = choice[1] in GROUPS and not NAME.fullmatch(choice[2])
        hint = f"; the name of a package's law has {LETTERS}" * is_misnamed
        return f"there is no {choice[1]} '{choice[2]}'; there are: {', '.join(choice[3].split())}{hint}"
    if "hydra/launcher/submitit" in text:
        return "this launcher is not installed: pip install 'snowrepro[slurm]'"
    if re.match("(mismatched|extraneous) input|no viable alternative|missing [A-Z'{]", text):  # Hydra's parser
        return "a bracket is not closed, or a value is missing"
    if "LexerNoViableAltException" in text:
        return "it has letters that must stand in quotes, as in \"name='value'\""
    relative = re.search(r"In '([^']+)': Could not override '[^']+/([^/'@]+)@", text)
    if relative:
        return f"{relative[1]}.yaml: a group of another folder begins with a slash: 'override /{relative[2]}: ...'"
    unknown = re.search(r"Could not override '([^']+)'", text) or re.search(r"Key '(\w+)' is not in struct", text)
    if unknown:
        return _no_such_key(unknown[1].lstrip("+"))
    return re.split(r" Config search path:| See https://", text)[0]


def describe_file_error(path: Path, error: Exception) -> str:
    """Say in one line at which place and why a YAML file cannot be read."""
    if isinstance(error, UnicodeDecodeError):
        lines_before = error.object[: error.start].count(b"\n")
        return f"{path}, line {lines_before + 1}: is not in UTF-8; save it in that encoding"
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark:
        return f"{path}, line {error.problem_mark.line + 1}: {error.problem}"
    first_line = str(error).partition("\n")[0]
    return f"{path}: cannot be read: {first_line}"


def list_causes(error: BaseException | None) -> list[BaseException]:
    """List an error, then what it was raised from, and so on."""
    causes: list[BaseException] = []
    while error is not None and error not in causes:
        causes.append(error)
        error = error.__cause__ or error.__context__
    return causes


def _fields_of(annotation: Any) -> dict[str, FieldInfo]:
    """The fields of the section that a field holds, of all that it may be; none if it holds a value."""
    kinds = [
        kind.__origin__ if get_origin(kind) is Annotated else kind for kind in get_args(annotation) or (annotation,)
    ]
    sections = [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)]
    return {name: field for section in sections for name, field in section.model_fields.items()}


def _find_same(word: str) -> list[str]:
    """The keys of all settings whose last word is this one, in large or small letters."""
    return [key for key in _list_keys() if key.rpartition(".")[2].lower() == word.lower()]


def _find_close(word: str) -> list[str]:
    """The keys of all settings whose last word is close to this one, the closest first."""
    words = {key.rpartition(".")[2].lower() for key in _list_keys()}
    return [key for close in difflib.get_close_matches(word.lower(), words, n=1) for key in _find_same(close)]


def find_setting(key: str) -> FieldInfo | None:
    """The setting that a key such as reading.gravity names; None if there is none."""
    fields = {name: field for part in PARTS.values() for name, field in part.model_fields.items()}
    *sections, last = key.split(".")
    for section in sections:
        fields = _fields_of(fields[section].annotation) if section in fields else {}
    return fields.get(last)


@functools.cache
def _list_keys() -> list[str]:
    """The keys of all settings, those in sections by their whole names; without those of the items of a list."""

    def walk(fields: Mapping[str, FieldInfo], under: str) -> Iterator[str]:
        """The keys of a section, which is called ``under``."""
        for name, field in fields.items():
            yield f"{under}{name}"
            if get_origin(field.annotation) is not tuple:
                yield from walk(_fields_of(field.annotation), f"{under}{name}.")

    return [key for part in PARTS.values() for key in walk(part.model_fields, "")]


def _no_such_key(key: str) -> str:
    """Say that a key does not exist, which is near to it, also in other sections, and which there are."""
    fields = {name: field for part in PARTS.values() for name, field in part.model_fields.items()}
    *parents, last = key.split(".")
    place = "".join(f"{parent}." for parent in parents)  # the group in front, as it is to be written
    for number, parent in enumerate(parents):
        inner = _fields_of(fields[parent].annotation) if parent in fields else {}
        if not inner:
            last, place = parent, "".join(f"{known}." for known in parents[:number])
            break
        fields = inner
    names = sorted({*fields, *(DRAWING if "points" in fields else ())})
    if last in names:
        return f"'{key}' is not set by the options chosen; to set it, write +{key}=..."
    word = key.rpartition(".")[2]
    whole = difflib.get_close_matches(key, _list_keys(), n=1, cutoff=LEAST_LIKE) if last != word else []
    inside = [f"{place}{name}" for name in difflib.get_close_matches(last, names, n=1)]
    near = whole or _find_same(word) or inside or _find_close(word)
    hint = f"; did you mean {' or '.join(repr(name) for name in near[:MOST_NAMED])}?" if near else "."
    return f"there is no setting '{key}'{hint} There are: {', '.join(names)}"
