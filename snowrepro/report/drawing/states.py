"""The colours of lumps, crushed and loose snow, and the legend that names them."""

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch
from scipy.spatial import cKDTree

from ...analysis.fragments import Fragments
from ...analysis.lumps import Classification
from ...analysis.motion import Motion
from ...analysis.states import STATES

# Colour-blind readers tell them apart, on the paper's sky and floor too: tests/report/test_colours.py.
LUMPS = ("#fc6c24", "#24d8fc", "#9024b4", "#b4fc00", "#b40000", "#d8906c", "#6c00fc")
CRUSHED, LOOSE = "#2c3a57", "#f4ead0"
WORDS = ("lumps, a colour each", "crushed", "loose")
LEGEND = " ".join(WORDS)
FOOT = 0.3  # height of the legend below panels [inches]
NEAR = 2.0  # cells of the paper; lumps as near as that have different colours


def colour_fragments(classified: Classification) -> list[np.ndarray]:
    """Choose a colour for each particle in each classified frame; returns one array (n,) of colours for each frame.

    It is that of the particle's largest part.  A lump keeps the colour that its id had before.  A new lump gets the one
    that covers the least mass, of those that no lump beside it has, now or at the end.
    """
    colour_of_lump: dict[int, str] = {}
    beside_at_end = find_lumps_beside(classified.last, classified.motion)
    colours_by_frame = []
    for fragments in classified.fragments:
        _colour_new_lumps(fragments, classified.motion, beside_at_end, colour_of_lump)
        colours = np.array([colour_of_lump.get(name, LOOSE) for name in fragments.id.tolist()], dtype=object)
        state = fragments.largest_state
        colours_by_frame.append(np.choose(state, [colours[fragments.label], CRUSHED, LOOSE]))
    return colours_by_frame


def find_lumps_beside(fragments: Fragments, motion: Motion) -> dict[int, set[int]]:
    """Find the ids of the lumps that are NEAR each lump, by its id."""
    is_in_lump = fragments.largest_state == STATES.index("lump")
    places = motion.position[motion.index(fragments.frame)][is_in_lump].astype(float)
    ids = fragments.id[fragments.label[is_in_lump]]
    squares = np.unique(np.column_stack([np.floor(places / (NEAR * motion.cell)), ids]), axis=0)
    touching = squares[cKDTree(squares[:, :-1]).query_pairs(1.5, p=np.inf, output_type="ndarray"), -1].astype(int)
    beside: dict[int, set[int]] = defaultdict(set)
    for one, other in np.unique(touching[touching[:, 0] != touching[:, 1]], axis=0).tolist():
        beside[one].add(other)
        beside[other].add(one)
    return beside


def _colour_new_lumps(
    fragments: Fragments, motion: Motion, beside_at_end: Mapping[int, set[int]], colour_of_lump: dict[int, str]
) -> None:
    """Add the colours of the lumps that are new in a frame, the heaviest first."""
    ids, mass = fragments.id[fragments.is_lump].tolist(), fragments.mass[fragments.is_lump].tolist()
    if not set(ids) - set(colour_of_lump):
        return
    beside = find_lumps_beside(fragments, motion)
    mass_in_colour = dict.fromkeys(LUMPS, 0.0)
    for lump, its_mass in zip(ids, mass, strict=True):
        if lump in colour_of_lump:
            mass_in_colour[colour_of_lump[lump]] += its_mass
    for lump, its_mass in zip(ids, mass, strict=True):
        if lump not in colour_of_lump:
            others = beside.get(lump, set()) | beside_at_end.get(lump, set())
            taken = {colour_of_lump.get(other) for other in others}
            free = [colour for colour in LUMPS if colour not in taken] or LUMPS
            colour_of_lump[lump] = min(free, key=mass_in_colour.__getitem__)
            mass_in_colour[colour_of_lump[lump]] += its_mass


def add_state_legend(figure: Figure, letters: float, **place: Any) -> None:
    """Add the legend of the three states, in a line; ``letters``: their points; ``place``: as Matplotlib has it."""
    lumps = tuple(Patch(facecolor=colour, linewidth=0) for colour in LUMPS[:4])
    others = [Patch(facecolor=colour, edgecolor="0.4", linewidth=0.5) for colour in (CRUSHED, LOOSE)]
    handles: list[Any] = [lumps, *others]
    figure.legend(
        handles, WORDS, handler_map={tuple: HandlerTuple(ndivide=None, pad=0.0)}, ncols=3, frameon=False,
        fontsize=letters, borderpad=0.0, borderaxespad=0.2, handlelength=1.6, columnspacing=1.2, **place,
    )  # fmt: skip
