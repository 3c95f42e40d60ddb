"""What the viewer holds of one run: its particles at some frames, their colours there, and the shares of the frames."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...analysis.lumps import Classification, find_frame_before
from ...store.run import Run
from ...summary.classify import classify
from ..drawing.colouring import index_colours

FIELDS = ("density", "J_P")
FINENESS = 1024  # of the squares along a side by which particles are put in order


@dataclass(frozen=True)
class EmbeddedRun:
    """One run, with its particles in an order in which neighbours are mostly near each other.

    ``places`` (frames, n, 2); ``fields`` by name (frames, n), and their ``units``; ``colours`` (frames, n): indices of
    PALETTE; ``gone`` (n,): the index of the frame from which on a particle has vanished, or the number of frames;
    ``shares`` and ``lumps`` (frames,): part of the mass in each of STATES, and number of lumps; None before release.
    """

    run: Run
    places: np.ndarray
    fields: dict[str, np.ndarray]
    units: dict[str, str]
    colours: np.ndarray
    gone: np.ndarray
    shares: list[list[float] | None]
    lumps: list[int | None]


def embed(run: Run, frames: Sequence[int]) -> EmbeddedRun:
    """Read a finished run at ``frames``, which contain the release; where one is not stored, as it was before."""
    with run.open() as dataset:
        held = [find_frame_before(dataset["snapshot"].values, frame) for frame in frames]
        released = sorted({frame for frame in held if frame >= int(dataset.attrs["release_frame"])})
        classified = classify(dataset, run.config.question.analysis, frames=released)
        stored = dataset[["position", *FIELDS]].sel(snapshot=held).load()
    order = _order_along_curve(stored["position"].values[0])
    places = stored["position"].values[:, order].astype(float)
    gone = np.isnan(places).any(axis=2)
    shares, lumps = _list_shares(classified, held)
    return EmbeddedRun(
        run,
        _keep_last_places(places, gone),
        {name: np.nan_to_num(stored[name].values[:, order]) for name in FIELDS},
        {name: stored[name].attrs["units"] for name in FIELDS},
        index_colours(classified, held)[:, order],
        len(frames) - gone.sum(axis=0),
        shares,
        lumps,
    )


def _list_shares(
    classified: Classification, frames: Sequence[int]
) -> tuple[list[list[float] | None], list[int | None]]:
    """List the part of the mass in each of STATES, and the number of lumps, of each frame; None before the release."""
    found = {fragments.frame: fragments for fragments in classified.fragments}
    here = [found.get(frame) for frame in frames]
    return [list(f.shares.values()) if f else None for f in here], [f.lumps if f else None for f in here]


def _order_along_curve(places: np.ndarray) -> np.ndarray:
    """Order particles at ``places`` (n, 2) along a curve through all squares of a grid (Morton); returns (n,)."""
    low = places.min(axis=0)
    square = ((places - low) / max(np.ptp(places, axis=0).max(), np.finfo(float).tiny) * (FINENESS - 1)).astype(int)
    code = np.zeros(len(places), dtype=int)
    for bit in range(FINENESS.bit_length() - 1):
        for axis in range(2):
            code |= ((square[:, axis] >> bit) & 1) << (2 * bit + axis)
    return np.argsort(code, kind="stable")


def _keep_last_places(places: np.ndarray, gone: np.ndarray) -> np.ndarray:
    """Keep particles that are ``gone`` (frames, n) where they were last; ``places`` (frames, n, 2)."""
    for frame in range(1, len(places)):
        places[frame][gone[frame]] = places[frame - 1][gone[frame]]
    return places
