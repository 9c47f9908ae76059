"""ROS arguments are refused in one sentence if ROS cannot read them, or reads nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_domain import free_domain

from gameinfer_ros.names.ros_args import SWITCHES
from gameinfer_ros.nodes.base import spin
from gameinfer_ros.nodes.base.argument_form import check_form
from gameinfer_ros.nodes.base.ros_names import RosArgsError

NO_VALUE = "x has no value: write one, such as '' for an empty text"
MAPPING = "x is a mapping: write a single value or a list"
LEVELS = (
    "is not allowed: it must be LEVEL or LOGGER:=LEVEL, with a level of debug, info, warn, error, "
    "fatal, unset"
)
UNKNOWN = "is unknown to ROS; put other arguments before --ros-args or after --"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-p", "x:=#1"], NO_VALUE),
        (["-p", "x:= "], NO_VALUE),
        (["-p", "x:=&a"], NO_VALUE),
        (["-p", "x:=[a, -, b"], "x cannot be read as YAML: "),
        (["-p", "x:=@home"], "x cannot be read as YAML: found character '@' that cannot start any"),
        (["-p", "x:={}"], MAPPING),
        (["-p", "x:={a: 1}"], MAPPING),
        (["-p", "n:x:=a: 1"], MAPPING),
        (["-p", "x:=[1, 2.0]"], "x is a list of different types, an integer and a double: write "),
        (["-p", "x:=[on, 'on']"], "x is a list of different types, a boolean and text: write "),
        (["-p", "x:=[[1, 2]]"], "x is a list of lists or mappings, but ROS only reads lists of "),
        (["--log-level", "verbose"], LEVELS),
        (["--log-level", "warning"], f"{LEVELS}; did you mean warn?"),
        (["--log-level", "simulator:=debg"], f"{LEVELS}; did you mean debug?"),
        (["--log-level", "simulator:="], LEVELS),
        (["--log-level", ":=debug"], LEVELS),
        (["--log-level", "20"], LEVELS),
        (["--log-config-file", "f"], "is not allowed: the logger of ROS does not read such a file"),
        (["--log-lvel", "debug"], f"{UNKNOWN}; did you mean --log-level?"),
        (["--enable-rosout-log"], f"{UNKNOWN}; did you mean --enable-rosout-logs?"),
        (["steps:=3"], UNKNOWN),
    ],
)
def test_it_is_refused_with_what_to_write(words: list[str], message: str) -> None:
    with pytest.raises(RosArgsError) as caught:
        spin.init(["node", "--ros-args", *words], context=rclpy.Context())
    text = str(caught.value)
    assert text.startswith(f"--ros-args: {words[0]}") and message in text
    assert len(text.splitlines()) == 1


def parameters_in_ros(words: list[str], domain: int) -> dict[str, Any] | None:
    """The parameters of a node in ROS with these arguments; None if ROS refuses them."""
    context = rclpy.Context()
    try:
        rclpy.init(args=["--ros-args", *words], context=context, domain_id=domain)
        node = Node("node", context=context, start_parameter_services=False)
        given = dict(node._parameter_overrides)
        node.destroy_node()
    except Exception:
        return None
    finally:
        context.try_shutdown()
    return given


def accepted(words: list[str]) -> bool:
    try:
        check_form(words)
    except RosArgsError:
        return False
    return True


def test_ros_reads_every_value_that_is_not_refused() -> None:
    rng, domain = np.random.default_rng(0), free_domain()
    parts = ["a", "1", "2.5", "yes", "~", "'b'", '"c d"', "#", ":", ",", "[", "]", "{", "}", "-"]
    parts += [" ", "&x", "*x", "!!str", "|", "\n", "@", "%", "?", "é", ".", "---"]
    values = ["".join(rng.choice(parts, size=rng.integers(1, 5))) for _ in range(300)]
    values += [f"[{','.join(rng.choice(parts[:8], size=rng.integers(0, 4)))}]" for _ in range(60)]
    found = {True: 0, False: 0}
    for value in values:
        words = ["-p", f"x:={value}"]
        if accepted(words):
            given = parameters_in_ros(words, domain)
            assert given is not None, words
            assert (given["x"].type_ == Parameter.Type.NOT_SET) == (value == "[]"), words
        found[accepted(words)] += 1
    assert min(found.values()) > 60


def test_exactly_the_levels_that_ros_knows_are_allowed() -> None:
    domain = free_domain()
    levels = ["debug", "INFO", "Warn", "error", "fatal", "unset", "trace", "off", "warning", "10"]
    levels += ["", "a:=info", "a.b:=DEBUG", "/a:=info", "rcl:=warn", "a:=b:=info", "a:=", ":=info"]
    levels += ["~:=info", "a=info", "a:info", "1a:=info", "a-b:=fatal"]
    for level in levels:
        words = ["--log-level", level]
        assert accepted(words) == (parameters_in_ros(words, domain) is not None), level


@pytest.mark.parametrize("switch", SWITCHES)
def test_the_switches_of_ros_are_allowed(switch: str) -> None:
    assert accepted([switch]) and parameters_in_ros([switch], free_domain()) is not None
