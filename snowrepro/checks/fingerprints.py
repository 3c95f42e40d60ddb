"""Tier 1: the bits of short runs compared with those of the reference, for each platform that has one."""

import hashlib
import platform
from collections.abc import Mapping

import numpy as np

from ..compiler import name_compiler
from ..store.provenance import environment
from .cases import State
from .finding import MOVED, OK, Finding

Prints = dict[str, dict[str, str]]  # frame, quantity, digest
LETTERS = 16


def name_platform() -> str:
    """Name the platform that bits belong to: system, architecture, compiler; not Python or NumPy."""
    compiler = name_compiler()
    return f"{platform.system()} {platform.machine()}, {compiler} {environment()[compiler]}"


def find_platform(platforms: Mapping[str, Mapping]) -> str:
    """Find the platform to compare with: this one, or else its system and architecture with another compiler.

    Taichi and Quadrants give the same bits.  This one too where there is neither.
    """
    here = name_platform()
    machine = here.partition(",")[0]
    return next((name for name in (here, *platforms) if name in platforms and name.partition(",")[0] == machine), here)


def take_fingerprints(states: Mapping[int, State]) -> Prints:
    """Take the digest of every observed quantity in the watched frames."""
    return {
        str(frame): {name: _digest_bits(values) for name, values in state.items()} for frame, state in states.items()
    }


def compare_with_reference(case: str, prints: Prints, platforms: Mapping[str, Mapping]) -> Finding:
    """Compare the fingerprints of a case with those of this platform.

    Where there are none, see ``find_platform``, or bits moved, tier 2 decides.  ``platforms``: by ``name_platform``,
    the fingerprints of each case and the ``processor`` that they were taken on.
    """
    here, of = name_platform(), find_platform(platforms)
    reference = platforms.get(of, {}).get("cases", {}).get(case)
    expected = "the same bits" if of == here else f"the same bits as on {of}"
    if reference is None:
        known = "; ".join(platforms) or "none"
        return Finding(1, case, MOVED, f"no fingerprint for {here}", expected, f"tier 2 takes over; known: {known}")
    moved = [
        (frame, name)
        for frame, digests in reference.items()
        for name in digests
        if prints.get(frame, {}).get(name) != digests[name]
    ]
    if not moved:
        return Finding(1, case, OK, f"the same bits in frames {', '.join(reference)}", expected)
    frame = moved[0][0]
    names = [name for at, name in moved if at == frame]
    processor = platforms[of].get("processor", "unknown")
    other = "" if processor == environment()["processor"] else f"; the reference was taken on {processor}"
    return Finding(
        1, case, MOVED, f"other bits from frame {frame} on: {', '.join(names[:3])}{', ...' * (len(names) > 3)}",
        expected, f"tier 2 takes over{other}",
    )  # fmt: skip


def _digest_bits(values: np.ndarray) -> str:
    """Return a digest of the bits of numbers, as little-endian doubles."""
    return hashlib.sha256(values.astype("<f8").tobytes()).hexdigest()[:LETTERS]
