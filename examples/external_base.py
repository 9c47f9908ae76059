"""A simulated base for the robot of a scenario: it subscribes to cmd_vel and publishes odometry.

A TurtleBot, or a base in Gazebo, has the same interface. In another terminal, start
`gameinfer run --scenario two_player --external robot`.
"""

import math
from contextlib import suppress
from time import monotonic

import rclpy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

RATE = 50  # Hz
TIMEOUT = 0.5  # s without a command after which the base stops


class Base(Node):
    """Executes velocity commands and publishes the odometry of the base."""

    def __init__(self) -> None:
        super().__init__("base")
        self.x, self.y, self.yaw, self.v, self.omega = -3.0, 0.0, 0.0, 0.0, 0.0
        self.last_command = self.last_move = monotonic()
        self.odom = self.create_publisher(Odometry, "robot/odom", 10)
        self.create_subscription(TwistStamped, "robot/cmd_vel", self.follow, 10)
        self.create_timer(1 / RATE, self.move)

    def follow(self, message: TwistStamped) -> None:
        """Store a velocity command."""
        self.v, self.omega = message.twist.linear.x, message.twist.angular.z
        self.last_command = monotonic()

    def move(self) -> None:
        """Move the base, and publish its odometry."""
        seconds, self.last_move = monotonic() - self.last_move, monotonic()
        if self.last_move - self.last_command > TIMEOUT:
            self.v = self.omega = 0.0
        self.x += self.v * seconds * math.cos(self.yaw)
        self.y += self.v * seconds * math.sin(self.yaw)
        self.yaw += self.omega * seconds
        message = Odometry()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id, message.child_frame_id = "map", "base_link"
        message.pose.pose.position.x, message.pose.pose.position.y = self.x, self.y
        message.pose.pose.orientation.z = math.sin(self.yaw / 2)
        message.pose.pose.orientation.w = math.cos(self.yaw / 2)
        message.twist.twist.linear.x, message.twist.twist.angular.z = self.v, self.omega
        self.odom.publish(message)


if __name__ == "__main__":
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.init()
        rclpy.spin(Base())
