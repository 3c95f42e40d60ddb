"""``snowrepro classify`` on files of other codes, as a subprocess."""

import json
import os
import subprocess
import sys

import netCDF4
import numpy as np
import pandas as pd
import pytest
import xarray as xr

# A code that does not know this package: two blocks of lattice, one of which flies off and one of which scatters.
ANOTHER_CODE = """
import netCDF4, numpy as np

rng = np.random.default_rng(0)
block = np.stack(np.meshgrid(np.arange(30), np.arange(30)), -1).reshape(-1, 2) * 0.5 + rng.uniform(-0.1, 0.1, (900, 2))
snow = np.concatenate([block, block + [15.0, 0.0]])
states = [snow]
for step in range(1, 6):
    moved = snow.copy()
    moved[:900, 0] -= 2.0 * step
    moved[900:] += rng.normal(0, 0.3 * step, (900, 2))
    states.append(moved)
with netCDF4.Dataset("other.nc", "w") as file:
    for name, size in (("time", 6), ("particle", 1800)):
        file.createDimension(name, size)
    for d, name in enumerate("xy"):
        file.createVariable(name, "f8", ("time", "particle"))[:] = np.stack(states)[:, :, d]
    file.createVariable("time", "f8", ("time",))[:] = 0.1 * np.arange(6)
    file.createVariable("mass", "f8", ("particle",))[:] = 2.0
"""


@pytest.fixture
def other(tmp_path):
    """The file of another code."""
    assert "snowrepro" not in ANOTHER_CODE
    subprocess.run([sys.executable, "-c", ANOTHER_CODE], cwd=tmp_path, check=True)
    return tmp_path / "other.nc"


def test_a_file_of_another_code(snowrepro, other, tmp_path):
    """Half of the snow is a lump; what was assumed is told; tables and ids are written."""
    words = ["--release", "0", "lump_cells=0", "definition=bonds", "--frames", "all", "--out", "found"]
    shown = snowrepro("classify", "other.nc", *words)
    assert shown.returncode == 0, shown.stderr
    assert "assumed: grid spacing" in shown.stderr
    measures = json.loads((tmp_path / "found/measures.json").read_text())
    assert measures["lump_fraction"] == pytest.approx(0.5, abs=0.03)
    assert measures["lumps"] == 1
    assert measures["analysis"]["definition"] == "bonds"
    table = pd.read_csv(tmp_path / "found/fragments.csv")
    assert sorted(set(table["frame"])) == list(range(6))
    assert table[table["frame"] == 3]["mass"].sum() == pytest.approx(3600)
    lump = table[(table["frame"] == 5) & table["is_lump"]].iloc[0]
    assert lump["velocity_x"] == pytest.approx(-20.0, rel=1e-2)
    with xr.open_dataset(tmp_path / "found/fragments.nc") as found:
        assert found["fragment"].shape == (6, 1800)
        assert (found["fragment"][-1, :900] == lump["id"]).mean() > 0.95
        assert float(found["broken_both"][-1]) > float(found["broken_both"][0]) == 0.0


def test_the_three_states_over_a_cell_of_ones_own(snowrepro, other, tmp_path):
    """The block that flew off is a lump; how much of the scattered one is loose depends on the cell that is given."""
    shown = snowrepro("classify", "other.nc", "--release", "0", "--cell", "0.5", "lump_cells=0", "--out", "found")
    assert shown.returncode == 0, shown.stderr
    assert "assumed: a cell, " not in shown.stderr
    measures = json.loads((tmp_path / "found/measures.json").read_text())
    assert measures["lump_fraction"] == pytest.approx(0.5, abs=0.01)
    assert measures["loose_fraction"] == pytest.approx(0.5, abs=0.01)
    with xr.open_dataset(tmp_path / "found/fragments.nc") as found:
        parts = [found[state][-1].values for state in ("lump", "crushed", "loose")]
        assert np.sum(parts, axis=0) == pytest.approx(1.0)


def test_settings_and_definitions(snowrepro, other):
    """By proximity the scattered half still hangs together."""
    shown = snowrepro("classify", "other.nc", "--release", "0", "definition=proximity", "proximity=2")
    assert shown.returncode == 0, shown.stderr
    numbers = dict(line.split(maxsplit=1) for line in shown.stdout.splitlines())
    assert numbers["definition"] == "proximity"
    assert float(numbers["lump_fraction"]) > 0.8


def test_a_setting_of_two_numbers(snowrepro, other, tmp_path):
    """With or without brackets."""
    for words in ("volume_change=0.1,0.3", "volume_change=[0.1,0.3]"):
        shown = snowrepro("classify", "other.nc", "--release", "0", words, "--out", "found")
        assert shown.returncode == 0, shown.stderr
        measures = json.loads((tmp_path / "found/measures.json").read_text())
        assert measures["analysis"]["volume_change"] == [0.1, 0.3]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "does not say when the snow was released"),
        (["--release", "9"], "the release in frame 9 is not stored: stored are 6 frames from 0 to 5"),
        (["--release", "0", "brake_strain=1"], "no setting 'brake_strain'"),
        (["--release", "0", "break_strain=-1"], "break_strain: should be greater than 0 (got '-1')"),
        (["--release", "0", "proximity"], "'proximity' is not a setting: write name=value"),
        (["--release", "0", "--grid-spacing", "-1"], "grid_spacing must be positive"),
    ],
)
def test_refusals(snowrepro, other, arguments, message):
    """One line each, exit code 2, no traceback."""
    shown = snowrepro("classify", "other.nc", *arguments)
    assert shown.returncode == 2
    assert message in " ".join(shown.stderr.split())
    assert "Traceback" not in shown.stderr


def test_a_broken_file(snowrepro, tmp_path):
    """Not a NetCDF at all."""
    (tmp_path / "broken.nc").write_bytes(b"no")
    shown = snowrepro("classify", "broken.nc")
    assert shown.returncode == 2
    assert "cannot be read" in shown.stderr


BLOCK = np.stack(np.meshgrid(np.arange(10), np.arange(10)), -1).reshape(-1, 2) * 0.5
BLOCK = BLOCK + np.random.default_rng(0).uniform(-0.1, 0.1, (100, 2))
SCATTER = np.random.default_rng(1).normal(0, 1.5, (100, 2))
STATES = np.stack([np.concatenate([BLOCK - [2.0 * s, 0.0], BLOCK + [20.0, 0.0] + s * SCATTER]) for s in range(6)])
TIMES = 0.1 * np.arange(6)


def write(path, dims=("time", "particle"), group="", names="xy", form="NETCDF4", timed=True, **attributes):
    """The particles, time by particle: a lump that flies off with 20 a second, and loose ones."""
    with netCDF4.Dataset(path, "w", format=form) as file:
        node = file.createGroup(group) if group else file
        sizes = {dims[0]: 6, dims[1]: 200}
        for dim in sorted(dims):
            node.createDimension(dim, sizes[dim])
        for axis, name in enumerate(names):
            values = STATES[:, :, axis] if axis < 2 else np.zeros((6, 200))
            order = sorted(dims)
            node.createVariable(name, "f8", order)[:] = values if order == list(dims) else values.T
        if timed:
            clock = node.createVariable("time", "f8", dims[:1])
            clock[:] = TIMES * 1000
            clock.units = "ms since 2000-01-01 00:00:00"
        node.setncatts(attributes)


@pytest.mark.parametrize(
    ("made", "arguments"),
    [
        ({"dims": ("obs", "trajectory"), "featureType": "trajectory"}, []),
        ({"dims": ("b", "a")}, ["--particle-dimension", "a"]),
        ({"group": "particles"}, ["--group", "particles"]),
        ({"names": ["east", "north"]}, ["--position", "east,north"]),
        ({"names": "xyz"}, []),
        ({"grid_spacing": "1.0 mm", "config": "not ours"}, ["--grid-spacing", "1"]),
        ({"form": "NETCDF3_CLASSIC", "config": "{}", "title": "\x1b[31m"}, []),
    ],
)
def test_files_as_other_codes_write_them(snowrepro, tmp_path, made, arguments):
    """Half of the snow is the lump, and its speed is by the second."""
    write(tmp_path / "file.nc", **made)
    words = ["--release", "0", "lump_cells=0", "--frames", "all", "--out", "found", *arguments]
    shown = snowrepro("classify", "file.nc", *words)
    assert shown.returncode == 0, shown.stderr
    measures = json.loads((tmp_path / "found/measures.json").read_text())
    assert (measures["lumps"], measures["lump_fraction"]) == (1, 0.5)
    assert measures["units"] == {"length": "unknown", "time": "s"}
    table = pd.read_csv(tmp_path / "found/fragments.csv")
    assert table[(table["frame"] == 5) & table["is_lump"]]["velocity_x"].tolist() == pytest.approx([-20.0])
    assert ("assumed: dimensions: 2, as z is 0 everywhere" in shown.stderr) == (made.get("names") == "xyz")


@pytest.mark.parametrize(
    ("made", "arguments", "message"),
    [
        (
            {"dims": ("b", "a"), "timed": False},
            [],
            "which dimension is time, 'a' (200) or 'b' (6): say it with --time-dimension",
        ),
        ({"group": "particles"}, [], "the file has groups, name one with --group: 'particles'"),
        ({"grid_spacing": "\x1b[2J1 mm"}, [], r"grid_spacing is '\x1b[2J1 mm', which is no number"),
        ({}, ["--position", "\x1b[31m"], r"no variable '\x1b[31m' that can be read (--position)"),
    ],
)
def test_what_is_refused_names_the_option(snowrepro, tmp_path, made, arguments, message):
    """On one line that begins with the file, and on which nothing acts on the terminal."""
    write(tmp_path / "file.nc", **made)
    shown = snowrepro("classify", "file.nc", "--release", "0", *arguments)
    assert shown.returncode == 2
    assert shown.stderr.startswith("error: file.nc: ") and message in shown.stderr
    assert shown.stderr.count("\n") == 1 and shown.stderr.strip().isprintable()
    assert shown.stdout == ""


def test_what_is_no_file(snowrepro, tmp_path):
    """A pipe is not waited for; a file that is cut off is named with its sizes."""
    os.mkfifo(tmp_path / "pipe\x1b[31m")
    shown = snowrepro("classify", "pipe\x1b[31m")
    assert (shown.returncode, shown.stderr.count("is no regular file"), "\x1b" in shown.stderr) == (2, 1, False)
    write(tmp_path / "cut.nc", form="NETCDF3_CLASSIC", release_frame=0)
    whole = (tmp_path / "cut.nc").read_bytes()
    (tmp_path / "cut.nc").write_bytes(whole[: len(whole) * 2 // 3])
    shown = snowrepro("classify", "cut.nc")
    assert shown.returncode == 2
    assert f"cut off, as it should have {len(whole):,} bytes by its header" in shown.stderr


def test_lengths_count_for_a_run_too(snowrepro, small_run, tmp_path):
    """Another cell gives other strains, and one that is none is refused."""
    small_run.to_netcdf(tmp_path / "run.nc")
    wide, usual = (snowrepro("classify", "run.nc", "definition=strain", *cell) for cell in (["--cell", "5"], []))
    assert wide.returncode == usual.returncode == 0, wide.stderr
    assert wide.stdout.splitlines() != usual.stdout.splitlines()
    refused = snowrepro("classify", "run.nc", "--cell", "-1")
    assert (refused.returncode, refused.stderr.strip()) == (2, "error: run.nc: cell must be positive, not -1")
