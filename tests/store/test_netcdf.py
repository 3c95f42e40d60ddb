"""NetCDF files that are cut off, are something else, or declare more than they hold; and files in several threads."""

import copy
import os
import pickle
import subprocess
import sys

import netCDF4
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from snowrepro.errors import DataError, StoreError
from snowrepro.store import classic, netcdf
from snowrepro.store.netcdf import open_netcdf
from snowrepro.summary.classify import classify, compose_analysis

CLASSIC = ("NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA")
ANALYSIS = compose_analysis()


def write(path, form, types=("f8",), sizes=(6, 20), grows=False):
    """Variables of some types (time, particle), and one that does not grow."""
    path.unlink(missing_ok=True)
    with netCDF4.Dataset(path, "w", format=form) as file:
        file.createDimension("time", None if grows else sizes[0])
        file.createDimension("particle", sizes[1])
        file.title = "odd"
        for number, kind in enumerate(types):
            variable = file.createVariable(f"v{number}", kind, ("time", "particle"))
            variable.units = "furlong"
            variable[:] = np.ones(sizes, kind)
        file.createVariable("mass", "f4", ("particle",))[:] = 1.0
    return path


@given(st.data())
@settings(max_examples=60, deadline=None, derandomize=True)
def test_classic_files_declare_their_size(tmp_path_factory, data):
    """Of every form, with types of every width and a dimension that grows or not: no byte of values may be missing."""
    form = data.draw(st.sampled_from(CLASSIC))
    kinds = ["f8", "f4", "i4", "i2", "i1"] + (["u1", "u2", "u4", "i8", "u8"] if form == CLASSIC[2] else [])
    types = data.draw(st.lists(st.sampled_from(kinds), min_size=1, max_size=4))
    sizes = data.draw(st.tuples(st.integers(1, 7), st.integers(1, 9)))
    path = write(tmp_path_factory.mktemp("c") / "c.nc", form, types, sizes, data.draw(st.booleans()))
    whole = path.read_bytes()
    declared = classic.find_declared_size(path)
    assert len(whole) - 3 <= declared <= len(whole)
    open_netcdf(path).close()
    path.write_bytes(whole[: data.draw(st.integers(0, declared - 1))])
    with pytest.raises(StoreError, match=r"cut off|cannot be read as NetCDF"):
        open_netcdf(path)


@pytest.mark.parametrize("form", ["NETCDF4", "NETCDF4_CLASSIC"])
def test_files_of_hdf5_that_are_cut_off(tmp_path, form):
    """At any place."""
    path = write(tmp_path / "h.nc", form, sizes=(6, 200))
    whole = path.read_bytes()
    for part in (0.01, 0.1, 0.3, 0.5, 0.9, 0.999):
        path.unlink()
        path.write_bytes(whole[: int(part * len(whole))])
        with pytest.raises(StoreError, match="cannot be read"):
            open_netcdf(path)


def test_what_is_no_file_of_netcdf(tmp_path):
    """Each kind by its name, at once."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty").touch()
    (tmp_path / "text\x1b[31m").write_text("hello")
    for name, message in {
        "pipe": "it is a pipe", "folder": "it is a folder", "empty": "it is empty", "nothing": "No such file",
        "text\x1b[31m": r"text\\x1b\[31m cannot be read as NetCDF: it begins with b'hell'",
    }.items():  # fmt: skip
        with pytest.raises(StoreError, match=message):
            open_netcdf(tmp_path / name)
    with pytest.raises(StoreError, match="it is a device"):
        open_netcdf(tmp_path / "/dev/zero")


def test_more_than_a_file_can_hold_is_refused(tmp_path):
    """By what is declared, before anything is read: values, pieces, coordinates."""
    with netCDF4.Dataset(tmp_path / "huge.nc", "w") as file:
        file.createDimension("time", 10**5)
        file.createDimension("particle", 10**7)
        file.createVariable("x", "f8", ("time", "particle"), chunksizes=(1, 1000))
        file.createVariable("y", "f8", ("time", "particle"), chunksizes=(1, 1000))
    with netCDF4.Dataset(tmp_path / "zeros.nc", "w") as file:
        for name, size in (("time", 3), ("particle", 3 * 10**6)):
            file.createDimension(name, size)
        for name in "xy":
            file.createVariable(name, "f8", ("time", "particle"), zlib=True)[0] = 0.0
    for name, message in (("huge.nc", "'x' has 1.6e.04 GB, more than the 1.07 GB"), ("zeros.nc", "cannot hold")):
        with open_netcdf(tmp_path / name) as dataset, pytest.raises(DataError, match=message):
            classify(dataset, ANALYSIS, release=0)
    with netCDF4.Dataset(tmp_path / "coordinate.nc", "w") as file:
        file.createDimension("time", 10**9)
        file.createVariable("time", "f8", ("time",))
    with pytest.raises(StoreError, match="declares 8,000,000,000 bytes for its coordinate 'time'"):
        open_netcdf(tmp_path / "coordinate.nc")


def test_variables_that_cannot_be_read_are_left_out(tmp_path):
    """The others are there; who asks for one is told why."""
    path = write(tmp_path / "a.nc", "NETCDF4", ("f8", "f8", "f8", "f8"))
    with netCDF4.Dataset(path, "a") as file:
        file["v0"].scale_factor = "a"
        file["v1"].coordinates = 5
        file["v2"].setncattr("_Encoding", "utf-8")
    with open_netcdf(path) as dataset:
        assert {*dataset.variables} == {"v3", "mass"}
        with pytest.raises(
            DataError, match=r"no variable 'v0' that can be read.*scale_factor is 'a', which is no number"
        ):
            classify(dataset, ANALYSIS, position="v0,v3", release=0)


def test_groups(tmp_path):
    """A file with all in groups names them; one that is not there is refused."""
    with netCDF4.Dataset(tmp_path / "g.nc", "w") as file:
        inner = file.createGroup("a").createGroup("b")
        inner.createDimension("time", 2)
        inner.createVariable("x", "f8", ("time",))[:] = 1.0
    with (
        open_netcdf(tmp_path / "g.nc") as dataset,
        pytest.raises(DataError, match=r"name one with --group: 'a', 'a/b'"),
    ):
        classify(dataset, ANALYSIS)
    with open_netcdf(tmp_path / "g.nc", "a/b") as dataset:
        assert dataset["x"].values.tolist() == [1.0, 1.0]
    with pytest.raises(StoreError, match="has no group 'c'; there are: 'a', 'a/b'"):
        open_netcdf(tmp_path / "g.nc", "c")


def test_the_lock_goes_along_with_a_dataset(tmp_path):
    """Into copies and through a pickle it stays the one of the process."""
    path = write(tmp_path / "p.nc", "NETCDF4")
    assert copy.deepcopy(netcdf.LOCK) is netcdf.LOCK
    with open_netcdf(path) as dataset:
        again = pickle.loads(pickle.dumps(dataset))
        xr.testing.assert_identical(again.load(), dataset.load())


THREADS = """
import os, random, sys, threading, time
from pathlib import Path
import numpy as np, xarray as xr
from snowrepro.store.netcdf import LOCK, open_netcdf, write_netcdf

end = time.monotonic() + float(sys.argv[1])
paths = [Path(f"{number}.nc") for number in range(3)]
opened = []

def replace(path, value):
    part = Path(f"{path}.{threading.get_ident()}")
    values = np.full((20, 500, 2), float(value))
    write_netcdf(xr.Dataset({"position": (("t", "p", "axis"), values)}), part, {"position": {"zlib": True}})
    part.replace(path)

def work(seed):
    rng, held = random.Random(seed), []
    while time.monotonic() < end:
        path = rng.choice(paths)
        if rng.random() < 0.1:
            replace(path, seed)
        first, second = open_netcdf(path), open_netcdf(path)
        for dataset in (first, second):
            values = dataset["position"][:, rng.randrange(500)].values
            assert (values == values[0]).all()
        held.append(second)
        if rng.random() < 0.5:
            first.close()
        if len(held) > 5:
            held.pop(0)
        opened.append(2)

for path in paths:
    replace(path, 0)
threads = [threading.Thread(target=work, args=(seed,)) for seed in range(int(sys.argv[2]))]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(sum(opened))
"""


@pytest.mark.parametrize("seconds", [4, pytest.param(60, marks=pytest.mark.nightly)])
def test_files_opened_in_several_threads_do_not_crash(tmp_path, seconds):
    """Opened twice, read, replaced and dropped in four threads; with no lock while opening it crashed in seconds."""
    command = [sys.executable, "-X", "faulthandler", "-c", THREADS, str(seconds), "4"]
    shown = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert shown.returncode == 0, shown.stderr[-2000:]
    assert "Error" not in shown.stderr
    assert int(shown.stdout) > 20
