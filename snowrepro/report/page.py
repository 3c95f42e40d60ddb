"""Write the report of an experiment: pictures, summary.csv and index.md with the verdict first."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from ..config import Config, Experiment
from ..mpm.diagnostics import bounded
from ..store.files import require_writable
from ..store.states import standing
from . import calibration, convergence, energy, grid, hardness, laws, scenes, strip, tables
from .evidence import Evidence, gathered, in_paper_order, markdown, name_of, opened, origin

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
MOST_LISTED = 48  # runs; more are in summary.csv alone

# Columns of the summary that the page shows, and their heads.
SHOWN = {
    "shape": "shape",
    "floor": "floor",
    "pressure": "pressure",
    "sintering": "sintering",
    "seed": "seed",
    "indenter": "indenter",  # in experiments that have one
    "hardness": "hardness",
    "lump_fraction": "lumps [mass]",
    "lumps": "lumps [count]",
    "largest_fragment": "largest",
    "broken_bonds": "bonds broken",
    "settled": "settled",
    "density_at_release": "density",
    "hardening_at_release": "xi",
    "factor_at_release": "hardening factor",
    "poisson_capped": "nu capped",
    "hardening_capped": "Eq. 1 capped",
    "hardening_floored": "Eq. 1 floored",
    "seconds": "seconds",
}


@dataclass(frozen=True)
class Report:
    """Where a report was written and the sentence it comes to."""

    folder: Path
    verdict: str


def write_report(configs: Sequence[Config], overrides: Sequence[str]) -> Report:
    """Report on an experiment from the store alone; runs that are missing are shown as missing."""
    experiment = configs[0].experiment
    assert experiment is not None, "only an experiment has a report"
    folder = report_folder(configs[0], experiment)
    require_writable(folder)
    evidence = gathered(configs, folder)
    findings = PICTURES[experiment.picture](evidence)
    page = [f"# {experiment.title}", "", *findings.lines, ""]
    if experiment.needs_runs:
        evidence.table.to_csv(folder / "summary.csv", index=False, float_format="%.6g", lineterminator="\n")
        page += [*_runs(evidence), *_reading(configs[0])]
    page += origin(evidence, "run", overrides)
    (folder / "index.md").write_text("\n".join(page).rstrip() + "\n", encoding="utf-8")
    return Report(folder, findings.verdict)


def report_folder(config: Config, experiment: Experiment) -> Path:
    """reports/<experiment>, with the fidelity behind it unless it is the paper's."""
    suffix = "" if config.fidelity.name == "paper" else f"-{config.fidelity.name}"
    return Path(config.reports) / f"{experiment.name}{suffix}"


def _runs(evidence: Evidence) -> list[str]:
    """Numbers of each run, what had to be bounded, and what is missing."""
    lines = ["## Runs", ""]
    if len(evidence.configs) > MOST_LISTED:
        lines += [f"All {len(evidence.table)} finished runs, a row each: [summary.csv](summary.csv).", ""]
    elif len(evidence.table):
        lines += [
            *markdown(evidence.table[[name for name in SHOWN if name in evidence.table]].rename(columns=SHOWN)),
            "",
            "Density, xi and hardening factor (geometric mean) are at release, means over particles. nu capped, "
            "Eq. 1 capped and floored: the most particles at a bound in any frame. All columns: "
            "[summary.csv](summary.csv).",
            "",
            "What was bounded, on how many particles at most, and since when:",
            "",
            *(f"- {name_of(c)}: {_bounds(c)}" for c in in_paper_order(evidence.configs) if evidence.is_done(c)),
            "",
        ]
    for config in evidence.configs:
        if not evidence.is_done(config):
            lines += [f"- **missing**: {name_of(config)}: {standing(config).reason}", ""]
    return lines


def _bounds(config: Config) -> str:
    with opened(config) as dataset:
        return "; ".join(bounded(dataset)) or "nothing"


def _reading(config: Config) -> list[str]:
    """Every choice that the paper leaves open, as made here."""
    choices = pd.DataFrame(config.reading.model_dump().items(), columns=["choice", "value"]).astype(str)
    return [
        "## What the paper leaves open, as read here",
        "",
        f"Reading `{config.reading.name}`, fidelity `{config.fidelity.name}`, seed {config.seed}. "
        "Each switch is explained in conf/reading/grid_units.yaml.",
        "",
        *markdown(choices),
        "",
    ]
