"""Between NumPy arrays and ROS messages: one module a message, and the QoS profiles.

Every module has `encode`, from arrays to a message, and `decode`, from a message to arrays.
`decode` raises `MessageError` for whatever it cannot use; the message of that error names the
field, its value and what is allowed.
"""

from msg_adapters.error import MessageError

__all__ = ["MessageError"]
