"""Peers whose quality of service does not fit are reported, on topics of both directions."""

from __future__ import annotations

from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import MultiDOFJointState
from small_scenario import ScenarioFile

from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from msg_adapters import qos

VOLATILE = QoSProfile(depth=1)


def test_a_publisher_that_offers_too_little_is_reported(
    world: Any, scenario_file: ScenarioFile, capfd: pytest.CaptureFixture[str]
) -> None:
    agent = world.add(HumanAgent, scenario=scenario_file("uu"))
    reports = world.reports(agent, first_state=False)
    assert VOLATILE.durability == DurabilityPolicy.VOLATILE
    world.tester.create_publisher(MultiDOFJointState, "joint_state", VOLATILE)
    world.until(lambda: any(r.values.get("incompatible_peers") == "1" for r in reports))
    errors = capfd.readouterr().err
    assert "a publisher of joint_state offers an incompatible quality of service (DURA" in errors


def test_a_subscriber_that_asks_for_too_much_is_reported(
    world: Any, scenario_file: ScenarioFile, capfd: pytest.CaptureFixture[str]
) -> None:
    planner = world.add(RobotPlanner, scenario=scenario_file("uu"))
    reports = world.reports(planner, first_state=False)
    # No base shall get an old velocity.
    world.hear(TwistStamped, "robot/cmd_vel", qos.LATEST)
    world.until(lambda: any(r.values.get("incompatible_peers") == "1" for r in reports))
    errors = capfd.readouterr().err
    assert "a subscriber of robot/cmd_vel requests an incompatible quality of service" in errors


def test_a_recorder_hears_early_statuses_and_finds_no_fault_with_other_systems(
    world: Any, scenario_file: ScenarioFile
) -> None:
    file = scenario_file("uu")
    world.tester.create_publisher(DiagnosticArray, "/diagnostics", VOLATILE)
    agent = world.add(HumanAgent, scenario=file)
    agent.report("early", {"late_steps": 0})
    recorder = world.add(Recorder, scenario=file)
    world.until(lambda: recorder.count_publishers("/diagnostics") == 3)
    world.until(lambda: agent.get_fully_qualified_name() in recorder.figures)
    assert not recorder.topic_faults.figures().keys() & {"incompatible_peers"}
