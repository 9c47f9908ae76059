"""What a run that fails reports."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from rclpy.node import Node
from ros_context import ros_context
from ros_domain import free_domain
from sensor_msgs.msg import MultiDOFJointState

from gameinfer_ros.orchestration.node_process import NodeProcess
from gameinfer_ros.orchestration.run_error import RunError
from msg_adapters import qos

#: How long a run may take to fail, in s, on however busy a machine.
DEADLINE = 300.0

#: A run on a machine where Python is gone by the time that the nodes are to be started.
WITHOUT_PYTHON = """
import sys
from gameinfer_ros.commands import cli
sys.executable = "/gone/python"
sys.exit(cli.main(["run", *sys.argv[1:]]))
"""

#: A run that finds others on however busy a machine, and does not wait long for them to end.
IMPATIENT = """
import sys
from gameinfer_ros.commands import cli
from gameinfer_ros.orchestration import watch
watch.DISCOVERY, watch.LAST_ONES = 8.0, 1.0
sys.exit(cli.main(["run", *sys.argv[1:]]))
"""


def run(code: str, folder: Path, domain: int) -> subprocess.CompletedProcess[str]:
    """Run two players by some code, to the end."""
    done = subprocess.run(
        [sys.executable, "-c", code, "--scenario", "two_player", "--out", str(folder)],
        env={
            **os.environ,
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_DOMAIN_ID": str(domain),
        },
        capture_output=True,
        text=True,
        timeout=DEADLINE,
    )
    assert "Traceback" not in done.stderr
    return done


def test_a_node_that_cannot_be_started_is_not_blamed_on_the_results_folder(tmp_path: Path) -> None:
    done = run(WITHOUT_PYTHON, tmp_path, free_domain())
    assert done.returncode == 1, done.stdout + done.stderr
    assert "the node simulator cannot be started" in done.stderr
    assert "/gone/python" in done.stderr
    assert "--out" not in done.stderr


def test_no_node_is_started_where_another_node_publishes_states(tmp_path: Path) -> None:
    domain = free_domain()
    with ros_context(domain) as context:
        stranger = Node("stranger", context=context)
        stranger.create_publisher(MultiDOFJointState, "joint_state", qos.STREAM)
        done = run(IMPATIENT, tmp_path, domain)
        stranger.destroy_node()
    assert done.returncode == 1, done.stdout + done.stderr
    assert "another node publishes joint_state" in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_node_process_tells_a_bad_folder_from_a_bad_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError, match="file"):
        NodeProcess("robot", "robot_planner", {}, tmp_path / "file")
    monkeypatch.setattr(sys, "executable", "/gone/python")
    with pytest.raises(RunError, match=r"the node robot cannot be started: .*/gone/python"):
        NodeProcess("robot", "robot_planner", {}, tmp_path / "out")
