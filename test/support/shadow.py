"""A temporary folder that looks like the repository, in which commands of the pages are run."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

from forking import start, write_python
from pages import ROOT
from ros_domain import free_domain

#: Stands in for ./dev, which would set up a virtual environment: the tests run in one already.
DEV = """#!/bin/sh
case $1 in
  demo) shift; exec gameinfer run --scenario three_player --planner map --time realtime "$@" ;;
  exec) shift; exec "$@" ;;
  *) echo "$1 is not run by this test" >&2; exit 3 ;;
esac
"""
#: `gameinfer` as it is installed, but a fork.
GAMEINFER = '#!/bin/sh\nexec "{python}" -m gameinfer_ros "$@"\n'

#: How long a command may take, in s, on however busy a machine.
DEADLINE = 240.0


class Shadow:
    """The folder, and an environment with a ROS domain of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("config", "benchmarks", "docs", "examples"):
            (folder / name).symlink_to(ROOT / name)
        executables = folder / ".bin"
        executables.mkdir()
        python = executables / "forking_python"
        write_python(python)
        gameinfer = GAMEINFER.format(python=python)
        for path, text in ((folder / "dev", DEV), (executables / "gameinfer", gameinfer)):
            path.write_text(text)
            path.chmod(0o755)
        self.environment = {
            **os.environ,
            "PATH": os.pathsep.join(
                [str(executables), str(Path(sys.executable).parent), os.environ["PATH"]]
            ),
            "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
            "ROS_DOMAIN_ID": str(free_domain()),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        }

    def run(self, command: str) -> str:
        """Run a command of a shell to its end; returns what it printed.

        Raises:
            AssertionError: it failed.
        """
        done = subprocess.run(
            ["bash", "-euc", command],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=DEADLINE,
        )
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    def run_together(self, commands: list[str], until: str) -> None:
        """Run nodes, which end by Ctrl-C only, at the same time.

        Args:
            commands: `python -m gameinfer_ros.nodes...`; what runs is a fork.
            until: what one of them prints when it is time to interrupt them all.

        Raises:
            AssertionError: one ends before.
        """
        logs = [self.folder / f"terminal-{j}.log" for j in range(len(commands))]
        running = []
        try:
            for command, log in zip(commands, logs, strict=True):
                with log.open("wb") as output:
                    python, *words = shlex.split(command)
                    assert python == "python"
                    process = start(
                        [sys.executable, *words],
                        cwd=self.folder,
                        env=self.environment,
                        stdin=subprocess.DEVNULL,
                        stdout=output,
                        stderr=subprocess.STDOUT,
                        start_new_session=True,
                    )
                running.append(process)
            deadline = time.monotonic() + DEADLINE
            while not any(until in log.read_text(errors="replace") for log in logs):
                said = "\n".join(log.read_text(errors="replace") for log in logs)
                assert all(process.poll() is None for process in running), said
                assert time.monotonic() < deadline, said
                time.sleep(0.05)
        finally:
            for process in running:
                process.send_signal(signal.SIGINT)
            for process in running:
                process.wait(DEADLINE)
