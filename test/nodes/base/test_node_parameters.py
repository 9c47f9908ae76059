"""Parameters: described, bounded, fixed or live, and refused if they make no sense."""

from __future__ import annotations

from typing import Any

import pytest
from rcl_interfaces.msg import ParameterType
from rclpy.parameter import Parameter

from gameinfer_ros.names.planners import planners
from gameinfer_ros.nodes.base.parameter_node import ParameterError
from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.nodes.table import NODES, class_of
from gameinfer_ros.nodes.viewer import Viewer
from gameinfer_ros.scenario import ScenarioError

PLANNERS = ", ".join(planners())
BOOL, DOUBLE, INTEGER, STRING = (
    ParameterType.PARAMETER_BOOL,
    ParameterType.PARAMETER_DOUBLE,
    ParameterType.PARAMETER_INTEGER,
    ParameterType.PARAMETER_STRING,
)
#: Parameters that can be set while the node runs.
LIVE = {
    "brake_after", "deadline", "max_strategy_age", "odom_timeout", "particles", "plan_length",
    "planner", "planner_seed", "robot_plays", "safety", "seed",
}  # fmt: skip
CLASSES = [*map(class_of, NODES), Recorder]
#: Parameters of which the default may be in use.
UNLIKE_DEFAULT = {Viewer: {"port": 0}}


def other_value(kind: int, before: Any, constraints: str) -> Any:
    """A value that a live parameter may have, and does not have yet."""
    if kind == STRING:
        return next(c for c in constraints.removeprefix("one of ").split(", ") if c != before)
    return {BOOL: not before, DOUBLE: 0.7, INTEGER: 7}[kind]


@pytest.mark.parametrize("make", CLASSES)
def test_parameters_are_described_bounded_and_fixed_if_they_must(make: type, world: Any) -> None:
    node = world.add(make, **UNLIKE_DEFAULT.get(make, {}))
    own = set(node.get_parameters_by_prefix("")) - set(world.tester.get_parameters_by_prefix(""))
    assert own >= {"scenario", "time"}
    for name in own:
        descriptor = node.describe_parameter(name)
        kind = descriptor.type
        assert len(descriptor.description) > 10
        assert descriptor.read_only == (name not in LIVE)
        if kind == INTEGER:
            (limits,) = descriptor.integer_range
            value = node.get_parameter(name).value
            assert 0 <= limits.from_value <= value <= limits.to_value
            assert limits.step == 1
        if kind == DOUBLE:
            (limits,) = descriptor.floating_point_range
            value = node.get_parameter(name).value
            assert 0.0 <= limits.from_value <= value <= limits.to_value
        before = node.get_parameter(name).value
        if name in LIVE:
            value = other_value(kind, before, descriptor.additional_constraints)
            (result,) = node.set_parameters([Parameter(name, value=value)])
            assert result.successful, result.reason
            assert node.get_parameter(name).value == value != before
            continue
        other = {BOOL: True, DOUBLE: 0.5, INTEGER: 7, STRING: "realtime"}[kind]
        (result,) = node.set_parameters([Parameter(name, value=other)])
        assert not result.successful
        assert "read-only" in result.reason
        assert node.get_parameter(name).value == before


BAD: list[tuple[type, str, Any, type[Exception], tuple[str, ...]]] = [
    *((make, "time", "slow", ParameterError, ("slow", "lockstep, realtime")) for make in CLASSES),
    *((make, "scenario", "nope", ScenarioError, ("nope", "three_player")) for make in CLASSES),
    *((make, "scenario", 3, ParameterError, ("3", "must be text")) for make in CLASSES),
    (Inference, "planner", "best", ParameterError, ("best", PLANNERS)),
    (Inference, "planner", True, ParameterError, ("true", "must be text")),
    (Inference, "planner_seed", -1, ParameterError, ("-1", "from 0 to ")),
    (Inference, "planner_seed", 1.5, ParameterError, ("1.5", "must be a whole number")),
    (RobotPlanner, "plan_length", 0, ParameterError, ("0", "from 1 to ")),
    (RobotPlanner, "plan_length", 1001, ParameterError, ("1001", " to 1000")),
    (HumanAgent, "player", "bob", ParameterError, ("bob", "robot, human_1, human_2")),
    (HumanAgent, "player", "", ParameterError, ("''", "robot, human_1, human_2")),
    (HumanAgent, "seed", -1, ParameterError, ("-1", "from 0 to ")),
    (HumanAgent, "seed", "one", ParameterError, ("one", "must be a whole number")),
    (Inference, "seed", -5, ParameterError, ("-5", "from 0 to ")),
    (Inference, "particles", -1, ParameterError, ("-1", "from 0 to ")),
    (Inference, "particles", 10**6 + 1, ParameterError, (" to 1000000",)),
    (Inference, "threads", -1, ParameterError, ("-1", "from 0 to ")),
    (Inference, "threads", 65, ParameterError, ("65", " to 64")),
    (Inference, "threads", 2.0, ParameterError, ("2.0", "must be a whole number")),
    (Inference, "deadline", -0.01, ParameterError, ("-0.01", "from 0.0 to ")),
    (Inference, "deadline", 60.5, ParameterError, ("60.5", " to 60")),
    (Inference, "deadline", 61, ParameterError, ("61", " to 60")),
    (Inference, "deadline", True, ParameterError, ("true", "must be a number from 0.0 to 60.0")),
    (Inference, "deadline", "1", ParameterError, ("1", "must be a number from 0.0 to 60.0")),
    (Inference, "robot_plays", "no", ParameterError, ("no", "must be true or false")),
    (Simulator, "steps", -1, ParameterError, ("-1", "from 0 to ")),
    (Simulator, "subscribers", -1, ParameterError, ("-1", "from 0 to ")),
    (Simulator, "external", "bob", ParameterError, ("bob", "robot, human_1, human_2")),
    (Simulator, "external", "human_1,", ParameterError, ("''", "robot, human_1, human_2")),
    (Simulator, "external", "human_1", ParameterError, ("human_1", "lockstep", "realtime")),
    (Simulator, "odom_time", "now", ParameterError, ("now", "stamp, arrival")),
    (Simulator, "odom_timeout", 0.0, ParameterError, ("0.0", "from 0.01 to ")),
    (RobotPlanner, "brake_after", 61.0, ParameterError, ("61", " to 60")),
    (Simulator, "publish_clock", 1, ParameterError, ("1", "must be true or false")),
    (Viewer, "port", 65536, ParameterError, ("65536", " to 65535")),
    (Viewer, "port", "any", ParameterError, ("any", "must be a whole number")),
    (Viewer, "control", 1, ParameterError, ("1", "must be true or false")),
    (Viewer, "use_sim_time", "on", ParameterError, ('"on"', "must be true or false")),
    (Simulator, "external", [], ParameterError, ("[]", "must be text")),
    (Viewer, "host", "", ParameterError, ("''", "this machine")),
]


@pytest.mark.parametrize(("make", "name", "value", "error", "words"), BAD)
def test_a_bad_parameter_is_refused_with_its_name_and_what_is_allowed(
    make: type, name: str, value: Any, error: type[Exception], words: tuple[str, ...], world: Any
) -> None:
    with pytest.raises(error) as caught:
        world.add(make, **{name: value})
    for word in (name, *words):
        assert word in str(caught.value)
    # No reference to the node is left by which it could be destroyed: it must not publish.
    topics = {topic for topic, _ in world.tester.get_topic_names_and_types()}
    assert not topics & {"/joint_state", "/belief", "/robot_strategy", "/robot/control"}


def test_a_human_of_the_scenario_is_the_default_player(world: Any) -> None:
    assert world.add(HumanAgent, scenario="two_player").get_parameter("player").value == "human_1"


def test_external_players_and_our_own_clock_exclude_each_other(world: Any) -> None:
    with pytest.raises(ParameterError, match=r"external.*publish_clock"):
        world.add(Simulator, time="realtime", external="human_1", publish_clock=True)


DOUBLES = [
    (Inference, "deadline"),
    (Simulator, "odom_timeout"),
    (RobotPlanner, "brake_after"),
    (RobotPlanner, "max_strategy_age"),
]


@pytest.mark.parametrize(("make", "name"), DOUBLES)
def test_integers_are_accepted_for_doubles(make: type, name: str, world: Any) -> None:
    node = world.add(make, **{name: 2})

    def value() -> tuple[Any, int]:
        return node.get_parameter(name).value, node.describe_parameter(name).type

    assert value() == (2.0, DOUBLE)
    assert isinstance(value()[0], float)
    (result,) = node.set_parameters([Parameter(name, value=3)])
    assert result.successful, result.reason
    assert value() == (3.0, DOUBLE)
    assert node.set_parameters_atomically([Parameter(name, value=4)]).successful
    assert value() == (4.0, DOUBLE)
    for wrong, reason in ((61, "61"), (True, "type"), ("1", "type")):
        (result,) = node.set_parameters([Parameter(name, value=wrong)])
        assert not result.successful
        assert reason in result.reason
    assert value() == (4.0, DOUBLE)


def test_every_double_is_tried_with_integers(world: Any) -> None:
    found = set()
    for make in CLASSES:
        node = world.add(make, **UNLIKE_DEFAULT.get(make, {}))
        names = node.get_parameters_by_prefix("")
        found |= {(make, n) for n in names if node.describe_parameter(n).type == DOUBLE}
    assert found == set(DOUBLES)
