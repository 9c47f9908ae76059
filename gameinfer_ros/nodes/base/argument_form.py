"""The form of ROS arguments."""

import re
from collections.abc import Iterable

from gameinfer_ros.names import ros_args
from gameinfer_ros.names.ros_args import SWITCHES, WITH_VALUE, Argument
from gameinfer_ros.names.text import did_you_mean
from gameinfer_ros.nodes.base.parameter_yaml import read
from gameinfer_ros.nodes.base.ros_names import LEVEL, RosArgsError

#: The levels of a logger; ROS ignores the case.
_LOG_LEVELS = ("debug", "info", "warn", "error", "fatal", "unset")


def check_form(for_ros: Iterable[str]) -> None:
    """Check the form of ROS arguments, without `--ros-args`, before ROS does.

    Raises:
        RosArgsError: a flag is unknown, or lacks its value, or its value has another form.
    """
    for argument in ros_args.parse(for_ros):
        why = _complaint(argument)
        if why:
            raise RosArgsError(f"--ros-args: {argument}: {why}")


def _complaint(argument: Argument) -> str:
    """Why an argument is refused; empty if it is not."""
    flag, value = argument.flag, argument.value
    if flag not in (*WITH_VALUE, *SWITCHES):
        hint = did_you_mean(flag, (*WITH_VALUE, *SWITCHES))
        return f"is unknown to ROS; put other arguments before --ros-args or after --{hint}"
    if value is None:
        return "requires a value" if flag in WITH_VALUE else ""
    if flag == "--log-level":
        return _of_log_level(value)
    if flag == "--log-config-file":
        return "is not allowed: the logger of ROS does not read such a file"
    return _of_rule(argument)


def _of_log_level(value: str) -> str:
    logger, assigned, level = value.rpartition(":=")
    if level.lower() in _LOG_LEVELS and (not assigned or re.fullmatch(r"[^\s:=~]+", logger)):
        return ""
    levels, hint = ", ".join(_LOG_LEVELS), did_you_mean(level.lower(), _LOG_LEVELS)
    hint = hint * (level.lower() not in _LOG_LEVELS)
    return f"is not allowed: it must be LEVEL or LOGGER:=LEVEL, with a level of {levels}{hint}"


def _of_rule(argument: Argument) -> str:
    rule = ros_args.rule(argument)
    if rule is None:
        return ""
    form = "NAME:=VALUE" if rule.is_parameter else "FROM:=TO"
    if (
        ":=" not in (argument.value or "")
        or not rule.name
        or (rule.is_parameter and not rule.value)
    ):
        return f"is not allowed: write {argument.flag} {form}"
    if rule.node is not None and not re.fullmatch(LEVEL, rule.node, re.ASCII):
        return (
            f"{rule.node} is not allowed: write {argument.flag} NODE:{form}, with the name of a "
            "node without slashes"
        )
    if rule.is_parameter:
        try:
            read(rule.value)
        except ValueError as error:
            return f"{rule.name} {error}"
    return ""
