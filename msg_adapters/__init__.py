"""Conversion between NumPy arrays and ROS messages, and the QoS profiles.

There is one module for each type of message. `encode` converts arrays to a message, and `decode` a
message to arrays. `decode` raises `MessageError` if the message is invalid; the error names the
field, its value and what is allowed.
"""

from msg_adapters.error import MessageError

__all__ = ["MessageError"]
