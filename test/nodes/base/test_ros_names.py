"""Names in ROS arguments are refused in one sentence if ROS cannot use them."""

from __future__ import annotations

import numpy as np
import pytest
import rclpy
from rclpy.node import Node
from ros_domain import free_domain

from gameinfer_ros.nodes.base import spin
from gameinfer_ros.nodes.base.ros_names import RosArgsError, check_names

NAMESPACE = (
    "this namespace is not allowed: it must start with a slash, consist of letters, digits and "
    "single underscores, and must not start with a digit or end with a slash"
)

SOURCE = (
    "this source of a remapping is not allowed: it must consist of letters, digits and single "
    "underscores, and must not start with a digit or end with a slash"
)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("-p steps=3", "is not allowed: write -p NAME:=VALUE"),
        ("--param steps:=", "is not allowed: write --param NAME:=VALUE"),
        ("-p :=3", "is not allowed: write -p NAME:=VALUE"),
        ("-r belief=b", "is not allowed: write -r FROM:=TO"),
        (
            "-p /simulator:steps:=3",
            "/simulator is not allowed: write -p NODE:NAME:=VALUE, with the name of a node without "
            "slashes",
        ),
        ("-r /simulator:belief:=b", "/simulator is not allowed: write -r NODE:FROM:=TO, with "),
        ("-p", "requires a value"),
        ("--params-file", "requires a value"),
        ("-r *:=b", SOURCE),
        ("-r /**/belief:=b", SOURCE),
        ("-r simulator:*:=b", SOURCE),
        ("-r my-topic:=b", f"{SOURCE}; did you mean my_topic?"),
        (
            "-p brake-after:=1",
            "this parameter name is not allowed: it must consist of letters, digits, "
            "underscores and dots, and must not start with a digit; did you mean brake_after?",
        ),
        ("-r __ns:=/foo/", f"{NAMESPACE}; did you mean /foo?"),
        ("-r __ns:=foo", f"{NAMESPACE}; did you mean /foo?"),
        ("-r __ns:=/1foo", NAMESPACE),
        ("-r __ns:=/my-robot", f"{NAMESPACE}; did you mean /my_robot?"),
        ("--remap __ns:=/foo//bar/", f"{NAMESPACE}; did you mean /foo/bar?"),
        ("-r simulator:__ns:=//a__b", f"{NAMESPACE}; did you mean /a_b?"),
        ("-r __ns:=", NAMESPACE),
        ("-r __ns:=/zoé", f"{NAMESPACE}; did you mean /zo_?"),
        ("-r __ns:=/é", NAMESPACE),
        ("-r __nod:=sim", f"{SOURCE}; did you mean __node?"),
        (
            "-r __node:=my-robot",
            "this node name is not allowed: it must consist of letters, digits and single "
            "underscores, and must not start with a digit; did you mean my_robot?",
        ),
        ("-r __node:=/foo/bar", "this node name is not allowed: "),
        ("-r human_agent:__name:=1st", "this node name is not allowed: "),
        (
            "-r joint_state:=my-topic/",
            "this topic or service name is not allowed: it must consist of letters, digits and "
            "single underscores, and must not start with a digit or end with a slash; did you mean "
            "my_topic?",
        ),
        ("-r joint_state:=/foo/", "did you mean /foo?"),
        ("-r rosservice://~/pause:=1st", "this topic or service name is not allowed: "),
        ("-e robot", "this enclave is not allowed: it must start with a slash, "),
        ("--enclave /my-robot/", "; did you mean /my_robot?"),
        ("--enclave /1robot", "this enclave is not allowed: "),
        (f"-r __ns:=/{'n' * 140}", "this namespace is not allowed: it must have at most 140"),
        (f"-r __node:={'n' * 81}", "this node name is not allowed: it must have at most 80"),
        (f"-r belief:=/{'n' * 100}", "this topic or service name is not allowed: it must have at"),
    ],
)
def test_a_name_is_refused_with_what_is_allowed(words: str, message: str) -> None:
    with pytest.raises(RosArgsError) as caught:
        spin.init(["simulator", "--ros-args", *words.split()], context=rclpy.Context())
    text = str(caught.value)
    assert text.startswith(f"--ros-args: {words[:60]}")
    assert text.endswith(message) or (message[-1] != "?" and message in text)
    assert len(text.splitlines()) == 1


def ros_accepts(words: list[str], domain: int) -> bool:
    context = rclpy.Context()
    try:
        rclpy.init(args=["--ros-args", *words], context=context, domain_id=domain)
        Node("node", context=context, start_parameter_services=False).destroy_node()
    except Exception:
        return False
    finally:
        context.try_shutdown()
    return True


def accepted(words: list[str]) -> bool:
    try:
        check_names(words)
    except RosArgsError:
        return False
    return True


@pytest.mark.parametrize(
    "rule",
    ["-r __ns:={}", "-r __node:={}", "-r topic:={}", "-r {}:=topic", "-e {}"],
)
def test_exactly_the_names_that_ros_can_use_are_allowed(rule: str) -> None:
    rng, domain = np.random.default_rng(0), free_domain()
    names = ["", "/", "~", "~/a", "/a/b", "a/b", "/_a", "/a_", "/__a", "/a__b", "/A1/b", "{node}"]
    names += ["*", "a*", "/*/a", "**"]
    letters = list("/a_1-~")
    names += ["".join(rng.choice(letters, size=rng.integers(1, 6))) for _ in range(60)]
    names += ["/" + "".join(rng.choice(letters[:3], size=4)) for _ in range(20)]
    found = {True: 0, False: 0}
    for name in names:
        words = rule.format(name).split(" ")
        usable = ros_accepts(words, domain)
        assert accepted(words) == usable, words
        found[usable] += 1
    assert found[True] >= 3 and found[False] > 20


@pytest.mark.parametrize(
    ("name", "usable"),
    [
        *((name, True) for name in ("steps", "a__b", "a/b.c", "qos_overrides./tf.publisher.depth")),
        *((name, False) for name in ("*", "a*", "a-b", "1a", "a..b", ".a", "a.", "~a")),
    ],
)
def test_names_of_parameters_that_ros_cannot_use_are_refused(name: str, usable: bool) -> None:
    words = ["-p", f"{name}:=1"]
    assert accepted(words) == ros_accepts(words, free_domain()) == usable


def test_the_longest_allowed_names_can_be_used() -> None:
    domain = free_domain()
    words = ["-r", f"__ns:=/{'n' * 139}", "-r", f"__node:={'n' * 80}", "-r", f"topic:={'n' * 100}"]
    check_names(words)
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", *words], context=context, domain_id=domain)
    try:
        node = Node("node", context=context)
        assert len(node.resolve_topic_name("topic")) == 241
        node.destroy_node()
    finally:
        context.try_shutdown()
