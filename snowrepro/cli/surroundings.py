"""What a process may lack or bring along: standard streams, a width of the screen, a setting for notebooks."""

import os
import sys
from pathlib import Path


def prepare_process() -> None:
    """Give the process streams that can be written to, and forget what its surroundings set for other programs."""
    _open_streams()
    if not os.environ.get("COLUMNS", "").lstrip("0").isdecimal():
        os.environ.pop("COLUMNS", None)  # 0, as in some editors: every message would be an empty line
    os.environ["MPLBACKEND"] = "agg"  # a notebook's is of no use here, and may be refused


def _open_streams() -> None:
    """Send to nowhere what has no stream, as with a daemon; and write what a stream's encoding lacks as escapes."""
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number, which a result file would take else
    nowhere = Path(os.devnull)
    sys.stdout = sys.stdout or nowhere.open("w", encoding="utf-8")
    sys.stderr = sys.stderr or nowhere.open("w", encoding="utf-8")
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
