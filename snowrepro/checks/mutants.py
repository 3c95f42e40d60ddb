"""Mutation testing of the checks: defects and harmless changes, each tried on a copy of the program.

``mutants.yaml`` lists them; a defect names the tier that must notice it.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from ..composition.compose import CONF_DIR
from ..errors import ConfigError, ExitCode
from ..report.document import Block, Document, Section, Table, escape
from ..report.page import markdown
from ..sources import digests_of
from ..store.files import published, read_json, write_json
from ..store.provenance import environment
from . import baseline as baselines
from .finding import MOVED, NOT_MEASURED, OK, TIERS, Finding
from .outputs import FILES
from .uses import find_one_experiment

LIST = Path(__file__).with_name("mutants.yaml")
PACKAGE = Path(__file__).resolve().parents[1]
PLUGINS = PACKAGE.parent / "hydra_plugins"
MOST_SECONDS = 3600.0
FINDINGS = "findings.csv"
# The modules that tiers 0 to 2 use, and those that all tiers use.
SHORT_CODE = tuple(f"checks.{name}" for name in ("cases", "fingerprints", "horizon", "invariances"))
LONG_CODE = (*SHORT_CODE, "checks.ensemble", "checks.verdicts")
HOW_TO_READ = (
    "A defect is shown to its own tier and one or two beside, a harmless change to all; tiers 3 and 4 look at Figure 5 "
    "alone. *moved*: other bits, handed on to tier 2, which decides; **n of m**: so many of the tier's checks failed; "
    "a dash: not asked."
)
NOT_CODE = shutil.ignore_patterns("__pycache__", "conf")


@dataclass(frozen=True)
class Edit:
    """One text replaced in one file of the package or of conf/."""

    file: str
    old: str
    new: str


@dataclass(frozen=True)
class Mutant:
    """A change of the program; ``tier``: the one that must notice it, None for a harmless change."""

    name: str
    tier: int | None
    edit: Edit

    @property
    def is_defect(self) -> bool:
        """Whether the change has to be noticed."""
        return self.tier is not None

    def tiers(self, full: bool) -> list[int]:
        """Return the tiers to run on it: its own and one or two beside, all for a harmless change or if ``full``."""
        beside = {0: [0, 1, 2], 1: [1, 2], 2: [1, 2], 3: [3, 4], 4: [3, 4]}
        return list(TIERS) if full or self.tier is None else beside[self.tier]


@dataclass(frozen=True)
class Trial:
    """A mutant with the findings of the checks on it; ``problem``: why they could not be run."""

    mutant: Mutant
    findings: tuple[Finding, ...] = ()
    problem: str = ""

    @property
    def is_right(self) -> bool:
        """Whether the checks are right: a defect is noticed by its tier, a harmless change by none."""
        if self.problem:
            return False
        caught = {finding.tier for finding in self.findings if finding.is_caught}
        if self.mutant.is_defect:
            return self.mutant.tier in caught
        return not caught and not any(finding.state == NOT_MEASURED for finding in self.findings)

    @property
    def verdict(self) -> str:
        """The verdict on the checks in a word or two."""
        if self.problem:
            return "NOT TRIED"
        if self.mutant.is_defect:
            return "caught" if self.is_right else "MISSED"
        return "left alone" if self.is_right else "FLAGGED"

    def tier(self, number: int) -> str:
        """Describe the findings of a tier in a few words."""
        findings = [finding for finding in self.findings if finding.tier == number]
        if not findings:
            return "-"
        caught = [finding for finding in findings if finding.is_caught]
        if caught:
            names = ", ".join(escape(finding.name) for finding in caught[:2]) + (", ..." if len(caught) > 2 else "")
            return f"**{len(caught)} of {len(findings)}**: {names}"
        states = {finding.state for finding in findings}
        return next((state for state in (NOT_MEASURED, MOVED, OK) if state in states), OK)


def read_mutants(path: Path = LIST) -> list[Mutant]:
    """Read the list of mutants, in its order.  Raises ConfigError where two have the same name."""
    mutants = []
    for entry in yaml.safe_load(path.read_text("utf-8")):
        edit = Edit(entry["file"], entry["old"], entry["new"])
        mutants.append(Mutant(entry["name"], entry.get("tier"), edit))
    if len({mutant.name for mutant in mutants}) < len(mutants):
        raise ConfigError(f"two mutants in {path} have the same name")
    return mutants


def copy_program(folder: Path) -> None:
    """Copy the package, its options and its plug-ins into ``folder``."""
    shutil.copytree(PACKAGE, folder / "snowrepro", ignore=NOT_CODE)
    shutil.copytree(CONF_DIR, folder / "conf")
    shutil.copytree(PLUGINS, folder / "hydra_plugins", ignore=NOT_CODE)


def apply_edit(folder: Path, edit: Edit) -> None:
    """Apply an edit to a copy of the program.  Raises ConfigError where the old text is not there exactly once."""
    path = folder / edit.file if edit.file.startswith("conf/") else folder / "snowrepro" / edit.file
    text = path.read_text("utf-8")
    if text.count(edit.old) != 1:
        raise ConfigError(f"'{edit.old}' stands {text.count(edit.old)} times in {edit.file}, and should once")
    path.write_text(text.replace(edit.old, edit.new), encoding="utf-8")


def try_mutants(mutants: Sequence[Mutant], baseline: Path, store: Path, full: bool, workers: int) -> Iterator[Trial]:
    """Try mutants, several at once; yields each trial when it ends.

    A mutant that was tried before on this code is not tried again.  ``baseline``: the references; ``store``: that of
    the unchanged program's checks, where findings are kept, and whose runs are shared with mutants that do not change
    them.  Tiers 3 and 4 look at one experiment alone.  Raises
    ConfigError where no one experiment is for that.
    """
    experiment = find_one_experiment("mutants")
    with ThreadPoolExecutor(workers) as pool:
        waiting = [pool.submit(_try_mutant, mutant, baseline, store, full, experiment) for mutant in mutants]
        try:
            for done in as_completed(waiting):
                yield done.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _try_mutant(mutant: Mutant, baseline: Path, store: Path, full: bool, experiment: str) -> Trial:
    """Run the tiers on a changed copy of the program, or read what they found before."""
    tiers = mutant.tiers(full)
    memory = store / "mutants" / f"{_make_key(mutant, baseline, tiers)}.json"
    record = read_json(memory)
    if record:
        return Trial(mutant, tuple(Finding(**finding) for finding in record["findings"]))
    memory.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="of-", dir=memory.parent) as name:
        folder = Path(name).resolve()
        try:
            copy_program(folder)
            apply_edit(folder, mutant.edit)
        except (ConfigError, OSError) as error:
            return Trial(mutant, problem=str(error))
        if 3 in tiers or 4 in tiers:
            _share_runs(store, folder / "runs")
        finding, problem = _run_check(folder, tiers, baseline, experiment)
    if not problem:
        write_json(memory, {"mutant": asdict(mutant), "findings": [asdict(f) for f in finding]})
    return Trial(mutant, finding, problem)


def _share_runs(store: Path, copy: Path) -> None:
    """Link finished runs into the changed program's store; it repeats those that it would simulate otherwise."""
    for manifest in store.glob("*/manifest.json"):
        target = copy / manifest.parent.name
        target.mkdir(parents=True, exist_ok=True)
        for path in manifest.parent.iterdir():
            os.link(path, target / path.name)


def _run_check(folder: Path, tiers: Sequence[int], baseline: Path, experiment: str) -> tuple[tuple[Finding, ...], str]:
    """Run the changed program's own check; returns its findings, or none and the reason."""
    options = {
        "--tier": ",".join(map(str, tiers)), "--only": experiment, "--workers": 1, "--baseline": baseline.resolve(),
        "--store": folder / "runs", "--out": folder / "out",
    }  # fmt: skip
    command = [sys.executable, "-m", "snowrepro", "check", *(str(word) for pair in options.items() for word in pair)]
    try:
        process = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=MOST_SECONDS, check=False,
            env={**os.environ, "PYTHONPATH": str(folder)},
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return (), f"not done after {MOST_SECONDS:.0f} s"
    record = read_json(folder / "out" / FILES[0])
    if not record.get("finished"):
        last = (process.stderr.strip().splitlines() or ["no message"])[-1]
        return (), f"the check itself ended with {process.returncode}: {last}"
    return tuple(Finding(**finding) for finding in record["findings"]), ""


def _make_key(mutant: Mutant, baseline: Path, tiers: Sequence[int]) -> str:
    """Make the key of a trial: a digest of the change, the tiers, the code that they use and their references."""
    modules = SHORT_CODE if set(tiers) <= {0, 1, 2} else LONG_CODE
    code = {name: digest_of_file for module in modules for name, digest_of_file in digests_of(module).items()}
    digest = hashlib.sha256(json.dumps([asdict(mutant), [*tiers], environment(), code]).encode())
    places = [(CONF_DIR, "*/*.yaml"), *((baseline, f"{baselines.PARTS[tier]}.*") for tier in tiers if tier)]
    for folder, pattern in places:
        for path in sorted(folder.glob(pattern)):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def count_trials(trials: Sequence[Trial]) -> str:
    """Count the trials that went right, in a line."""
    defects = [trial for trial in trials if trial.mutant.is_defect]
    harmless = [trial for trial in trials if not trial.mutant.is_defect]
    flagged = sum(not trial.is_right for trial in harmless)
    return (
        f"{sum(trial.is_right for trial in defects)} of {len(defects)} defects caught by their tier, "
        f"{flagged} of {len(harmless)} harmless changes flagged"
    )


def choose_exit_code(trials: Sequence[Trial]) -> ExitCode:
    """Choose the exit code: regressed where a trial went wrong, incomplete where a mutant could not be tried."""
    if any(not trial.is_right and not trial.problem for trial in trials):
        return ExitCode.REGRESSED
    return ExitCode.INCOMPLETE if any(trial.problem for trial in trials) else ExitCode.FINE


def list_wrong_trials(trials: Sequence[Trial]) -> list[str]:
    """List the trials that went wrong, and the counts, as lines for a screen."""
    wrong = [trial for trial in trials if not trial.is_right]
    return [*(f"{trial.verdict}: {trial.mutant.name} {trial.problem}" for trial in wrong), count_trials(trials)]


def tabulate_trials(trials: Sequence[Trial]) -> pd.DataFrame:
    """Tabulate the trials, a row for each mutant in the order of the list."""
    return pd.DataFrame(
        [
            {
                "change": escape(trial.mutant.name),
                "must be noticed by": f"tier {trial.mutant.tier}" if trial.mutant.is_defect else "none",
                "": trial.verdict if trial.is_right else f"**{trial.verdict}** {escape(trial.problem)}".strip(),
                **{f"tier {number}": trial.tier(number) for number in TIERS},
            }
            for trial in _sort_trials(trials)
        ]
    )


def write_trials(trials: Sequence[Trial], about: Mapping[str, Any], folder: Path) -> None:
    """Write index.md and a table of the findings into a folder.  Raises StoreError."""
    blocks: list[Block] = [
        f"{count_trials(trials)}.",
        HOW_TO_READ,
        Table(tabulate_trials(trials), "Every finding with its figures:", FINDINGS),
        "  \n".join(f"{name}: {escape(value)}" for name, value in about.items()),
    ]
    section = Section("mutants", "", blocks, command="snowrepro check --mutants")
    markdown.write_markdown(Document("What the checks notice", [section]), folder / "index.md")
    with published(folder / FINDINGS) as partial:
        tabulate_findings(trials).to_csv(partial, index=False, lineterminator="\n")


def tabulate_findings(trials: Sequence[Trial]) -> pd.DataFrame:
    """Tabulate the findings on all mutants that are not ok, a row for each finding."""
    return pd.DataFrame(
        [
            {
                "change": trial.mutant.name,
                "declared_tier": trial.mutant.tier,
                "verdict": trial.verdict,
                **asdict(finding),
            }
            for trial in _sort_trials(trials)
            for finding in trial.findings
            if finding.state != OK
        ]
    )


def _sort_trials(trials: Sequence[Trial]) -> list[Trial]:
    """Sort trials in the order of the list of mutants."""
    order = [mutant.name for mutant in read_mutants()]
    return sorted(trials, key=lambda trial: order.index(trial.mutant.name))
