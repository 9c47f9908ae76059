"""A person who walks straight ahead and makes way for nobody: `gameinfer run --external human_1`.

Whoever is tracked looks like this: odometry in the frame `map`. Here the tracking is made up.
"""

import math
from contextlib import suppress

import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

START, HEADING, SPEED, RATE = (1.5, -2.6), math.radians(120), 0.6, 30  # m, rad, m/s, Hz


class Walker(Node):
    """Tells where the person is; it sets out as soon as there is a run."""

    def __init__(self) -> None:
        super().__init__("walker")
        self.set_out = None
        self.odom = self.create_publisher(Odometry, "human_1/odom", 10)
        self.create_timer(1 / RATE, self.tell)

    def tell(self) -> None:
        """Publish where the person is, and how fast it walks, in its own frame."""
        now = self.get_clock().now()
        if self.set_out is None and self.count_publishers("joint_state"):
            self.set_out = now
        walked = SPEED * (now - self.set_out).nanoseconds / 1e9 if self.set_out else 0.0
        message = Odometry()
        message.header.stamp = now.to_msg()
        message.header.frame_id, message.child_frame_id = "map", "human_1"
        message.pose.pose.position.x = START[0] + walked * math.cos(HEADING)
        message.pose.pose.position.y = START[1] + walked * math.sin(HEADING)
        message.pose.pose.orientation.z = math.sin(HEADING / 2)
        message.pose.pose.orientation.w = math.cos(HEADING / 2)
        message.twist.twist.linear.x = SPEED
        self.odom.publish(message)


if __name__ == "__main__":
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.init()
        rclpy.spin(Walker())
