"""Arguments for ROS among others."""

from __future__ import annotations

import pytest

from gameinfer_ros.names import ros_args


@pytest.mark.parametrize(
    ("args", "own", "for_ros"),
    [
        (["--seed", "3"], ["--seed", "3"], []),
        (["--seed", "3", "--ros-args", "-p", "a:=1"], ["--seed", "3"], ["-p", "a:=1"]),
        (
            ["--ros-args", "-r", "__ns:=/x", "--", "--seed", "3"],
            ["--seed", "3"],
            ["-r", "__ns:=/x"],
        ),
        (["--", "x", "--ros-args", "-p", "a:=1"], ["--", "x"], ["-p", "a:=1"]),
        (["--ros-args"], [], []),
    ],
)
def test_arguments_for_ros_are_those_between_the_marks(
    args: list[str], own: list[str], for_ros: list[str]
) -> None:
    assert ros_args.split(args) == (own, for_ros)
