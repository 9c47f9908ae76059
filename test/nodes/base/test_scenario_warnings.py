"""Nodes log the warnings about their scenario."""

from __future__ import annotations

import pytest
from rclpy.parameter import Parameter
from ros_context import ros_context
from small_scenario import ScenarioFile

from gameinfer_ros.nodes.recorder import Recorder


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
