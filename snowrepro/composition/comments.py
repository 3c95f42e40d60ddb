"""What the comments of the files in conf/ say of settings."""

import re

import yaml

from .experiments import CONF_DIR


def read_comments(file: str) -> dict[str, str]:
    """Read what the comments of a file in conf/ say of its keys, by name ("every" of "output:" as "output.every").

    A line that is a comment alone goes on with the one before it, if that has one.
    """
    found: dict[str, str] = {}
    above, last = "", ""
    for line in (CONF_DIR / f"{file}.yaml").read_text(encoding="utf-8").splitlines():
        if matched := re.match(r"( *)(\w+):(?P<value>[^#]*)(?:# *(.+))?$", line):
            last = f"{above}.{matched[2]}" if matched[1] else matched[2]
            above = above if matched[1] else matched[2]
            found[last] = matched[4] or ""
        elif (matched := re.match(r" +# *(.+)$", line)) and found.get(last):
            found[last] += f" {matched[1]}"
    return {key: text for key, text in found.items() if text}


def find_default_option(group: str) -> str:
    """Find the option that conf/config.yaml chooses for a section; empty if it chooses none."""
    items = yaml.safe_load((CONF_DIR / "config.yaml").read_text(encoding="utf-8"))["defaults"]
    return next((item[group] for item in items if isinstance(item, dict) and item.get(group)), "")


def find_comment(key: str) -> str:
    """Find what the file of the default option says of a setting such as reading.gravity; empty if it says nothing."""
    group, _, inner = key.partition(".")
    if inner and (option := find_default_option(group)) and (CONF_DIR / group / f"{option}.yaml").exists():
        return read_comments(f"{group}/{option}").get(inner, "")
    return read_comments("config").get(key, "")


def adds_to(comment: str, description: str) -> bool:
    """Whether a comment says something that the description does not."""
    return not set(re.findall(r"[\w./]+", comment)) <= set(re.findall(r"[\w./^]+", description))
