"""Nodes with parameters that say what they are for, and what is allowed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter


class ParameterError(ValueError):
    """A parameter has a value that is not allowed; the message names both, and what is allowed."""


class ParameterNode(Node):
    """A node whose parameters have descriptions and limits.

    Some are read-only: they are given when the node starts, and a later change is refused. The
    others, called live, count as soon as they are set.

    Args:
        name: name of the node.
        node_options: passed on to `rclpy.node.Node`.
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self._choices: dict[str, tuple[str, ...]] = {}
        self._live: set[str] = set()
        self.add_on_set_parameters_callback(self._check_choices)
        self.add_post_set_parameters_callback(self._tell_changes)

    def declare(
        self,
        name: str,
        default: Any,
        description: str,
        limits: tuple[float, float] | None = None,
        choices: tuple[str, ...] = (),
    ) -> Any:
        """Declare a read-only parameter and return its value.

        Raises:
            ParameterError: it has a value that is none of the choices, where there are some.
        """
        self._declare(name, default, description, limits, choices, read_only=True)
        return self.get_parameter(name).value

    def declare_live(
        self,
        name: str,
        default: Any,
        description: str,
        limits: tuple[float, float] | None = None,
        choices: tuple[str, ...] = (),
    ) -> Callable[[], Any]:
        """Declare a parameter that can change while the node runs; returns what tells its value.

        Raises:
            ParameterError: it has a value that is none of the choices, where there are some.
        """
        self._declare(name, default, description, limits, choices, read_only=False)
        self._live.add(name)
        return lambda: self.get_parameter(name).value

    def _declare(
        self,
        name: str,
        default: Any,
        description: str,
        limits: tuple[float, float] | None,
        choices: tuple[str, ...],
        read_only: bool,
    ) -> None:
        integers, doubles = [], []
        if limits is not None and isinstance(default, float):
            doubles = [FloatingPointRange(from_value=limits[0], to_value=limits[1])]
        elif limits is not None:
            integers = [IntegerRange(from_value=limits[0], to_value=limits[1], step=1)]
        descriptor = ParameterDescriptor(
            description=description,
            additional_constraints=f"one of {', '.join(choices)}" if choices else "",
            read_only=read_only,
            integer_range=integers,
            floating_point_range=doubles,
        )
        parameter = self.declare_parameter(name, default, descriptor)
        self._choices[name] = choices
        result = self._check_choices([parameter])
        if not result.successful:
            raise ParameterError(result.reason)

    def _check_choices(self, parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            if isinstance(parameter.value, float) and not math.isfinite(parameter.value):
                reason = f"{parameter.name}: {parameter.value} is not allowed: it must be finite"
                return SetParametersResult(successful=False, reason=reason)
            choices = self._choices.get(parameter.name)
            if choices and parameter.value not in choices:
                reason = (
                    f"{parameter.name}: '{parameter.value}' is not allowed: "
                    f"it must be one of {', '.join(choices)}"
                )
                return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def _tell_changes(self, parameters: list[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name in self._live:
                self.get_logger().info(f"parameter {parameter.name} is {parameter.value} now")
