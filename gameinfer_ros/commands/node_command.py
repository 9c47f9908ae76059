"""The command line of a node, which takes only ROS arguments."""

from collections.abc import Sequence

from gameinfer_ros.commands.arguments.parser import Parser
from gameinfer_ros.names import ros_args
from gameinfer_ros.names.exit_codes import INTERRUPTED
from gameinfer_ros.nodes.table import NODES, class_of
from gameinfer_ros.system.load import load


def main(name: str, args: Sequence[str]) -> int:
    """Run a node of the table, and return its exit code."""
    parser = Parser(
        prog=name,
        usage=f"{name} [-h] [--ros-args ...]",
        description=f"{NODES[name]}\n\nParameters and remappings follow --ros-args.",
        examples=(f"{name} --ros-args -p scenario:=two_player",),
    )
    own, _ = ros_args.split(args)
    try:
        parser.parse_args(own)
        load(f"gameinfer_ros.nodes.{name}")
        return int(load("gameinfer_ros.nodes.base.spin").spin(class_of(name)))
    except KeyboardInterrupt:
        return INTERRUPTED
