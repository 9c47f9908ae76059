"""Values for parameters of nodes, by the service that sets them."""

from __future__ import annotations

from typing import Any

import numpy as np
from rcl_interfaces.msg import Parameter as Message
from rclpy.parameter import Parameter, parameter_value_to_python

VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 7, 10**6, 10**9, 2**62, -(2**63), 0.0, -0.0, 0.5, -1.0, 1e308,
    5e-324, float("nan"), float("inf"), float("-inf"), "", "map", "nobody", "x" * 10_000, "a\nb",
    "zoé 💥", b"\xff", [], [True], [1], [1.5], ["x"], [1, 2] * 500,
)  # fmt: skip

#: Parameters that rclpy itself declares.
NOT_OURS = ("use_sim_time", "start_type_description_service")


def names(node: Any) -> list[str]:
    return [name for name in node.get_parameters_by_prefix("") if name not in NOT_OURS]


def message(name: str, value: Any) -> Message:
    if value == b"\xff":
        value = [b"\xff"]
    if value == []:
        return Parameter(name, Parameter.Type.STRING_ARRAY, []).to_parameter_msg()
    return Parameter(name, value=value).to_parameter_msg()


def some(node: Any, rng: np.random.Generator) -> Message:
    """A request that may make no sense."""
    every = [*names(node), "nothing_like_it"]
    return message(every[int(rng.integers(len(every)))], VALUES[int(rng.integers(len(VALUES)))])


def values(node: Any) -> dict[str, Any]:
    return {name: node.get_parameter(name).value for name in names(node)}


def check(node: Any, request: Message, before: dict[str, Any], result: Any) -> str:
    """`accepted` or `rejected`: whether the answer is right and the node as it should be."""
    asked = parameter_value_to_python(request.value)
    if result.successful:
        assert values(node) == before | {request.name: asked}
        return "accepted"
    assert values(node) == before
    assert result.reason and len(result.reason) < 12_000
    return "rejected"
