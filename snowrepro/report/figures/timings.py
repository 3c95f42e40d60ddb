"""Table 2: particles and seconds for each frame beside those of the paper."""

import pandas as pd

from ...evidence.gather import Evidence
from ...store.run import Run
from ...text import make_cells
from ..document import Block, FigureContent, Table
from .kinds import FigureKind

# Table 2 as printed: shape, floor, particles, seconds a frame; on a 2.5 GHz Core i7 under OS X 10.11.
TABLE_2 = (("ball", "L", 8151, 0.25), ("star", "square", 22076, 0.51))


def report(evidence: Evidence) -> FigureContent:
    """Tabulate particles and seconds for each frame beside those of the paper, with the machine and the substeps."""
    rows = []
    for shape, floor, particles, seconds in TABLE_2:
        matching = [run for run in evidence.runs if (run.case.shape.name, run.case.floor.name) == (shape, floor)]
        example = f"{shape} shape, {floor} floor"
        rows += [[example, f"{particles:,}", *_measure_run(run, evidence, seconds)] for run in matching]
    columns = ["example", "particles (paper)", "particles", "s/frame (paper)", "s/frame", "paper / here", "substeps"]
    table = pd.DataFrame(rows, columns=columns)
    make_cells(table).to_csv(evidence.folder / "table2.csv", index=False, lineterminator="\n")
    summary = "; ".join(f"{row[0]}: {row[2]} particles, {row[4]} s/frame (paper: {row[3]})" for row in rows)
    blocks: list[Block] = [
        Table(table, data="table2.csv"),
        (
            "Seconds a frame: mean over all frames of one run on one core, pressing, sintering, diagnostics and "
            "storing included, compilation not. Substeps: mean a frame; they follow the stiffness. The paper measured "
            "on a 2.5 GHz Core i7 and prints neither its time step nor its substeps, so the ratio compares machines "
            "and settings as much as programs."
        ),
        *_list_machines(evidence),
    ]
    return FigureContent(blocks, f"{summary}.")


def _list_machines(evidence: Evidence) -> list[str]:
    """List the machines on which the runs were timed."""
    machines = set()
    for run in evidence.runs:
        if evidence.is_done(run):
            with run.open() as dataset:
                machines.add(dataset.attrs["machine"])
    return [f"Here: {'; '.join(sorted(machines))}."] if machines else []


def _measure_run(run: Run, evidence: Evidence, printed: float) -> list[str]:
    """Format particles, the paper's seconds (``printed``), ours, their ratio, and substeps for each frame."""
    if not evidence.is_done(run):
        return ["missing", f"{printed:g}", "missing", "", ""]
    row = evidence.table.set_index("run_id").loc[run.id]
    with run.open() as dataset:
        substeps = float(dataset["substeps"][1:].mean())
    seconds = float(row["seconds_per_frame"])
    return [f"{row['particles']:,}", f"{printed:g}", f"{seconds:.3f}", f"{printed / seconds:.1f}", f"{substeps:.1f}"]


FIGURE = FigureKind(report)
