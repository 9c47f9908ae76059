"""Each node as a process: ready, stopped by a signal, or refused with a message."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from node_of_its_own import DEADLINE, NodeOfItsOwn
from ros_domain import free_domain

from gameinfer_ros.nodes.table import NODES
from gameinfer_ros.orchestration.node_process import NodeProcess, stop_all

Start = Callable[..., NodeOfItsOwn]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    nodes: list[NodeOfItsOwn] = []

    def make(module: str, *arguments: str, forked: bool = False) -> NodeOfItsOwn:
        log, local = tmp_path / f"{len(nodes)}.log", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        environment = {**os.environ, **local}
        nodes.append(
            NodeOfItsOwn(
                module, log, free_domain(), *arguments, environment=environment, forked=forked
            )
        )
        return nodes[-1]

    yield make
    for node in nodes:
        node.end()


@pytest.mark.parametrize("module", NODES)
def test_a_node_says_when_it_is_ready_and_ends_well_on_a_signal(module: str, start: Start) -> None:
    free_port = ("--ros-args", "-p", "port:=0") if module == "viewer" else ()
    for signal_number, node in [
        (s, start(module, *free_port, forked=s == signal.SIGTERM))
        for s in (signal.SIGINT, signal.SIGTERM)
    ]:
        node.until_ready()
        node.process.send_signal(signal_number)
        # rclpy itself may complain of a signal that comes while it makes its executor.
        assert node.exit_code() == 0, node.words


def test_a_suspended_node_ends_like_any_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(free_domain()))
    node = NodeProcess("robot_planner", "robot_planner", {"scenario": "two_player"}, tmp_path)
    try:
        deadline = time.monotonic() + DEADLINE
        while "ready" not in node.last_output():
            assert node.exit_code is None and time.monotonic() < deadline, node.last_output()
            time.sleep(0.02)
        node.send(signal.SIGSTOP)
        stop_all([node])
        assert node.exit_code == 0, node.ending
    finally:
        node.send(signal.SIGKILL)


def test_a_signal_during_start_up_ends_a_node_too(start: Start) -> None:
    # While Python still imports, the signal itself ends it, as it does any program; after that,
    # also while the node is made, it ends well.
    usual = start("simulator")
    began = time.monotonic()
    usual.until_ready()
    duration = time.monotonic() - began
    usual.process.kill()
    for signal_number in (signal.SIGINT, signal.SIGTERM):
        for delay in (0.3, 0.8 * duration, 0.9 * duration):
            node = start("simulator")
            time.sleep(delay)
            node.process.send_signal(signal_number)
            assert node.exit_code() in (0, -signal_number), node.words


def test_a_signal_during_imports_raises_no_exception_in_them(tmp_path: Path) -> None:
    # Libraries may turn it into another error: this one stands for rclpy.
    (tmp_path / "rclpy").mkdir()
    library = tmp_path / "rclpy/__init__.py"
    library.write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n")
    of_node, of_user = (
        ("-m", "gameinfer_ros.nodes.simulator"),
        ("-c", "import gameinfer_ros.nodes, rclpy"),
    )
    for command, raises in ((of_node, False), (of_user, True)):
        done = subprocess.run(
            [sys.executable, *command],
            env={**os.environ, "PYTHONPATH": str(tmp_path)},
            capture_output=True,
            text=True,
            timeout=DEADLINE,
        )
        assert done.returncode == -signal.SIGINT
        assert ("KeyboardInterrupt" in done.stderr) == raises, done.stderr


@pytest.mark.parametrize(
    ("module", "name", "value", "words"),
    [
        ("human_agent", "seed", "-1", ("-1", "from 0 to")),
        ("simulator", "scenario", "nope", ("nope", "three_player")),
    ],
)
def test_a_bad_parameter_ends_a_node_with_2_and_a_message(
    module: str, name: str, value: str, words: tuple[str, ...], start: Start
) -> None:
    node = start(module, "--ros-args", "-p", f"{name}:={value}", forked=True)
    assert node.exit_code() == 2, node.words
    assert "Traceback" not in node.words
    for word in (name, *words):
        assert word in node.words


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--nonsense", "is unknown to ROS; put other arguments before --ros-args or after --"),
        ("-r __ns:=/foo/", "did you mean /foo?"),
        ("-r __node:=my-robot", "did you mean my_robot?"),
        ("-p stepz:=3", "the node simulator has no parameter stepz; did you mean steps?"),
        ("-r joint_stat:=s", "the node simulator has no topic or service joint_stat; did you mean"),
        ("-p simulatr:steps:=3", "no node is called simulatr: the name of this node is simulator"),
        ("-r __ns:=/a -p simulator:steps:=3", "no effect in the namespace /a: write -p steps:=3"),
        ("-p steps:=1 -p steps:=2.0", "steps is a double here, but an integer in -p steps:=1, and"),
        ("-p steps=3", "-p steps=3: is not allowed: write -p NAME:=VALUE"),
        ("-r *:=b", "-r *:=b: this source of a remapping is not allowed: it must consist of"),
        ("-p external:=[1,x]", "external is a list of different types, an integer and text: "),
        ("-p steps:=#3", "steps has no value: write one, such as '' for an empty text"),
        ("--log-level verbose", "it must be LEVEL or LOGGER:=LEVEL, with a level of debug, info,"),
    ],
)
def test_bad_ros_arguments_end_a_node_with_2_and_a_message(
    arguments: str, message: str, start: Start
) -> None:
    node = start("simulator", "--ros-args", *arguments.split(), forked=True)
    assert node.exit_code() == 2, node.words
    assert "Traceback" not in node.words
    (line,) = node.words.splitlines()
    assert line.startswith("--ros-args: ") and message in line


def test_words_that_are_no_ros_arguments_end_a_node_with_2_and_a_message(start: Start) -> None:
    node = start("simulator", "--steps", "3", "--ros-args", "-p", "steps:=3")
    assert node.exit_code() == 2, node.words
    assert node.words == "--steps 3: is not allowed: write --ros-args -p NAME:=VALUE\n"


@pytest.mark.parametrize(
    ("section", "code"),
    [
        ("/**/simulator: {ros__parameters: {odom_timeout: 1}}", 0),
        ("/**/simulator: {ros__parameters: {odom_timout: 1}}", 2),
        ("/**/simulatr: {ros__parameters: {odom_timeout: 1}}", 2),
    ],
)
def test_a_params_file_for_several_nodes_is_checked(
    section: str, code: int, start: Start, tmp_path: Path
) -> None:
    file = tmp_path / "shared.yaml"
    file.write_text(
        f"{section}\n"
        "/**: {ros__parameters: {scenario: two_player, deadline: 1}}\n"
        "inference: {ros__parameters: {particles: 3}}\n"
        "controller_server: {ros__parameters: {rate: 1.0}}\n"
    )
    node = start("simulator", "--ros-args", "--params-file", str(file), forked=True)
    if code == 0:
        node.until_ready()
        assert "waits for robot, human_1\n" in node.words
        node.until_it_says(f"{file}: parameters for other nodes: /controller_server")
        node.process.send_signal(signal.SIGINT)
    assert node.exit_code() == code, node.words
    refused = f"--params-file {file}: /**/" in node.words and "; did you mean " in node.words
    assert refused == (code == 2)


def test_a_node_can_be_renamed_and_put_into_a_namespace(start: Start) -> None:
    node = start("simulator", "--ros-args", "-r", "__node:=world", "-r", "__ns:=/a", forked=True)
    node.until_ready()
    assert "[a.world]: ready" in node.words


def test_processes_do_not_import_what_only_some_need() -> None:
    """It takes long, and every process of a run, and every worker of a study, pays for it."""
    studies = (
        "equilibria.equilibria_study", "check.command", "prediction.prediction_study",
        "planning.planning_study",
    )  # fmt: skip
    modules = {
        "orchestration.orchestrator": ("aiohttp", "matplotlib", "scipy.stats", "scipy.optimize"),
        **{f"nodes.{node}": ("matplotlib", "scipy.stats", "scipy.optimize") for node in NODES},
        **{f"experiments.{study}": ("matplotlib", "scipy.stats") for study in studies},
    }
    code = "import importlib, sys\n" + "\n".join(
        f"importlib.import_module('gameinfer_ros.{module}')\n"
        f"print(*({module!r} + ' imports ' + m for m in {needless} if m in sys.modules), end='')"
        for module, needless in modules.items()
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.stdout, done.returncode) == ("", 0), done.stderr
