"""Small clusters on this machine: Slurm with one node of two processors, Ray with two nodes of one each.

They listen on loopback alone, and no daemon outlives the process that started it.
"""

import ctypes
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

LOOPBACK = "127.0.0.1"
RAY_LOOPBACK = "127.0.0.2"  # Ray replaces 127.0.0.1 by an address that other machines reach
START_SECONDS = 60.0
STOP_SECONDS = 10.0
PR_SET_PDEATHSIG = 1

SLURM_CONF = """\
ClusterName=snowrepro
SlurmctldHost={host}({loopback})
SlurmctldPort={controller_port}
SlurmdPort={node_port}
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
KillWait=5
MpiDefault=none
NodeName={host} NodeAddr={loopback} CPUs=2 RealMemory={memory} State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def slurm_lacks() -> str | None:
    """What keeps Slurm from being started here, and what to do about it; None if nothing does."""
    missing = [name for name in ("munged", "slurmctld", "slurmd", "sbatch", "srun") if not _which(name)]
    if missing:
        return f"no Slurm here ({', '.join(missing)} missing): as root, apt-get install slurm-wlm munge"
    return None if os.geteuid() == 0 else "Slurm's daemons are started as root only"


@contextmanager
def slurm_cluster() -> Iterator[dict[str, str]]:
    """A running Slurm; gives the environment that its commands need."""
    folder = Path(tempfile.mkdtemp(prefix="slurm-"))  # short: it holds a socket
    folder.chmod(0o755)  # munged refuses a socket that others cannot reach
    host = socket.gethostname().split(".")[0]
    env = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
    for name in ("state", "spool"):
        (folder / name).mkdir()
    key = folder / "munge.key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o400)
    controller_port, node_port = _free_ports(2)
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20 * 9 // 10
    (folder / "slurm.conf").write_text(
        SLURM_CONF.format(
            host=host,
            folder=folder,
            loopback=LOOPBACK,
            memory=memory,
            controller_port=controller_port,
            node_port=node_port,
        )
    )
    munge = [f"--{name}={folder}/munge.{name.split('-')[0]}" for name in ("key-file", "socket", "pid-file", "log-file")]
    with ExitStack() as stack:
        stack.callback(shutil.rmtree, folder, ignore_errors=True)
        stack.enter_context(_daemon("munged", ["-F", *munge, f"--seed-file={folder}/munge.seed"], env, folder))
        _wait_for((folder / "munge.socket").exists, "munged", folder)
        stack.enter_context(_daemon("slurmctld", ["-D", "-i"], env, folder))
        stack.enter_context(_daemon("slurmd", ["-D", "-N", host], env, folder))
        stack.callback(_end_jobs, env)
        _wait_for(lambda: _output(["sinfo", "-h", "-o", "%T"], env) in ("idle", "mixed", "allocated"), "slurmd", folder)
        yield env


@contextmanager
def ray_cluster(python_path: str) -> Iterator[tuple[str, dict[str, str]]]:
    """A running Ray of two nodes; gives its address and the environment for those who join.

    Its workers have this environment, not that of whoever sends a task: ``python_path`` says whose package they import.
    """
    folder = Path(tempfile.mkdtemp(prefix="ray-"))
    # The folder is also where Ray notes the cluster that a ray.init() without address joins: not in /tmp/ray for all.
    env = {**os.environ, "PYTHONPATH": python_path, "RAY_USAGE_STATS_ENABLED": "0", "RAY_TMPDIR": str(folder)}
    (folder / "ray").mkdir()
    script = (
        "import signal, sys\n"
        "from ray.cluster_utils import Cluster\n"
        "node = dict(num_cpus=1, object_store_memory=80 * 2**20, include_dashboard=False)\n"
        f"head = dict(node, node_ip_address='{RAY_LOOPBACK}')\n"
        "cluster = Cluster(initialize_head=True, head_node_args=head)\n"
        f"cluster.add_node(**dict(node, node_ip_address='{RAY_LOOPBACK}'))\n"
        "cluster.wait_for_nodes()\n"
        "print('ready', cluster.address, flush=True)\n"
        "sys.stdin.read()\n"  # until the parent closes it, also by dying
        "cluster.shutdown()\n"
    )
    with ExitStack() as stack:
        stack.callback(shutil.rmtree, folder, ignore_errors=True)
        log = stack.enter_context(open(folder / "head.log", "w"))
        server = subprocess.Popen(
            [sys.executable, "-c", script],
            env=env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            start_new_session=True,
        )
        stack.callback(_end_group, server)
        assert server.stdout is not None
        address = next((line.split()[1] for line in server.stdout if line.startswith("ready")), None)  # or it ended
        if address is None:
            raise RuntimeError(f"Ray did not start:\n{(folder / 'head.log').read_text()[-2000:]}")
        yield address, env


@contextmanager
def _daemon(name: str, arguments: Sequence[str], env: dict[str, str], folder: Path) -> Iterator[subprocess.Popen]:
    """A daemon in the foreground for as long as the block lasts; it dies with this process too."""
    program = _which(name)
    assert program is not None
    with open(folder / f"{name}.log", "w") as log:
        process = subprocess.Popen(
            [program, *arguments],
            env=env,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
            preexec_fn=_die_with_parent,
        )
    try:
        yield process
    finally:
        _end_group(process)


def _die_with_parent() -> None:
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def _end_group(process: subprocess.Popen) -> None:
    """End a process that leads its own session, in order, or by force with all that it started."""
    if process.stdin:
        process.stdin.close()
    else:
        process.terminate()
    with suppress(subprocess.TimeoutExpired):
        process.wait(STOP_SECONDS)
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _end_jobs(env: dict[str, str]) -> None:
    """Cancel what is queued and wait until its processes are gone."""
    subprocess.run(["scancel", "--full", "--signal=KILL", "--user=root"], env=env, capture_output=True)
    subprocess.run(["scancel", "--user=root"], env=env, capture_output=True)
    end = time.monotonic() + STOP_SECONDS
    while _output(["squeue", "-h"], env) and time.monotonic() < end:
        time.sleep(0.2)


def _wait_for(there: Callable[[], bool], name: str, folder: Path) -> None:
    end = time.monotonic() + START_SECONDS
    while not there():
        if time.monotonic() > end:
            logs = "\n".join(path.read_text()[-2000:] for path in sorted(folder.glob("*.log")))
            raise RuntimeError(f"{name} did not start:\n{logs}")
        time.sleep(0.1)


def _output(command: list[str], env: dict[str, str]) -> str:
    return subprocess.run(command, env=env, capture_output=True, text=True, timeout=30).stdout.strip()


def _which(name: str) -> str | None:
    return shutil.which(name) or shutil.which(name, path="/usr/sbin:/sbin")


def _free_ports(count: int) -> list[int]:
    """Ports that nobody listens on at this moment."""
    sockets = [socket.socket() for _ in range(count)]
    try:
        for one in sockets:
            one.bind((LOOPBACK, 0))
        return [one.getsockname()[1] for one in sockets]
    finally:
        for one in sockets:
            one.close()
