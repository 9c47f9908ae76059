"""Runs and nodes that are forked from a process in which all is imported and loaded already.

A run of two players is five processes, each of which takes a second of processor time to import
libraries and to load compiled code. A fork has no need to. Apart from that, it is a process like
any other, with a session, streams, an environment, a working directory and a command line of its
own, and a child of the process that asked for it. How processes start is tested without this.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import IO, Any

import pytest

#: What is forked: `python -m` this, and the modules whose names begin so.
COMMAND, NODES = "gameinfer_ros", "gameinfer_ros.nodes."

STREAMS = ("stdin", "stdout", "stderr")

#: Room for the command line of a fork, in bytes.
ROOM = 4096

#: Makes orphans among the descendants of a process its children, from `sys/prctl.h`.
_PR_SET_CHILD_SUBREAPER = 36

_from_scratch = subprocess.Popen
_one_request = threading.Lock()


class Forked:
    """In the place of `subprocess.Popen`, with a few of its arguments and methods.

    Args:
        server: where to fork it.
        command: `[sys.executable, "-m", module, *arguments]`.
        controlled: whether its standard input is a terminal, from which it gets signals.
        ignore_sigint: whether it starts with SIGINT ignored, as in the background of a shell.
        first: code that it runs before anything else.
        start_new_session: must be true.
    """

    def __init__(
        self,
        server: socket.socket,
        command: Sequence[str],
        *,
        stdin: int | IO[bytes],
        stdout: int | IO[bytes],
        stderr: int | IO[bytes],
        start_new_session: bool,
        env: Mapping[str, str] | None = None,
        cwd: Path | str | None = None,
        pass_fds: Sequence[int] = (),
        controlled: bool = False,
        ignore_sigint: bool = False,
        first: str = "",
    ) -> None:
        assert start_new_session
        self.args, self.returncode = command, None
        streams = [stdin, stdout, stdout if stderr == subprocess.STDOUT else stderr]
        request = {
            "command": command,
            "environment": dict(os.environ if env is None else env),
            "folder": str(cwd or os.getcwd()),
            "files": [0, 1, 2, *pass_fds],
            "controlled": controlled,
            "ignore_sigint": ignore_sigint,
            "first": first,
        }
        null = os.open(os.devnull, os.O_RDWR)
        try:
            files = [null if s == subprocess.DEVNULL else s for s in streams]
            files = [s if isinstance(s, int) else s.fileno() for s in files]
            with _one_request:
                socket.send_fds(server, [json.dumps(request).encode()], [*files, *pass_fds])
                answer = server.recv(64)
            assert answer, "the fork server has ended, and has said why on stderr"
            self.pid = int(answer)
        finally:
            os.close(null)

    def poll(self) -> int | None:
        if self.returncode is None:
            ended, status = os.waitpid(self.pid, os.WNOHANG)
            if ended:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        deadline = None if timeout is None else time.monotonic() + timeout
        while self.poll() is None:
            if deadline is not None and time.monotonic() > deadline:
                raise subprocess.TimeoutExpired(self.args, timeout)
            time.sleep(0.01)
        return self.returncode

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)


@cache
def _server() -> socket.socket:
    """A connection to the server of these tests, which ends with them."""
    adopt_orphans()
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        _from_scratch(
            [sys.executable, Path(__file__).with_name("fork_server.py"), str(theirs.fileno()),
             "-" * ROOM],
            pass_fds=(theirs.fileno(),),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )  # fmt: skip
    return ours


def start(command: Sequence[str], **options: Any) -> Forked:
    """Fork a run or a node; for options, see `Forked`."""
    return Forked(_server(), command, **options)


def gameinfer(*arguments: str, timeout: float) -> subprocess.CompletedProcess[str]:
    """Fork the command `gameinfer`, and wait for its end.

    Raises:
        subprocess.TimeoutExpired: it still ran; it was killed.
    """
    command = [sys.executable, "-m", COMMAND, *arguments]
    with tempfile.TemporaryFile("w+") as stdout, tempfile.TemporaryFile("w+") as stderr:
        fork = start(
            command, stdin=subprocess.DEVNULL, stdout=stdout, stderr=stderr, start_new_session=True
        )
        try:
            code = fork.wait(timeout)
        finally:
            fork.kill()
        said = []
        for file in (stdout, stderr):
            file.seek(0)
            said.append(file.read())
    return subprocess.CompletedProcess(command, code, *said)


def popen(command: Any, *args: Any, server: socket.socket | None = None, **options: Any) -> Any:
    """In the place of `subprocess.Popen`: nodes are forked, and all else is not."""
    is_node = [*command[:2]] == [sys.executable, "-m"] and command[2].startswith(NODES)
    begin = partial(Forked, server or _server()) if is_node else _from_scratch
    return begin(command, *args, **options)


@pytest.fixture
def forked_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes that this process starts are forked."""
    monkeypatch.setattr(subprocess, "Popen", popen)


def write_python(file: Path) -> None:
    """Write an executable that is `python -m gameinfer_ros` for a shell, but a fork."""
    file.write_text(PYTHON.format(python=sys.executable, address=_address()))
    file.chmod(0o755)


#: Hands all that it has on to the fork, and waits for its exit code.
PYTHON = """\
#!{python} -IS
import json, os, socket, sys
server = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
server.connect({address!r})
said = [sys.argv[1:], dict(os.environ), os.getcwd()]
socket.send_fds(server, [json.dumps(said).encode()], [0, 1, 2])
sys.exit(int(server.recv(64) or 1))
"""


@cache
def _address() -> str:
    """Where those ask that `write_python` has written."""
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listener.bind(f"\0gameinfer_ros-tests-{os.getpid()}")
    listener.listen()
    server = _server()

    def answer(asker: socket.socket) -> None:
        with asker:
            data, files, _, _ = socket.recv_fds(asker, 2**20, 3)
            arguments, environment, folder = json.loads(data)
            fork = Forked(
                server, [sys.executable, *arguments], **dict(zip(STREAMS, files, strict=True)),
                start_new_session=True, env=environment, cwd=folder,
            )  # fmt: skip
            for file in files:
                os.close(file)
            asker.send(str(fork.wait() % 256).encode())

    def listen() -> None:
        while True:
            asker, _ = listener.accept()
            threading.Thread(target=answer, args=(asker,), daemon=True).start()

    threading.Thread(target=listen, daemon=True).start()
    return str(listener.getsockname().decode())


def adopt_orphans() -> None:
    """Become the parent of what is forked for this process: its own parent ends at once."""
    if ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0):
        raise OSError("this process cannot become a subreaper")
