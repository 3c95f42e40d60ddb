"""What a check's findings come to, and how they are told."""

import json
from xml.etree import ElementTree as ET

import pytest

from snowrepro.checks import outputs
from snowrepro.checks.finding import (
    CONTRADICTED,
    FAILED,
    MOVED,
    NOT_MEASURED,
    OK,
    REGRESSED,
    Finding,
    check_bound,
    choose_exit_code,
)
from snowrepro.errors import ExitCode


def of(*states: str) -> list[Finding]:
    return [Finding(2, f"a <b> & {n}", state, "3 | 4 *x*", "1 tolerance", "note") for n, state in enumerate(states)]


@pytest.mark.parametrize(
    ("states", "code"),
    [
        ([OK], ExitCode.FINE),
        ([OK, MOVED], ExitCode.FINE),
        ([OK, REGRESSED, FAILED, NOT_MEASURED], ExitCode.REGRESSED),
        ([CONTRADICTED], ExitCode.REGRESSED),
        ([FAILED, NOT_MEASURED, OK], ExitCode.RUNS_FAILED),
        ([NOT_MEASURED, OK], ExitCode.INCOMPLETE),
        ([], ExitCode.INCOMPLETE),
    ],
)
def test_the_gravest_finding_decides_the_exit_code(states, code):
    assert choose_exit_code(of(*states)) == code


def test_a_bound_is_kept_or_not_and_nan_is_not():
    assert check_bound(0, "x", 1.0, 1.0, "m").state == OK
    assert check_bound(0, "x", 1.1, 1.0, "m").state == REGRESSED
    assert check_bound(0, "x", float("nan"), 1.0, "m").state == REGRESSED


def test_every_output_tells_every_finding(tmp_path):
    """JSON and JUnit are well formed whatever the text; the Markdown names what is wrong first."""
    findings = of(OK, MOVED, REGRESSED, FAILED, NOT_MEASURED)
    outputs.write_findings(findings, {"machine": "a & b"}, tmp_path)
    said = json.loads((tmp_path / "check.json").read_text())
    assert (said["exit_code"], said["finished"], len(said["findings"])) == (1, True, 5)
    (suite,) = ET.parse(tmp_path / "check.xml").getroot()
    counts = [suite.get(name) for name in ("tests", "failures", "errors", "skipped")]
    assert counts == ["5", "1", "1", "1"]
    cases = suite.findall("testcase")
    assert [case.get("name") for case in cases] == [found.name for found in findings]
    assert [case[0].tag for case in cases] == ["system-out", "system-out", "failure", "error", "skipped"]
    text = (tmp_path / "check.md").read_text()
    assert text.index("**REGRESSED**") < text.index("**RUN FAILED**") < text.index("<details>")
    assert r"a \<b\> \& 2" in text and r"3 \| 4 \*x\*" in text
