"""The node that replays recorded states in place of the simulator."""

from typing import Any

from builtin_interfaces.msg import Time
from rclpy.node import Node
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray

from msg_adapters import qos, stamp


class Replayer(Node):
    """Publishes recorded states one by one, and stores the beliefs that result in `beliefs`.

    Subscribers:
        belief (std_msgs/Float64MultiArray, `STREAM`)

    Publishers:
        run_start (builtin_interfaces/Time, `LATEST`): `start`, in ns.
        joint_state (sensor_msgs/MultiDOFJointState, `STREAM`)
    """

    def __init__(self, start: int, name: str = "replayer", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self.beliefs: list[Float64MultiArray] = []
        self.create_publisher(Time, "run_start", qos.LATEST).publish(stamp.encode(start))
        self._states = self.create_publisher(MultiDOFJointState, "joint_state", qos.STREAM)
        self.create_subscription(Float64MultiArray, "belief", self.beliefs.append, qos.STREAM)

    @property
    def alone(self) -> bool:
        """Whether no other node publishes states, and at most one publishes beliefs."""
        return bool(
            self.count_publishers("joint_state") <= 1 and self.count_publishers("belief") <= 1
        )

    def publish(self, state: bytes) -> None:
        """Publish a serialized state unchanged."""
        self._states.publish(state)
