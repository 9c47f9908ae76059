"""The ROS arguments of a run, which all its nodes get."""

from collections.abc import Sequence

from gameinfer_ros.names import ros_args
from gameinfer_ros.names.ros_args import NODE_NAMES
from gameinfer_ros.nodes.base.parameter_values import check_values
from gameinfer_ros.nodes.base.ros_names import RosArgsError
from gameinfer_ros.nodes.base.unused_arguments import check_effect, for_node
from gameinfer_ros.nodes.interface import NodeInterface

#: Parameters that a run and its nodes must agree on, and how to set them.
_AGREED = {
    **{name: f"in a run, write --{name}" for name in ("scenario", "time", "steps", "external")},
    **{name: "a run sets it itself" for name in ("subscribers", "player")},
}


def check_run_arguments(for_ros: Sequence[str], nodes: Sequence[NodeInterface]) -> list[str]:
    """Check the ROS arguments of a run, without `--ros-args`.

    Returns:
        Remarks on sections of parameter files for other nodes, to be shown to the user.

    Raises:
        RosArgsError: an argument has no effect or an ambiguous value, renames or moves a node away
            from the others, or sets a parameter that the run and its nodes must agree on.
    """
    for argument in ros_args.parse(for_ros):
        rule = ros_args.rule(argument)
        if rule is None:
            continue
        if rule.is_parameter and rule.name in _AGREED:
            why = _AGREED[rule.name]
        elif rule.is_special and rule.name in NODE_NAMES:
            why = "the names of the nodes of a run are fixed"
        elif rule.is_special and rule.node is not None:
            why = f"all nodes of a run share one namespace: write -r __ns:={rule.value}"
        else:
            continue
        raise RosArgsError(f"--ros-args: {argument}: is not allowed: {why}")
    remarks = check_effect(for_ros, nodes)
    for node in nodes:
        check_values(for_node(for_ros, node), node)
    return remarks
