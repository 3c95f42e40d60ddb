"""A sweep or a run as an RO-Crate: a folder to publish that says in JSON-LD which run made which file, when, with what.

The profile is Process Run Crate 0.5.  The crate is also a store: its runs are in ``runs/``, as in any.
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

from ..config import Config
from ..errors import ConfigError, StoreError
from ..store import manifest, runs, states
from ..store.files import flush, write_json, writing
from ..sweep import record
from ..sweep.collect import collect, missing, write_tables
from ..sweep.explain import config_of_run
from .evidence import name_of

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
    """What a store does not know: under which licence (a URL), and by whom (with an ORCID, a URL) runs were made."""

    licence: str | None = None
    agent: str | None = None
    orcid: str | None = None


@dataclass(frozen=True)
class Made:
    """A run that was done, or failed, as the crate has it.

    ``folder``: from the crate's root; ``said``: its manifest, or how it ended; ``error``: why it has no result.
    """

    config: Config
    folder: Path
    said: Mapping[str, Any]
    error: str | None = None


def terms(licence: str | None, agent: str | None, orcid: str | None) -> Terms:
    """What a command line states.  ``licence``: a URL or an SPDX identifier.  Raises ConfigError."""
    if licence and not licence.startswith(("https://", "http://")):
        if not re.fullmatch(r"[\w.+-]+", licence):
            raise ConfigError(f"licence: should be a URL or an SPDX identifier such as CC-BY-4.0 (got {licence})")
        licence = f"https://spdx.org/licenses/{licence}"
    if orcid and not agent:
        raise ConfigError("whose is this ORCID? give also --agent NAME")
    if orcid and not re.fullmatch(r"(https://orcid\.org/)?(\d{4}-){3}\d{3}[\dX]", orcid):
        raise ConfigError(f"orcid: should be like 0000-0000-0000-0000 (got {orcid})")
    return Terms(licence, agent, orcid and f"https://orcid.org/{orcid.removeprefix('https://orcid.org/')}")


def write_crate(name: str, store: str | Path, out: Path, stated: Terms) -> str:
    """Write the crate of a remembered sweep, or of a run by its id or an end of it, whole or not at all.

    Returns, in a line, which runs have no result.  The same store gives the same bytes.  Raises ConfigError where
    there is no such sweep or run, or none of its runs was done; StoreError where ``out`` is there already, or a
    result is not as it was written.
    """
    if out.exists():
        raise StoreError(f"'{out}' is there already: remove it or name another folder, --out FOLDER")
    partial = out.with_name(f".{out.name}.{uuid.uuid4().hex[:8]}.part")
    try:
        with writing(out):
            partial.mkdir(parents=True)
            lacking = _fill(partial, name, store, stated)
            flush(partial)
            os.rename(partial, out)
            flush(out.parent)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return lacking


def _fill(crate: Path, name: str, store: str | Path, stated: Terms) -> str:
    """Put all files into the crate's folder, then what is said of them."""
    if name in record.names(store):
        title, lacking, configs = f"sweep {name}", _copy_sweep(crate, name, store), _configs(name, store)
    else:
        configs = [_config_of_run(name, store)]
        title, lacking = f"run {runs.identify(configs[0])}", ""
    made = [run for config in configs if (run := _copy_run(crate, config))]
    if not made:
        raise ConfigError(f"no run of '{name}' was done yet, and none failed: there is nothing to publish")
    graph = _graph(crate, title, made, lacking, stated)
    write_json(crate / METADATA, {"@context": f"{RO_CRATE}/context", "@graph": graph})
    return lacking


def _config_of_run(name: str, store: str | Path) -> Config:
    try:
        return config_of_run(name, store)
    except ConfigError as error:
        raise ConfigError(f"{error}; sweeps are: {', '.join(record.names(store)) or 'none yet'}") from error


def _configs(name: str, store: str | Path) -> list[Config]:
    """Each run of a sweep once, in the order of their ids."""
    configs = {runs.identify(config): config for config in record.plan_of(name, store).configs}
    return [configs[run_id] for run_id in sorted(configs)]


def _copy_sweep(crate: Path, name: str, store: str | Path) -> str:
    """The sweep's record, tables and report; returns which of its runs have no result."""
    plan = record.plan_of(name, store)
    if not plan.needs_runs:
        raise ConfigError(f"'{name}' has no runs")
    folder = record.folder_of(name, crate / STORE)
    folder.mkdir(parents=True)
    shutil.copyfile(record.folder_of(name, store) / record.RECORD, folder / record.RECORD)
    found = collect(plan)
    write_tables(found, folder)
    if plan.configs[0].experiment:
        from .page import report_folder

        report = report_folder(plan.configs[0], plan.overrides)
        if (report / "index.html").is_file():
            shutil.copytree(report, crate / "reports" / report.name, ignore=shutil.ignore_patterns(".*", "*.part"))
    return missing(found.table)


def _copy_run(crate: Path, config: Config) -> Made | None:
    """Copy what a run left, and its configuration; None if it was not run, or left no word of how it ended."""
    run_id, state = runs.identify(config), states.standing(config).state
    if state == states.DONE:
        place = Path(STORE) / run_id
        _copy(runs.run_dir(config), crate / place, (runs.RESULT, runs.LOG, manifest.MANIFEST))
        said = manifest.read(crate / place)
        if flaw := manifest.flaw(crate / place, said, run_id):
            raise StoreError(f"{runs.run_dir(config)}: {flaw}; 'snowrepro run' makes it again")
        write_json(crate / place / runs.CONFIG, said["config"])
        return Made(config, place, said)
    if state in (states.FAILED, states.TIMED_OUT, states.INTERRUPTED) and (said := runs.outcome(config)):
        place = Path(STORE) / runs.WORK / run_id
        _copy(runs.work_dir(config), crate / place, (runs.LOG, runs.OUTCOME, runs.CONFIG, runs.CHECKPOINT))
        return Made(config, place, said, f"{state}: {said['message']}")
    return None


def _copy(source: Path, place: Path, names: Sequence[str]) -> None:
    place.mkdir(parents=True)
    for name in names:
        if (source / name).is_file():
            shutil.copyfile(source / name, place / name)


def _graph(crate: Path, title: str, made: Sequence[Made], lacking: str, stated: Terms) -> list[dict[str, Any]]:
    """All that the crate says: of itself, of its files, of each run, and of what made them."""
    files = [_file(path, crate) for path in sorted(crate.rglob("*")) if path.is_file()]
    tools = list(dict.fromkeys(_tool(run) for run in made))
    actions = [_action(run, f"#software-{tools.index(_tool(run)) + 1}", files, stated) for run in made]
    root = {
        "@id": "./",
        "@type": "Dataset",
        "name": f"Snow that is pressed and dropped: {title}",
        "description": f"{SUBJECT}: {title}. "
        + (f"Without a result are {lacking}. " if lacking else "")
        + f"The folder {STORE} is a store that snowrepro reads.",
        "datePublished": max(run.said["created"] for run in made),
        "license": {"@id": stated.licence} if stated.licence else NO_LICENCE,
        "conformsTo": {"@id": PROFILE},
        "hasPart": _references(file["@id"] for file in files),
        "mentions": _references(action["@id"] for action in actions),
        **({"author": {"@id": _agent(stated)}} if stated.agent else {}),
    }
    software = [_software(f"#software-{number}", *tool) for number, tool in enumerate(tools, 1)]
    return [_descriptor(), root, *_named(stated), *files, *actions, *software]


def _references(identifiers: Iterable[str]) -> Any:
    """One reference as it is, several as a list: the profile wants no lists of one."""
    found = [{"@id": identifier} for identifier in identifiers]
    return found[0] if len(found) == 1 else found


def _descriptor() -> dict[str, Any]:
    """What the metadata's file is itself."""
    about = {"conformsTo": {"@id": RO_CRATE}, "about": {"@id": "./"}}
    return {"@id": METADATA, "@type": "CreativeWork", **about}


def _named(stated: Terms) -> Iterator[dict[str, Any]]:
    """The profile, the licence and the agent."""
    yield {"@id": PROFILE, "@type": "CreativeWork", "name": "Process Run Crate", "version": "0.5"}
    if stated.licence:
        name = stated.licence.rstrip("/").rsplit("/", 1)[1]
        yield {
            "@id": stated.licence,
            "@type": "CreativeWork",
            "name": name,
            "description": f"licence of this crate: {name}",
        }
    if stated.agent:
        yield {"@id": _agent(stated), "@type": "Person", "name": stated.agent}


def _agent(stated: Terms) -> str:
    return stated.orcid or "#agent"


def _file(path: Path, crate: Path) -> dict[str, Any]:
    """A file of the crate."""
    inside = path.relative_to(crate)
    told = ABOUT.get(path.name, "report, as it stood") if inside.parts[0] == STORE else "report, as it stood"
    kind = TYPES.get(path.suffix)
    return {
        "@id": quote(inside.as_posix()),
        "@type": "File",
        "name": path.name,
        "description": told,
        "contentSize": str(path.stat().st_size),
        **({"encodingFormat": kind} if kind else {}),
    }


def _action(run: Made, tool: str, files: Sequence[Mapping[str, Any]], stated: Terms) -> dict[str, Any]:
    """What was done: one run, with what went in and what came out."""
    folder = quote(f"{run.folder.as_posix()}/")
    own = [file["@id"] for file in files if file["@id"].startswith(folder)]
    config = f"{folder}{runs.CONFIG}"
    command = f", by: {run.said['command']}" if "command" in run.said else ""
    took = f" in {run.said['wall_seconds']:g} s" if "wall_seconds" in run.said else ""
    return {
        "@id": f"#{quote(runs.identify(run.config))}",
        "@type": "CreateAction",
        "name": f"simulation of {name_of(run.config)}",
        "description": f"simulated on {run.said.get('machine', 'a machine not told')}{took}{command}",
        "instrument": {"@id": tool},
        "object": {"@id": config},
        "result": _references(name for name in own if name != config),
        **({"startTime": run.said["began"]} if "began" in run.said else {}),
        "endTime": run.said["created"],
        "actionStatus": STATUS.format("Failed" if run.error else "Completed"),
        **({"error": run.error} if run.error else {}),
        **({"agent": {"@id": _agent(stated)}} if stated.agent else {}),
    }


def _tool(run: Made) -> tuple[str, str]:
    """Versions and code that made a run."""
    return str(run.said.get("versions", "unknown")), str(run.said.get("git_state", "unknown"))


def _software(identifier: str, versions: str, commit: str) -> dict[str, Any]:
    """The program in one state."""
    own = re.search(r"snowrepro (\S+?)(,|$)", versions)
    return {
        "@id": identifier,
        "@type": "SoftwareApplication",
        "name": "snowrepro",
        "softwareVersion": f"{own[1] if own else 'unknown'}, commit {commit}",
        "description": f"with {versions}",
    }
