"""A Dask cluster on this machine: a scheduler and workers, each a process."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from gameinfer_ros.orchestration.node_process import stop_all

pytest.importorskip("distributed", reason="Dask is an option")


class _Process:
    """What `stop_all` needs to know of a process."""

    def __init__(self, *args: str, log: Path) -> None:
        # Workers must find the tasks of the tests.
        path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
        self._process = subprocess.Popen(
            [sys.executable, "-m", "dask", *args, "--host", "127.0.0.1", "--no-dashboard"],
            env={**os.environ, "PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            stdout=log.open("wb"),
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )

    @property
    def exit_code(self) -> int | None:
        return self._process.poll()

    def send(self, number: signal.Signals) -> None:
        if self.exit_code is None:
            os.killpg(self._process.pid, number)


@contextmanager
def dask_cluster(folder: Path, workers: int = 2) -> Iterator[str]:
    """Start a cluster; its address."""
    file = folder / "scheduler.json"
    processes = [
        _Process(
            "scheduler", "--port", "0", "--scheduler-file", str(file), log=folder / "scheduler.log"
        )
    ]
    try:
        deadline = time.monotonic() + 60
        while not (file.exists() and file.read_text()):  # it is created before it is written
            assert time.monotonic() < deadline, (folder / "scheduler.log").read_text()
            time.sleep(0.05)
        address = json.loads(file.read_text())["address"]
        for number in range(workers):
            processes.append(
                _Process(
                    *("worker", address, "--nthreads", "1", "--local-directory", str(folder)),
                    log=folder / f"worker-{number}.log",
                )
            )
        yield address
    finally:
        stop_all(processes)
