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


def test_arguments_are_a_flag_and_perhaps_a_value() -> None:
    words = ["-p", "a:=1", "--disable-rosout-logs", "--params-file", "-r", "-e"]
    flags = [(argument.flag, argument.value) for argument in ros_args.parse(words)]
    assert flags == [
        ("-p", "a:=1"),
        ("--disable-rosout-logs", None),
        ("--params-file", "-r"),
        ("-e", None),
    ]
    assert [word for argument in ros_args.parse(words) for word in argument.words] == words


@pytest.mark.parametrize(
    ("flag", "text", "rule"),
    [
        ("-p", "a.b:=1", (True, None, "", "a.b", "1")),
        ("--param", "node:a:=x:=y", (True, "node", "", "a", "x:=y")),
        ("-r", "__ns:=/x", (False, None, "", "__ns", "/x")),
        ("-r", "node:/a/b:=c", (False, "node", "", "/a/b", "c")),
        ("--remap", "rostopic://a:=b", (False, None, "rostopic", "a", "b")),
        ("-r", "node:rosservice:///a:=b", (False, "node", "rosservice", "/a", "b")),
        ("-r", "a", (False, None, "", "a", "")),
    ],
)
def test_parameters_and_remappings_are_taken_apart(
    flag: str, text: str, rule: tuple[object, ...]
) -> None:
    assert ros_args.rule(ros_args.Argument(flag, text)) == rule


def test_other_arguments_are_no_rules_and_control_characters_are_shown() -> None:
    assert ros_args.rule(ros_args.Argument("--params-file", "a:=b")) is None
    assert ros_args.rule(ros_args.Argument("-p")) is None
    assert str(ros_args.Argument("-r", "a:=\x1b[1m")) == "-r a:=\\x1b[1m"
    assert len(str(ros_args.Argument("-r", "a:=" + "b" * 1000))) == 200
