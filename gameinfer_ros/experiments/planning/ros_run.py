"""A closed-loop run by the nodes."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from gameinfer_ros.experiments.study import FailedRunError
from gameinfer_ros.experiments.study.folder import write_scenario
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.scenario import Scenario


def run_on_ros(scenario: Scenario, planner: str, seed: int, safety: bool = False) -> RunRecord:
    """What `closed_loop.run` does, by `gameinfer run --time lockstep` in processes of its own.

    The nodes are in a namespace of their own, so that several runs can share a ROS domain.

    Raises:
        FailedRunError: the run failed.
    """
    with tempfile.TemporaryDirectory(prefix="gameinfer_ros-") as name:
        folder = Path(name)
        write_scenario(scenario, folder / "scenario.yaml")
        command = [
            *(sys.executable, "-m", "gameinfer_ros", "run", "--time", "lockstep"),
            *("--scenario", str(folder / "scenario.yaml"), "--planner", planner),
            *("--seed", str(seed), "--out", str(folder)),
            *(() if safety else ("--no-safety",)),
            *("--ros-args", "-r", f"__ns:=/study_{os.getpid()}_{planner}_{seed}"),
        ]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            said = "\n".join((done.stdout + done.stderr).splitlines()[-20:])
            raise FailedRunError(f"run {seed} with planner {planner} failed:\n{said}")
        return RunRecord.load(folder, scenario.vehicles)
