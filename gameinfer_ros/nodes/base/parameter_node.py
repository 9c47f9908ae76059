"""Base class of nodes whose parameters have descriptions and constraints."""

import json
import math
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from gameinfer_ros.names.text import shorten

#: What rclpy raises if a value has another type or violates the limits.
_INVALID = InvalidParameterTypeException, InvalidParameterValueException


class ParameterError(ValueError):
    """The value of a parameter is invalid. The message names the parameter and allowed values."""


class ParameterNode(Node):
    """A node whose parameters have descriptions and constraints.

    Read-only parameters are set at start; later changes are refused. Live parameters can be set
    while the node runs.

    Raises:
        ParameterError: the value of a parameter of rclpy, such as `use_sim_time`, is invalid.
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        try:
            super().__init__(name, **node_options)
        except InvalidParameterTypeException as error:  # rclpy declares some, all booleans
            parameter = str(error).rpartition(": ")[2]
            given = self._parameter_overrides.get(parameter)
            raise _refusal(parameter, given, False) from None
        self._checks: dict[str, Callable[[Any], None]] = {}
        self._on_set: dict[str, Callable[[], None]] = {}
        self.add_pre_set_parameters_callback(self._with_doubles)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._on_parameters_set)

    def close(self) -> None:
        """Release what ROS does not; called when the node has been spun."""

    def declare(
        self,
        name: str,
        default: Any,
        description: str,
        limits: tuple[float, float] | None = None,
        choices: tuple[str, ...] = (),
    ) -> Any:
        """Declare a read-only parameter, and return its value. See also `declare_live`."""
        return self.declare_live(name, default, description, limits, choices, read_only=True)()

    def declare_live(
        self,
        name: str,
        default: Any,
        description: str,
        limits: tuple[float, float] | None = None,
        choices: tuple[str, ...] = (),
        check: Callable[[Any], None] = lambda value: None,
        on_set: Callable[[], None] = lambda: None,
        read_only: bool = False,
    ) -> Callable[[], Any]:
        """Declare a parameter that can be set while the node runs, unless it is `read_only`.

        Args:
            name: name of the parameter.
            default: default value; its type is that of the parameter.
            description: description of the parameter, also for the reference of nodes.
            limits: lowest and highest value of a number; None if there are none.
            choices: allowed values; empty if all are allowed.
            check: raises `ValueError` if a value is not allowed for another reason.
            on_set: called after each change.
            read_only: whether later changes are refused.

        Returns:
            A function that returns its present value.

        Raises:
            ParameterError: the value is of another type, not finite, not within the limits, not one
                of the choices, or refused by `check`.
        """
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

        def check_value(value: Any) -> None:
            if choices and value not in choices:
                allowed = ", ".join(choices)
                raise ValueError(f"{name}: '{value}' is not allowed: it must be one of {allowed}")
            check(value)

        given = self._parameter_overrides.get(name)
        try:
            if isinstance(default, float) and given is not None and _is_integer(given):
                value = self.declare_parameter(name, float(given.value), descriptor, True).value
            else:
                value = self.declare_parameter(name, default, descriptor).value
        except _INVALID:
            raise _refusal(name, given, default, limits) from None
        if value is None:  # an empty list, whose type is unknown
            raise _refusal(name, given, default, limits)
        try:
            check_value(value)
        except ValueError as error:
            raise ParameterError(str(error)) from None
        self._checks[name], self._on_set[name] = check_value, on_set
        return lambda: self.get_parameter(name).value

    def _with_doubles(self, parameters: list[Parameter]) -> list[Parameter]:
        """Convert integers for parameters that are doubles, as in `ros2 param set NODE NAME 1`."""
        return [
            Parameter(p.name, value=float(p.value))
            if _is_integer(p)
            and self.has_parameter(p.name)
            and self.get_parameter(p.name).type_ == Parameter.Type.DOUBLE
            else p
            for p in parameters
        ]

    def _check_parameters(self, parameters: list[Parameter]) -> SetParametersResult:
        try:
            for parameter in parameters:
                name, value = parameter.name, parameter.value
                if isinstance(value, float) and not math.isfinite(value):
                    raise ValueError(f"{name}: {value} is not allowed: it must be finite")
                if name in self._checks:
                    self._checks[name](value)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _on_parameters_set(self, parameters: list[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name in self._on_set:
                self.get_logger().info(f"parameter {parameter.name} set to {parameter.value}")
                self._on_set[parameter.name]()


def _refusal(
    name: str, given: Parameter | None, default: Any, limits: tuple[float, float] | None = None
) -> ParameterError:
    types = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}
    allowed = types[type(default)] + (f" from {limits[0]} to {limits[1]}" if limits else "")
    value = [] if given is None or given.value is None else given.value
    # As in YAML, so that numbers and text in quotes differ.
    shown = shorten(json.dumps(value, ensure_ascii=False, default=list), 80)
    return ParameterError(f"{name}: {shown} is not allowed: it must be {allowed}")


def _is_integer(parameter: Parameter) -> bool:
    return parameter.type_ == Parameter.Type.INTEGER
