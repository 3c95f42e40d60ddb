"""A check's findings for whoever reads them: a table on a screen, JSON, JUnit XML, and Markdown for a pull request."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from xml.etree import ElementTree

import pandas as pd

from ..errors import ExitCode
from ..report.document import plain
from ..report.markdown import table
from ..store.files import published, write_json
from .finding import CONTRADICTED, FAILED, MOVED, NOT_MEASURED, OK, REGRESSED, TIERS, Finding, exit_code

STATES = (REGRESSED, CONTRADICTED, FAILED, NOT_MEASURED, MOVED, OK)
WORDS = {
    ExitCode.FINE: "fine",
    ExitCode.REGRESSED: "regressed or contradicted",
    ExitCode.RUNS_FAILED: "runs failed",
    ExitCode.INCOMPLETE: "incomplete",
}
FILES = ("check.json", "check.xml", "check.md")


def verdict(findings: Sequence[Finding]) -> str:
    """All findings in a line."""
    counts = {state: sum(f.state == state for f in findings) for state in STATES}
    told = ", ".join(f"{count} {state}" for state, count in counts.items() if count)
    return f"{WORDS[exit_code(findings)]}: {told or 'nothing was measured'}"


def line(found: Finding) -> str:
    """A finding in a line or two."""
    allowed = f" (allowed: {found.allowed})" if found.allowed else ""
    note = f"\n{'':17}{found.note}" if found.note else ""
    return f"{found.tier}  {found.state:12}  {found.name}: {found.measured}{allowed}, {found.seconds:.0f} s{note}"


def text(findings: Sequence[Finding]) -> list[str]:
    """The table for a screen, tier by tier."""
    lines = []
    for tier, name in TIERS.items():
        own = [found for found in findings if found.tier == tier]
        lines += [f"tier {tier}, {name}", *(line(found) for found in own)] if own else []
    return lines


def write(findings: Sequence[Finding], about: Mapping[str, str], folder: Path, finished: bool = True) -> None:
    """Write FILES into the folder.  ``about``: what made them, in words by name.  Raises StoreError."""
    said = {"verdict": verdict(findings), "exit_code": int(exit_code(findings)), "finished": finished, **about}
    write_json(folder / FILES[0], {**said, "findings": [asdict(found) for found in findings]})
    with published(folder / FILES[1]) as partial:
        _junit(findings, about).write(partial, encoding="utf-8", xml_declaration=True)
    with published(folder / FILES[2]) as partial:
        partial.write_text("\n".join(markdown(findings, about)) + "\n", encoding="utf-8")


def markdown(findings: Sequence[Finding], about: Mapping[str, str]) -> list[str]:
    """What a pull request shows: what is wrong first, then each tier folded."""
    lines = [f"## Reproducibility: {verdict(findings)}", ""]
    wrong = [found for found in findings if found.state != OK]
    if wrong:
        lines += [*table(_frame(sorted(wrong, key=lambda f: STATES.index(f.state)))), ""]
    for tier, name in TIERS.items():
        own = [found for found in findings if found.tier == tier]
        fine = sum(found.state == OK for found in own)
        if own:
            summary = f"<details><summary>Tier {tier}, {name}: {fine} of {len(own)} ok</summary>"
            lines += [summary, "", *table(_frame(own)), "", "</details>", ""]
    return [*lines, *(f"{name}: {plain(value)}  " for name, value in about.items())]


def _frame(findings: Sequence[Finding]) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "tier": [found.tier for found in findings],
            "check": [plain(found.name) for found in findings],
            "": [f"**{found.state}**" if found.state != OK else OK for found in findings],
            "measured": [plain(found.measured) for found in findings],
            "allowed": [plain(found.allowed) for found in findings],
            "note": [plain(found.note) for found in findings],
        }
    )


def _junit(findings: Sequence[Finding], about: Mapping[str, str]) -> ElementTree.ElementTree:
    """A suite a tier; what is wrong is a failure, a run that failed an error, what was not measured skipped."""
    root = ElementTree.Element("testsuites", name="snowrepro check")
    for tier, title in TIERS.items():
        own = [found for found in findings if found.tier == tier]
        if not own:
            continue
        kinds = Counter(_KIND.get(found.state) for found in own)
        counts = {name: str(kinds[kind]) for kind, name in _COUNTED.items()}
        seconds = f"{sum(found.seconds for found in own):.1f}"
        suite = ElementTree.SubElement(
            root, "testsuite", name=f"tier {tier}, {title}", tests=str(len(own)), time=seconds, **counts
        )
        properties = ElementTree.SubElement(suite, "properties")
        for name, value in about.items():
            ElementTree.SubElement(properties, "property", name=name, value=value)
        for found in own:
            suite.append(_test_case(found))
    return ElementTree.ElementTree(root)


def _test_case(found: Finding) -> ElementTree.Element:
    about = {"classname": f"snowrepro.check.tier{found.tier}", "name": found.name, "time": f"{found.seconds:.1f}"}
    case = ElementTree.Element("testcase", about)
    told = f"{found.state}: {found.measured}; allowed: {found.allowed or '-'}; {found.note}"
    kind = _KIND.get(found.state)
    if kind:
        ElementTree.SubElement(case, kind, message=told)
    else:
        ElementTree.SubElement(case, "system-out").text = told
    return case


_KIND = {REGRESSED: "failure", CONTRADICTED: "failure", FAILED: "error", NOT_MEASURED: "skipped"}
_COUNTED = {"failure": "failures", "error": "errors", "skipped": "skipped"}  # as JUnit spells them
