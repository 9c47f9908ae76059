"""A bag is replayed: the same states lead to the same beliefs."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded_run import STEPS
from ros_domain import free_domain

from gameinfer_ros.commands import cli

pytestmark = pytest.mark.usefixtures("forked_nodes")


@pytest.fixture
def replay(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[[Path], tuple[int, dict[str, Any]]]:
    """Replays a bag; gives exit code and the JSON object."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(free_domain()))

    def play(bag: Path) -> tuple[int, dict[str, Any]]:
        capsys.readouterr()
        code = cli.main(["replay", str(bag), "--json"])
        return code, json.loads(capsys.readouterr().out)

    return play


def test_a_replay_gives_the_same_beliefs_to_the_last_bit(
    run: Path, replay: Callable[[Path], tuple[int, dict[str, Any]]]
) -> None:
    code, found = replay(run / "bag")
    assert found == {
        "identical": True,
        "steps": STEPS + 1,
        "identical_steps": STEPS + 1,
        "first_difference": None,
    }
    assert code == 0


def test_a_replay_writes_no_files(
    run: Path,
    replay: Callable[[Path], tuple[int, dict[str, Any]]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*words: object, **options: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(tempfile, "mkdtemp", fail)
    monkeypatch.setattr(tempfile, "mkstemp", fail)
    code, found = replay(run / "bag")
    assert code == 0 and found["identical"]


def move_a_human(topic: str, k: int, message: Any) -> Any:
    if (topic, k) == ("/joint_state", 4):
        message.transforms[1].translation.x += 1e-9
    return message


def weigh_a_particle(topic: str, k: int, message: Any) -> Any:
    if (topic, k) == ("/belief", 4):
        message.data = message.data.copy()
        weight = 3 + 1  # behind stamp, MAP and the first particle's number
        message.data[weight] = np.nextafter(message.data[weight], 0.5)
    return message


@pytest.mark.parametrize("tamper", [move_a_human, weigh_a_particle])
def test_a_replay_detects_a_bag_that_was_tampered_with(
    tamper: Callable[[str, int, Any], Any],
    copy: Callable[..., Path],
    replay: Callable[[Path], tuple[int, dict[str, Any]]],
) -> None:
    code, found = replay(copy(tamper))
    assert code == 1
    assert not found["identical"]
    # The next belief contains the costs that a state leads to.
    assert found["first_difference"] in (4, 5)
    assert found["identical_steps"] < found["steps"] == STEPS + 1


def test_a_bag_in_which_an_external_player_was_lost_can_be_used(
    copy: Callable[..., Path], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    def gap(topic: str, k: int, message: Any) -> Any:
        return None if topic in ("/joint_state", "/belief") and k in (4, 5) else message

    bag = copy(gap, external=["human_1"])
    assert cli.main(["inspect", str(bag), "--json", "--animation", str(tmp_path / "a.gif")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["missing_steps"], found["steps"]) == (2, STEPS)
    code = cli.main(["replay", str(bag), "--json"])
    found = json.loads(capsys.readouterr().out)
    assert found["steps"] == STEPS - 1
    # Until the gap the belief is the same; then it lacks what the run knew.
    assert (code, found["first_difference"]) == (1, 6)
