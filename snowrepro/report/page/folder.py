"""The folder of a report."""

from collections.abc import Sequence
from pathlib import Path

from ...store.run import Run
from ...sweep.record import name_without_seeds


def find_report_folder(run: Run, overrides: Sequence[str]) -> Path:
    """Find the folder of a sweep's report; it is named like the sweep, but without seeds.

    ``run``: any of the sweep's runs; ``overrides``: those of the sweep.
    """
    experiment = run.config.question.experiment
    others = [override for override in overrides if not override.startswith("experiment=")]
    named = [f"experiment={experiment.name}", *others] if experiment else others
    return Path(run.config.question.reports) / name_without_seeds(named)
