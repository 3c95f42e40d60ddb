"""The references that a check compares with: small files in one folder, renewed by ``bless`` alone.

``origin.json``     by part: the reason it was renewed for, when, by which code, versions and machine, under which model
``fingerprints.json``  tier 1: digests by platform, case, frame and quantity
``horizon.csv``     tier 2: numbers with their tolerances
``ensemble.csv``    tier 3: the measures of every run, of the twins too
``verdicts.csv``    tier 4: the verdicts
``log.md``          what each renewal changed, the last first
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from ..errors import StoreError
from ..settings.case import MODEL_VERSION
from ..store.files import published, read_json, write_json
from ..store.provenance import CLONE, provenance

FOLDER = Path("reports/baseline")
ORIGIN, PRINTS, LOG = "origin.json", "fingerprints.json", "log.md"
PARTS = {1: "fingerprints", 2: "horizon", 3: "ensemble", 4: "verdicts"}
# The tables, and which of their columns must hold numbers.
TABLES = {
    "horizon": ("frame", "value", "tolerance"),
    "ensemble": ("pressure", "seed", "lump_fraction"),
    "verdicts": ("seeds",),
}
TITLE = "# What the references were renewed for\n"


@dataclass(frozen=True)
class Baseline:
    """The references of a folder, read into memory; a part that the folder does not have is empty."""

    folder: Path
    origin: Mapping[str, Any] = field(default_factory=dict)
    platforms: Mapping[str, Any] = field(default_factory=dict)
    tables: Mapping[str, pd.DataFrame] = field(default_factory=dict)

    def table(self, part: str) -> pd.DataFrame:
        """Return one of TABLES; empty if there is none."""
        return self.tables.get(part, pd.DataFrame())

    def flaw(self, tier: int) -> str:
        """Return why a tier has no reference to compare with; empty if it has one."""
        part = PARTS[tier]
        model = self.origin.get(part, {}).get("model_version")
        if model is None:
            return f"no reference in {self.folder}: {self._find_remedy()}"
        if model != MODEL_VERSION:
            return f"the reference is of model version {model}, this is {MODEL_VERSION}: snowrepro bless renews it"
        return ""

    def _find_remedy(self) -> str:
        """Return what to do where there is no reference."""
        if self.folder.is_dir():
            return "snowrepro bless makes one"
        known = CLONE / FOLDER
        where = known if known.is_dir() else f"CLONE/{FOLDER}"
        return f"they are in a clone of the program: go there, or name them, --baseline {where}"


def read_baseline(folder: Path) -> Baseline:
    """Read the references in a folder; a part that is not there is empty.  Raises StoreError where a file is broken."""
    origin, prints = (_read_json(folder / name) for name in (ORIGIN, PRINTS))
    paths = {part: folder / f"{part}.csv" for part in TABLES}
    tables = {part: _read_table(path, TABLES[part]) for part, path in paths.items() if path.exists()}
    return Baseline(folder, origin, prints.get("platforms", {}), tables)


def _read_json(path: Path) -> dict[str, Any]:
    """Read a JSON file; empty if there is none.  Raises StoreError where it is broken."""
    content = read_json(path)
    if path.exists() and not content:
        raise StoreError(f"{path} cannot be read: git restores it, or snowrepro bless makes it anew")
    return content


def _read_table(path: Path, numbers: Sequence[str]) -> pd.DataFrame:
    """Read a table whose columns ``numbers`` must hold numbers.  Raises StoreError where it is broken."""
    try:
        table = pd.read_csv(path, keep_default_na=False, na_values=[""], float_precision="round_trip")
    except (OSError, ValueError) as error:
        raise StoreError(f"{path} cannot be read: {error}") from error
    broken = [name for name in numbers if name not in table or table[name].dtype.kind not in "if"]
    if broken or table.isna().to_numpy().any():
        what = f"no numbers in {', '.join(broken)}" if broken else "a cell is empty"
        raise StoreError(f"{path} cannot be read: {what}; git restores it, or snowrepro bless makes it anew")
    return table


def write_baseline(
    baseline: Baseline,
    reason: str,
    platforms: Mapping[str, Any] | None,
    tables: Mapping[str, pd.DataFrame],
    changes: Mapping[str, Sequence[str]],
) -> None:
    """Write some parts anew: their files first, then their origin, then the log.

    ``platforms``: fingerprints by platform, None to leave them; ``tables``: by part; ``changes``: lines for the log, by
    part.  Raises StoreError.
    """
    folder = baseline.folder
    if platforms is not None:
        write_json(folder / PRINTS, {"platforms": platforms})
    for part, table in tables.items():
        with published(folder / f"{part}.csv") as partial:
            table.to_csv(partial, index=False, lineterminator="\n")
    origin = {"reason": reason, "model_version": MODEL_VERSION, **provenance()}
    renewed = [*(["fingerprints"] if platforms is not None else []), *tables]
    write_json(folder / ORIGIN, {**baseline.origin, **dict.fromkeys(renewed, origin)})
    _write_log(folder / LOG, origin, changes)


def group_by_name(
    column: str, before: pd.DataFrame, after: pd.DataFrame
) -> Iterator[tuple[str, pd.DataFrame, pd.DataFrame]]:
    """Group a renewed table by the names in a column: yields name, old rows (maybe none) and new rows of each."""
    for name, new in after.groupby(column, sort=False):
        yield str(name), before[before[column] == name] if len(before) else before, new


def _write_log(path: Path, origin: Mapping[str, Any], changes: Mapping[str, Sequence[str]]) -> None:
    """Put an entry on top of the log."""
    older_entries = path.read_text("utf-8").removeprefix(TITLE) if path.exists() else ""
    lines = [
        f"## {origin['created'][:10]}: {origin['reason']}",
        "",
        f"{origin['git_state']}; {origin['versions']}; {origin['machine']}",
        "",
    ]
    for part, lines_of_part in changes.items():
        lines += [f"- {part}: {line}" for line in lines_of_part]
    with published(path) as partial:
        partial.write_text(f"{TITLE}\n" + "\n".join(lines) + f"\n{older_entries}", encoding="utf-8")
