"""Repeats the first message of a topic, far too often: `stranger.py TOPIC RATE`.

Inputs it sends in its own name, by which who watches tells them from the planner's. Nodes do not
look at that.
"""

from __future__ import annotations

import signal
import sys
import time

import rclpy
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.base import middleware
from msg_adapters import qos

TOPICS = {
    "joint_state": (MultiDOFJointState, qos.STREAM),
    "robot_strategy": (Float64MultiArray, qos.RECENT),
    "robot/control": (MultiDOFJointTrajectory, qos.LATEST),
    "belief": (Float64MultiArray, qos.STREAM),
    "map_equilibrium": (MultiDOFJointTrajectory, qos.RECENT),
}


def main() -> None:
    """Flood a topic until Ctrl-C; then print the number of messages."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have had it ignored
    topic, rate = sys.argv[1], float(sys.argv[2])
    message_type, profile = TOPICS[topic]
    middleware.set_defaults()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node, heard = rclpy.create_node("stranger"), list[bytes]()
    listener = node.create_subscription(message_type, topic, heard.append, profile, raw=True)
    while not heard:
        rclpy.spin_once(node)
    node.destroy_subscription(listener)
    data = heard[0]
    if message_type is MultiDOFJointTrajectory and topic.endswith("/control"):
        message = deserialize_message(data, message_type)
        message.header.frame_id = node.get_name()
        data = serialize_message(message)
    publisher = node.create_publisher(message_type, topic, profile)
    print("begins", flush=True)
    sent, begin = 0, time.monotonic()
    try:
        while True:
            publisher.publish(data)
            sent += 1
            time.sleep(max(0.0, begin + sent / rate - time.monotonic()))
    except KeyboardInterrupt:
        node.destroy_node()
        print(sent, flush=True)
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
