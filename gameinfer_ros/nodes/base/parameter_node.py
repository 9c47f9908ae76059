"""Base class of nodes whose parameters have descriptions and constraints."""

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
    """The value of a parameter is invalid. The message names the parameter and allowed values."""


class ParameterNode(Node):
    """A node whose parameters have descriptions and constraints.

    Read-only parameters are set at start; later changes are refused. Live parameters can be set
    while the node runs.

    Args:
        name: name of the node.
        node_options: passed to `rclpy.node.Node`.
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self._choices: dict[str, tuple[str, ...]] = {}
        self._live: set[str] = set()
        self.add_on_set_parameters_callback(self._check_choices)
        self.add_post_set_parameters_callback(self._log_changes)

    def declare(
        self,
        name: str,
        default: Any,
        description: str,
        limits: tuple[float, float] | None = None,
        choices: tuple[str, ...] = (),
    ) -> Any:
        """Declare a read-only parameter.

        Args:
            name: name of the parameter.
            default: default value; its type is that of the parameter.
            description: description of the parameter.
            limits: lowest and highest value of a number; None if there are none.
            choices: allowed values; empty if all are allowed.

        Returns:
            Its value.

        Raises:
            ParameterError: the value is not finite or not one of the choices.
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
        """Declare a parameter that can be set while the node runs.

        Args:
            name: name of the parameter.
            default: default value; its type is that of the parameter.
            description: description of the parameter.
            limits: lowest and highest value of a number; None if there are none.
            choices: allowed values; empty if all are allowed.

        Returns:
            A function that returns its present value.

        Raises:
            ParameterError: the value is not finite or not one of the choices.
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

    def _log_changes(self, parameters: list[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name in self._live:
                self.get_logger().info(f"parameter {parameter.name} set to {parameter.value}")
