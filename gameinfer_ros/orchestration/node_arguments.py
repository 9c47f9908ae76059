"""The ROS arguments of a run, which all its nodes get."""

from collections.abc import Sequence

from gameinfer_ros.names import ros_args
from gameinfer_ros.names.ros_args import NODE_NAMES
from gameinfer_ros.nodes.base.parameter_values import check_values, values
from gameinfer_ros.nodes.base.ros_names import RosArgsError
from gameinfer_ros.nodes.base.unused_arguments import check_effect, for_node
from gameinfer_ros.nodes.interface import NodeInterface

#: Parameters that a run sets for its nodes, and how to set them. Its results show its options, so
#: another value in a node would make them wrong.
SET_BY_RUN = {
    **{
        name: f"in a run, write --{name}"
        for name in ("scenario", "time", "steps", "external", "planner", "particles", "seed")
    },
    "planner_seed": "in a run, write --seed",
    "safety": "in a run, it is on unless you write --no-safety",
    "port": "in a run, write --view-port",
    "control": "in a run, write --control",
    **{name: "a run sets it itself" for name in ("subscribers", "player")},
}


def check_run_arguments(for_ros: Sequence[str], nodes: Sequence[NodeInterface]) -> list[str]:
    """Check the ROS arguments of a run, without `--ros-args`.

    Returns:
        Remarks on sections of parameter files for other nodes, to be shown to the user.

    Raises:
        RosArgsError: an argument has no effect or an ambiguous value, renames or moves a node away
            from the others, or sets a parameter that the run itself sets, also in a file.
    """
    for argument in ros_args.parse(for_ros):
        for node in nodes:
            for section, name, _ in values(argument, node):
                if name in SET_BY_RUN and name in node.parameters:
                    what = f"--ros-args: {argument}"
                    if argument.flag == "--params-file":
                        what = f"{argument}: {section}: {name}"
                    raise RosArgsError(f"{what}: is not allowed: {SET_BY_RUN[name]}")
        rule = ros_args.rule(argument)
        if rule is None or not rule.is_special:
            continue
        if rule.name in NODE_NAMES:
            why = "the names of the nodes of a run are fixed"
        elif rule.node is not None:
            why = f"all nodes of a run share one namespace: write -r __ns:={rule.value}"
        else:
            continue
        raise RosArgsError(f"--ros-args: {argument}: is not allowed: {why}")
    remarks = check_effect(for_ros, nodes)
    for node in nodes:
        check_values(for_node(for_ros, node), node)
    return remarks
