"""A simulated person who walks straight ahead and gives way to no one.

A tracker of real people publishes the same: odometry in the frame `map`. In another terminal, start
`gameinfer run --external human_1`.
"""

import math
from contextlib import suppress

import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

START, HEADING, SPEED, RATE = (1.5, -2.6), math.radians(120), 0.6, 30  # m, rad, m/s, Hz


class Walker(Node):
    """Publishes the odometry of the person, who starts to walk when a run is active."""

    def __init__(self) -> None:
        super().__init__("walker")
        self.start_time = None
        self.odom = self.create_publisher(Odometry, "human_1/odom", 10)
        self.create_timer(1 / RATE, self.publish)

    def publish(self) -> None:
        """Publish the pose of the person, and the velocity in the person's own frame."""
        now = self.get_clock().now()
        if self.start_time is None and self.count_publishers("joint_state"):
            self.start_time = now
        walked = SPEED * (now - self.start_time).nanoseconds / 1e9 if self.start_time else 0.0
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
