"""What the tests of the adapters share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import settings
from rclpy.serialization import deserialize_message, serialize_message

# The same examples on every machine, however busy it is.
settings.register_profile("reproducible", derandomize=True, deadline=None)
settings.load_profile("reproducible")

OverTheWire = Callable[[Any], Any]


@pytest.fixture(scope="session")
def over_the_wire() -> OverTheWire:
    """What arrives of a message: the bytes that DDS carries, read again."""

    def send(message: Any) -> Any:
        return deserialize_message(serialize_message(message), type(message))

    return send
