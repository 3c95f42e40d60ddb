"""What an outside tool, compliance-checker, finds against the CF conventions in NetCDF files."""

import json
import subprocess
import sys
from pathlib import Path

from snowrepro.store.cf import CONVENTIONS


def complaints(*paths: Path) -> list[list[str]]:
    """Messages of high and medium priority, by file; a check that broke off is a failure here."""
    tool = Path(sys.executable).with_name("compliance-checker")
    test = CONVENTIONS.lower().replace("-", ":")
    report = paths[0].with_suffix(".cf.json")
    command = [tool, f"--test={test}", "--format=json_new", f"--output={report}", *paths]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert "exceptions occurred" not in ran.stderr, ran.stderr
    found = json.loads(report.read_text())
    report.unlink()
    return [_messages(found[str(path)][test]) for path in paths]


def _messages(found: dict) -> list[str]:
    checks = [*found["high_priorities"], *found["medium_priorities"]]
    assert len(checks) > 10, "the tool checked nothing"
    assert all(check["msgs"] or check["value"][0] == check["value"][1] for check in checks)
    return [f"{check['name']}: {message}" for check in checks for message in check["msgs"]]
