"""A closed-loop run of the ROS 2 nodes."""

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
    """Play the run of `closed_loop.run` with the nodes, by `gameinfer run --time lockstep`.

    Each run has its own namespace, so that parallel runs can share a ROS domain.

    Raises:
        FailedRunError: the command failed; the message contains the end of its output.
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
            output = "\n".join((done.stdout + done.stderr).splitlines()[-20:])
            raise FailedRunError(f"run {seed} with planner {planner} failed:\n{output}")
        return RunRecord.load(folder, scenario.vehicles)
