"""Parameter files that ROS cannot read, or from which it would take one of several values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rclpy
from ros_domain import free_domain

from gameinfer_ros.nodes.base import spin
from gameinfer_ros.nodes.base.params_file import check_files
from gameinfer_ros.nodes.base.ros_names import RosArgsError

NAME = (
    "this name of a node is not allowed: its levels must consist of letters, digits and "
    "underscores, and must not start with a digit, or be * or **"
)
NO_VALUE = "has no value: write one, such as '' for an empty text"
EMPTY = "has no parameters: write NODE: {ros__parameters: {NAME: VALUE}}"
HINT = "; did you mean ros__parameters?"
WRITE = "is not below ros__parameters: write NODE: {ros__parameters: {NAME: VALUE}}"


def ros_reads(file: Path) -> bool:
    context = rclpy.Context()
    try:
        context.init(["--ros-args", "--params-file", str(file)], domain_id=free_domain())
    except Exception:
        return False
    context.shutdown()
    return True


def refusal(file: Path) -> str:
    """The message with which a node refuses the file, before ROS sees it."""
    with pytest.raises(RosArgsError) as caught:
        spin.init(["simulator", "--ros-args", "--params-file", str(file)], context=rclpy.Context())
    start, message = str(caught.value)[: len(f"{file}") + 16], str(caught.value)
    assert start == f"--params-file {file}: "
    assert len(message.splitlines()) == 1
    return message.removeprefix(start)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "simulator:\n  ros_parameters:\n    odom_timeout: 1.0",
            f"line 3: /simulator/ros_parameters/odom_timeout: {WRITE}; did you mean "
            "ros__parameters?",
        ),
        (
            "/**:\n  ros__parameter: {steps: 3}",
            f"line 2: /**/ros__parameter/steps: {WRITE}; did you mean ros__parameters?",
        ),
        ("simulator: {steps: 3}", f"line 1: /simulator/steps: {WRITE}"),
        ("simulator: {steps: [3]}", f"line 1: /simulator/steps: {WRITE}"),
        ("simulator:", f"line 1: /simulator: {WRITE}"),
        (
            "ros__parameters: {steps: 3}",
            "line 1: ros__parameters must be below the name of a node, such as /**",
        ),
        (
            "simulator:\n  ros__parameters:\n",
            "line 2: /simulator: ros__parameters must contain a mapping of parameters",
        ),
        ("? [simulator]\n: 3", "line 1: a key must be text, not a list or a mapping"),
        (
            "/**: {ros__parameters: &all {steps: 3}}\nsimulator: {ros__parameters: *all}",
            "line 2: ROS does not support aliases: replace *all",
        ),
        ("/**: &all {x: *all}", "line 1: ROS does not support aliases: replace *all"),
        (
            "simulator: {ros__parameters: {steps: [}}",
            "line 1: cannot be read as YAML: expected the node content, but found '}'",
        ),
        (
            "my-node: {ros__parameters: {steps: 3}}",
            f"line 1: my-node: {NAME}",
        ),
        ("/demo/: {1st: {ros__parameters: {steps: 3}}}", f"line 1: /demo/1st: {NAME}"),
        ("demo: {/simulator: {ros__parameters: {a: 3}}}", f"line 1: demo//simulator: {NAME}"),
        ('"simulator/": {ros__parameters: {steps: 3}}', f"line 1: simulator/: {NAME}"),
        ('"": {ros__parameters: {steps: 3}}', "line 1: a key must not be empty"),
        (
            "/**:\n  ros__parameters:\n    a: {b: }",
            f"line 3: /**: b {NO_VALUE}",
        ),
        (
            "other: {ros__parameters: {a: [yes, 1]}}",
            "line 1: /other: a is a list of different types, a boolean and an integer: write "
            "values of one type, text in quotes",
        ),
        (
            "/**:\n  ros__parameters: {steps: 3}\n  simulator: {ros__parameters: {steps: 4}}",
            "line 3: /**: simulator must be above ros__parameters, or below another node",
        ),
    ],
)
def test_what_ros_cannot_read_is_refused_with_its_line(
    text: str, message: str, tmp_path: Path
) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(text)
    assert not ros_reads(file)
    assert refusal(file) == message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "simulator:\n  ros__parameters:\n    odom_timeout: 1.0\n    odom_timeout: 2.0",
            "line 4: duplicate key 'odom_timeout': it is in line 3 too",
        ),
        (
            'simulator:\n  ros__parameters:\n    odom_time: stamp\n    "odom_time": arrival',
            "line 4: duplicate key 'odom_time': it is in line 3 too",
        ),
        (
            "simulator: {ros__parameters: {steps: 3}}\nsimulator: {ros__parameters: {steps: 4}}",
            "line 2: duplicate key 'simulator': it is in line 1 too",
        ),
        (
            "other: {ros__parameters: {a.b: 1,\n a: {b: 2}}}",
            "line 2: /other: duplicate key 'a.b': it is in line 1 too",
        ),
        (
            "simulator: {ros__parameters: {steps: 3}}\n/simulator: {ros__parameters: {a: 4}}",
            "line 2: /simulator: duplicate node: it is in line 1 too",
        ),
        (
            "/demo/simulator: {ros__parameters: {steps: 3}}\n"
            "demo:\n  other: {ros__parameters: {steps: 3}}\n"
            "  simulator: {ros__parameters: {steps: 4}}",
            "line 4: /demo/simulator: duplicate node: it is in line 1 too",
        ),
        (
            "/**: {ros__parameters: {steps: 3}}\n---\n/**: {ros__parameters: {steps: 4}}",
            "line 3: /**: duplicate node: it is in line 1 too",
        ),
    ],
)
def test_duplicate_keys_and_nodes_are_refused(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(text)
    assert ros_reads(file)
    assert refusal(file) == message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("/**: {ros_parameters: {}}", f"line 1: /**/ros_parameters: {EMPTY}{HINT}"),
        (
            "simulator:\n  ros__params: {}\n/**: {ros__parameters: {steps: 3}}",
            f"line 2: /simulator/ros__params: {EMPTY}{HINT}",
        ),
        ("simulater: {}", f"line 1: /simulater: {EMPTY}"),
        ("simulator: {ros__parameters: {steps: {}}}", f"line 1: /simulator: steps {NO_VALUE}"),
        (
            "simulator: {ros__parameters: {external: [a, [b]]}}",
            "line 1: /simulator: external is a list of lists or mappings, but ROS only reads lists "
            "of single values",
        ),
    ],
)
def test_what_ros_ignores_or_reads_in_part_is_refused(
    text: str, message: str, tmp_path: Path
) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(text)
    assert ros_reads(file)
    assert refusal(file) == message


def test_files_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path / "nope.yaml") == "cannot be read: No such file or directory"
    assert refusal(tmp_path) == "cannot be read: Is a directory"
    assert refusal(tmp_path / ("x" * 300)) == "cannot be read: File name too long"
    deep = tmp_path / "deep.yaml"
    deep.write_text("a: " + 5000 * "{a: " + "1" + 5000 * "}")
    assert refusal(deep).startswith("cannot be read: ")


def test_what_ros_reads_is_fine(tmp_path: Path) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(
        "/**: {ros__parameters: {use_sim_time: false}}\n"
        "demo: {simulator: {ros__parameters: {1: !!str 2, a: {b: [1, 2], c: [], d: ''}}}}\n"
        "/demo/: {other: {ros__parameters: {}}}\n"
        "/: {a: {b: {ros__parameters: {c: [~, 'x']}}}}\n"
    )
    assert ros_reads(file)
    check_files(["--params-file", str(file), "--params-file", "/dev/null"])


NAMES = ["simulator", "/simulator", "//a", "a/", "/", "a-b", "1a", "*", "/**", "a*", "a__b", "~"]
VALUES = ["1", "a", "", "~", "[]", "[1, 2]", "[1, a]", "[a, [b]]", "{}", "{b: 1}", "{b: }", "'' "]


def test_ros_reads_every_file_that_is_not_refused(tmp_path: Path) -> None:
    file, rng, fine = tmp_path / "params.yaml", np.random.default_rng(0), 0
    for _ in range(400):
        top, inner, value = rng.choice(NAMES), rng.choice(NAMES), rng.choice(VALUES)
        section = f"ros__parameters: {{x: {value}, y: 2}}"
        if rng.random() < 0.3:
            section = f'"{inner}": {{{section}}}'
        file.write_text(f'"{top}": {{{section}}}\nother: {{ros__parameters: {{x: 1}}}}\n')
        try:
            check_files(["--params-file", str(file)])
        except RosArgsError:
            continue
        fine += 1
        assert ros_reads(file), file.read_text()
    assert fine > 30
