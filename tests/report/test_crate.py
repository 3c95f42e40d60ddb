"""A sweep as an RO-Crate: whole, read by snowrepro itself, and valid for the validator of others."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from urllib.parse import unquote

import pytest
import xarray as xr

from snowrepro import open_sweep
from snowrepro.cli import main
from snowrepro.store import manifest
from snowrepro.store.files import sha256
from snowrepro.sweep import record
from snowrepro.sweep.plan import make_plan
from tests import command_line
from tests.conftest import SMALL
from tests.report.small_runs import saved

HERE = Path(__file__).parent
FAILED = "diverged in frame 3"
OF_A_STORE = ("summary.json", "analysis.nc")  # what a store keeps of having been read


@pytest.fixture(scope="module")
def sweep(small_run, tmp_path_factory) -> tuple[Path, str]:
    """A folder with a store and a report; of the sweep's six runs four are done, one failed and one never ran."""
    folder = tmp_path_factory.mktemp("sweep")
    saved(small_run, folder / "runs")
    options = ["experiment=fig5", "experiment.frames=[0,20,60]", "sintering=paper,none", "pressure=500,3000,9000"]
    plan = make_plan([*SMALL, *options, f"store={folder}/runs"], multirun=True)
    record.write_record(plan)
    (failing, _) = [run for run in plan.runs if run.case.pressure == 9000]
    failing.save_config()
    failing.save_outcome("failed", FAILED, final=True)
    name = record.name_sweep(plan.overrides)
    report = folder / "my_reports" / name
    report.mkdir(parents=True)
    (report / "index.html").write_text("<p>verdicts")
    (report / "half.png.12.part").touch()
    return folder, name


@pytest.fixture(scope="module")
def written(sweep, tmp_path_factory) -> Path:
    """The crate of that sweep, called by its experiment's name, with nothing stated."""
    out = tmp_path_factory.mktemp("written") / "crate"
    done = command_line.run("crate", "fig5", "--out", str(out), cwd=sweep[0])
    assert (done.returncode, done.stdout) == (0, f"{out}\n"), done.stderr
    assert "without a result: 2 of 6 runs:" in done.stderr
    return out


@pytest.fixture
def crate(sweep, monkeypatch, capsys):
    """Call the command in the sweep's folder; returns a function from arguments to exit code, output, errors."""

    def call(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.chdir(sweep[0])
        with pytest.raises(SystemExit) as ended:
            main(["crate", *arguments])
        return ended.value.code, *capsys.readouterr()

    return call


def read(folder: Path) -> dict[str, dict]:
    """The entities of a crate by their ids."""
    graph = json.loads((folder / "ro-crate-metadata.json").read_text())["@graph"]
    assert len({entity["@id"] for entity in graph}) == len(graph)
    return {entity["@id"]: entity for entity in graph}


def content(folder: Path) -> dict[str, str]:
    return {path.relative_to(folder).as_posix(): sha256(path) for path in folder.rglob("*") if path.is_file()}


def test_a_sweep_as_a_crate(sweep, written):
    """Every file is described and there; an action a run, with what went in and came out, also of what failed."""
    out = written
    found = read(out)
    files = {unquote(name) for name, entity in found.items() if entity["@type"] == "File"}
    assert files == {name for name in content(out) if not name.endswith((*OF_A_STORE, "ro-crate-metadata.json"))}
    assert {unquote(part["@id"]) for part in found["./"]["hasPart"]} == files
    assert f"reports/{sweep[1]}/index.html" in files and not any(name.endswith(".part") for name in files)
    assert {f"runs/sweeps/{sweep[1]}/results.csv", f"runs/sweeps/{sweep[1]}/results.nc"} <= files
    actions = {name: entity for name, entity in found.items() if entity["@type"] == "CreateAction"}
    assert {part["@id"] for part in found["./"]["mentions"]} == actions.keys() and len(actions) == 5
    done = [entity for entity in actions.values() if entity["actionStatus"].endswith("/CompletedActionStatus")]
    (failed,) = [entity for entity in actions.values() if entity["actionStatus"].endswith("/FailedActionStatus")]
    assert failed["error"] == f"failed: {FAILED}"
    for action in done:
        assert "error" not in action
        folder = out / unquote(action["object"]["@id"]).removesuffix("config.json")
        written = manifest.read(folder)
        assert json.loads((folder / "config.json").read_text()) == written["config"]
        assert manifest.flaw(folder, written, folder.name, thorough=True) is None
        results = {(out / unquote(result["@id"])).name for result in action["result"]}
        assert results == {"run.nc", "manifest.json"}
        assert action["endTime"] == written["created"]
        tool = found[action["instrument"]["@id"]]
        assert (tool["@type"], tool["name"]) == ("SoftwareApplication", "snowrepro")
        assert written["git_state"] in tool["softwareVersion"] and written["versions"] in tool["description"]
    assert not any(entity["@type"] == "Person" or "agent" in entity for entity in found.values())
    assert "No licence was stated" in found["./"]["license"]


def test_a_crate_is_a_store(sweep, written):
    """The sweep is read from it as from the store it came from, runs and failure."""
    copied, original = (open_sweep(sweep[1], folder / "runs") for folder in (written, sweep[0]))
    xr.testing.assert_identical(copied, original)
    assert sorted(copied.state.values.ravel()) == ["done"] * 4 + ["failed", "pending"]


def test_the_same_store_gives_the_same_bytes(sweep, written, crate, tmp_path):
    before = {name: value for name, value in content(written).items() if not name.endswith(OF_A_STORE)}
    assert crate(sweep[1], "--out", str(tmp_path / "again"))[0] == 0
    assert content(tmp_path / "again") == before


def test_one_run_and_what_is_stated(sweep, crate):
    """By an end of its id, into a folder named after that; licence and person are those given, and nobody else."""
    run_id = next(path.parent.name for path in (sweep[0] / "runs").glob("*/run.nc"))
    stated = ("--license", "CC-BY-4.0", "--agent", "Ada Snow", "--orcid", "0000-0002-1825-0097")
    code, said, _ = crate(run_id[-8:], *stated)
    assert (code, said) == (0, f"{run_id[-8:]}-crate\n")
    found = read(sweep[0] / f"{run_id[-8:]}-crate")
    person = "https://orcid.org/0000-0002-1825-0097"
    (action,) = [entity for entity in found.values() if entity["@type"] == "CreateAction"]
    assert action["@id"] == f"#{run_id}" and action["agent"] == {"@id": person}
    assert found[person] == {"@id": person, "@type": "Person", "name": "Ada Snow"}
    assert found["./"]["license"] == {"@id": "https://spdx.org/licenses/CC-BY-4.0"}
    assert found["./"]["mentions"] == {"@id": action["@id"]}


def test_what_makes_no_crate_is_refused(sweep, crate, tmp_path):
    """One line, exit code 2, nothing written."""
    never = make_plan([*SMALL, "pressure=1,2", f"store={tmp_path}/runs"], multirun=True)
    record.write_record(never)
    (tmp_path / "there").mkdir()
    before = sorted(tmp_path.rglob("*"))
    for arguments, message in (
        (["nothing"], f"'nothing' should name one run of the store 'runs'; no run is; sweeps are: {sweep[1]}"),
        (
            [record.name_sweep(never.overrides), "--store", f"{tmp_path}/runs"],
            "none failed: there is nothing to publish",
        ),
        ([sweep[1], "--out", str(tmp_path / "there")], "is there already: remove it or name another folder"),
        ([sweep[1], "--license", "as you like"], "licence: should be a URL or an SPDX identifier"),
        ([sweep[1], "--orcid", "0000-0002-1825-0097"], "give also --agent NAME"),
        ([sweep[1], "--agent", "Ada", "--orcid", "12"], "orcid: should be like"),
        ([sweep[1], "--out", "/proc/nowhere"], "cannot write /proc/nowhere"),
    ):
        out = [] if "--out" in arguments else ["--out", str(tmp_path / "crate")]
        code, said, errors = crate(*arguments, *out)
        assert code == 2, arguments
        assert message in errors and errors.count("\n") == 1 and said == ""
    assert sorted(tmp_path.rglob("*")) == before


def test_a_result_that_is_not_as_it_was_written_is_not_published(sweep, crate, tmp_path):
    """A byte that changed behind the same size and time; nothing is left of the crate."""
    store = tmp_path / "runs"
    shutil.copytree(sweep[0] / "runs", store)
    path = next(store.glob("*/run.nc"))
    changed = bytearray(path.read_bytes())
    changed[len(changed) // 2] ^= 1
    path.write_bytes(changed)
    os.utime(path, ns=(manifest.read(path.parent)["files"]["run.nc"]["mtime_ns"],) * 2)
    code, _, errors = crate(sweep[1], "--store", str(store), "--out", str(tmp_path / "crate"))
    assert code == 2
    assert f"{path.parent.name}: run.nc is not as it was written: its checksum differs" in errors
    assert [path.name for path in tmp_path.iterdir()] == ["runs"]


@pytest.fixture(scope="module")
def validate(tmp_path_factory):
    """The validator of RO-Crates, offline; returns a function from a crate to its issues by severity."""
    place = f"{HERE.parents[1] / 'build' / 'validator' / 'bin'}"
    tool = shutil.which("rocrate-validator", path=place) or shutil.which("rocrate-validator")
    if tool is None:
        pytest.skip("no rocrate-validator: make validator, or pip install 'snowrepro[validate-crate]'")
    cache = tmp_path_factory.mktemp("validator") / "cache"
    subprocess.run([Path(tool).with_name("python"), HERE / "seed_context.py", cache], check=True)

    def issues(crate: Path) -> dict[str, set[tuple[str, str]]]:
        answer = crate.with_name(f"{crate.name}.json")
        options = ["-p", "process-run-crate-0.5", "-l", "recommended", "--offline", "--cache-path", cache]
        command = [tool, "-y", "validate", *options, "-f", "json", "-o", answer, crate]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300)
        assert answer.exists(), done.stdout + done.stderr
        found = json.loads(answer.read_text())
        assert found["statistics"]["total_checks_by_severity"]["REQUIRED"] > 40
        return {
            severity: {(i["violatingEntity"] or "", i["message"]) for i in found["issues"] if i["severity"] == severity}
            for severity in ("REQUIRED", "RECOMMENDED")
        }

    return issues


def test_an_outside_validator_finds_nothing_required_wrong(sweep, crate, validate, tmp_path):
    """And of what is recommended, with all stated, only what nobody said: addresses, affiliation, publisher."""
    stated = ("--license", "CC-BY-4.0", "--agent", "Ada Snow", "--orcid", "0000-0002-1825-0097")
    assert crate(sweep[1], "--out", str(tmp_path / "crate"), *stated)[0] == 0
    found = validate(tmp_path / "crate")
    assert found["REQUIRED"] == set()
    about = ("have a url", "be an absolute URI", "`publisher`", "affiliation")
    assert [text for _, text in found["RECOMMENDED"] if not any(word in text for word in about)] == []


def test_an_outside_validator_finds_what_is_broken(written, validate, tmp_path):
    """An action without its instrument, and a file that is not there."""
    out = tmp_path / "crate"
    shutil.copytree(written, out)
    path = out / "ro-crate-metadata.json"
    said = json.loads(path.read_text())
    broken = next(entity for entity in said["@graph"] if entity["@type"] == "CreateAction")
    del broken["instrument"]
    path.write_text(json.dumps(said))
    next(out.glob("runs/*/run.nc")).unlink()
    found = validate(out)["REQUIRED"]
    assert any(broken["@id"] in entity and "MUST have an instrument" in message for entity, message in found)
    assert any("run.nc" in message or "run.nc" in entity for entity, message in found)
