"""Two stacks side by side in one ROS domain."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ros_domain import free_domain
from run_command import Command

from gameinfer_ros.names.choices import MAP
from gameinfer_ros.runs import closed_loop
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.scenario import Scenario

pytestmark = pytest.mark.alone

STEPS = 15


def test_two_stacks_under_namespaces_do_not_disturb_each_other(
    tmp_path: Path, two_player: Scenario
) -> None:
    domain, seeds = free_domain(), {"one": 3, "two": 4}
    commands = {
        name: Command(
            tmp_path / name,
            *("--scenario", "two_player", "--time", "lockstep", "--seed", seed),
            *("--steps", STEPS, "--out", tmp_path / name / "out"),
            *("--ros-args", "-r", f"__ns:=/{name}"),
            domain=domain,
        )
        for name, seed in seeds.items()
    }
    try:
        for command in commands.values():
            assert command.exit_code() == 0, command.stderr
    finally:
        for command in commands.values():
            command.end()
    for name, seed in seeds.items():
        record = RunRecord.load(tmp_path / name / "out", two_player.vehicles)
        alone = closed_loop.run(two_player, MAP, seed, safety=True)
        np.testing.assert_array_equal(record.states, alone.states[: STEPS + 1])
        assert record.beliefs == {k: alone.beliefs[k] for k in range(STEPS + 1)}
