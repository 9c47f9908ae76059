"""Runs that are not as they should be are refused, or say so, before they begin."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from ros_domain import free_domain
from run_command import Command
from small_scenario import ScenarioFile

from gameinfer_ros.bags.run_bag import RunBag


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


@pytest.mark.parametrize(
    ("arguments", "settings", "words"),
    [
        *(
            (("--ros-args", *words.split()), {}, (f"--ros-args: {words}: ", message))
            for words, message in (
                ("-r __ns:=not-good", "this namespace is not allowed: it must start with a slash"),
                ("-r __ns:=/foo/", "; did you mean /foo?"),
                ("-r __ns:=/1foo", "must not start with a digit"),
                ("-e robot", "this enclave is not allowed: it must start with a slash"),
                ("-r robot/cmd_vel:=/cmd-vel", "; did you mean /cmd_vel?"),
                ("-p odom_timout:=1.0", "; did you mean odom_timeout?"),
                ("-r robot/cmd_vell:=/cmd_vel", "; did you mean robot/cmd_vel?"),
                ("-p robot_plannr:brake_after:=9.0", "; did you mean robot_planner?"),
                ("-r __node:=sim", "the names of the nodes of a run are fixed"),
            )
        ),
        (("--ros-args", "--steps", "3"), {}, ("--ros-args: --steps: is unknown to ROS; put",)),
        ((), {"ROS_DOMAIN_ID": "233"}, ("ROS_DOMAIN_ID: 233 is not allowed", "from 0 to 232")),
        ((), {"ROS_DOMAIN_ID": "-1"}, ("ROS_DOMAIN_ID: -1 is not allowed", "from 0 to 232")),
        ((), {"ROS_DOMAIN_ID": "one"}, ("ROS_DOMAIN_ID: one is not allowed", "from 0 to 232")),
    ],
)
def test_what_ros_cannot_use_is_refused_before_any_node_starts(
    arguments: tuple[str, ...],
    settings: dict[str, str],
    words: tuple[str, ...],
    start: Callable[..., Command],
    scenario_file: ScenarioFile,
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    command = start(
        "--scenario", scenario_file("u", steps=20), "--out", out, *arguments, **settings
    )
    assert command.exit_code() == 2, command.stdout + command.stderr
    for word in words:
        assert word in command.stderr
    assert "Traceback" not in command.stderr
    assert not out.exists()


def test_a_results_folder_that_cannot_be_made_is_refused(
    start: Callable[..., Command], scenario_file: ScenarioFile, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    out = tmp_path / "file" / "out"
    command = start("--scenario", scenario_file("uu"), "--out", out)
    assert command.exit_code() == 2, command.stdout + command.stderr
    assert command.stderr.startswith(f"--out: {out} cannot be created: ")
    assert "Logs" not in command.stderr


def test_a_folder_belongs_to_one_run(
    start: Callable[..., Command],
    endless: Callable[..., Command],
    scenario_file: ScenarioFile,
    tmp_path: Path,
) -> None:
    out, bag = tmp_path / "out", tmp_path / "bag"
    first = endless("--out", out, "--record", bag)
    first.until_it_moves()
    parameters = {path.name for path in (out / "parameters").iterdir()}
    # The lock is that of the folder: these runs are in other domains.
    two = ("--scenario", scenario_file("u", steps=5), "--time", "lockstep")
    others = {
        f"--out: {out} is in use by another command": ("--out", out, "--overwrite"),
        f"--record: {bag} is in use by another command": ("--record", bag, "--overwrite"),
        f"--record: '{bag}' is not allowed": ("--record", bag),
    }
    commands = {words: start(*two, *arguments) for words, arguments in others.items()}
    for words, command in commands.items():
        assert command.exit_code() == 2, command.stdout + command.stderr
        assert words in command.stderr
    assert first.process.poll() is None
    assert {path.name for path in (out / "parameters").iterdir()} == parameters
    first.process.send_signal(signal.SIGINT)
    assert first.exit_code() == 130

    again = start(*two, "--out", out)
    assert again.exit_code() == 2, again.stdout + again.stderr
    assert f"--out: {out} contains the results of a run" in again.stderr
    last = start(*two, "--out", out, "--record", bag, "--overwrite")
    assert last.exit_code() == 0, last.stdout + last.stderr
    for folder, kind in (("parameters", "yaml"), ("logs", "log")):
        found = {path.name for path in (out / folder).iterdir()}
        assert found == {f"{name}.{kind}" for name in ("simulator", "inference", "robot_planner")}
    assert RunBag(bag).record().steps == 5


def test_a_run_warns_of_headings_that_look_like_degrees(
    start: Callable[..., Command], scenario_file: ScenarioFile
) -> None:
    command = start("--scenario", scenario_file("u", heading=200.0, steps=2), "--time", "lockstep")
    assert command.exit_code() == 0, command.stdout + command.stderr
    assert "players.robot.initial: theta is 200 rad, more than a turn" in command.stderr


@pytest.mark.parametrize("namespace", ["/", "/x"])
def test_a_parameter_for_one_node_reaches_it_in_any_namespace(
    namespace: str, start: Callable[..., Command], scenario_file: ScenarioFile
) -> None:
    command = start(
        *("--scenario", scenario_file("u", steps=3), "--time", "lockstep", "--ros-args"),
        *("-r", f"__ns:={namespace}", "-p", "simulator:odom_timeout:=1000"),
    )
    assert command.exit_code() == 2, command.stdout + command.stderr
    assert "odom_timeout: 1000 is not allowed: it must be a number from" in command.stderr
