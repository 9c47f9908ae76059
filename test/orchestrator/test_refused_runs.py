"""Runs that are not as they should be are refused, or say so, before they begin."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from ros_domain import free_domain
from run_command import Command

pytestmark = pytest.mark.alone


def test_a_second_run_in_the_same_domain_is_refused(
    endless: Callable[..., Command], start: Callable[..., Command]
) -> None:
    domain = free_domain()
    first = endless(domain=domain)
    first.until_it_moves()
    second = start("--scenario", "two_player", domain=domain)
    assert second.exit_code() == 2, second.stdout + second.stderr
    assert "another run is in the ROS domain" in second.stderr
    assert second.leftovers() == {}
    assert first.process.poll() is None, "the first run goes on"


@pytest.mark.parametrize("far", [True, False])
def test_a_run_says_if_other_machines_may_reach_it(
    far: bool, start: Callable[..., Command]
) -> None:
    command = start(**({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"} if far else {}))
    command.until(lambda: "Loading" in command.stdout)
    words = "Other machines may reach the nodes of this run: ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET"
    assert (words in command.stdout.splitlines()) == far
    assert far or "Other machines" not in command.stdout


def test_bad_ros_arguments_are_refused_before_any_node_starts(
    start: Callable[..., Command], side_by_side: Callable[[int], Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    command = start(
        *("--scenario", side_by_side(1), "--out", out, "--ros-args", "-r", "__ns:=not-good")
    )
    assert command.exit_code() == 2, command.stdout + command.stderr
    for word in ("--ros-args", "__ns:=not-good"):
        assert word in command.stderr
    assert "Traceback" not in command.stderr
    assert not list((out / "logs").iterdir())
