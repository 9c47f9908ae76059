"""A bag, whatever has happened to it, is either read or refused in words."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bad_bags
import numpy as np
import pytest
from nodes_room import Run
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import MultiDOFJointState

from gameinfer_ros import cli
from gameinfer_ros.bag_label import BagLabel
from gameinfer_ros.exit_codes import BAD_INPUT
from gameinfer_ros.run_bag import BagError, RunBag

STEPS = 6
Messages = dict[str, tuple[str, list[bytes]]]


@pytest.fixture
def played(world: Any, scenario_file: Callable[..., Path]) -> tuple[Path, Messages]:
    """A scenario, and what the nodes said of states and beliefs in a run of it."""
    file = scenario_file("uu", steps=STEPS)
    run = Run(world, file, STEPS, listeners=5)
    run.listen()
    world.until(
        lambda: run.done and all(len(run.heard[t]) > STEPS for t in ("/joint_state", "/belief"))
    )
    return file, {
        "/joint_state": ("sensor_msgs/msg/MultiDOFJointState", run.heard["/joint_state"]),
        "/belief": ("std_msgs/msg/Float64MultiArray", run.heard["/belief"]),
        "/diagnostics": ("diagnostic_msgs/msg/DiagnosticArray", run.heard["/diagnostics"]),
    }


def test_a_spoiled_bag_is_read_or_refused(
    played: tuple[Path, Messages], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "bag"
    bad_bags.write(bag, *played)
    assert bad_bags.outcome(bag) == "accepted"
    rng, outcomes = np.random.default_rng(0), []
    for k in range(80):
        copy = tmp_path / f"copy_{k}"
        bad_bags.spoil(bag, copy, rng)
        outcomes.append(bad_bags.outcome(copy))
        if outcomes[-1] == "rejected" and k % 20 == 0:
            for command in ("inspect", "replay"):
                assert cli.main([command, str(copy)]) == BAD_INPUT
                assert capsys.readouterr().err.startswith(f"{copy}: ")
    assert "rejected" in outcomes


@pytest.mark.parametrize("step", [STEPS + 200_000, 2**31])
def test_a_stamp_of_the_far_future_takes_no_memory(
    step: int, played: tuple[Path, Messages], tmp_path: Path
) -> None:
    file, messages = played
    kind, states = messages["/joint_state"]
    last = deserialize_message(states[-1], MultiDOFJointState)
    last.header.stamp.sec = min(step // 10, 2**31 - 1)
    messages["/joint_state"] = kind, [*states[:-1], serialize_message(last)]
    bad_bags.write(tmp_path / "bag", file, messages)
    bag = RunBag(tmp_path / "bag")
    object.__setattr__(bag.label, "external", ["human_1"])  # then states may be missing
    with pytest.raises(BagError, match=r"joint_state: step \d+ is not allowed"):
        bag.record()


@pytest.mark.parametrize(
    ("field", "value"),
    [("seed", "x"), ("seed", -1), ("seed", 2**63), ("particles", None), ("topics", []),
     ("external", "human_1"), ("external", [3]), ("ros_args", {}), ("namespace", 7)],
)  # fmt: skip
def test_a_label_with_a_value_of_another_type_is_refused(field: str, value: Any) -> None:
    label = BagLabel("x", "map", "lockstep", 1)
    content = json.loads(label.encode()["gameinfer_ros"]) | {field: value}
    with pytest.raises(
        ValueError, match=rf"custom_data\.gameinfer_ros\.{field}: .* is not allowed"
    ):
        BagLabel.decode({"gameinfer_ros": json.dumps(content)})
