"""Makes particle files that are damaged or odd, and reads them as ``snowrepro classify`` does; run as a program.

Prints a line of JSON for each file: its number, what was done to it, how reading it ended, and seconds.
"""

import json
import os
import resource
import signal
import sys
import time
import warnings
from pathlib import Path

import netCDF4
import numpy as np

from snowrepro.errors import SnowreproError
from snowrepro.store.find import open_particles
from snowrepro.summary.classify import classify, compose_analysis, is_whole_run, read_analysis

FORMATS = ("NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA", "NETCDF4", "NETCDF4_CLASSIC")
LONGEST_READ = 10  # s
ODD = (
    "start", "1.0 mm", "", "\x1b[31mred\x07", "=1+1", "nan", "1e999", -1, 0, 2.5, float("nan"), float("inf"), 1e300,
    [1.0, 2.0], 2**31 - 1, "{}", '{"analysis": 3}', "[" * 5000, "x" * 200_000, "\u202eolleh", "days since never",
    "months since 2000-01-01", "s", "ms", "None", "\u00b5s",
)  # fmt: skip
ON_FILE = ("release_frame", "grid_spacing", "cell_mass", "config", "featureType", "run_id", "coordinates")
ON_VARIABLE = (
    "units", "scale_factor", "add_offset", "missing_value", "coordinates", "_Encoding", "dtype", "calendar", "axis",
    "standard_name", "cf_role", "_Unsigned", "valid_range", "bounds",
)  # fmt: skip


def main(seed: int, count: int, folder: Path) -> None:
    """Make and read ``count`` files."""
    warnings.simplefilter("ignore")
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
    analysis = compose_analysis()
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        path = folder / f"{number % 4}.nc"
        deed = damage(path, rng)
        started = time.perf_counter()
        signal.alarm(LONGEST_READ)
        ended = read(path, analysis, rng)
        signal.alarm(0)
        seconds = time.perf_counter() - started
        print(json.dumps({"number": number, "deed": deed, "ended": ended, "seconds": seconds}), flush=True)
    print(json.dumps({"memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024}))


def damage(path: Path, rng: np.random.Generator) -> str:
    """Make a file and do something to it; returns in words what."""
    form = str(rng.choice(FORMATS))
    path.unlink(missing_ok=True)
    kind = str(rng.choice(["cut", "flipped", "attributes", "shapes", "values"]))
    write(path, form, rng, shapes=kind == "shapes", values=kind == "values")
    if kind == "attributes":
        with netCDF4.Dataset(path, "a") as file:
            for _ in range(rng.integers(1, 4)):
                change_attribute(file, rng)
    content = bytearray(path.read_bytes())
    if kind == "cut":
        content = content[: rng.integers(len(content))]
    elif kind == "flipped":
        reach = len(content) if rng.random() < 0.5 else min(len(content), 2000)
        for _ in range(rng.integers(1, 9)):
            content[rng.integers(reach)] ^= 1 << int(rng.integers(8))
    path.unlink()
    path.write_bytes(content)
    return f"{form} {kind}"


def write(path: Path, form: str, rng: np.random.Generator, shapes: bool, values: bool) -> None:
    """Write particles, plainly or with odd dimensions or values."""
    states, particles, axes = (int(number) for number in (rng.integers(1, 6), rng.integers(1, 60), rng.integers(2, 4)))
    names = {"time": states, "particle": particles, "axis": axes}
    if shapes:
        odd = rng.permutation([*names, "obs", "n", "\u202eemit", "trajectory"])[:3].tolist()
        names = dict(zip(odd, names.values(), strict=True))
        if rng.random() < 0.3:
            names = dict.fromkeys(names, int(rng.integers(form != "NETCDF4", 4)))
        if form == "NETCDF4" and rng.random() < 0.3:
            names[next(iter(names))] = int(rng.choice([10**6, 10**9, 10**12, 2**40]))
    huge = max(names.values()) > 10**5
    with netCDF4.Dataset(path, "w", format=form) as file:
        order = rng.permutation(list(names)).tolist() if shapes else list(names)
        for name, size in names.items():  # classic files have a growing dimension in the first place alone
            file.createDimension(name, None if rng.random() < 0.1 and form == "NETCDF4" and not huge else size)
        kind = str(rng.choice(["f8", "f4", "i4", "S1"] if shapes or values else ["f8"]))
        position = file.createVariable("position", kind, order[: 3 if rng.random() < 0.9 else 2])
        places = rng.uniform(0, 10, [names[name] for name in order]) if not huge else None
        if values and places is not None:
            spoil(places, rng)
        if places is not None and kind != "S1" and position.ndim == 3 and rng.random() < 0.95:
            with np.errstate(all="ignore"):
                position[:] = places.astype(kind)
        dims = list(names)
        for name, where in (("time", dims[:1]), ("mass", dims[1:2]), ("id", dims[:2]), ("velocity", order)):
            if rng.random() < 0.5 and not huge:
                variable = file.createVariable(name, "f8", where)
                sizes = [names[dim] for dim in where]
                numbers = np.arange(1.0, 1.0 + np.prod(sizes)).reshape(sizes)
                if name == "id" and rng.random() < 0.8:
                    numbers = rng.permuted(np.broadcast_to(numbers[:1], sizes), axis=1)
                variable[:] = rng.permutation(numbers) if values else numbers
        file.release_frame = 0


def spoil(places: np.ndarray, rng: np.random.Generator) -> None:
    """Put values into places, in place, that are no places."""
    for _ in range(rng.integers(1, 4)):
        value = rng.choice([np.nan, np.inf, -np.inf, 1e300, -1e38, 9.969209968386869e36, 0.0, 1e-300, 1e17])
        index = tuple(slice(None) if rng.random() < 0.4 else int(rng.integers(size)) for size in places.shape)
        places[index] = value


def change_attribute(file: netCDF4.Dataset, rng: np.random.Generator) -> None:
    """Give the file or a variable an attribute that it may have, with an odd value."""
    value = ODD[rng.integers(len(ODD))]
    variables = list(file.variables.values())
    on_file = rng.random() < 0.5
    target = file if on_file else variables[rng.integers(len(variables))]
    try:
        target.setncattr(str(rng.choice(ON_FILE if on_file else ON_VARIABLE)), value)
    except Exception:  # noqa: BLE001  # netCDF4 itself refuses some
        return


def read(path: Path, analysis, rng: np.random.Generator) -> str:
    """Read a file as the command does; returns "fine", "refused" or what else came."""
    options = {"release": 0} if rng.random() < 0.7 else {}
    if rng.random() < 0.2:
        options["time_dimension"] = "time"
    if rng.random() < 0.2:
        options["definition"] = str(rng.choice(["proximity", "grid", "damage"]))
    try:
        with open_particles(path) as dataset:
            is_whole_run(dataset)
            if rng.random() < 0.05:
                read_analysis(dataset)
            found = classify(dataset, analysis, frames="all", **options)
            found.table()
            found.measures()
            found.to_dataset()
    except SnowreproError as error:
        text = str(error)
        if "\n" in text or not text.isprintable() or len(text) > 1500:
            return f"raw text: {text!r}"
        return "refused"
    except Exception as error:  # noqa: BLE001  # this is what is looked for
        import traceback

        return f"{type(error).__name__}: {error} at {traceback.extract_tb(error.__traceback__)[-1]}"
    return "fine"


if __name__ == "__main__":
    os.environ["OMP_NUM_THREADS"] = "1"
    main(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))
