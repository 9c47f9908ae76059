"""What is said of command lines that cannot be understood."""

from __future__ import annotations

import argparse
import importlib
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from gameinfer_ros.commands import cli
from gameinfer_ros.commands.cli import COMMANDS
from gameinfer_ros.names.planners import planners
from gameinfer_ros.nodes.table import NODES

PLANNERS = ", ".join(planners())


@pytest.mark.parametrize(
    ("line", "usage", "words"),
    [
        ("rnu", "", f"'rnu' is not allowed: it must be one of {', '.join(COMMANDS)}; did"),
        ("rnu", "", "; did you mean run?"),
        ("nothing-like-it", "", f"{', '.join(COMMANDS)}\n"),
        ("--versoin", "", "unrecognized arguments: --versoin; did you mean --version?"),
        (
            "run --plannr map",
            " run",
            "unrecognized arguments: --plannr map; did you mean --planner?",
        ),
        ("run --plannr=map", " run", "; did you mean --planner?"),
        ("run --planner mpa", " run", f"'mpa' is not allowed: it must be one of {PLANNERS}; did"),
        ("run --scen two_player", " run", "unrecognized arguments: --scen two_player"),
        ("run two_player", " run", "unrecognized arguments: two_player\n"),
        ("run --seed one", " run", "argument --seed: 'one' is not allowed"),
        ("planning --sample 3", " planning", "unrecognized arguments: --sample 3"),
        ("equilibria --sample 3", " equilibria", "; did you mean --samples?"),
        ("bench --quik", " bench", "; did you mean --quick?"),
        ("inspect", " inspect", "the following arguments are required: DIR"),
        ("replay a b", " replay", "unrecognized arguments: b"),
        ("report --scenario x", " report", "unrecognized arguments: --scenario x"),
        ("bench --ros-args -p a:=1", " bench", "--ros-args is only allowed for run, not for bench"),
    ],
)
def test_the_nearest_is_named_under_the_usage_of_the_command(
    line: str, usage: str, words: str, shell: dict[str, str]
) -> None:
    done = subprocess.run(
        ["gameinfer", *line.split()], env=shell, capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"usage: gameinfer{usage} [-h]")
    assert f"\ngameinfer{usage}: error: " in done.stderr
    assert words in done.stderr


def folders() -> Iterator[tuple[str, str]]:
    """Each command with each of its arguments that are folders."""
    for command in COMMANDS:
        parser = argparse.ArgumentParser()
        importlib.import_module(f"gameinfer_ros.commands.{command}").add_arguments(parser)
        for action in parser._actions:
            if action.metavar == "DIR":
                yield command, "".join(action.option_strings)


@pytest.mark.parametrize(("command", "option"), [*folders()])
def test_an_empty_folder_is_not_the_current_one(
    command: str,
    option: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        cli.main([command, *([option] if option else []), ""])
    assert ended.value.code == 2
    words = f"argument {option or 'DIR'}: '' is not allowed: it must be the path of a folder; "
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_all_folders_are_tried() -> None:
    assert {("run", "--out"), ("run", "--record"), ("inspect", ""), ("replay", "")} < {*folders()}
    assert len({command for command, option in folders() if option == "--out"}) == 7


@pytest.mark.parametrize("node", NODES)
def test_a_node_takes_arguments_for_ros_only(node: str, shell: dict[str, str]) -> None:
    def start(*args: str) -> subprocess.CompletedProcess[str]:
        code = (
            "import sys; sys.modules['rclpy'] = sys.modules['numba'] = None\n"
            f"from gameinfer_ros.commands.executables import {node}; sys.exit({node}())"
        )
        line = [shell["PATH"].split(":")[1] + "/python", "-c", code, *args]
        return subprocess.run(line, env=shell, capture_output=True, text=True, timeout=60)

    told = start("--help")
    assert told.returncode == 0, told.stderr
    assert told.stdout.startswith(f"usage: {node} [-h] [--ros-args ...]")
    refused = start("--seed", "3", "--ros-args", "-p", "seed:=3")
    assert refused.returncode == 2
    assert "unrecognized arguments: --seed 3" in refused.stderr
