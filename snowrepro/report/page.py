"""The report of an experiment: its pictures and tables, and a page that puts them together."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from ..config import Config
from ..store.files import require_writable
from ..sweep.record import unseeded
from . import calibration, convergence, energy, grid, hardness, html, laws, markdown, scenes, strip, tables
from .about import about_runs, runs_anchor
from .document import Block, Document, Findings, Section, moved, plain
from .evidence import Evidence, gathered, in_paper_order, redo
from .lead import lead
from .records import write_document
from .viewer import Viewer
from .viewer import gathered as gathered_runs

MOST_BOLD = 400  # letters of a verdict
VIEWER_BYTES = 2_300_000  # of a page, which is to stay below 5 MB

# Who draws which picture.
PICTURES = {
    "strip": strip.report,
    "calibration": calibration.report,
    "shapes": scenes.report_shapes,
    "floors": scenes.report_floors,
    "setting": scenes.report_setting,
    "parameters": tables.report_parameters,
    "timings": tables.report_timings,
    "grid": grid.report,
    "convergence": convergence.report,
    "energy": energy.report,
    "hardness": hardness.report,
    "laws": laws.report,
}


@dataclass(frozen=True)
class Part:
    """What one experiment gives to a report."""

    evidence: Evidence
    findings: Findings
    redo: str

    @cached_property
    def viewer(self) -> Viewer | None:
        """Runs of one scene to look at in motion: of several the first whose numbers disagree with a claim."""
        scenes = self.evidence.scenes
        if not self.evidence.experiment.is_judged:
            return None
        chosen = next((scene for scene in scenes if any(v.agrees is False for v in scene.verdicts)), scenes[0])
        done = [c for c in in_paper_order(self.evidence.of_first_seed) if self.evidence.is_done(c)]
        shown = [c for c in done if (c.shape.name, c.floor.name) == (chosen.shape, chosen.floor)]
        return gathered_runs(shown, VIEWER_BYTES)

    def section(self, seen_from: Path) -> Section:
        """The experiment's section of a report in the folder ``seen_from``."""
        experiment, way = self.evidence.experiment, self.evidence.seen_from(seen_from)
        verdict = plain(self.findings.verdict)
        blocks: list[Block] = [f"**{verdict}**" if len(verdict) < MOST_BOLD else verdict, *self.findings.blocks]
        if way:
            blocks = [moved(block, way) for block in blocks]
        runs = runs_anchor(self.evidence) if experiment.needs_runs else ""
        return Section(experiment.name, plain(experiment.title), blocks, plain(experiment.says), self.redo, runs)


def draw(configs: Sequence[Config], overrides: Sequence[str], folder: Path | None = None) -> Part:
    """Draw an experiment's pictures and write its tables into its folder.  Raises StoreError where that cannot be."""
    folder = folder or report_folder(configs[0], overrides)
    require_writable(folder)
    evidence = gathered(configs, folder)
    if evidence.experiment.needs_runs:
        evidence.table.to_csv(folder / "summary.csv", index=False, float_format="%.6g", lineterminator="\n")
    findings = PICTURES[evidence.experiment.picture](evidence)
    return Part(evidence, findings, redo(overrides))


def write_page_of(part: Part, more: Sequence[Section] = ()) -> Path:
    """Write the report of one experiment; returns the page."""
    return write_page(part.evidence.experiment.title, [part], part.evidence.folder, more)


def write_page(title: str, parts: Sequence[Part | Section], folder: Path, more: Sequence[Section] = ()) -> Path:
    """Write index.html, index.md and report.json; returns the page.

    What one sees first, the parts, ``more``, and what all share.
    """
    require_writable(folder)
    evidences = [part.evidence for part in parts if isinstance(part, Part)]
    sections = [part.section(folder) if isinstance(part, Part) else part for part in parts]
    first, others = lead(evidences, sections)
    viewer = next((part.viewer for part in parts if isinstance(part, Part) and part.viewer), None)
    return write_document_to(Document(title, [first, *others, *more, *about_runs(evidences, folder)]), folder, viewer)


def write_document_to(document: Document, folder: Path, viewer: Viewer | None = None) -> Path:
    """Write a document's three forms into a folder; returns the page."""
    markdown.write(document, folder / "index.md")
    html.write(document, folder / "index.html", viewer)
    write_document(document, folder / "report.json")
    return folder / "index.html"


def report_folder(config: Config, overrides: Sequence[str]) -> Path:
    """Where an experiment's report goes: named as its sweep, whatever seeds it has."""
    assert config.experiment is not None, "only an experiment has a report"
    others = [o for o in overrides if not o.startswith("experiment=")]
    return Path(config.reports) / unseeded([f"experiment={config.experiment.name}", *others])
