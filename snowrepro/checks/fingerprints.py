"""Tier 1: the bits of short runs beside those of the reference, for each platform that has one."""

import hashlib
import platform
from collections.abc import Mapping

from ..store.provenance import environment
from .cases import State
from .finding import MOVED, OK, Finding

Prints = dict[str, dict[str, str]]  # frame, quantity, digest
LETTERS = 16


def platform_key() -> str:
    """What bits are promised for: system, architecture and Taichi with its compiler, not Python and NumPy."""
    return f"{platform.system()} {platform.machine()}, taichi {environment()['taichi']}"


def take(states: Mapping[int, State]) -> Prints:
    """Digests of every observed quantity in the watched frames."""
    return {str(frame): {name: _digest(values) for name, values in state.items()} for frame, state in states.items()}


def compare(case: str, found: Prints, platforms: Mapping[str, Mapping]) -> Finding:
    """Beside the reference of this platform; where there is none, or the bits moved, tier 2 decides.

    ``platforms``: by ``platform_key``, the prints of each case and the ``processor`` that they were taken on.
    """
    here = platform_key()
    reference = platforms.get(here, {}).get("cases", {}).get(case)
    if reference is None:
        known = "; ".join(platforms) or "none"
        return Finding(
            1, case, MOVED, f"no fingerprint for {here}", "the same bits", f"tier 2 takes over; known: {known}"
        )
    moved = [
        (frame, name)
        for frame, prints in reference.items()
        for name in prints
        if found.get(frame, {}).get(name) != prints[name]
    ]
    if not moved:
        return Finding(1, case, OK, f"the same bits in frames {', '.join(reference)}", "the same bits")
    frame = moved[0][0]
    names = [name for at, name in moved if at == frame]
    processor = platforms[here].get("processor", "unknown")
    other = "" if processor == environment()["processor"] else f"; the reference was taken on {processor}"
    return Finding(
        1, case, MOVED, f"other bits from frame {frame} on: {', '.join(names[:3])}{', ...' * (len(names) > 3)}",
        "the same bits", f"tier 2 takes over{other}",
    )  # fmt: skip


def _digest(values) -> str:
    return hashlib.sha256(values.astype("<f8").tobytes()).hexdigest()[:LETTERS]
