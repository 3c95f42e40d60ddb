"""The findings of a check as a table on a screen, JSON, JUnit XML, and Markdown for a pull request."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from xml.etree import ElementTree as ET

import pandas as pd

from ..errors import ExitCode
from ..report.document import escape
from ..report.page.markdown import format_table
from ..store.files import published, write_json
from .finding import CONTRADICTED, FAILED, MOVED, NOT_MEASURED, OK, REGRESSED, TIERS, Finding, choose_exit_code

STATES = (REGRESSED, CONTRADICTED, FAILED, NOT_MEASURED, MOVED, OK)
WORDS = {
    ExitCode.FINE: "fine",
    ExitCode.REGRESSED: "regressed or contradicted",
    ExitCode.RUNS_FAILED: "runs failed",
    ExitCode.INCOMPLETE: "incomplete",
}
FILES = ("check.json", "check.xml", "check.md")


def summarise_findings(findings: Sequence[Finding]) -> str:
    """Summarise all findings in a line."""
    counts = {state: sum(f.state == state for f in findings) for state in STATES}
    words = ", ".join(f"{count} {state}" for state, count in counts.items() if count)
    return f"{WORDS[choose_exit_code(findings)]}: {words or 'nothing was measured'}"


def format_finding(finding: Finding) -> str:
    """Format a finding as a line or two."""
    allowed = f" (allowed: {finding.allowed})" if finding.allowed else ""
    note = f"\n{'':17}{finding.note}" if finding.note else ""
    result = f"{finding.name}: {finding.measured}{allowed}, {finding.seconds:.0f} s{note}"
    return f"{finding.tier}  {finding.state:12}  {result}"


def format_next(finding: Finding, before: Sequence[Finding]) -> list[str]:
    """Format a finding as lines for a screen, under the title of its tier if it is the first of that tier."""
    is_first = all(finding.tier != other.tier for other in before)
    return [f"tier {finding.tier}, {TIERS[finding.tier]}"] * is_first + format_finding(finding).split("\n")


def write_findings(findings: Sequence[Finding], about: Mapping[str, str], folder: Path, finished: bool = True) -> None:
    """Write FILES into a folder.  ``about``: what made the findings, in words by name.  Raises StoreError."""
    content = {
        "verdict": summarise_findings(findings),
        "exit_code": int(choose_exit_code(findings)),
        "finished": finished,
        **about,
    }
    write_json(folder / FILES[0], {**content, "findings": [asdict(finding) for finding in findings]})
    with published(folder / FILES[1]) as partial:
        _make_junit(findings, about).write(partial, encoding="utf-8", xml_declaration=True)
    with published(folder / FILES[2]) as partial:
        partial.write_text("\n".join(format_markdown(findings, about)) + "\n", encoding="utf-8")


def format_markdown(findings: Sequence[Finding], about: Mapping[str, str]) -> list[str]:
    """Format the findings as Markdown for a pull request: what is wrong first, then each tier folded."""
    lines = [f"## Reproducibility: {summarise_findings(findings)}", ""]
    wrong = [finding for finding in findings if finding.state != OK]
    if wrong:
        lines += [*format_table(_tabulate(sorted(wrong, key=lambda f: STATES.index(f.state)))), ""]
    for tier, name in TIERS.items():
        findings_of_tier = [finding for finding in findings if finding.tier == tier]
        fine = sum(finding.state == OK for finding in findings_of_tier)
        if findings_of_tier:
            summary = f"<details><summary>Tier {tier}, {name}: {fine} of {len(findings_of_tier)} ok</summary>"
            lines += [summary, "", *format_table(_tabulate(findings_of_tier)), "", "</details>", ""]
    return [*lines, *(f"{name}: {escape(value)}  " for name, value in about.items())]


def _tabulate(findings: Sequence[Finding]) -> pd.DataFrame:
    """Tabulate findings for Markdown, a row each."""
    return pd.DataFrame(
        {
            "tier": [finding.tier for finding in findings],
            "check": [escape(finding.name) for finding in findings],
            "": [f"**{finding.state}**" if finding.state != OK else OK for finding in findings],
            "measured": [escape(finding.measured) for finding in findings],
            "allowed": [escape(finding.allowed) for finding in findings],
            "note": [escape(finding.note) for finding in findings],
        }
    )


def _make_junit(findings: Sequence[Finding], about: Mapping[str, str]) -> ET.ElementTree:
    """Make JUnit XML with a suite for each tier.

    What is wrong is a failure, a run that failed is an error, what was not measured is skipped.
    """
    root = ET.Element("testsuites", name="snowrepro check")
    for tier, title in TIERS.items():
        findings_of_tier = [finding for finding in findings if finding.tier == tier]
        if not findings_of_tier:
            continue
        kinds = Counter(_KIND.get(finding.state) for finding in findings_of_tier)
        attributes = {"name": f"tier {tier}, {title}", "tests": str(len(findings_of_tier))}
        attributes["time"] = f"{sum(finding.seconds for finding in findings_of_tier):.1f}"
        attributes |= {name: str(kinds[kind]) for kind, name in _COUNTED.items()}
        suite = ET.SubElement(root, "testsuite", attributes)
        properties = ET.SubElement(suite, "properties")
        for name, value in about.items():
            ET.SubElement(properties, "property", name=name, value=value)
        for finding in findings_of_tier:
            suite.append(_make_test_case(finding))
    return ET.ElementTree(root)


def _make_test_case(finding: Finding) -> ET.Element:
    """Make the XML element of one finding."""
    about = {"classname": f"snowrepro.check.tier{finding.tier}", "name": finding.name, "time": f"{finding.seconds:.1f}"}
    case = ET.Element("testcase", about)
    message = f"{finding.state}: {finding.measured}; allowed: {finding.allowed or '-'}; {finding.note}"
    kind = _KIND.get(finding.state)
    if kind:
        ET.SubElement(case, kind, message=message)
    else:
        ET.SubElement(case, "system-out").text = message
    return case


_KIND = {REGRESSED: "failure", CONTRADICTED: "failure", FAILED: "error", NOT_MEASURED: "skipped"}
_COUNTED = {"failure": "failures", "error": "errors", "skipped": "skipped"}  # as JUnit spells them
