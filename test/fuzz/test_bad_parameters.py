"""A parameter that makes no sense is refused, at the start and later; the rest stays as it was."""

from __future__ import annotations

from typing import Any

import bad_parameters
import pytest
import rclpy
from nodes_room import LISTENERS
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from small_scenario import ScenarioFile

from gameinfer_ros.nodes.base.parameter_node import ParameterError
from gameinfer_ros.nodes.base.spin import spin
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.scenario import ScenarioError

NODES = {who: LISTENERS[who] for who in LISTENERS if who != "robot planner in realtime"}

#: What rclpy says itself, of a parameter that it does not name.
BY_RCLPY = (
    "read-only", "Static parameter cannot be undeclared", "undeclared parameter",
    "Wrong parameter type",
)  # fmt: skip


@pytest.mark.parametrize("who", NODES)
def test_a_running_node_takes_what_is_allowed_and_keeps_its_value_else(
    who: str, world: Any, scenario_file: ScenarioFile
) -> None:
    make, parameters = NODES[who]
    node = world.add(make, scenario=scenario_file("uu"), **parameters)
    service = f"{node.get_fully_qualified_name()}/set_parameters"
    client = world.tester.create_client(SetParameters, service)
    world.until(client.service_is_ready)
    outcomes = []
    for name in [*bad_parameters.names(node), "nothing_like_it"]:
        for value in bad_parameters.VALUES:
            before, request = bad_parameters.values(node), bad_parameters.message(name, value)
            future = client.call_async(SetParameters.Request(parameters=[request]))
            world.until(future.done, f"{service} does not answer")
            (result,) = future.result().results
            outcomes.append(bad_parameters.check(node, request, before, result))
            if not result.successful:
                assert any(word in result.reason for word in (name, *BY_RCLPY)), result.reason
    assert "rejected" in outcomes


@pytest.mark.parametrize("who", NODES)
def test_a_node_starts_with_what_is_allowed_or_says_why_not(
    who: str, make_world: Any, scenario_file: ScenarioFile
) -> None:
    make, parameters = NODES[who]
    file, world = scenario_file("uu"), make_world()
    node = world.add(make, scenario=file, **parameters)
    names = bad_parameters.names(node)
    world.remove(node)
    for k, name in enumerate(names):
        for value in bad_parameters.VALUES[k % 4 :: 4]:
            given = {"scenario": str(file), **parameters, name: value}
            if value is None or value == [] or value == b"\xff":
                continue  # cannot be given by -p
            overrides = [Parameter(key, value=v) for key, v in given.items()]
            try:
                node = make(context=world._context, parameter_overrides=overrides)
            except (ParameterError, ScenarioError) as error:
                assert name in str(error) or name == "scenario", error
                assert len(str(error)) < 12_000
            else:
                node.destroy_node()


def test_more_particles_than_memory_holds_are_refused(
    world: Any, scenario_file: ScenarioFile
) -> None:
    file = scenario_file("uu", horizon=10_000)
    node = world.add(Inference, scenario=file)
    (result,) = node.set_parameters([Parameter("particles", value=10**6)])
    assert not result.successful
    assert "particles: 1000000 is not allowed: with 8 states, 4 inputs and a" in result.reason
    assert node.get_parameter("particles").value == 0
    with pytest.raises(ParameterError, match="particles: 1000000 is not allowed"):
        world.add(Inference, "another", scenario=file, particles=10**6)


@pytest.mark.parametrize(
    "argument",
    ["time:=slow", "particles:=many", "particles:=-1", "deadline:=.nan", "scenario:=nowhere",
     "seed:=99999999999999999999", "threads:=[1]", "deadline:=61", "no_colon", ":=x",
     "particles:=1000000"],
)  # fmt: skip
def test_a_node_exits_with_2_and_one_sentence(
    argument: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert spin(Inference, ["--ros-args", "-p", argument]) == 2
    told = capfd.readouterr().err
    assert "Traceback" not in told
    assert argument.partition(":=")[0] in told
    # ROS warns if another test has made a node of the same name in this process.
    lines = [line for line in told.splitlines() if "rcl.logging_rosout" not in line]
    assert len(lines) == 1, "ROS says nothing of its own"
    assert not rclpy.ok()
