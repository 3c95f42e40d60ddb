"""Particle files that are cut, flipped or odd, as ``snowrepro classify`` reads them: see ``particle_files``."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MOST_MEMORY = 2 << 30  # bytes


@pytest.mark.parametrize(("seed", "count"), [(17, 200), pytest.param(18, 6000, marks=pytest.mark.nightly)])
def test_files_are_read_or_refused(tmp_path, seed, count):
    """Nothing but the program's own errors, on one printable line; no crash, no hang, bounded memory."""
    command = [sys.executable, "-m", "tests.fuzz.particle_files", str(seed), str(count), str(tmp_path)]
    shown = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=1800)
    *files, last = [json.loads(line) for line in shown.stdout.splitlines()]
    assert shown.returncode == 0, f"ended by {shown.returncode} after {files[-1:]}: {shown.stderr[-500:]}"
    assert len(files) == count
    assert [file for file in files if file["ended"] not in ("fine", "refused")] == []
    assert last["memory"] < MOST_MEMORY
    fine = [file for file in files if file["ended"] == "fine"]
    assert 0.05 * count < len(fine) < 0.6 * count, "the files are to be neither all hopeless nor all sound"
    assert not [file for file in fine if "cut" in file["deed"]], "what is cut off is never read"
