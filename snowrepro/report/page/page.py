"""The report of an experiment: its pictures and tables, and the page that contains them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from ...evidence.gather import Evidence, command_to_repeat, find_experiment, gather_evidence, sort_as_in_paper
from ...store.files import require_no_links, require_writable
from ...summary.row import ARM
from ...sweep.plan import Plan
from ...text import make_cells
from ..document import Block, Document, FigureContent, Section, escape, relocate_block
from ..drawing.common import own_style
from ..figures.kinds import find_figure
from ..sections.records import write_json
from ..viewer.viewer import Viewer, embed_runs
from .about import make_run_sections, make_runs_anchor
from .folder import find_report_folder
from .html import write_html
from .lead import make_lead
from .markdown import write_markdown, write_markdown_parts

RESULTS = "Results"
MOST_BOLD = 400  # letters of a verdict
VIEWER_BYTES = 2_300_000  # of a page, which is to stay below 5 MB


@dataclass(frozen=True)
class ExperimentReport:
    """What one experiment contributes to a report.

    ``content``: what its figure shows; ``command``: the command that makes runs and report again.
    """

    evidence: Evidence
    content: FigureContent
    command: str

    @cached_property
    def viewer(self) -> Viewer | None:
        """The interactive viewer for the runs of one scene, first seed; None if no claims are judged or no run fits.

        Of several scenes it shows the first whose numbers disagree with a claim.
        """
        scenes = self.evidence.scenes
        if not find_figure(self.evidence.experiment).is_judged:
            return None
        chosen = next((scene for scene in scenes if any(v.agrees is False for v in scene.verdicts)), scenes[0])
        done = [run for run in sort_as_in_paper(self.evidence.first_seed_runs) if self.evidence.is_done(run)]
        of_scene = [run for run in done if (run.case.shape.name, run.case.floor.name) == (chosen.shape, chosen.floor)]
        return embed_runs(of_scene, VIEWER_BYTES)

    def make_section(self, folder: Path) -> Section:
        """Make the experiment's section of a report in ``folder``."""
        experiment, path = self.evidence.experiment, self.evidence.path_from(folder)
        verdict = escape(self.content.verdict)
        blocks: list[Block] = [f"**{verdict}**" if len(verdict) < MOST_BOLD else verdict, *self.content.blocks]
        if path:
            blocks = [relocate_block(block, path) for block in blocks]
        runs = make_runs_anchor(self.evidence) if find_figure(experiment).needs_runs else ""
        return Section(experiment.name, escape(experiment.title), blocks, escape(experiment.says), self.command, runs)


@own_style()
def draw_experiment(plan: Plan, folder: Path | None = None) -> ExperimentReport:
    """Draw the pictures and write the tables of an experiment, or of a sweep that is none.

    ``folder``: where to; by default the folder of the sweep's own report.  Raises StoreError if it cannot be written.
    """
    folder = folder or find_report_folder(plan.runs[0], plan.overrides)
    require_no_links(folder)
    require_writable(folder)
    figure = find_figure(find_experiment(plan.runs))
    evidence = gather_evidence(plan.runs, folder, figure.needs_runs, plan)
    if figure.needs_runs:
        make_cells(evidence.table.drop(columns=ARM, errors="ignore")).to_csv(
            folder / "summary.csv", index=False, float_format="%.6g", lineterminator="\n"
        )
    return ExperimentReport(evidence, figure.report(evidence), command_to_repeat(plan.overrides))


def write_experiment_page(report: ExperimentReport, sections: Sequence[Section] = ()) -> Path:
    """Write the report of one experiment, followed by ``sections``; returns the page."""
    return write_page(report.evidence.experiment.title, [report], report.evidence.folder, sections)


@own_style()
def write_page(
    title: str,
    contents: Sequence[ExperimentReport | Section],
    folder: Path,
    more: Sequence[Section] = (),
    in_parts: bool = False,
) -> Path:
    """Write a report as index.html, index.md and report.json; returns the page.

    It consists of the summary, ``contents``, the sections ``more``, and the sections on all runs.  ``in_parts``:
    whether its Markdown is a file for each of these.
    """
    require_no_links(folder)
    require_writable(folder)
    evidences = [content.evidence for content in contents if isinstance(content, ExperimentReport)]
    sections = [
        content.make_section(folder) if isinstance(content, ExperimentReport) else content for content in contents
    ]
    # A page on one experiment has its title above: the section needs another.
    sections = [replace(each, title=RESULTS) if each.title == escape(title) else each for each in sections]
    not_run = [content.title for content in contents if isinstance(content, Section)]
    first, others = make_lead(evidences, sections, not_run)
    viewer = next(
        (content.viewer for content in contents if isinstance(content, ExperimentReport) and content.viewer), None
    )
    return write_document(
        Document(title, [first, *others, *more, *make_run_sections(evidences, folder)]), folder, viewer, in_parts
    )


def write_document(document: Document, folder: Path, viewer: Viewer | None = None, in_parts: bool = False) -> Path:
    """Write a document as HTML, Markdown, if asked for ``in_parts``, and JSON into a folder; returns the page."""
    if in_parts:
        write_markdown_parts(document, folder)
    else:
        write_markdown(document, folder / "index.md")
    write_html(document, folder / "index.html", viewer)
    write_json(document, folder / "report.json")
    return folder / "index.html"
