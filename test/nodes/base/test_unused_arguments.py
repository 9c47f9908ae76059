"""Arguments that would have no effect are refused, with the nearest name."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.node import Node
from ros_domain import free_domain

from gameinfer_ros.nodes.base.params_file import sections
from gameinfer_ros.nodes.base.ros_names import RosArgsError
from gameinfer_ros.nodes.base.unused_arguments import check_effect, check_effect_on, for_node
from gameinfer_ros.nodes.interface import NodeInterface
from gameinfer_ros.orchestration.node_arguments import check_run_arguments

PLAYERS = ["robot", "human_1", "human_2"]
AGENTS = [("human_agent", f"{name}_agent", name) for name in PLAYERS[1:]]
KINDS = [(kind, kind, "") for kind in ("simulator", "inference", "robot_planner")]


def run(namespace: str = "/") -> list[NodeInterface]:
    """The nodes of a run without the live page."""
    return [
        NodeInterface(kind, name, namespace, PLAYERS, own) for kind, name, own in KINDS + AGENTS
    ]


def one(kind: str, name: str = "", namespace: str = "/") -> NodeInterface:
    own = "human_1" if kind == "human_agent" else ""
    return NodeInterface(kind, name or kind, namespace, PLAYERS, own)


@pytest.mark.parametrize(
    "words",
    [
        "-p odom_timeout:=1.0",
        "--param robot_planner:brake_after:=9.0",
        "-p use_sim_time:=true",
        "-p human_2_agent:plan_length:=4",
        "-r robot/cmd_vel:=/cmd_vel -r robot/odom:=/odometry/map",
        "-r /joint_state:=/states -r rostopic://belief:=b -r rosservice://simulator/reset:=r",
        "-r human_1_agent:human_1/control:=c",
        "--remap ~/reset:=again",
        "-r /diagnostics:=d",
        "-r __ns:=/demo",
        "-e /enclave --log-level debug --log-level simulator:=warn --log-level rcl:=warn",
        "--disable-rosout-logs --enable-external-lib-logs",
        "",
    ],
)
def test_what_a_node_of_the_run_has_is_fine(words: str) -> None:
    assert check_run_arguments(words.split(), [*run(), one("viewer")]) == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            "-p odom_timout:=1.0",
            "no node of this run has a parameter odom_timout; did you mean odom_timeout?",
        ),
        ("--param use_sim_tim:=true", "parameter use_sim_tim; did you mean use_sim_time?"),
        ("-p wings:=2", "no node of this run has a parameter wings: it must be one of brake_after"),
        ("-p a.b:=2", "no node of this run has a parameter a.b: it must be one of "),
        (
            "-p robot_plannr:brake_after:=9.0",
            "no node is called robot_plannr: the nodes are simulator, inference, robot_planner, "
            "human_1_agent, human_2_agent; did you mean robot_planner?",
        ),
        ("-p human_3_agent:seed:=1", "no node is called human_3_agent: the nodes are "),
        ("-p viewer:port:=1", "no node is called viewer: the nodes are "),
        ("-p port:=1", "no node of this run has a parameter port: "),
        (
            "-p robot_planner:odom_timeout:=1",
            "the node robot_planner has no parameter odom_timeout: it must be one of ",
        ),
        (
            "-p inference:dedline:=0.1",
            "the node inference has no parameter dedline; did you mean deadline?",
        ),
        (
            "-r robot/cmd_vell:=/cmd_vel",
            "run has a topic or service robot/cmd_vell; did you mean robot/cmd_vel?",
        ),
        ("-r /robot/cmd_vell:=/cmd_vel", "did you mean /robot/cmd_vel?"),
        ("-r human_1/cmd_vel:=/cmd_vel", "service human_1/cmd_vel; did you mean "),
        ("-r cmd_vel:=/cmd_vel", "service cmd_vel; did you mean robot/cmd_vel?"),
        ("-r ~/rset:=again", "service ~/rset; did you mean ~/reset?"),
        ("-r rostopic://~/reset:=again", "no node of this run has a topic ~/reset: it must be"),
        ("-r rosservice://belief:=b", "no node of this run has a service belief: it must be"),
        (
            "-r simulator:robot/cmd_vel:=/cmd_vel",
            "the node simulator has no topic or service robot/cmd_vel; did you mean ",
        ),
        ("-r human_1_agent:human_2/control:=c", "the node human_1_agent has no topic or service "),
        ("-r simulater:belief:=b", "no node is called simulater: the nodes are "),
        ("-p steps:=5", "is not allowed: in a run, write --steps"),
        ("-p inference:time:=realtime", "is not allowed: in a run, write --time"),
        ("-p subscribers:=0", "is not allowed: a run sets it itself"),
        ("-p planner:=baseline", "is not allowed: in a run, write --planner"),
        ("-p human_2_agent:seed:=4", "is not allowed: in a run, write --seed"),
        ("-p safety:=false", "is not allowed: in a run, it is on unless you write --no-safety"),
        ("-r __node:=sim", "is not allowed: the names of the nodes of a run are fixed"),
        ("-r simulator:__node:=sim", "is not allowed: the names of the nodes of a run are fixed"),
        (
            "-r simulator:__ns:=/demo",
            "is not allowed: all nodes of a run share one namespace: write -r __ns:=/demo",
        ),
        (
            "--log-level simulatr:=debug",
            "no node has a logger simulatr; did you mean simulator?",
        ),
    ],
)
def test_what_no_node_of_the_run_has_is_refused(words: str, message: str) -> None:
    with pytest.raises(RosArgsError) as caught:
        check_run_arguments(["--disable-rosout-logs", *words.split()], run())
    assert str(caught.value).startswith(f"--ros-args: {words}: ")
    assert message in str(caught.value)


def test_in_a_namespace_names_are_those_of_the_namespace() -> None:
    demo = run("/demo")
    fine = "-r robot/cmd_vel:=/cmd_vel -r /demo/belief:=b --log-level demo.simulator:=debug"
    assert check_effect(fine.split(), demo) == []
    for words, hint in (
        ("-r /robot/cmd_vel:=/cmd_vel", "did you mean /demo/robot/cmd_vel?"),
        ("--log-level simulator:=debug", "did you mean demo.simulator?"),
    ):
        with pytest.raises(RosArgsError) as caught:
            check_effect(words.split(), demo)
        assert hint in str(caught.value)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("-p stepz:=3", "the node simulator has no parameter stepz; did you mean steps?"),
        ("-p deadline:=0.1", "the node simulator has no parameter deadline: it must be one of "),
        ("-p inference:deadline:=1.0", "no node is called inference: the name of this node is "),
        ("-r robot/cmd_vel:=/cmd_vel", "the node simulator has no topic or service robot/cmd_vel"),
    ],
)
def test_a_single_node_refuses_what_it_does_not_have(words: str, message: str) -> None:
    with pytest.raises(RosArgsError) as caught:
        check_effect_on(words.split(), one("simulator"))
    assert message in str(caught.value)


def test_a_single_node_may_have_another_name() -> None:
    words = "-r human_agent:__node:=ana -p ana:seed:=3 -r ana:joint_state:=s -r human_1/control:=c"
    assert check_effect_on(words.split(), one("human_agent", "ana")) == []
    with pytest.raises(RosArgsError, match=r"the name of this node is ana$"):
        check_effect_on(["-p", "human_agent:seed:=3"], one("human_agent", "ana"))


def test_a_single_node_says_how_to_set_a_parameter_in_a_namespace() -> None:
    words = ["-p", "simulator:steps:=3"]
    assert check_effect_on(words, one("simulator")) == []
    with pytest.raises(RosArgsError, match=r"no effect in the namespace /demo: write -p steps:=3$"):
        check_effect_on(words, one("simulator", namespace="/demo"))


def test_a_node_of_a_run_gets_what_it_has() -> None:
    parameters = "-p simulator:steps:=3 -p deadline:=0.1 -p use_sim_time:=true"
    rest = "-r joint_state:=s --params-file f.yaml -r __ns:=/demo -e /x --log-level debug"
    words = f"{parameters} -r robot/cmd_vel:=/cmd_vel {rest}".split()
    for kind, kept in (
        ("simulator", "-p steps:=3 -p use_sim_time:=true"),
        ("inference", "-p deadline:=0.1 -p use_sim_time:=true"),
        ("robot_planner", "-p use_sim_time:=true -r robot/cmd_vel:=/cmd_vel"),
    ):
        assert for_node(words, one(kind, namespace="/demo")) == f"{kept} {rest}".split()


SHARED = """
/**:
  ros__parameters: {use_sim_time: false, deadline: 0.1, port: 8000}
simulator:
  ros__parameters: {steps: 3}
/**/robot_planner:
  ros__parameters: {brake_after: 2}
viewer:
  ros__parameters: {port: 8001}
"""


def file_with(tmp_path: Path, text: str) -> list[str]:
    path = tmp_path / "params.yaml"
    path.write_text(text)
    return ["--params-file", str(path)]


def test_a_shared_file_is_fine_for_a_run_and_for_each_node(tmp_path: Path) -> None:
    words = file_with(tmp_path, SHARED)
    assert check_effect(words, run()) == []
    for kind in ("simulator", "inference", "robot_planner", "human_agent", "viewer"):
        assert check_effect(words, [one(kind)]) == []
    (remark,) = check_effect(words, [one("simulator", namespace="/demo")])
    assert remark.endswith(": parameters for other nodes: /simulator, /viewer")


def test_agents_of_a_run_are_named_after_players(tmp_path: Path) -> None:
    words = file_with(tmp_path, SHARED + "human_agent: {ros__parameters: {seed: 3}}")
    assert (
        check_effect(words, [one("simulator")]) == check_effect(words, [one("human_agent")]) == []
    )
    for nodes in (run(), [one("human_agent", "human_1_agent")]):
        with pytest.raises(RosArgsError, match=r"/human_agent: no .* did you mean human_._agent"):
            check_effect(words, nodes)


def test_sections_for_nodes_of_other_packages_are_fine_and_named(tmp_path: Path) -> None:
    others = "controller_server: {ros__parameters: {FollowPath: {max_vel: 1}}}\n"
    others += "local_costmap: {local_costmap: {ros__parameters: {width: 3}}}\n"
    words = file_with(tmp_path, SHARED + others)
    for nodes in (run(), [one("simulator")]):
        (remark,) = check_effect(words, nodes)
        assert remark == (
            f"--params-file {words[1]}: parameters for other nodes: /controller_server, "
            "/local_costmap/local_costmap"
        )


@pytest.mark.parametrize(
    "text",
    ["human_3_agent: ", "simulator_2: ", "simulator2: ", "/robot_2/simulator: ", "my_simulator: "],
)
def test_further_nodes_of_a_kind_are_other_nodes(text: str, tmp_path: Path) -> None:
    words = file_with(tmp_path, SHARED + text + "{ros__parameters: {seed: 3}}")
    (remark,) = check_effect(words, run())
    assert remark.endswith(text.lstrip("/").rstrip(": "))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            SHARED + "robot_plannr: {ros__parameters: {brake_after: 9.0}}",
            ": /robot_plannr: no node is called that; did you mean robot_planner?",
        ),
        (
            "/**/simulater: {ros__parameters: {steps: 3}}",
            ": /**/simulater: no node is called that; did you mean simulator?",
        ),
        (
            "simulator: {ros__parameters: {odom_timout: 1.0}}",
            ": /simulator: no node has a parameter odom_timout; did you mean odom_timeout?",
        ),
        (
            "simulator: {ros__parameters: {deadline: 1.0}}",
            ": /simulator: no node has a parameter deadline: it must be one of external, ",
        ),
        (
            "/**/simulator: {ros__parameters: {deadline: 1.0}}",
            ": /**/simulator: no node has a parameter deadline: it must be one of external, ",
        ),
        (
            "/**: {ros__parameters: {odom: {timeout: 1.0}}}",
            ": /**: no node has a parameter odom.timeout; did you mean odom_timeout?",
        ),
        (
            "/*: {ros__parameters: {wings: 2}}",
            ": /*: no node has a parameter wings: it must be one of brake_after, ",
        ),
        (
            "controller_server: {ros__parameters: {a: 1}}",
            ": has no effect: it is for /controller_server; ",
        ),
        (
            "/demo/simulator: {ros__parameters: {steps: 1}}",
            ": has no effect: it is for /demo/simulator; ",
        ),
        ("demo: {simulator: {ros__parameters: {steps: 1}}}", "for /demo/simulator; "),
        ("3", ": must contain a mapping of nodes"),
    ],
)
@pytest.mark.parametrize("nodes", [run(), [one("simulator")]], ids=["run", "single"])
def test_files_with_unknown_names_are_refused(
    text: str, message: str, nodes: list[NodeInterface], tmp_path: Path
) -> None:
    words = file_with(tmp_path, text)
    with pytest.raises(RosArgsError) as caught:
        check_effect(words, nodes)
    assert str(caught.value).startswith(f"--params-file {words[1]}: ")
    assert message in str(caught.value)


def test_a_section_without_the_namespace_of_the_run_is_refused(tmp_path: Path) -> None:
    words = file_with(tmp_path, "simulator: {ros__parameters: {steps: 3}}")
    with pytest.raises(RosArgsError, match=r"did you mean /demo/simulator\?$"):
        check_effect(words, run("/demo"))


def test_a_pipe_is_left_to_ros(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert check_effect(["--params-file", str(pipe)], run()) == []


@pytest.mark.parametrize("text", ["# nothing yet\n", "{}", "simulator: {ros__parameters: {}}"])
def test_a_file_without_parameters_is_fine_and_reported(text: str, tmp_path: Path) -> None:
    words = file_with(tmp_path, text)
    assert check_effect(words, run()) == [f"--params-file {words[1]}: contains no parameters"]


PATTERNS = [
    *("simulator", "/simulator", "/**", "**", "/*", "*", "/**/simulator", "/*/simulator"),
    *("*/simulator", "/demo/simulator", "demo/simulator", "/demo/**", "/demo/*", "/*/*"),
    *("/a/b/simulator", "/**/demo/simulator", "/a/*/simulator", "/a/**/simulator", "/a/**"),
]


@pytest.mark.parametrize("namespace", ["/", "/demo", "/a/b"])
def test_sections_apply_to_the_nodes_that_ros_applies_them_to(
    namespace: str, tmp_path: Path
) -> None:
    domain, applied = free_domain(), {True: 0, False: 0}
    for pattern in PATTERNS:
        words = file_with(tmp_path, f'"{pattern}": {{ros__parameters: {{a: {{b: 1, c.d: 2}}}}}}')
        context: Any = rclpy.Context()
        rclpy.init(
            args=["--ros-args", "-r", f"__ns:={namespace}", *words],
            context=context,
            domain_id=domain,
        )
        node = Node("simulator", context=context, start_parameter_services=False)
        given = set(node._parameter_overrides)
        name = node.get_fully_qualified_name()
        node.destroy_node()
        context.try_shutdown()
        (section,) = sections(Path(words[1]))
        assert section.is_for(name) == bool(given), pattern
        assert not given or given == set(section.parameters)
        applied[bool(given)] += 1
    assert min(applied.values()) > 3
