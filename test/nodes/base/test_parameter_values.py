"""Values of parameters that a node would not get are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.node import Node
from ros_domain import free_domain

from gameinfer_ros.nodes.base.parameter_values import check_values
from gameinfer_ros.nodes.base.ros_names import RosArgsError
from gameinfer_ros.nodes.interface import NodeInterface
from gameinfer_ros.orchestration.node_arguments import check_run_arguments

PLAYERS = ["robot", "human_1"]
PLANNER = NodeInterface("robot_planner", "robot_planner", "/", PLAYERS)

FILES = {
    "any.yaml": "/**: {ros__parameters: {brake_after: 1, safety: true}}",
    "own.yaml": "robot_planner: {ros__parameters: {brake_after: 0.5}}",
    "both.yaml": "/**: {ros__parameters: {brake_after: 1}}\n"
    "robot_planner: {ros__parameters: {brake_after: 0.5}}",
    "octal.yaml": "robot_planner: {ros__parameters: {plan_length: 010}}",
    "other.yaml": "inference: {ros__parameters: {seed: 010, brake_after: x}}",
}

EITHER = "and ROS may use either value: write both as the same type"


@pytest.fixture
def words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make the parameter files, in the working directory."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def values_in_ros(arguments: str) -> dict[str, Any]:
    """The values that ROS gives to the node."""
    context = rclpy.Context()
    context.init(["--ros-args", *arguments.split()], domain_id=free_domain())
    try:
        node = Node("robot_planner", context=context, start_parameter_services=False)
        values = {name: given.value for name, given in node._parameter_overrides.items()}
        node.destroy_node()
    finally:
        context.shutdown()
    return values


@pytest.mark.parametrize(
    ("arguments", "value"),
    [
        ("-p brake_after:=1 -p brake_after:=2", 2),
        ("-p brake_after:=1.0 -p brake_after:=.5", 0.5),
        ("-p brake_after:=1. -p brake_after:=5e-1", 0.5),
        ("-p brake_after:=0x10", 16),
        ("-p brake_after:=0 -p robot_planner:brake_after:=0.5", 0.5),
        ("--params-file any.yaml -p brake_after:=2", 2),
        ("--params-file own.yaml -p brake_after:=2", 2),
        ("--params-file both.yaml", 0.5),
        ("--params-file other.yaml -p brake_after:=2", 2),
        ("-p safety:=no -p safety:=Y -p brake_after:=3", 3),
        ("-p scenario:=a -p scenario:='1' -p scenario:=1:30 -p brake_after:=3", 3),
    ],
)
@pytest.mark.usefixtures("words")
def test_the_node_gets_the_last_value(arguments: str, value: float) -> None:
    check_values(arguments.split(), PLANNER)
    assert values_in_ros(arguments)["brake_after"] == value


@pytest.mark.parametrize(
    ("arguments", "message", "wrong"),
    [
        (
            "-p brake_after:=1 -p brake_after:=0.5",
            "--ros-args: -p brake_after:=0.5: brake_after is a double here, but an integer in "
            f"-p brake_after:=1, {EITHER}",
            1,
        ),
        (
            "--params-file any.yaml -p brake_after:=0.5",
            "--ros-args: -p brake_after:=0.5: brake_after is a double here, but an integer in "
            f"--params-file any.yaml, {EITHER}",
            1,
        ),
        (
            "-p brake_after:=0.5 --params-file any.yaml -p brake_after:=abc",
            "--params-file any.yaml: brake_after is an integer here, but a double in "
            f"-p brake_after:=0.5, {EITHER}",
            1,
        ),
        (
            "-p brake_after:=on -p brake_after:=1",
            "--ros-args: -p brake_after:=1: brake_after is an integer here, but a boolean in "
            f"-p brake_after:=on, {EITHER}",
            True,
        ),
        (
            "--params-file both.yaml -p brake_after:=2",
            "--ros-args: -p brake_after:=2: has no effect, because ROS prefers the value that "
            "--params-file both.yaml has for /robot_planner: remove one of them",
            0.5,
        ),
        (
            "-p brake_after:=2 --params-file own.yaml",
            "--ros-args: -p brake_after:=2: has no effect, because ROS prefers the value that "
            "--params-file own.yaml has for /robot_planner: remove one of them",
            0.5,
        ),
        (
            "-p brake_after:=010",
            "--ros-args: -p brake_after:=010: brake_after: ROS reads 010 as the octal number 8: "
            "write 10",
            8,
        ),
        (
            "--params-file octal.yaml -p brake_after:=-07",
            "--params-file octal.yaml: plan_length: ROS reads 010 as the octal number 8: write 10",
            -7,
        ),
    ],
)
@pytest.mark.usefixtures("words")
def test_what_the_node_would_not_get_is_refused(arguments: str, message: str, wrong: float) -> None:
    with pytest.raises(RosArgsError) as caught:
        check_values(arguments.split(), PLANNER)
    assert str(caught.value) == message
    assert values_in_ros(arguments)["brake_after"] == wrong


def test_in_a_run_a_node_gets_its_arguments_without_its_name() -> None:
    """Then both belong to the section `/**`, so their types must be the same."""
    arguments = ["-p", "brake_after:=1", "-p", "robot_planner:brake_after:=0.5"]
    check_values(arguments, PLANNER)
    with pytest.raises(RosArgsError, match="is a double here, but an integer in "):
        check_run_arguments(arguments, [PLANNER])
