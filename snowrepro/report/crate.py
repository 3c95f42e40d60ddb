"""A sweep or a run as an RO-Crate, a folder to publish.

Its metadata says in JSON-LD which run made which file, when and with what; the profile is Process Run Crate 0.5.  The
crate is also a store: its runs are in ``runs/``, as in any.
"""

import os
import re
import shutil
import uuid
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ..composition.overrides import override_folder
from ..errors import ConfigError, StoreError
from ..evidence.collect import collect_sweep, describe_missing, write_tables
from ..evidence.gather import describe_run
from ..foreign import copy_plain, is_plain_file
from ..store import manifest, states
from ..store.files import flush, write_json, writing
from ..store.folders import WORK
from ..store.run import CHECKPOINT, CONFIG, LOG, OUTCOME, RESULT, Run
from ..sweep import record
from ..sweep.explain import run_named
from .figures.kinds import needs_runs
from .page.folder import find_report_folder

METADATA = "ro-crate-metadata.json"
RO_CRATE = "https://w3id.org/ro/crate/1.1"
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
STATUS = "http://schema.org/{}ActionStatus"
STORE = "runs"  # in the crate
SUBJECT = "Runs of snowrepro, a reproduction of 'Snow Simulation Considering Pressure Sintering'"
NO_LICENCE = "No licence was stated when this was made: ask whoever published it before you use it."
TYPES = {
    ".csv": "text/csv", ".html": "text/html", ".json": "application/json", ".log": "text/plain", ".md": "text/markdown",
    ".mp4": "video/mp4", ".nc": "application/x-netcdf", ".npz": "application/zip", ".png": "image/png",
}  # fmt: skip
ABOUT = {
    "run.nc": "particles and diagnostics over time",
    "run.log": "log of the run",
    "manifest.json": "configuration, checksums and what made the run; 'snowrepro redo' does it again from this alone",
    "config.json": "configuration of the run",
    "outcome.json": "how the run ended without a result",
    "checkpoint.npz": "last good state of the run",
    "sweep.json": "what the sweep asked for: its overrides, and the id of each run",
    "results.csv": "numbers of the sweep's runs, a row a run",
    "results.nc": "numbers of the sweep's runs, on the grid of what was varied",
}


@dataclass(frozen=True)
class Terms:
    """What a store does not know: the licence (a URL), and who made the runs (with an ORCID, a URL)."""

    licence: str | None = None
    agent: str | None = None
    orcid: str | None = None


@dataclass(frozen=True)
class CopiedRun:
    """A run in the crate that was done or failed.

    ``folder``: its path in the crate; ``record``: its manifest, or how it ended; ``error``: why it has no result.
    """

    run: Run
    folder: Path
    record: Mapping[str, Any]
    error: str | None = None


def parse_terms(licence: str | None, agent: str | None, orcid: str | None) -> Terms:
    """Check and complete what a command line says of licence and agent.

    ``licence``: a URL or an SPDX identifier.  Raises ConfigError if something is not well formed.
    """
    if licence and not licence.startswith(("https://", "http://")):
        if not re.fullmatch(r"[\w.+-]+", licence):
            raise ConfigError(f"licence: should be a URL or an SPDX identifier such as CC-BY-4.0 (got {licence})")
        licence = f"https://spdx.org/licenses/{licence}"
    if orcid and not agent:
        raise ConfigError("whose is this ORCID? give also --agent NAME")
    if orcid and not re.fullmatch(r"(https://orcid\.org/)?(\d{4}-){3}\d{3}[\dX]", orcid):
        raise ConfigError(f"orcid: should be like 0000-0000-0000-0000 (got {orcid})")
    return Terms(licence, agent, orcid and f"https://orcid.org/{orcid.removeprefix('https://orcid.org/')}")


def write_crate(name: str, store: str | Path, out: Path, terms: Terms, reports: str | None = None) -> str:
    """Write the crate of a recorded sweep, or of a run by its id or an end of it, completely or not at all.

    ``reports``: the folder that keeps the reports, if it is not the usual one.  Returns a line on the runs without a
    result, empty if there are none.  The same store gives the same bytes.  Raises ConfigError if there is no such sweep
    or run, or none of its runs was done; StoreError if ``out`` exists already, or a result is not as it was written.
    """
    if out.exists():
        raise StoreError(f"'{out}' is there already: remove it or name another folder, --out FOLDER")
    partial = out.with_name(f".{out.name}.{uuid.uuid4().hex[:8]}.part")
    try:
        with writing(out):
            partial.mkdir(parents=True)
            missing_runs = _fill_crate(partial, name, store, terms, reports)
            flush(partial)
            partial.rename(out)
            flush(out.parent)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return missing_runs


def _fill_crate(crate: Path, name: str, store: str | Path, terms: Terms, reports: str | None) -> str:
    """Copy all files into the crate's folder and write the metadata; returns a line on runs without a result."""
    sweep = record.find_sweep(name, store, is_name=True)
    if sweep:
        title, runs = f"sweep {sweep}", _list_runs(sweep, store)
        missing_runs = _copy_sweep(crate, sweep, store, reports)
    else:
        runs = [run_named(name, store, or_sweep=True)]
        title, missing_runs = f"run {runs[0].id}", ""
    copied_runs = [copied for run in runs if (copied := _copy_run(crate, run))]
    if not copied_runs:
        raise ConfigError(f"no run of '{name}' was done yet, and none failed: there is nothing to publish")
    graph = _make_graph(crate, title, copied_runs, missing_runs, terms)
    write_json(crate / METADATA, {"@context": f"{RO_CRATE}/context", "@graph": graph})
    return missing_runs


def _list_runs(name: str, store: str | Path) -> list[Run]:
    """List each run of a sweep once, in the order of their ids."""
    runs = {run.id: run for run in record.plan_remembered(name, store).runs}
    return [runs[run_id] for run_id in sorted(runs)]


def _copy_sweep(crate: Path, name: str, store: str | Path, reports: str | None) -> str:
    """Copy the sweep's record, tables and report; returns a line on runs without a result."""
    plan = record.plan_remembered(name, store, [override_folder("reports", reports)] if reports else [])
    if not needs_runs(plan.runs):
        raise ConfigError(f"'{name}' has no runs")
    folder = record.locate_sweep(name, crate / STORE)
    folder.mkdir(parents=True)
    copy_plain(record.locate_sweep(name, store) / record.RECORD, folder / record.RECORD)
    collected = collect_sweep(plan)
    write_tables(collected, folder)
    report = find_report_folder(plan.runs[0], plan.overrides)
    if is_plain_file(report / "index.html"):
        _copy_report(report, crate / "reports" / report.name)
    return describe_missing(collected.table)


def _copy_run(crate: Path, run: Run) -> CopiedRun | None:
    """Copy the files of a run with its configuration; None if it was not run, or no record says how it ended."""
    run_id, state = run.id, states.standing(run).state
    if state == states.DONE:
        place = Path(STORE) / run_id
        _copy_files(run.folder, crate / place, (RESULT, LOG, manifest.MANIFEST))
        content = manifest.read(crate / place)
        if flaw := manifest.flaw(crate / place, content, run_id, thorough=True):
            raise StoreError(f"{run.folder}: {flaw}; 'snowrepro run' makes it again")
        write_json(crate / place / CONFIG, content["config"])
        return CopiedRun(run, place, content)
    if state in (states.FAILED, states.TIMED_OUT, states.INTERRUPTED) and (outcome := run.outcome()):
        place = Path(STORE) / WORK / run_id
        _copy_files(run.work, crate / place, (LOG, OUTCOME, CONFIG, CHECKPOINT))
        return CopiedRun(run, place, outcome.model_dump(), f"{state}: {outcome.message}")
    return None


def _copy_report(report: Path, place: Path) -> None:
    """Copy the files of a report, those of its folders too; neither links nor what is hidden or half-written."""
    for folder, folders, names in os.walk(report):
        folders[:] = sorted(
            name for name in folders if not name.startswith(".") and not Path(folder, name).is_symlink()
        )
        to = place / Path(folder).relative_to(report)
        to.mkdir(parents=True)
        for name in sorted(names):
            if not name.startswith(".") and not name.endswith(".part") and is_plain_file(Path(folder, name)):
                copy_plain(Path(folder, name), to / name)


def _copy_files(source: Path, place: Path, names: Sequence[str]) -> None:
    """Copy those of the files ``names`` that are there, and no links."""
    place.mkdir(parents=True)
    for name in names:
        if is_plain_file(source / name):
            copy_plain(source / name, place / name)


def _make_graph(
    crate: Path, title: str, copied_runs: Sequence[CopiedRun], missing_runs: str, terms: Terms
) -> list[dict[str, Any]]:
    """Make all metadata: of the crate, its files, each run, and the software."""
    files = [_describe_file(path, crate) for path in sorted(crate.rglob("*")) if path.is_file()]
    tools = list(dict.fromkeys(_identify_software(copied) for copied in copied_runs))
    actions = [
        _describe_run(copied, f"#software-{tools.index(_identify_software(copied)) + 1}", files, terms)
        for copied in copied_runs
    ]
    root = {
        "@id": "./",
        "@type": "Dataset",
        "name": f"Snow that is pressed and dropped: {title}",
        "description": f"{SUBJECT}: {title}. "
        + (f"Without a result are {missing_runs}. " if missing_runs else "")
        + f"The folder {STORE} is a store that snowrepro reads.",
        "datePublished": max(copied.record.get("created", "") for copied in copied_runs),
        "license": {"@id": terms.licence} if terms.licence else NO_LICENCE,
        "conformsTo": {"@id": PROFILE},
        "hasPart": _refer_to(file["@id"] for file in files),
        "mentions": _refer_to(action["@id"] for action in actions),
        **({"author": {"@id": _get_agent_id(terms)}} if terms.agent else {}),
    }
    software = [_describe_software(f"#software-{number}", *tool) for number, tool in enumerate(tools, 1)]
    return [_describe_metadata(), root, *_describe_terms(terms), *files, *actions, *software]


def _refer_to(identifiers: Iterable[str]) -> Any:
    """Make one reference, or a list of several: the profile does not allow lists of one."""
    references = [{"@id": identifier} for identifier in identifiers]
    return references[0] if len(references) == 1 else references


def _describe_metadata() -> dict[str, Any]:
    """Describe the file of metadata itself."""
    references = {"conformsTo": {"@id": RO_CRATE}, "about": {"@id": "./"}}
    return {"@id": METADATA, "@type": "CreativeWork", **references}


def _describe_terms(terms: Terms) -> Iterator[dict[str, Any]]:
    """Describe the profile, the licence and the agent."""
    yield {"@id": PROFILE, "@type": "CreativeWork", "name": "Process Run Crate", "version": "0.5"}
    if terms.licence:
        name = terms.licence.rstrip("/").rsplit("/", 1)[1]
        yield {
            "@id": terms.licence,
            "@type": "CreativeWork",
            "name": name,
            "description": f"licence of this crate: {name}",
        }
    if terms.agent:
        yield {"@id": _get_agent_id(terms), "@type": "Person", "name": terms.agent}


def _get_agent_id(terms: Terms) -> str:
    """Get the identifier of the agent."""
    return terms.orcid or "#agent"


def _describe_file(path: Path, crate: Path) -> dict[str, Any]:
    """Describe a file of the crate."""
    inside = path.relative_to(crate)
    description = ABOUT.get(path.name, "report, as it stood") if inside.parts[0] == STORE else "report, as it stood"
    kind = TYPES.get(path.suffix)
    return {
        "@id": quote(inside.as_posix()),
        "@type": "File",
        "name": path.name,
        "description": description,
        "contentSize": str(path.stat().st_size),
        **({"encodingFormat": kind} if kind else {}),
    }


def _describe_run(copied: CopiedRun, tool: str, files: Sequence[Mapping[str, Any]], terms: Terms) -> dict[str, Any]:
    """Describe one run as an action, with what went in and what came out.  ``tool``: identifier of the software."""
    folder = quote(f"{copied.folder.as_posix()}/")
    files_of_run = [file["@id"] for file in files if file["@id"].startswith(folder)]
    config = f"{folder}{CONFIG}"
    command = f", by: {copied.record['command']}" if "command" in copied.record else ""
    duration = f" in {copied.record['wall_seconds']:g} s" if "wall_seconds" in copied.record else ""
    return {
        "@id": f"#{quote(copied.run.id)}",
        "@type": "CreateAction",
        "name": f"simulation of {describe_run(copied.run)}",
        "description": f"simulated on {copied.record.get('machine', 'a machine not told')}{duration}{command}",
        "instrument": {"@id": tool},
        "object": {"@id": config},
        "result": _refer_to(name for name in files_of_run if name != config),
        **({"startTime": copied.record["began"]} if "began" in copied.record else {}),
        "endTime": copied.record.get("created", "unknown"),
        "actionStatus": STATUS.format("Failed" if copied.error else "Completed"),
        **({"error": copied.error} if copied.error else {}),
        **({"agent": {"@id": _get_agent_id(terms)}} if terms.agent else {}),
    }


def _identify_software(copied: CopiedRun) -> tuple[str, str]:
    """Return versions and code that made a run."""
    return str(copied.record.get("versions", "unknown")), str(copied.record.get("git_state", "unknown"))


def _describe_software(identifier: str, versions: str, commit: str) -> dict[str, Any]:
    """Describe the program in one state of its code."""
    version = re.search(r"snowrepro (\S+?)(,|$)", versions)
    return {
        "@id": identifier,
        "@type": "SoftwareApplication",
        "name": "snowrepro",
        "softwareVersion": f"{version[1] if version else 'unknown'}, commit {commit}",
        "description": f"with {versions}",
    }
