"""The examples of the tutorial lead to what it says."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml_text
from pages import ROOT, blocks

from gameinfer_ros.runs import closed_loop
from gameinfer_ros.scenario import Scenario

PAGE = ROOT / "docs/tutorial/scenario.md"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (block,) = [block for block in blocks(PAGE) if block.file == "swap.yaml"]
    file = tmp_path / block.file
    file.write_text(block.text)
    return file


def test_the_scenario_can_be_played(file: Path) -> None:
    scenario = Scenario.load(file)
    record = closed_loop.run(scenario, "map", 0)
    assert record.steps == scenario.steps
    assert record.smallest_distance > 0.6
    ends = scenario.game.players.positions(record.states[-1])
    assert abs(ends - [[2, 0], [-2, 0]]).max() < 0.5


def test_the_shown_error_is_what_a_wrong_scenario_gives(file: Path) -> None:
    content = yaml_text.load(file.read_text())
    content["costs"][0]["weights"][1] = -10
    file.write_text(yaml_text.dump(content))
    with pytest.raises(ValueError) as caught:
        Scenario.load(file)
    assert shown()[0] == str(caught.value).replace(f"{file.parent}/", "")


def test_the_shown_warning_is_what_degrees_give(file: Path) -> None:
    content = yaml_text.load(file.read_text())
    content["players"]["walker"]["initial"][2] = 180
    file.write_text(yaml_text.dump(content))
    assert shown()[1:] == [f"{file.name}: warning: {w}" for w in Scenario.load(file).warnings]


def shown() -> list[str]:
    """The messages on the page."""
    return [block.text.strip() for block in blocks(PAGE) if block.language == "text"]
