"""Many cases in one launch: each has the bits that it has alone, whatever stands beside it."""

import os
import signal
import subprocess
import sys
import time
from functools import partial

import numpy as np
import pytest
import xarray as xr

from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError, Diverged
from snowrepro.mpm import parallel, solver
from snowrepro.mpm.batch import Batch, Follower, require_one_kind
from snowrepro.mpm.cases import CHUNK, LANES, Cases
from snowrepro.mpm.constants import make_constants
from snowrepro.run import simulate
from snowrepro.scene.build import build_scene
from snowrepro.simulation import simulate_cases
from tests import command_line
from tests.conftest import SMALL
from tests.validation.test_restart import assert_same_bits

SHORT = (
    "fidelity=preview", "solver.summation=fixed_point", "loading.press_frames=6", "loading.frames=16",
    "reading.drop_height=3", "reading.gravity=40",
)  # fmt: skip
KINDS = (
    ("pressure=3000",),
    ("sintering=none", "shape=star", "floor=stair3", "loading.frames=11"),  # ends before the others
    ("pressure=1e9",),  # diverges
    ("pressure=5900", "shape=rectangle", "floor=square", "seed=1"),
    ("shape=triangle", "floor=zigzag", "reading.gravity=10"),
    ("pressure=900", "floor=triangle", "loading.press_frames=4"),
)


def compose_kinds(*more: str, kinds=KINDS):
    return [compose([*SHORT, *kind, *more]).case for kind in kinds]


def simulate_alone(kind, *more):
    try:
        return simulate(compose([*SHORT, *kind, *more]))
    except Diverged as error:
        return error


def assert_same(one: xr.Dataset | Diverged, other: xr.Dataset | Diverged) -> None:
    """The same bits of all that is stored, or the same failure."""
    if isinstance(one, Diverged):
        assert str(one) == str(other)
        return
    assert_same_bits(one, other)


@pytest.mark.slow
def test_each_case_has_the_bits_that_it_has_alone():
    """On two threads beside one that diverges and one that ends before."""
    kinds = KINDS[:3]
    together = dict(simulate_cases(compose_kinds(kinds=kinds), threads=2))
    assert isinstance(together[2], Diverged)
    for i, kind in enumerate(kinds):
        assert_same(simulate_alone(kind), together[i])


@pytest.mark.nightly
@pytest.mark.parametrize(
    "more",
    [
        (),
        ("reading.contact=penalty", "solver.transfer=pic_flip", "reading.release=rest"),
        ("solver.precision=f32",),
        ("reading.initial_volume=grid_density", "solver.spline=quadratic", "solver.transfer=mls", "material=cam_clay"),
    ],
)
def test_company_and_order_change_no_bit(more):
    """Six different cases: alone, all together, and some of them in another order."""
    together = dict(simulate_cases(compose_kinds(*more)))
    some = (4, 2, 0, 5)
    others = dict(simulate_cases([compose_kinds(*more)[i] for i in some], threads=2))
    for place, i in enumerate(some):
        assert_same(others[place], together[i])
    for i, kind in enumerate(KINDS):
        assert_same(simulate_alone(kind, *more), together[i])


@pytest.mark.nightly
def test_a_case_goes_on_from_its_checkpoint():
    """Beside another one that begins: the same state in its last frame."""
    one, other = compose_kinds(kinds=[KINDS[0], KINDS[3]])
    alone = run_to([one], [None], stop=16)[0]
    saved = run_to([one, other], [None, None], stop=9)[0]
    again = run_to([other, one], [None, saved], stop=16)[1]
    for name, values in alone.items():
        np.testing.assert_array_equal(again[name], values, err_msg=name)


@pytest.mark.slow
def test_a_frame_that_fails_at_once_is_a_failure():
    """In its first substep, from a checkpoint on: not a start, and not the end of a run."""
    (case,) = compose_kinds(kinds=KINDS[:1])
    saved = run_to([case], [None], stop=2)[0]
    saved["poisson"][5] = 0.6
    with pytest.raises(Diverged, match=r"diverged in frame 3 .* particle 5 .* Poisson's ratio of 0\.6"):
        run_to([case], [saved], stop=9)


def test_a_node_without_mass_has_no_old_velocity(taichi):
    """What reaches a node may round to no mass in fixed point; particles near still read its velocity."""
    case = compose_kinds(kinds=KINDS[:1])[0]
    constants = make_constants(case)
    particles, nodes, ledger = solver.allocate(case, build_scene(case), constants)
    nodes.velocity.fill(7.0)
    parallel.begin(particles, nodes, ledger, constants, np.ones(1, np.int32), np.zeros((1, 3)))
    parallel.advance_substep(particles, nodes, ledger, constants)
    (low,), (high,) = ledger.low.to_numpy(), ledger.high.to_numpy()
    part = nodes.velocity.to_numpy()[low[0] : high[0], low[1] : high[1]]
    assert (nodes.mass.to_numpy()[low[0] : high[0], low[1] : high[1]] == 0.0).any()
    assert np.abs(part).max() < 7.0


def run_to(cases, resumes, stop: int) -> list[dict[str, np.ndarray]]:
    """The checkpoints of cases side by side, each in a frame."""
    scenes = [build_scene(case) for case in cases]
    batch, pairs = Batch(cases, scenes, resumes), zip(cases, scenes, strict=True)
    followers = [
        Follower(case, scene, batch.table, batch.place_block(batch.force, i), partial(batch.read_case, i))
        for i, (case, scene) in enumerate(pairs)
    ]
    ends, reports = {}, batch.start()
    while reports or batch.is_under_way():
        going_on = []
        for i, report in reports.items():
            frame = followers[i].take(report)
            if frame.number == stop:
                ends[i] = frame.checkpoint()
            else:
                followers[i].press()
                going_on.append(i)
        batch.begin(going_on)
        batch.launch()
        reports = batch.collect()
    return [ends[i] for i in range(len(cases))]


def test_sums_in_fixed_point_are_those_in_order():
    """To 1e-9 of each quantity's size over a short run, as sums only round otherwise."""
    ends = []
    for summation in ("in_order", "fixed_point"):
        dataset = simulate(compose([*SHORT, *KINDS[0], f"solver.summation={summation}", "loading.frames=8"]))
        ends.append(dataset)
    for name in ("kinetic_energy", "elastic_energy", "plastic_work", "mean_hardening", "centre_height"):
        one, other = (dataset[name].values for dataset in ends)
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-9 * np.abs(one).max(), err_msg=name)


@pytest.mark.parametrize(
    ("kinds", "more", "message"),
    [
        (KINDS[:1], ("solver.summation=in_order",), "solver.summation=in_order gives other bits in other company"),
        (KINDS[:1], ("indenter=disc",), "a batch takes no indenter"),
        (
            (("reading.initial_volume=sampled",), ("reading.initial_volume=grid_density",)),
            (),
            "differ in what the solver is compiled for",
        ),
        ((("reading.friction=0.1",), ("reading.friction=0.2",)), (), "differ in what the solver is compiled for"),
    ],
)
def test_what_does_not_go_together_is_refused(kinds, more, message):
    with pytest.raises(ConfigError, match=message):
        require_one_kind(compose_kinds(*more, kinds=kinds))


def test_where_cases_stand(taichi):
    """A case alone takes whole lane groups; beside others whole chunks of slots, and columns of its own."""
    alone, many = Cases([130], [(7, 9)]), Cases([130, 1, CHUNK], [(7, 9), (3, 12), (4, 2)])
    assert (alone.slots, alone.chunks, alone.grid) == (-(-130 // LANES) * LANES, 2, (7, 9))
    assert many.first_slots == (0, 2 * CHUNK, 3 * CHUNK, 4 * CHUNK)
    assert (many.first_columns, many.grid) == ((0, 7, 10, 14), (14, 12))
    assert many.case_of_chunk.to_numpy().tolist() == [0, 0, 1, 2]
    assert many.last_slot.to_numpy().tolist() == [130, 2 * CHUNK + 1, 4 * CHUNK]
    assert many.find_spans([2, 0]) == [(0, 2 * CHUNK), (3 * CHUNK, 4 * CHUNK)]
    assert many.find_spans([1, 0]) == [(0, 3 * CHUNK)]
    assert many.find_spans([]) == []


@pytest.mark.nightly
def test_a_sweep_is_computed_side_by_side(tmp_path):
    """By the command line into a store: the runs of the usual launcher, bit by bit, and their failures.

    The process that computes is ended with the sweep, and keeps its kernels all the same.
    """
    varied = ("pressure=3000,1e9", "sintering=paper,none", "solver.summation=fixed_point", "loading.frames=30")
    stores = {}
    for launcher in ("batch", "local"):
        made = command_line.run(
            "run", "-m", *SMALL[:-3], "reading.drop_height=6", "reading.gravity=40", "loading.press_frames=20", *varied,
            f"hydra/launcher={launcher}", f"store={launcher}", cwd=tmp_path,
            env={**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": str(tmp_path / f"kernels-{launcher}")},
        )  # fmt: skip
        assert made.returncode == 3, made.stderr
        stores[launcher] = {path.parent.name: path for path in sorted((tmp_path / launcher).glob("*/run.nc"))}
    assert list(tmp_path.glob("kernels-batch/**/*.tic"))
    assert len(stores["batch"]) == 2  # those that do not diverge
    assert [*stores["batch"]] == [*stores["local"]]
    for run, path in stores["batch"].items():
        with xr.open_dataset(path) as one, xr.open_dataset(stores["local"][run]) as other:
            assert_same_bits(one, other)


@pytest.mark.nightly
def test_a_batch_that_was_stopped_goes_on(tmp_path):
    """Ctrl-C between frames, then one run a process: the bits of runs that were never stopped; each says where it went
    on.
    """
    sweep = ("fidelity=preview", "solver.summation=fixed_point", "pressure=500,3000", "loading.frames=200")
    command = [sys.executable, "-m", "snowrepro", "run", "-m", *sweep, "store=stopped", "hydra/launcher=batch"]
    process = subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    deadline = time.monotonic() + 200
    while len(list(tmp_path.glob("stopped/.work/*/progress.json"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert len(list(tmp_path.glob("stopped/.work/*/checkpoint.npz"))) == 2
    for store in ("stopped", "whole"):
        assert command_line.run("run", "-m", *sweep, f"store={store}", cwd=tmp_path).returncode == 0
    for path in tmp_path.glob("stopped/*/run.nc"):
        assert "goes on from frame" in (path.parent / "run.log").read_text()
        with xr.open_dataset(path) as one, xr.open_dataset(tmp_path / "whole" / path.parent.name / "run.nc") as other:
            assert_same_bits(one, other)


def test_a_batch_asks_for_fixed_point_before_any_work(tmp_path):
    made = command_line.run("run", "-m", *SMALL, "pressure=1,2", "hydra/launcher=batch", "store=s", cwd=tmp_path)
    assert made.returncode == 2
    assert "solver.summation=fixed_point" in made.stderr
    assert not list((tmp_path / "s").glob("*/run.log"))
