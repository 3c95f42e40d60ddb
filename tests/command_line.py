"""The command line in a process of its own: a new one, or one forked from a server that has imported packages.

A new process spends seconds on imports.  The server has imported once what takes them, all but the command line
itself, and done nothing with it; each call is then a process with its own folder, streams and exit code, as fresh as a
new one.  What is read while Python starts or packages are imported it does not see: where the environment is not that
of the tests, a new process is taken.  Likewise by those tests that are about a process as a user has it.
"""

import functools
import gc
import importlib
import json
import os
import pkgutil
import runpy
import select
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
PATIENCE = 300  # seconds
SET_BY_TESTS = ("PYTEST_", "MPLBACKEND", "KMP_", "RAY_")
# Of the server alone: no threads, which a fork would lose, and the backend that the command line sets before imports.
PREPARED = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1") | {"MPLBACKEND": "agg"}


def run(*arguments: str, cwd: Path, **options) -> subprocess.CompletedProcess:
    """Run the command line; ``options`` are those of ``subprocess.run``, with which it is a new process."""
    if options or sys.platform != "linux" or _environment() != ENVIRONMENT:
        return run_new(*arguments, cwd=cwd, **options)
    with tempfile.TemporaryDirectory() as folder:
        streams = [Path(folder, name) for name in ("stdout", "stderr")]
        code = _call({"arguments": arguments, "cwd": str(cwd), "streams": [str(path) for path in streams]})
        return subprocess.CompletedProcess(arguments, code, *(path.read_text() for path in streams))


def run_new(*arguments: str, cwd: Path, **options) -> subprocess.CompletedProcess:
    """Run the command line in a new process, as a user does."""
    command = [sys.executable, "-m", "snowrepro", *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=PATIENCE, **options)


def _call(request: Mapping) -> int:
    """Have the server fork a process; returns its exit code when it has ended."""
    server = _start_server()
    server.stdin.write(json.dumps(request).encode() + b"\n")
    process = int(server.stdout.readline())
    if not select.select([server.stdout], [], [], PATIENCE)[0]:
        os.kill(process, signal.SIGKILL)
        server.stdout.readline()
        raise subprocess.TimeoutExpired(request["arguments"], PATIENCE)
    return int(server.stdout.readline())


@functools.cache
def _start_server() -> subprocess.Popen:
    """Start the server of this process; it ends when nobody can ask it any more."""
    command = [sys.executable, "-c", f"from {__name__} import serve; serve()"]
    return subprocess.Popen(
        command, cwd=ROOT, env=ENVIRONMENT | PREPARED, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0
    )


def _environment() -> dict[str, str]:
    """The environment, but for what pytest, packages and the command line, called within a test, set in it."""
    return {name: value for name, value in os.environ.items() if not name.startswith(SET_BY_TESTS)}


ENVIRONMENT = _environment()  # of the server


def serve() -> None:
    """Fork a process for each request in standard input; print its id at once, and its exit code at its end.

    In the forked process, be the command line.
    """
    _import_packages()
    gc.freeze()  # else each process spends a second at its end to look through all that was imported
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the tests, which Ctrl-C reaches too, end this
    for line in sys.stdin:
        process = os.fork()
        if process == 0:
            _be_command_line(**json.loads(line))
        print(process, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), flush=True)


def _import_packages() -> None:
    """Import this program, with all that it imports, but not its command line."""
    import snowrepro

    for module in pkgutil.walk_packages(snowrepro.__path__, "snowrepro."):
        if not module.name.startswith(("snowrepro.cli", "snowrepro.__main__")):
            importlib.import_module(module.name)


def _be_command_line(arguments: list[str], cwd: str, streams: list[str]) -> None:
    """Do what ``python -m snowrepro`` does in a folder, and exit; it prints into two files."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    for number, path in enumerate(streams, start=1):
        os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT), number)
    for name in PREPARED:
        del os.environ[name]
    os.chdir(cwd)
    sys.path[0] = cwd
    sys.argv[1:] = arguments
    runpy.run_module("snowrepro", run_name="__main__", alter_sys=True)
    sys.exit()
