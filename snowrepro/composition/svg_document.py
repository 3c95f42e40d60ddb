"""An SVG file as a tree of elements whose style sheets are applied; nothing outside the file is read.

The XML is read by expat, with its entities off; the style sheets by tinycss2.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import tinycss2

MOST_BYTES = 4_000_000  # of a file
MOST_ELEMENTS = 5_000
MOST_DEPTH = 100  # of elements in elements
MOST_MATCHES = 2_000_000  # of rules with elements
NAMESPACE = "http://www.w3.org/2000/svg"
INHERITED = (
    *("color", "visibility", "fill", "fill-rule", "fill-opacity", "clip-rule", "stroke", "stroke-opacity"),
    *("stroke-width", "stroke-linecap", "stroke-linejoin", "stroke-miterlimit", "stroke-dasharray"),
    *("marker-start", "marker-mid", "marker-end"),
)
OWN = ("display", "opacity", "overflow", "clip-path", "mask", "filter", "vector-effect")
# What a style sheet can say of a shape's place, where only attributes are read.
GEOMETRY = (
    *("transform", "transform-origin", "transform-box", "translate", "rotate", "scale", "offset-path", "zoom"),
    *("x", "y", "cx", "cy", "r", "rx", "ry", "d", "width", "height"),
)
SELECTOR = re.compile(r"(\*|[\w-]+)?((?:[.#][\w-]+)*)")

Style = dict[str, str]


@dataclass(frozen=True)
class Rule:
    """Which elements a rule of a style sheet is about, and what it says of them: values, and whether important."""

    tag: str
    id: str | None
    classes: frozenset[str]
    rank: tuple[int, int, int]  # among rules: ids, classes, tags in its selector
    values: Mapping[str, tuple[str, bool]]

    def matches(self, element: Element) -> bool:
        """Whether the rule is about an element."""
        return (
            self.tag in ("", "*", tag_of(element))
            and self.id in (None, element.get("id"))
            and (not self.classes or self.classes <= set((element.get("class") or "").split()))
        )


def read_document(path: Path) -> Element:
    """The root of an SVG file.  Raises ValueError with what is wrong with it."""
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise ValueError(f"it has {size:,} bytes; at most {MOST_BYTES:,} can be read: simplify it")
    text = path.read_bytes()
    if text.startswith(b"\x1f\x8b"):
        raise ValueError("it is compressed: unpack it, or save it as plain SVG")
    root = _parse(text)
    if tag_of(root) != "svg":
        raise ValueError(f"this is no SVG: its root is <{root.tag.rpartition('}')[2]}>")
    _apply_style_sheets(root)
    return root


def tag_of(element: Element) -> str:
    """The name of an SVG element; that of an element of another namespace is empty."""
    namespace, _, name = element.tag.rpartition("}")
    return name if namespace in ("", "{" + NAMESPACE) else ""


def style_of(element: Element) -> Style:
    """What an element, after ``read_document``, says of its own look and effects, by property."""
    return {name: value for name in (*INHERITED, *OWN) if (value := element.get(name, "").strip())}


def _parse(text: bytes) -> Element:
    """Text as a tree, without reading anything else.  Raises ValueError with line and column."""
    builder = TreeBuilder()
    parser = expat.ParserCreate(namespace_separator="}")
    count = depth = 0

    def named(name: str) -> str:
        return "{" + name if "}" in name else name

    def start(name: str, attributes: Mapping[str, str]) -> None:
        nonlocal count, depth
        count, depth = count + 1, depth + 1
        if count > MOST_ELEMENTS:
            raise ValueError(f"it has more than {MOST_ELEMENTS:,} elements: simplify it")
        if depth > MOST_DEPTH:
            raise ValueError(f"its elements are nested more than {MOST_DEPTH} deep: simplify it")
        builder.start(named(name), {named(key): value for key, value in attributes.items()})

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(named(name))

    def refuse_entity(*declared: Any) -> None:
        raise ValueError(f"it declares the entity '{declared[0]}', which is not read: save it as plain SVG")

    def refuse_sheet(target: str, _: str) -> None:
        if target == "xml-stylesheet":
            raise ValueError("it has a style sheet outside of the file, which is not read: save it as plain SVG")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = refuse_entity
    parser.ProcessingInstructionHandler = refuse_sheet
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise ValueError(f"this is no SVG: {error}") from error
    return builder.close()


def _apply_style_sheets(root: Element) -> None:
    """Write what style sheets and ``style`` say of each element into its attributes."""
    styles = [element for element in root.iter() if tag_of(element) == "style"]
    sheets = ["".join(style.itertext()) for style in styles if style.get("media", "all") in ("all", "screen", "")]
    rules = sorted((rule for sheet in sheets for rule in _rules_of(sheet)), key=lambda rule: rule.rank)
    elements = list(root.iter())
    if len(rules) * len(elements) > MOST_MATCHES:
        raise ValueError(f"its <style> has {len(rules):,} rules for {len(elements):,} elements, too many: simplify it")
    for element in elements:
        values = [rule.values for rule in rules if rule.matches(element)]
        values.append(_declarations(tinycss2.parse_declaration_list(element.get("style") or "")))
        for is_important in (False, True):
            for name, (value, important) in (item for layer in values for item in layer.items()):
                if important == is_important:
                    _set(element, name, value)


def _set(element: Element, name: str, value: str) -> None:
    """Set a property of an element to what a style sheet says.  Raises ValueError if that cannot be read."""
    if name == "marker":
        for where in ("start", "mid", "end"):
            element.set(f"marker-{where}", value)
    elif name in INHERITED or name in OWN:
        element.set(name, value)
    elif name in GEOMETRY and not (name in ("width", "height") and tag_of(element) == "svg"):
        raise ValueError(f"a style sets '{name}' of <{tag_of(element)}>, which is read only from attributes")


def _rules_of(sheet: str) -> list[Rule]:
    """The rules of a style sheet.  Raises ValueError for what is not read: selectors of relations, @media and such."""
    rules = []
    for part in tinycss2.parse_stylesheet(sheet, skip_comments=True, skip_whitespace=True):
        if part.type == "at-rule" and part.lower_at_keyword in ("charset", "font-face", "namespace", "keyframes"):
            continue
        if part.type != "qualified-rule":
            raise ValueError(f"its <style> has {_name(part)}, which is not read: save it as plain SVG")
        values = _declarations(tinycss2.parse_declaration_list(part.content))
        selectors = re.sub(r"/\*.*?\*/", "", tinycss2.serialize(part.prelude)).split(",")
        rules += [_rule(selector.strip(), values) for selector in selectors]
    return rules


def _rule(selector: str, values: Mapping[str, tuple[str, bool]]) -> Rule:
    found = SELECTOR.fullmatch(selector)
    if not selector or found is None:
        raise ValueError(f"its <style> selects '{selector}', which is not read: save it as plain SVG")
    names = re.findall(r"[.#][\w-]+", found[2])
    ids = [name[1:] for name in names if name[0] == "#"]
    classes = frozenset(name[1:] for name in names if name[0] == ".")
    tag = found[1] or ""
    rank = (len(ids), len(names) - len(ids), int(tag not in ("", "*")))
    return Rule(tag, ids[0] if ids else None, classes, rank, values)


def _declarations(parsed: list[Any]) -> dict[str, tuple[str, bool]]:
    """What a list of declarations says, by property."""
    return {
        part.lower_name: (tinycss2.serialize(part.value).strip(), part.important)
        for part in parsed
        if part.type == "declaration"
    }


def _name(part: Any) -> str:
    return f"@{part.lower_at_keyword}" if part.type == "at-rule" else "what is no rule"
