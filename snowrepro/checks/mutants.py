"""Do the checks notice?  Deliberate defects and harmless changes, each tried on a copy of the program.

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

from ..composition import CONF_DIR
from ..errors import ConfigError, ExitCode
from ..report import markdown
from ..report.document import Document, Section, Table, plain
from ..store.files import published, read_json, write_json
from ..store.manifest import SOURCES
from ..store.provenance import environment
from . import baseline as baselines
from .finding import MOVED, NOT_MEASURED, OK, TIERS, Finding
from .outputs import FILES

LIST = Path(__file__).with_name("mutants.yaml")
PACKAGE = Path(__file__).resolve().parents[1]
PLUGINS = PACKAGE.parent / "hydra_plugins"
MOST_SECONDS = 3600.0
FINDINGS = "findings.csv"
ONLY = "fig5"  # of tiers 3 and 4
# What tiers 0 to 2 look at and are made of; what the others do beside.
SHORT_CODE = (*SOURCES, *(f"checks/{name}.py" for name in ("cases", "check", "fingerprints", "horizon", "invariances")))
LONG_CODE = (*SHORT_CODE, "checks/ensemble.py", "checks/verdicts.py", "analysis/*.py", "sweep/*.py", "store/*.py")
NOT_CODE = shutil.ignore_patterns("__pycache__", "conf")


@dataclass(frozen=True)
class Edit:
    """One text replaced in one file of the package or of conf/."""

    file: str
    old: str
    new: str


@dataclass(frozen=True)
class Mutant:
    """A change of the program.  ``tier``: that must notice it; None: it is harmless."""

    name: str
    tier: int | None
    edit: Edit

    @property
    def is_defect(self) -> bool:
        """Whether it has to be noticed."""
        return self.tier is not None

    def tiers(self, full: bool) -> list[int]:
        """Those that it is shown to: its own and one or two beside, a harmless change to all."""
        beside = {0: [0, 1, 2], 1: [1, 2], 2: [1, 2], 3: [3, 4], 4: [3, 4]}
        return list(TIERS) if full or self.tier is None else beside[self.tier]


@dataclass(frozen=True)
class Trial:
    """What the checks made of a mutant; ``problem``: why they could not be asked."""

    mutant: Mutant
    findings: tuple[Finding, ...] = ()
    problem: str = ""

    @property
    def is_right(self) -> bool:
        """A defect is noticed by its tier; a harmless change by none."""
        if self.problem:
            return False
        caught = {found.tier for found in self.findings if found.is_caught}
        if self.mutant.is_defect:
            return self.mutant.tier in caught
        return not caught and not any(found.state == NOT_MEASURED for found in self.findings)

    @property
    def verdict(self) -> str:
        """In a word or two."""
        if self.problem:
            return "NOT TRIED"
        if self.mutant.is_defect:
            return "caught" if self.is_right else "MISSED"
        return "left alone" if self.is_right else "FLAGGED"

    def tier(self, number: int) -> str:
        """What a tier said, in a few words."""
        own = [found for found in self.findings if found.tier == number]
        if not own:
            return "-"
        caught = [found for found in own if found.is_caught]
        if caught:
            names = ", ".join(plain(found.name) for found in caught[:2]) + (", ..." if len(caught) > 2 else "")
            return f"**{len(caught)} of {len(own)}**: {names}"
        states = {found.state for found in own}
        return next((state for state in (NOT_MEASURED, MOVED, OK) if state in states), OK)


def read_list(path: Path = LIST) -> list[Mutant]:
    """The mutants, defects first as they are listed.  Raises ConfigError where two have one name."""
    mutants = []
    for entry in yaml.safe_load(path.read_text("utf-8")):
        edit = Edit(entry["file"], entry["old"], entry["new"])
        mutants.append(Mutant(entry["name"], entry.get("tier"), edit))
    if len({mutant.name for mutant in mutants}) < len(mutants):
        raise ConfigError(f"two mutants in {path} have the same name")
    return mutants


def copy_of_program(folder: Path) -> None:
    """The package, options and plug-ins in ``folder``."""
    shutil.copytree(PACKAGE, folder / "snowrepro", ignore=NOT_CODE)
    shutil.copytree(CONF_DIR, folder / "conf")
    shutil.copytree(PLUGINS, folder / "hydra_plugins", ignore=NOT_CODE)


def change(folder: Path, edit: Edit) -> None:
    """Change a copy of the program.  Raises ConfigError where the old text does not stand there once."""
    path = folder / edit.file if edit.file.startswith("conf/") else folder / "snowrepro" / edit.file
    text = path.read_text("utf-8")
    if text.count(edit.old) != 1:
        raise ConfigError(f"'{edit.old}' stands {text.count(edit.old)} times in {edit.file}, and should once")
    path.write_text(text.replace(edit.old, edit.new), encoding="utf-8")


def try_all(mutants: Sequence[Mutant], baseline: Path, store: Path, full: bool, workers: int) -> Iterator[Trial]:
    """Try the mutants, several at once, as they end; those that were tried before on this code are not tried again.

    ``baseline``: the references; ``store``: that of the unchanged program's checks, which keeps what is found, and
    whose runs those changes share that make no other runs.
    """
    with ThreadPoolExecutor(workers) as pool:
        waiting = [pool.submit(_try, mutant, baseline, store, full) for mutant in mutants]
        try:
            for done in as_completed(waiting):
                yield done.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _try(mutant: Mutant, baseline: Path, store: Path, full: bool) -> Trial:
    tiers = mutant.tiers(full)
    memory = store / "mutants" / f"{_key(mutant, baseline, tiers)}.json"
    known = read_json(memory)
    if known:
        return Trial(mutant, tuple(Finding(**found) for found in known["findings"]))
    memory.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="of-", dir=memory.parent) as name:
        folder = Path(name).resolve()
        try:
            copy_of_program(folder)
            change(folder, mutant.edit)
        except (ConfigError, OSError) as error:
            return Trial(mutant, problem=str(error))
        if 3 in tiers or 4 in tiers:
            _share_runs(store, folder / "runs")
        found, problem = _check(folder, tiers, baseline)
    if not problem:
        write_json(memory, {"mutant": asdict(mutant), "findings": [asdict(f) for f in found]})
    return Trial(mutant, found, problem)


def _share_runs(store: Path, copy: Path) -> None:
    """Link finished runs into the changed program's store; it does those again that it would make otherwise."""
    for manifest in store.glob("*/manifest.json"):
        target = copy / manifest.parent.name
        target.mkdir(parents=True, exist_ok=True)
        for path in manifest.parent.iterdir():
            os.link(path, target / path.name)


def _check(folder: Path, tiers: Sequence[int], baseline: Path) -> tuple[tuple[Finding, ...], str]:
    """What the changed program's own check says; and why it says nothing, if so."""
    options = {
        "--tier": ",".join(map(str, tiers)), "--only": ONLY, "--workers": 1, "--baseline": baseline.resolve(),
        "--store": folder / "runs", "--out": folder / "out",
    }  # fmt: skip
    command = [sys.executable, "-m", "snowrepro", "check", *(str(word) for pair in options.items() for word in pair)]
    try:
        ended = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=MOST_SECONDS,
            env={**os.environ, "PYTHONPATH": str(folder)},
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return (), f"not done after {MOST_SECONDS:.0f} s"
    record = read_json(folder / "out" / FILES[0])
    if not record.get("finished"):
        last = (ended.stderr.strip().splitlines() or ["no message"])[-1]
        return (), f"the check itself ended with {ended.returncode}: {last}"
    return tuple(Finding(**found) for found in record["findings"]), ""


def _key(mutant: Mutant, baseline: Path, tiers: Sequence[int]) -> str:
    """What a trial depends on: the change, the tiers, the code that they look at, their references."""
    code = SHORT_CODE if set(tiers) <= {0, 1, 2} else LONG_CODE
    places = [(PACKAGE, pattern) for pattern in code]
    places += [(CONF_DIR, "*/*.yaml"), *((baseline, f"{baselines.PARTS[tier]}.*") for tier in tiers if tier)]
    digest = hashlib.sha256(json.dumps([asdict(mutant), [*tiers], environment()]).encode())
    for folder, pattern in places:
        for path in sorted(folder.glob(pattern)):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def counts(trials: Sequence[Trial]) -> str:
    """All trials in a line."""
    defects = [trial for trial in trials if trial.mutant.is_defect]
    harmless = [trial for trial in trials if not trial.mutant.is_defect]
    flagged = sum(not trial.is_right for trial in harmless)
    return (
        f"{sum(trial.is_right for trial in defects)} of {len(defects)} defects caught by their tier, "
        f"{flagged} of {len(harmless)} harmless changes flagged"
    )


def exit_code(trials: Sequence[Trial]) -> ExitCode:
    """Incomplete where a mutant could not be tried; regressed where a defect was missed or harmless code flagged."""
    if any(not trial.is_right and not trial.problem for trial in trials):
        return ExitCode.REGRESSED
    return ExitCode.INCOMPLETE if any(trial.problem for trial in trials) else ExitCode.FINE


def text(trials: Sequence[Trial]) -> list[str]:
    """What was not as it should be, and the counts, for a screen."""
    wrong = [trial for trial in trials if not trial.is_right]
    return [*(f"{trial.verdict}: {trial.mutant.name} {trial.problem}" for trial in wrong), counts(trials)]


def table(trials: Sequence[Trial]) -> pd.DataFrame:
    """A row a mutant, as they are listed."""
    return pd.DataFrame(
        [
            {
                "change": plain(trial.mutant.name),
                "must be noticed by": f"tier {trial.mutant.tier}" if trial.mutant.is_defect else "none",
                "": trial.verdict if trial.is_right else f"**{trial.verdict}** {plain(trial.problem)}".strip(),
                **{f"tier {number}": trial.tier(number) for number in TIERS},
            }
            for trial in _in_order(trials)
        ]
    )


def write(trials: Sequence[Trial], about: Mapping[str, Any], folder: Path) -> None:
    """Write index.md, and a table of the findings.  Raises StoreError."""
    told = [
        f"{counts(trials)}.",
        "A defect is shown to its own tier and one or two beside, a harmless change to all; tiers 3 and 4 look at "
        "Figure 5 alone. *moved*: other bits, handed on to tier 2, which decides; **n of m**: so many of the tier's "
        "checks failed; a dash: not asked.",
        Table(table(trials), "Every finding with its figures:", FINDINGS),
        "  \n".join(f"{name}: {plain(value)}" for name, value in about.items()),
    ]
    redo = "snowrepro check --mutants"
    markdown.write(Document("What the checks notice", [Section("mutants", "", told, redo=redo)]), folder / "index.md")
    with published(folder / FINDINGS) as partial:
        findings(trials).to_csv(partial, index=False, lineterminator="\n")


def findings(trials: Sequence[Trial]) -> pd.DataFrame:
    """What was found of each mutant that is not plainly fine: a row a finding."""
    return pd.DataFrame(
        [
            {"change": trial.mutant.name, "declared_tier": trial.mutant.tier, "verdict": trial.verdict, **asdict(found)}
            for trial in _in_order(trials)
            for found in trial.findings
            if found.state != OK
        ]
    )


def _in_order(trials: Sequence[Trial]) -> list[Trial]:
    """As the mutants are listed."""
    order = [mutant.name for mutant in read_list()]
    return sorted(trials, key=lambda trial: order.index(trial.mutant.name))
