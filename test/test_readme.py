"""What the README shows works as it stands there."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from pydantic import BaseModel
from ros_domain import free_domain

from gameinfer_ros.experiments import closed_loop
from gameinfer_ros.games import CostTerm, Dynamics
from gameinfer_ros.inference import BeliefSettings
from gameinfer_ros.scenario import Scenario, available
from gameinfer_ros.solver import SolverSettings

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("code", blocks("python"))
def test_python_runs(code: str) -> None:
    code = code.replace("domain_id=42", f"domain_id={free_domain()}")
    environment = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr


def test_there_are_two_python_examples_and_a_scenario() -> None:
    assert len(blocks("python")) == 2
    assert len(blocks("yaml")) == 1


def test_scenario_can_be_played(tmp_path: Path) -> None:
    file = tmp_path / "swap.yaml"
    file.write_text(blocks("yaml")[0])
    scenario = Scenario.load(file)
    record = closed_loop.run(scenario, "map", 0)
    assert record.steps == scenario.steps
    assert record.smallest_distance > 0.6
    ends = scenario.game.players.positions(record.states[-1])
    assert abs(ends - [[2, 0], [-2, 0]]).max() < 0.5


def test_shown_error_is_what_a_wrong_scenario_gives(tmp_path: Path) -> None:
    content = yaml.safe_load(blocks("yaml")[0])
    content["costs"][0]["weights"][1] = -10
    file = tmp_path / "swap.yaml"
    file.write_text(yaml.safe_dump(content))
    with pytest.raises(ValueError) as caught:
        Scenario.load(file)
    assert str(caught.value).replace(f"{tmp_path}/", "") in README


def test_every_parameter_and_topic_of_every_node_is_named() -> None:
    found = 0
    for module in (ROOT / "gameinfer_ros/nodes").glob("*.py"):
        source = module.read_text(encoding="utf-8")
        for parameter in re.findall(r"self\.declare(?:_live)?\(\s*\"(\w+)\"", source):
            assert f"| `{parameter}` |" in README, f"{parameter} of {module.name}"
            found += 1
        for topic in re.findall(r"\"(/?[a-z_]+)\", qos\.", source):
            assert f"| `{topic}` |" in README, f"{topic} of {module.name}"
            found += 1
    assert found > 15


def test_node_parameter_file_has_known_parameters_only() -> None:
    content = yaml.safe_load((ROOT / "config/nodes.yaml").read_text(encoding="utf-8"))
    for node, body in content.items():
        for parameter in body["ros__parameters"]:
            assert f"| `{parameter}` |" in README, f"{parameter} of {node}"


@pytest.mark.parametrize("settings", [BeliefSettings, SolverSettings])
def test_every_field_of_the_settings_is_named(settings: type[BaseModel]) -> None:
    for field in settings.model_fields:
        assert re.search(rf"^\| [^|]*`{field}`", README, re.MULTILINE), field


def test_every_kind_and_scenario_is_named() -> None:
    for kind, member in {**Dynamics.family, **CostTerm.family}.items():
        if member.__module__.startswith("gameinfer_ros"):  # and not one of some test
            assert f"| `{kind}` |" in README, kind
    for name in available():
        assert f"`{name}`" in README, name
