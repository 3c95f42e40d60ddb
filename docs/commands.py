"""The reference of the command line, from the parser itself."""

import argparse
from collections.abc import Iterator

from markdown_text import plain

from snowrepro.cli.main import VERBS, build_parser


def page() -> str:
    """All commands as Markdown."""
    parsers = {name: _parser_of(name) for name in VERBS}
    lines = ["", "## All commands", "", "| command | what it does |", "|---|---|"]
    lines += [f"| [`{name}`](#{_anchor(name)}) | {plain(summary)} |" for name, summary in VERBS.items()]
    for name, command in parsers.items():
        lines += ["", f"(command-{name})=", f"## snowrepro {name}", "", *_described(command)]
    return "\n".join([*lines, ""])


def _parser_of(name: str) -> argparse.ArgumentParser:
    """The parser of one command, whose arguments are there when the command is named."""
    parser = build_parser([name])
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return commands.choices[name]


def _anchor(name: str) -> str:
    return f"command-{name}"


def _described(command: argparse.ArgumentParser) -> Iterator[str]:
    """Usage, arguments, and what follows them."""
    command.formatter_class = _Wide
    text = (command.description or "").strip()
    yield from [
        plain(f"{text[:1].upper()}{text[1:]}{'' if text.endswith('?') else '.'}"),
        "",
        "```text",
        command.format_usage().strip(),
        "```",
        "",
    ]
    rows = [action for action in command._actions if not isinstance(action, argparse._HelpAction)]
    if rows:
        yield from ["| argument | meaning |", "|---|---|"]
    for action in rows:
        meaning = (action.help or "") % {**vars(action), "prog": command.prog}
        choices = f" One of {', '.join(f'`{choice}`' for choice in action.choices)}." if action.choices else ""
        yield f"| {_name(action)} | {plain(meaning)}{'.' if choices and meaning else ''}{choices} |"
    if command.epilog:
        yield from ["", "```text", command.epilog.strip(), "```"]


def _name(action: argparse.Action) -> str:
    """An argument as it is typed."""
    shown = action.metavar or (action.dest if not action.option_strings else action.dest.upper())
    if not action.option_strings:
        return f"`{shown}`"
    takes = "" if action.nargs == 0 else f" {shown}"
    return ", ".join(f"`{option}{takes}`" for option in action.option_strings)


class _Wide(argparse.RawDescriptionHelpFormatter):
    """The same text whatever the width of the terminal is."""

    def __init__(self, prog: str, **given):
        super().__init__(prog, **{**given, "width": 100})
