"""The process that `forking` forks from; see there."""

from __future__ import annotations

import atexit
import ctypes
import fcntl
import importlib
import inspect
import io
import json
import os
import signal
import socket
import subprocess
import sys
import termios
import warnings
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import forking

Request = dict[str, Any]

#: Descriptors that forks are to inherit are below this.
LAST_FILE = 500


def preload() -> None:
    """Import all that runs and nodes need, and load what is compiled and what is looked up."""
    for module in (
        "gameinfer_ros.commands.cli",
        "gameinfer_ros.commands.gameinfer",
        "gameinfer_ros.orchestration.orchestrator",
        "gameinfer_ros.runs.animation",
        "gameinfer_ros.runs.picture",
        *(
            forking.NODES + node
            for node in ("human_agent", "inference", "robot_planner", "simulator", "viewer")
        ),
    ):
        importlib.import_module(module)
    from matplotlib.figure import Figure

    from gameinfer_ros.scenario import Scenario
    from gameinfer_ros.solver import GameSolver

    scenario = Scenario.load("two_player")
    GameSolver(scenario.game, scenario.solver).warm_up()
    for name, module in list(sys.modules.items()):
        if name.endswith((".msg", ".srv")):  # what publishers and clients of these types load
            for kind in vars(module).values():
                if hasattr(kind, "__import_type_support__"):
                    kind.__import_type_support__()
    inspect.getmodule(sys._getframe())  # looks up the files of all modules, as the first log entry
    figure = Figure()
    figure.subplots().set_title("loads fonts")
    figure.savefig(io.BytesIO())


def serve(requests: socket.socket) -> Request:
    """Fork for each request; returns in the fork, with its request."""
    while True:
        data, files, _, _ = socket.recv_fds(requests, 2**20, 32)
        if not data:  # who could ask has ended
            os._exit(0)
        told, tell = os.pipe()
        if os.fork() == 0:
            fork = os.fork()
            if fork:
                os.write(tell, str(fork).encode())
                os._exit(0)
            request: Request = json.loads(data)
            requests.close()
            become(request, files)
            return request
        os.wait()  # now the fork is an orphan, and belongs to who asked
        requests.send(os.read(told, 64))
        for file in (*files, told, tell):
            os.close(file)


def become(request: Request, files: Sequence[int]) -> None:
    """Make this fork what is asked for, but for what it runs."""
    os.setsid()
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    inherited = [fcntl.fcntl(file, fcntl.F_DUPFD, LAST_FILE) for file in files]
    os.closerange(0, LAST_FILE)
    for number, file in zip(request["files"], inherited, strict=True):
        os.dup2(file, number)
        os.close(file)
    if request["controlled"]:
        fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    unbuffered = "PYTHONUNBUFFERED" in os.environ
    sys.stdin = os.fdopen(0, closefd=False)
    sys.stdout = os.fdopen(1, "w", 1 if unbuffered or os.isatty(1) else -1, closefd=False)
    sys.stderr = os.fdopen(2, "w", 1, closefd=False)
    ignored = request["ignore_sigint"]
    signal.signal(signal.SIGINT, signal.SIG_IGN if ignored else signal.default_int_handler)
    sys.argv = request["command"][2:]
    call_itself(*request["command"])


def call_itself(*command: str) -> None:
    """Show a command line to others; it replaces the one that this process was started with."""
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    start, end = int(fields[45]), int(fields[46])
    shown = b"".join(word.encode() + b"\0" for word in command)
    assert len(shown) < end - start
    ctypes.memset(start, 0, end - start)
    ctypes.memmove(start, shown, len(shown))


def serve_nodes(ours: socket.socket, theirs: socket.socket) -> Request:
    """Be the server of a run, from which its nodes are forked."""
    os.setsid()
    ours.close()
    null = os.open(os.devnull, os.O_RDWR)
    for number in range(3):
        os.dup2(null, number)
    call_itself("fork server")
    return serve(theirs)


def main() -> None:
    """Serve; forks run here what they were asked to."""
    warnings.simplefilter("ignore", DeprecationWarning)  # that OpenBLAS has threads
    requests = socket.socket(fileno=int(sys.argv[1]))
    preload()
    call_itself("fork server")
    request = serve(requests)
    module = request["command"][2]
    if module == forking.COMMAND:
        forking.adopt_orphans()
        ends = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        if os.fork() == 0:
            request = serve_nodes(*ends)
            module = request["command"][2]
        else:
            ends[1].close()
            subprocess.Popen = partial(forking.popen, server=ends[0])
    if module == forking.COMMAND:
        module = "gameinfer_ros.commands.gameinfer"
    exec(request["first"], {})
    try:
        if module.startswith(forking.NODES):
            from gameinfer_ros.nodes.base.spin import spin
            from gameinfer_ros.nodes.table import class_of

            code = spin(class_of(module.removeprefix(forking.NODES)))
        else:
            code = importlib.import_module(module).main()
    except SystemExit as error:
        code = error.code
    # To take all of it down by and by takes half a second.
    atexit._run_exitfuncs()
    sys.stdout.flush()
    os._exit(int(code))


if __name__ == "__main__":
    main()
