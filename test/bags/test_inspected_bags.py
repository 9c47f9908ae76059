"""What `gameinfer inspect` reports of a bag, and what is no bag of a run."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from recorded_run import STEPS
from run_command import DEADLINE

from gameinfer_ros.bags.label import KEY
from gameinfer_ros.bags.run_bag import BagError, RunBag
from gameinfer_ros.commands import cli


def test_inspect_reports_what_the_run_reported(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["inspect", str(run / "bag"), "--json"]) == 0
    printed = capsys.readouterr()
    found, wanted = json.loads(printed.out), json.loads((run / "run.json").read_text())
    for key in wanted:
        assert found[key] == wanted[key]
    assert (found["scenario"], found["planner"], found["seed"]) == ("passing", "map", 5)
    assert found["topics"]["/joint_state"] == STEPS + 1
    assert 0 < found["duration_s"] < DEADLINE
    assert 0 < found["solve_ms"]["median"] <= found["solve_ms"]["longest"]
    for words in ("passing, planner map, seed 5", "/joint_state", f"Steps: {STEPS}", "robot"):
        assert words in printed.err


#: Packages of ROS, which are told by their names, and the compiler.
NO_ROS = """
import sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        top = name.partition(".")[0]
        if top in ("rclpy", "builtin_interfaces", "numba", "llvmlite") or top.endswith("_msgs"):
            raise ModuleNotFoundError(f"there is no {name} here")

sys.meta_path.insert(0, NoRos())
"""


def test_bags_need_neither_ros_nor_numba(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["inspect", str(run / "bag"), "--json"]
    code = f"{NO_ROS}\nfrom gameinfer_ros.commands import cli\nsys.exit(cli.main({arguments!r}))\n"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=DEADLINE
    )
    assert done.returncode == 0, done.stderr
    assert cli.main(arguments) == 0
    assert done.stdout == capsys.readouterr().out


def no_bag(folder: Path, copy: Callable[..., Path]) -> None:
    """There is no such folder."""


def no_metadata(folder: Path, copy: Callable[..., Path]) -> None:
    folder.mkdir()


def no_label(folder: Path, copy: Callable[..., Path]) -> None:
    copy().rename(folder)
    metadata = folder / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(KEY, "other"))


def no_messages(folder: Path, copy: Callable[..., Path]) -> None:
    copy().rename(folder)
    (file,) = folder.glob("*.mcap")
    file.write_bytes(file.read_bytes()[:1000])


def no_state_3(folder: Path, copy: Callable[..., Path]) -> None:
    def change(topic: str, k: int, message: Any) -> Any:
        return None if (topic, k) == ("/joint_state", 3) else message

    copy(change).rename(folder)


def no_scenario(folder: Path, copy: Callable[..., Path]) -> None:
    copy().rename(folder)
    (folder / "scenario.yaml").unlink()


def other_players(folder: Path, copy: Callable[..., Path]) -> None:
    copy().rename(folder)
    file = folder / "scenario.yaml"
    file.write_text(file.read_text().replace("human_1", "human_2"))


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (no_bag, "does not exist"),
        (no_metadata, "metadata"),
        (no_label, "gameinfer run --record"),
        (no_messages, ""),
        (no_state_3, "the state of step 3 is missing"),
        (no_scenario, "scenario.yaml"),
        (other_players, "human_2"),
    ],
)
@pytest.mark.parametrize("name", ["inspect", "replay"])
def test_what_is_no_bag_of_a_run_is_refused(
    name: str,
    spoil: Callable[[Path, Callable[..., Path]], None],
    words: str,
    copy: Callable[..., Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = tmp_path / "spoiled"
    spoil(folder, copy)
    assert cli.main([name, str(folder)]) == 2
    told = capsys.readouterr().err
    assert str(folder) in told
    assert words in told


def test_a_message_that_cannot_be_read_is_reported(copy: Callable[..., Path]) -> None:
    def change(topic: str, k: int, message: Any) -> Any:
        if (topic, k) == ("/belief", 2):
            message.data = message.data[:-1]
        return message

    bag = RunBag(copy(change))
    with pytest.raises(BagError, match="damaged"):
        bag.record()


def test_the_animation_of_a_bag_is_that_of_the_run(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "again.gif"
    assert cli.main(["inspect", str(run / "bag"), "--animation", str(file), "--json"]) == 0
    printed = capsys.readouterr()
    assert str(file) in printed.err
    assert json.loads(printed.out)["steps"] == STEPS
    assert file.read_bytes() == (run / "run.gif").read_bytes()
    with Image.open(file) as image:
        assert image.n_frames == STEPS + 1


def test_an_animation_of_nothing_is_refused(
    copy: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = copy(lambda topic, k, message: None if topic == "/joint_state" else message)
    file = tmp_path / "none.gif"
    assert cli.main(["inspect", str(bag), "--animation", str(file)]) == 2
    told = capsys.readouterr().err
    for word in ("--animation", str(bag), "no state"):
        assert word in told
    assert not file.exists()
