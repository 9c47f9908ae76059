"""Parameters that a run sets for its nodes are refused in ROS arguments."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from gameinfer_ros.commands import run as run_command
from gameinfer_ros.nodes.base.ros_names import RosArgsError
from gameinfer_ros.nodes.interface import NodeInterface
from gameinfer_ros.orchestration.node_arguments import SET_BY_RUN, check_run_arguments
from gameinfer_ros.orchestration.node_list import node_list
from gameinfer_ros.scenario import Scenario

ALL = ("--record", "bag", "--view", "--view-port", "0", "--control", "--particles", "5")


def nodes_of(scenario: str, *arguments: str) -> dict[str, tuple[NodeInterface, dict[str, object]]]:
    """The nodes of a run by name, each with the parameters that the run sets."""
    parser = argparse.ArgumentParser()
    run_command.add_arguments(parser)
    options = parser.parse_args(arguments)
    options.external = []
    loaded = Scenario.load(scenario)
    return {
        name: (NodeInterface(module, name, "/", loaded.game.players.names), parameters)
        for name, module, parameters in node_list(loaded, Path(scenario), options)
    }


NODES = nodes_of("two_player", *ALL)
INTERFACES = [interface for interface, _ in NODES.values()]
SET = sorted({(node, name) for node, (_, parameters) in NODES.items() for name in parameters})


def test_no_parameter_is_missing_in_the_list() -> None:
    assert {name for _, name in SET} == set(SET_BY_RUN)


@pytest.mark.parametrize(("node", "name"), SET)
def test_what_a_run_sets_is_refused(node: str, name: str, tmp_path: Path) -> None:
    for words in (f"-p {name}:=1", f"-p {node}:{name}:=x"):
        with pytest.raises(RosArgsError) as caught:
            check_run_arguments(words.split(), INTERFACES)
        assert str(caught.value) == f"--ros-args: {words}: is not allowed: {SET_BY_RUN[name]}"
    file = tmp_path / "params.yaml"
    for section in ("/**", f"/{node}"):
        file.write_text(f"{section}: {{ros__parameters: {{{name}: 1}}}}")
        with pytest.raises(RosArgsError) as caught:
            check_run_arguments(["--params-file", str(file)], INTERFACES)
        assert str(caught.value) == (
            f"--params-file {file}: {section}: {name}: is not allowed: {SET_BY_RUN[name]}"
        )


def test_what_a_run_does_not_set_is_fine_in_a_file(tmp_path: Path) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(
        "/**: {ros__parameters: {plan_length: 5, use_sim_time: false}}\n"
        "other: {ros__parameters: {seed: 3, planner: x}}\n"
        "/elsewhere/inference: {ros__parameters: {seed: 3}}\n"
    )
    (remark,) = check_run_arguments(["--params-file", str(file)], INTERFACES)
    assert remark.endswith(": parameters for other nodes: /other, /elsewhere/inference")
