"""Running one node as a process."""

from __future__ import annotations

import sys
from collections.abc import Callable

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

from gameinfer_ros.nodes.game_node import ParameterError
from gameinfer_ros.scenario import ScenarioError

#: What rclpy raises for arguments behind --ros-args that it does not understand.
ROS_ARGS_ERRORS = (
    rclpy_implementation.RCLInvalidROSArgsError,
    rclpy_implementation.UnknownROSArgsError,
)


def spin(make_node: Callable[[], Node], args: list[str] | None = None) -> int:
    """Construct a node and spin it until it is shut down.

    Returns:
        Exit code: 0 after a shutdown, 2 if arguments, parameters or the scenario cannot be used.
    """
    try:
        # Everything stands in the `try`: a signal may come at any time, also during start-up.
        rclpy.init(args=args)
        node = make_node()
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (ScenarioError, ParameterError, ParameterException, *ROS_ARGS_ERRORS) as error:
        print(error, file=sys.stderr)
        return 2
    finally:
        rclpy.try_shutdown()
    return 0
