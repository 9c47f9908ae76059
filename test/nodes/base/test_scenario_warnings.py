"""Nodes log the warnings about their scenario."""

from __future__ import annotations

import pytest
from rclpy.parameter import Parameter
from ros_context import ros_context
from small_scenario import ScenarioFile

from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.simulator import Simulator


@pytest.mark.parametrize(("heading", "warns"), [(200.0, True), (2.0, False)])
def test_a_node_warns_of_headings_that_look_like_degrees(
    heading: float, warns: bool, scenario_file: ScenarioFile, capfd: pytest.CaptureFixture[str]
) -> None:
    path = scenario_file("ud", heading=heading)
    with ros_context() as context:
        scenario = Parameter("scenario", value=str(path))
        Recorder(context=context, parameter_overrides=[scenario]).destroy_node()
    logged = capfd.readouterr().err
    assert (f"{path}: players.robot.initial: theta is 200 rad" in logged) == warns
    assert ("goals.robot: theta is 200 rad, more than a turn" in logged) == warns
    assert ("[WARN]" in logged) == warns


def test_only_the_simulator_knows_when_the_run_ends(
    scenario_file: ScenarioFile, capfd: pytest.CaptureFixture[str]
) -> None:
    path = scenario_file("u", steps=20)  # its goal begins at 1.85 s
    with ros_context() as context:
        for node, steps in ((Recorder, 0), (Simulator, 20), (Simulator, 18)):
            given = [Parameter("scenario", value=str(path)), Parameter("steps", value=steps)]
            node(context=context, parameter_overrides=given).destroy_node()
            warned = "but the run ends at 1.8 s" in capfd.readouterr().err
            assert warned == (steps == 18)
