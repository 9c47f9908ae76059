"""A base that does what it is told, as the robot of a scenario: cmd_vel in, odometry out.

A TurtleBot, a base in Gazebo or one behind Nav2's controller looks like this to gameinfer_ros.
Here it is made up. Start `gameinfer run --scenario two_player --external robot` beside it.
"""

import math
from contextlib import suppress
from time import monotonic

import rclpy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

RATE, TIMEOUT = 50, 0.5  # Hz; s after which a base stops that is told nothing more


class Base(Node):
    """Follows velocities, and tells where it is."""

    def __init__(self) -> None:
        super().__init__("base")
        self.x, self.y, self.yaw, self.v, self.omega = -3.0, 0.0, 0.0, 0.0, 0.0
        self.told = self.moved = monotonic()
        self.odom = self.create_publisher(Odometry, "robot/odom", 10)
        self.create_subscription(TwistStamped, "robot/cmd_vel", self.follow, 10)
        self.create_timer(1 / RATE, self.move)

    def follow(self, message: TwistStamped) -> None:
        """Take on a velocity."""
        self.v, self.omega = message.twist.linear.x, message.twist.angular.z
        self.told = monotonic()

    def move(self) -> None:
        """Move on, and publish where the base is."""
        seconds, self.moved = monotonic() - self.moved, monotonic()
        if self.moved - self.told > TIMEOUT:
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
