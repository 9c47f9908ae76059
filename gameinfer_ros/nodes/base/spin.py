"""Initialisation of rclpy, and the main function of node executables."""

import os
import re
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import closing
from types import FrameType
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions

from gameinfer_ros.names import ros_args
from gameinfer_ros.names.text import shorten
from gameinfer_ros.nodes.base import middleware
from gameinfer_ros.nodes.base.argument_form import check_form
from gameinfer_ros.nodes.base.parameter_node import ParameterError, ParameterNode
from gameinfer_ros.nodes.base.params_file import check_files
from gameinfer_ros.nodes.base.ros_names import RosArgsError, check_names
from gameinfer_ros.scenario import ScenarioError
from gameinfer_ros.system import closed_terminal, lifeline
from gameinfer_ros.system.forced_end import ForcedEnd
from gameinfer_ros.system.interruption import handle_interrupts, interrupt

#: The highest domain ID with its own range of ports.
_LAST_DOMAIN = 232

#: Longest time that passes before a node notices a signal, in s.
_LOOK = 0.1

#: Longest time that a node takes to end, in s; more than a robot planner needs to stop its base,
#: with another publisher if need be.
END = 8.0

#: Environment variables by which ROS finds the folder of its logs, the first one that is set.
_LOG_FOLDERS = ("ROS_LOG_DIR", "ROS_HOME", "HOME")

#: Message without such a folder.
_NO_LOGS = "ROS cannot write its logs: {}; set ROS_LOG_DIR to a folder that you can write to"


def init(args: Sequence[str] | None = None, **options: Any) -> None:
    """Initialise rclpy with the defaults of `middleware`, and further `options` of `rclpy.init`.

    Raises:
        RosArgsError: an argument after --ros-args, a parameter file, or ROS_DOMAIN_ID is invalid,
            or the folder of ROS's own logs cannot be written.
        ScenarioError: the installation of the package is incomplete.
    """
    middleware.set_defaults()
    domain = os.environ.get("ROS_DOMAIN_ID", "")
    if domain and not (domain.isdecimal() and int(domain) <= _LAST_DOMAIN):
        allowed = f"it must be a whole number from 0 to {_LAST_DOMAIN}"
        raise RosArgsError(f"ROS_DOMAIN_ID: {shorten(domain, 50)} is not allowed: {allowed}")
    for_ros = ros_args.split(sys.argv if args is None else args)[1]
    check_form(for_ros)
    check_names(for_ros)
    check_files(for_ros)
    if not any(os.environ.get(name) for name in _LOG_FOLDERS):
        raise RosArgsError(_NO_LOGS.format(f"none of {', '.join(_LOG_FOLDERS)} is set"))
    try:
        rclpy.init(args=args, **options)
    except rclpy_implementation.RCLError as error:
        # Without the places in the sources of ROS.
        text = re.sub(r",? at /\S+:\d+", "", str(error)).removeprefix("failed to initialize rcl: ")
        text = " ".join(text.split())
        if "initialize logging" in text:
            raise RosArgsError(_NO_LOGS.format(text)) from None
        raise RosArgsError(f"--ros-args: {text}") from None


def spin(make_node: Callable[..., ParameterNode], args: list[str] | None = None) -> int:
    """Construct a node and spin it until it is shut down, or its parent process has ended.

    The node gets the words after `--ros-args` as `for_ros`.

    SIGINT, SIGTERM and SIGHUP end it after the callback that is being executed, so that the node
    can still publish while it is closed. This is the last that a process does: if it has not ended
    `END` seconds after the signal, or after the last callback, it is ended by force.

    Args:
        make_node: constructs the node.
        args: command line, in which other words than ROS arguments are refused. By default, that of
            this process, in which they are ignored.

    Returns:
        Exit code: 0 after a shutdown, 2 if arguments, parameters or the scenario are invalid.
    """
    interrupted, spinning = False, False
    end = ForcedEnd("the node")

    def on_signal(number: int, frame: FrameType | None) -> None:
        nonlocal interrupted
        interrupted = True
        if not spinning:  # construction may take long
            interrupt(number, frame)
        elif number == signal.SIGHUP:
            closed_terminal.leave()

    let_go = end.after_signals(END)
    try:
        # Everything is inside the `try`, because a signal may arrive during start-up too.
        lifeline.watch()
        handle_interrupts(on_signal)
        own, for_ros = ros_args.split(sys.argv[1:] if args is None else args)
        if own and args is not None:
            words = shorten(" ".join(own), 200)
            raise RosArgsError(f"{words}: is not allowed: write --ros-args -p NAME:=VALUE")
        init(args, signal_handler_options=SignalHandlerOptions.NO)
        with closing(make_node(for_ros=for_ros)) as node:
            spinning = True
            executor = SingleThreadedExecutor()
            executor.add_node(node)
            try:
                while not interrupted:
                    executor.spin_once(_LOOK)
            finally:
                if not end.pending:
                    end.within(END, "the node")
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (ScenarioError, ParameterError, RosArgsError) as error:
        print(error, file=sys.stderr)
        let_go()  # there is no node that could hang, and the process may go on
        return 2
    finally:
        spinning = True
        rclpy.try_shutdown()
    return 0
