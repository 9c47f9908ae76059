"""What the tests of the adapters share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import settings
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_typestore
from world import make_world, world

__all__ = ["make_world", "world"]

# The same examples on every machine.
settings.register_profile("reproducible", derandomize=True)
settings.load_profile("reproducible")

OverTheWire = Callable[[Any], Any]


@pytest.fixture(scope="session", params=["rclpy", "rosbags"])
def over_the_wire(request: pytest.FixtureRequest) -> OverTheWire:
    """What arrives of a message: the bytes that DDS carries, read by rclpy or from a bag."""
    types = get_typestore(Stores.ROS2_JAZZY)

    def send(message: Any) -> Any:
        data, kind = serialize_message(message), type(message)
        if request.param == "rclpy":
            return deserialize_message(data, kind)
        package = kind.__module__.partition(".")[0]
        return types.deserialize_cdr(data, f"{package}/msg/{kind.__name__}")

    return send
