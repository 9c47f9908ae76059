"""The processes of the nodes."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gameinfer_ros.orchestration.run_error import RunError
from gameinfer_ros.system.interruption import interrupts_deferred
from gameinfer_ros.system.lifeline import Lifeline

#: Timeout for the end of a node after each signal, in s. Before SIGKILL, a node that hangs ends
#: itself by force, and logs where it hangs; see `gameinfer_ros.nodes.base.spin`.
PATIENCE = {signal.SIGINT: 5.0, signal.SIGTERM: 5.0, signal.SIGKILL: 2.0}


class NodeProcess:
    """Runs a node of this package in its own process, which does not outlive this one.

    Its parameters are written to a file in `folder` that `ros2 run` can use too, and all its output
    to a log there.

    Attributes:
        name: name of the node.
        log: file with its output.

    Raises:
        OSError: the folder cannot be written.
        RunError: the process cannot be started.
    """

    def __init__(
        self,
        name: str,
        module: str,
        parameters: Mapping[str, Any],
        folder: Path,
        ros_args: Sequence[str] = (),
    ) -> None:
        self.name = name
        parameter_file = folder / "parameters" / f"{name}.yaml"
        self.log = folder / "logs" / f"{name}.log"
        for path in (parameter_file, self.log):
            path.parent.mkdir(parents=True, exist_ok=True)
        _write_parameters(parameter_file, parameters)
        self._command = [
            *(sys.executable, "-m", f"gameinfer_ros.nodes.{module}"),
            *("--ros-args", "-r", f"__node:={name}", "--params-file", str(parameter_file)),
            *ros_args,
        ]
        self.log.write_bytes(b"")
        self._start()

    def _start(self) -> None:
        try:
            self._lifeline = Lifeline()
            with self.log.open("ab") as log:
                # In its own session, the node does not receive Ctrl-C from the terminal.
                self._process = subprocess.Popen(
                    self._command,
                    # The working directory must not hide modules of the same name.
                    env={**os.environ, "PYTHONSAFEPATH": "1", **self._lifeline.environment},
                    pass_fds=(self._lifeline.inherited,),
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
            self._lifeline.tied()
        except OSError as error:
            raise RunError(f"the node {self.name} cannot be started: {error}") from error

    def restart(self) -> None:
        """Restart the node after it has ended, and append to its log; may raise `RunError`."""
        with interrupts_deferred():  # the new process must not be lost
            self._lifeline.let_go()
            self._start()

    @property
    def pid(self) -> int:
        """Process id; also that of its process group."""
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """Exit code; None while the node runs; minus the signal if one ended it."""
        return self._process.poll()

    @property
    def ending(self) -> str:
        """How the node ended, in words."""
        code = self._process.returncode
        if code is None:
            return "it still runs"
        return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"

    def last_output(self, lines: int = 15) -> str:
        """The last lines of the node's output."""
        return "\n".join(self.log.read_text(errors="replace").splitlines()[-lines:])

    def send(self, signal_number: signal.Signals) -> None:
        """Send a signal to the node and its child processes, if it still runs."""
        if self.exit_code is None:
            os.killpg(self.pid, signal_number)


def _write_parameters(file: Path, parameters: Mapping[str, Any]) -> None:
    """Write a parameter file that applies to any node."""
    # JSON is YAML in which no string can be mistaken for a boolean or a number. ROS does not
    # understand its escapes of characters such as emojis, which JSON need not escape.
    content = {"/**": {"ros__parameters": dict(parameters)}}
    file.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def stop_all(processes: Sequence[NodeProcess]) -> None:
    """End all processes, with the signals in `PATIENCE` one after the other.

    Suspended processes are continued, so that a robot planner can slow its base down.
    """
    for signal_number, patience in PATIENCE.items():
        for process in processes:
            process.send(signal_number)
            process.send(signal.SIGCONT)
        deadline = time.monotonic() + patience
        while any(p.exit_code is None for p in processes) and time.monotonic() < deadline:
            time.sleep(0.02)
