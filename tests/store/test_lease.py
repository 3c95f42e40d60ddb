"""Leases: one holder at a time, whoever dies, and whenever."""

import multiprocessing
import os
import time
from pathlib import Path

import pytest

from snowrepro.errors import StoreError
from snowrepro.store import lease
from snowrepro.store.files import write_json

ELSEWHERE = {"host": "elsewhere", "place": "elsewhere boot", "pid": 1}


def _count_alone(folder: Path, rounds: int) -> None:
    """Take the lease again and again; a file that must be new each time shows that nobody else has it."""
    lease.WAIT_SECONDS = 0.002
    for _ in range(rounds):
        with lease.hold_lease(folder / "work"):
            open(folder / "alone", "x").close()
            time.sleep(0.001)
            (folder / "alone").unlink()


def _take_and_die(folder: Path) -> None:
    lease.take(folder)
    os.kill(os.getpid(), 9)


def _take_and_sleep(folder: Path) -> None:
    lease.take(folder)
    time.sleep(60)


def _started(target, *arguments) -> multiprocessing.Process:
    process = multiprocessing.get_context("spawn").Process(target=target, args=arguments)
    process.start()
    return process


def _wait_for(condition) -> None:
    deadline = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_only_one_holds(tmp_path):
    """Four processes that take and give back a hundred times in all."""
    processes = [_started(_count_alone, tmp_path, 25) for _ in range(4)]
    for process in processes:
        process.join(60)
    assert [process.exitcode for process in processes] == [0] * 4
    assert [path.name for path in (tmp_path / "work").iterdir()] == ["lease.100"]


def test_the_living_keep_it_and_the_dead_lose_it(tmp_path):
    """On this host at once: by their process number, and not by how long they were silent."""
    process = _started(_take_and_sleep, tmp_path)
    _wait_for(lambda: (held := lease.holder(tmp_path)) and held.pid)  # and not just being written
    assert lease.holder(tmp_path).pid == process.pid
    assert lease.take(tmp_path) is None
    assert lease.dead_holder(tmp_path) is None
    process.kill()
    process.join()
    assert lease.holder(tmp_path) is None
    assert lease.dead_holder(tmp_path).pid == process.pid
    held = lease.take(tmp_path)
    assert held is not None and held.generation == 2
    held.release()
    assert lease.holder(tmp_path) is None and lease.dead_holder(tmp_path) is None


def test_a_killed_process_does_not_stop_who_waits(tmp_path):
    process = _started(_take_and_die, tmp_path)
    process.join(30)
    assert process.exitcode == -9
    with lease.hold_lease(tmp_path) as held:
        assert held.generation == 2


def test_another_host_is_dead_when_it_is_silent(tmp_path, monkeypatch):
    """Its process numbers mean nothing here; its heartbeat does, by the file system's clock, watched for a while."""
    monkeypatch.setattr(lease, "WATCHED_SECONDS", 0.2)
    path = tmp_path / "lease.7"
    write_json(path, ELSEWHERE)
    assert str(lease.holder(tmp_path)) == "process 1 on elsewhere"
    assert lease.take(tmp_path) is None
    late = path.stat().st_mtime - lease.EXPIRY_SECONDS - 5
    os.utime(path, (late, late))
    assert lease.holder(tmp_path) is None
    assert lease.dead_holder(tmp_path).host == "elsewhere"
    watch = lease.LeaseWatch()
    assert lease.take(tmp_path) is None and lease.take(tmp_path, watch) is None
    time.sleep(0.25)
    assert lease.take(tmp_path, lease.LeaseWatch()) is None
    held = lease.take(tmp_path, watch)
    assert held is not None and held.generation == 8 and not path.exists()
    held.release()


@pytest.mark.parametrize("jump", [-1e6, 1e6])
def test_a_clock_that_jumps_takes_nothing_from_the_living(tmp_path, monkeypatch, jump):
    """Wherever it jumps to: who renews the lease meanwhile is seen to live."""
    monkeypatch.setattr(lease, "WATCHED_SECONDS", 0.3)
    path, watch = tmp_path / "lease.1", lease.LeaseWatch()
    write_json(path, ELSEWHERE)
    for beat in range(8):
        moment = path.stat().st_mtime + beat + (jump if beat == 0 else 0)
        os.utime(path, (moment, moment))
        assert lease.take(tmp_path, watch) is None
        time.sleep(0.1)
    time.sleep(0.3)
    held = lease.take(tmp_path, watch)
    assert held is not None, "it has ended, and a clock that jumped does not hide it"
    held.release()


def test_a_living_process_of_this_host_keeps_it_however_long_it_is_silent(tmp_path):
    """Taichi compiles for minutes, and no thread gets to renew a lease meanwhile."""
    process = _started(_take_and_sleep, tmp_path)
    _wait_for(lambda: (held := lease.holder(tmp_path)) and held.pid)  # and not just being written
    for moment in (1.0, time.time() + 1e6):
        os.utime(tmp_path / "lease.1", (moment, moment))
        assert lease.holder(tmp_path).pid == process.pid
        assert lease.take(tmp_path, lease.LeaseWatch()) is None
    process.kill()
    process.join()


def test_another_process_with_the_number_of_a_dead_one_holds_nothing(tmp_path):
    """Numbers are given again; the time at which a process began is not."""
    here = lease.here()
    assert here.born
    write_json(tmp_path / "lease.1", {**vars(here), "born": str(int(here.born) - 1)})
    assert lease.holder(tmp_path) is None
    held = lease.take(tmp_path)
    assert held is not None
    held.release()


def test_a_heartbeat_keeps_it(tmp_path, monkeypatch):
    """The file's time goes on while the holder lives, whatever it does meanwhile."""
    monkeypatch.setattr(lease, "BEAT_SECONDS", 0.05)
    held = lease.take(tmp_path)
    os.utime(held.path, (1.0, 1.0))
    _wait_for(lambda: held.path.stat().st_mtime > time.time() - 10)
    assert not held.lost
    held.release()


def test_whoever_was_taken_for_dead_notices(tmp_path):
    """Suspended for long, then awake: it holds nothing any more, and gives nothing back."""
    held = lease.take(tmp_path)
    write_json(tmp_path / "lease.2", vars(lease.here()))
    assert held.lost
    held.release()
    assert lease.holder(tmp_path) is not None


def test_a_lease_that_is_being_written_counts(tmp_path):
    """Between its making and its first words it is somebody's."""
    (tmp_path / "lease.1").touch()
    assert lease.holder(tmp_path) is not None
    assert lease.take(tmp_path) is None


def test_where_nothing_can_be_written(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match=r"cannot write .*lease\.1"):
        lease.take(tmp_path / "file" / "work")
