"""What a run that fails says was the matter."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from ros_domain import free_domain

from gameinfer_ros.node_process import NodeProcess
from gameinfer_ros.run_error import RunError

#: How long a run may take to fail, in s, on however busy a machine.
DEADLINE = 300.0

#: A run on a machine where Python is gone by the time that the nodes are to be started.
WITHOUT_PYTHON = """
import sys
from gameinfer_ros import cli
sys.executable = "/gone/python"
sys.exit(cli.main(["run", *sys.argv[1:]]))
"""


def test_a_node_that_cannot_be_started_is_not_blamed_on_the_results_folder(tmp_path: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-c", WITHOUT_PYTHON, "--scenario", "two_player", "--out", str(tmp_path)],
        env={
            **os.environ,
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_DOMAIN_ID": str(free_domain()),
        },
        capture_output=True,
        text=True,
        timeout=DEADLINE,
    )
    assert run.returncode == 1, run.stdout + run.stderr
    assert "the node simulator cannot be started" in run.stderr
    assert "/gone/python" in run.stderr
    assert "--out" not in run.stderr
    assert "Traceback" not in run.stderr


def test_a_node_process_tells_a_bad_folder_from_a_bad_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError, match="file"):
        NodeProcess("robot", "robot_planner", {}, tmp_path / "file")
    monkeypatch.setattr(sys, "executable", "/gone/python")
    with pytest.raises(RunError, match=r"the node robot cannot be started: .*/gone/python"):
        NodeProcess("robot", "robot_planner", {}, tmp_path / "out")
