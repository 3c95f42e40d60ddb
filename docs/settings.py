"""The reference of all settings, from the classes of the configuration and the files in conf/."""

import dataclasses
import importlib
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

import yaml
from markdown_text import plain
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from hydra_plugins.snowrepro_launcher.local import LocalLauncherConf
from snowrepro.cli.meanings import write_units
from snowrepro.composition.comments import adds_to, find_default_option, read_comments
from snowrepro.composition.compose import compose
from snowrepro.composition.drawings import Drawing
from snowrepro.composition.experiments import CONF_DIR, read_experiments
from snowrepro.errors import ConfigError
from snowrepro.report.figures import kinds
from snowrepro.settings.config import PARTS

KINDS = {float: "number", int: "whole number", str: "text", bool: "`true` or `false`", type(None): "`null`"}
BOUNDS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
HEAD = ["| setting | values | default | meaning |", "|---|---|---|---|"]
ABSENT = object()


def page() -> str:
    """All settings as Markdown."""
    defaults = compose().settings()
    fields = fields_of_all()
    lines = ["", "## General", "", *HEAD]
    sections = {name: section for name, field in fields.items() if (section := section_of(field))}
    for name, field in fields.items():
        if name not in sections:
            why = "" if field.description else read_comments("config").get(name, "")
            lines.append(_row(name, field, defaults.get(name, ABSENT), why))
    for name, section in sections.items():
        lines += _section(name, section, defaults.get(name))
    return "\n".join([*lines, *_scenes_and_variants(), *_launchers(), ""])


def fields_of_all() -> dict[str, FieldInfo]:
    """The settings of the highest level, of case, question and execution alike."""
    return {name: field for part in PARTS.values() for name, field in part.model_fields.items()}


def names(fields: Mapping[str, FieldInfo] | None = None, under: str = "") -> Iterator[str]:
    """Every setting with its full name; those of each member of a list under ``name[]``."""
    for name, field in (fields_of_all() if fields is None else fields).items():
        sections = _sections_of(field)
        if not sections:
            yield f"{under}{name}"
        for section in sections:
            yield from names(section.model_fields, f"{under}{name}{'[]' if _is_list(field) else ''}.")


def section_of(field: FieldInfo) -> type[BaseModel] | None:
    """The class of the settings that a field holds, one or a list of them; None if it is a setting itself."""
    found = _sections_of(field)
    return found[0] if found else None


def _sections_of(field: FieldInfo) -> list[type[BaseModel]]:
    """The classes of settings that a field may hold: several where it is a choice of laws."""
    return [kind for kind in _kinds(field.annotation) if isinstance(kind, type) and issubclass(kind, BaseModel)]


def about(path: Path) -> str:
    """The comment at the head of a file, its first sentences up to a blank line or an end of the comment."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("# @package"):
            continue
        if not line.startswith("#") or line == "#":
            break
        lines.append(line.removeprefix("#").strip())
    return " ".join(lines)


def _section(name: str, section: type[BaseModel], values: Any) -> Iterator[str]:
    """A section: its settings, and the options that set them together."""
    yield from ["", f"## {name}", "", plain(_first_paragraph(section)), ""]
    chosen, why = find_default_option(name), {}
    if values is None:
        values = _values_of_some_option(name)
    if chosen and (CONF_DIR / name / f"{chosen}.yaml").exists():
        why = {f"{name}.{key}": text for key, text in read_comments(f"{name}/{chosen}").items()}
    elif not chosen:
        why = {key: text for key, text in read_comments("config").items() if key.startswith(f"{name}.")}
    yield from HEAD
    yield from _rows(name, section, values, why)
    if name in ("shape", "floor"):
        yield from ["", f"In place of a polygon, `{name}.outline` may be a drawing:", "", *HEAD]
        yield from _rows(f"{name}.outline", Drawing, {}, {})
    if name == "experiment":
        yield from _pictures()
    yield from _options(name, chosen)


def _pictures() -> Iterator[str]:
    """What ``experiment.picture`` can be, from the modules that draw."""
    yield from ["", "Pictures, chosen by `experiment.picture`:", ""]
    yield from ["| picture | shows | needs | runs | judges the claims |", "|---|---|---|---|---|"]
    for picture in kinds.list_figure_names():
        module = importlib.import_module(f"{kinds.__package__}.{picture}")
        figure = module.FIGURE
        number = f" ({figure.frames} of them)" if figure.frames else ""
        needs = ", ".join(f"`{name}`" for name in figure.needs) + number
        runs = "none" if not figure.needs_runs else "falls and hardness tests" if figure.takes_indenter else "falls"
        judged = "yes" if figure.is_judged else "no"
        yield f"| `{picture}` | {plain((module.__doc__ or '').strip())} | {needs or 'nothing'} | {runs} | {judged} |"


def _rows(under: str, section: type[BaseModel], values: Any, why: Mapping[str, str]) -> Iterator[str]:
    for name, field in section.model_fields.items():
        key = f"{under}.{name}"
        value = values.get(name, ABSENT) if isinstance(values, Mapping) else ABSENT
        inner = section_of(field)
        if inner is None:
            yield _row(key, field, value, why.get(key, ""))
        elif _is_list(field):
            yield from _rows(f"{key}[]", inner, {}, why)
        elif len(_sections_of(field)) > 1:
            yield from _rows_of_laws(key, under, _sections_of(field))
        else:
            yield from _rows(key, inner, value, why)


def _rows_of_laws(key: str, group: str, laws: Sequence[type[BaseModel]]) -> Iterator[str]:
    """The settings of every law that may be chosen, with the values and reasons of the option of its name."""
    for law in laws:
        name, *_ = get_args(law.model_fields["name"].annotation) or ("...",)
        yield f"| **`{key}.name={name}`** | | | {plain(_first_paragraph(law)).rstrip('.')} |"
        if name == "...":  # somebody else's
            for field, info in law.model_fields.items():
                yield _row(f"{key}.{field}", info, ABSENT, "")
        elif (CONF_DIR / group / f"{name}.yaml").exists() and len(law.model_fields) > 1:
            values = compose([f"{group}={name}"]).settings()[group]["law"]
            why = read_comments(f"{group}/{name}")
            fields = {field: info for field, info in law.model_fields.items() if field != "name"}
            for field, info in fields.items():
                yield _row(f"{key}.{field}", info, values[field], why.get(f"law.{field}", ""))


def _row(key: str, field: FieldInfo, value: Any, why: str) -> str:
    said = field.description or ""
    meaning = "; ".join(
        plain(write_units(text)).rstrip(".") for text in (said, why if adds_to(why, said) else "") if text
    )
    default = "" if value is ABSENT else f"`{_short(value)}`"
    return f"| `{key}` | {_values(field)} | {default} | {meaning} |"


def _short(value: Any) -> str:
    """A value as YAML has it on one line, cut where it is long."""
    if isinstance(value, tuple | list):
        text = f"[{', '.join(_short(item) for item in value)}]"
    else:
        text = yaml.safe_dump(value, default_flow_style=True, width=1000).removesuffix("...\n").strip()
    return text if len(text) <= 40 else f"{text[:37]}..."


def _values(field: FieldInfo) -> str:
    """Which values a setting takes: its type and its bounds."""
    limits = [
        f"{sign} {_number(limit)}"
        for bound in field.metadata
        for name, sign in BOUNDS.items()
        if (limit := getattr(bound, name, None)) is not None
    ]
    return ", ".join([" or ".join(_words(field.annotation)), *limits])


def _words(annotation: Any) -> list[str]:
    """The kinds of a type, in words."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return [f"`{value}`" for value in inner]
    if origin is Annotated:
        return _words(inner[0])
    if origin is tuple:
        kinds = dict.fromkeys(word for kind in inner if kind is not Ellipsis for word in _words(kind))
        number = "" if Ellipsis in inner else f"{len(inner)} "
        return [f"list of {number}{', '.join(_plural(kind) for kind in kinds)}"]
    if inner:
        return [word for kind in inner for word in _words(kind)]
    return [KINDS.get(annotation, str(getattr(annotation, "__name__", annotation)))]


def _plural(kind: str) -> str:
    return kind if kind.endswith("`") else re.sub(r"^list\b|(number|text)$", r"\g<0>s", kind, count=1)


def _number(value: float) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:g}"


def _kinds(annotation: Any) -> Iterator[Any]:
    inner = get_args(annotation)
    if inner and get_origin(annotation) is not Literal:
        for kind in inner:
            yield from _kinds(kind)
    else:
        yield annotation


def _is_list(field: FieldInfo) -> bool:
    return get_origin(field.annotation) in (tuple, list)


def _first_paragraph(section: type[BaseModel]) -> str:
    return (section.__doc__ or "").strip().split("\n\n")[0]


def _values_of_some_option(name: str) -> Any:
    """The values of a section that is empty by default, from the first option that fills it."""
    for path in sorted((CONF_DIR / name).glob("*.yaml")):
        try:
            values = compose([f"{name}={path.stem}"]).settings().get(name)
        except ConfigError:
            continue
        if values is not None and name != "experiment":
            return values
    return {}


def _options(name: str, chosen: str) -> Iterator[str]:
    """The files that set a section."""
    paths = sorted((CONF_DIR / name).glob("*.yaml"))
    if paths:
        yield from ["", f"Options, chosen by `{name}=`:", "", "| option | content |", "|---|---|"]
    for path in paths:
        yield f"| `{path.stem}`{' (default)' if path.stem == chosen else ''} | {plain(write_units(about(path)))} |"


def _scenes_and_variants() -> Iterator[str]:
    yield from ["", "## scene", "", "A shape and a floor together.", *_options("scene", "")]
    yield from ["", "## variant", "", "One choice changed, after all others: the variants of a study's file."]
    yield from ["", "| option | sets | study |", "|---|---|---|"]
    for study, section in read_experiments().items():
        for name, content in (section.get("variants") or {}).items():
            yield f"| `{name}` | {', '.join(f'`{text}`' for text in _flat(content))} | `{study}` |"


def _flat(values: Mapping[str, Any], under: str = "") -> Iterator[str]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{under}{key}.")
        else:
            yield f"{under}{key}={_short(value)}"


def _launchers() -> Iterator[str]:
    """Who does the runs of a sweep: this machine, Ray or Slurm."""
    yield from ["", "## hydra.launcher", "", "What does the runs of a sweep: `hydra/launcher=local`, `ray` or `slurm`."]
    yield from ["", "### local", "", plain(LocalLauncherConf.__doc__ or "").replace("\\`\\`", "`"), ""]
    yield from ["| setting | default |", "|---|---|"]
    for field in dataclasses.fields(LocalLauncherConf):
        if not field.name.startswith("_"):
            yield f"| `hydra.launcher.{field.name}` | `{_short(field.default)}` |"
    for launcher in ("ray", "slurm"):
        yield from ["", f"### {launcher}", "", "See [On a cluster](clusters.md).", ""]
        yield from ["| setting | default | meaning |", "|---|---|---|"]
        text = (CONF_DIR / "hydra" / "launcher" / f"{launcher}.yaml").read_text(encoding="utf-8")
        yield from _launcher_rows(text.splitlines())


def _launcher_rows(lines: Sequence[str]) -> Iterator[str]:
    """A row for each key of a launcher's file."""
    above: list[str] = []
    for line in lines:
        matched = re.match(r"( *)(\w+):([^#]*)(?:# *(.+))?$", line)
        if not matched or matched[2].startswith("_") or matched[2] == "defaults":
            continue
        above = [*above[: len(matched[1]) // 2], matched[2]]
        if matched[3].strip():
            key = ".".join(["hydra.launcher", *above])
            yield f"| `{key}` | `{matched[3].strip()}` | {plain(matched[4] or '')} |"
