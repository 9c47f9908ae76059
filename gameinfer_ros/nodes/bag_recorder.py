"""Records a run in a bag."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from shutil import copyfile
from threading import Event, Thread
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.rosbag2.storage_mcap import McapWriter
from rosbags.typesys import Stores, get_typestore
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory
from visualization_msgs.msg import MarkerArray

from gameinfer_ros.bags import unfinished as unfinished_bag
from gameinfer_ros.bags.label import SCENARIO_FILE, BagLabel
from gameinfer_ros.games import ROBOT
from gameinfer_ros.scenario import Scenario
from msg_adapters import qos

#: What has arrived is on its way to the disk after so long, in s.
FLUSH = 1.0

#: Others may hear of our subscriptions this much later than we of their publishers, in s; until
#: then, some publish nothing, because nobody seems to listen.
SETTLE = 0.5

#: When nothing has arrived for so long after the nodes have ended, in s, all has.
QUIET = 0.5

#: Nothing more is recorded so long after the nodes have ended, in s, whoever else still publishes.
END = 5.0


class BagRecorder(Node):
    """Records every topic of a run in a rosbag2 bag with MCAP storage, as the messages arrive.

    It works in a thread of its own, where no Ctrl-C can interrupt it while it writes. Every second
    it hands over what has arrived to the system: no more is lost if it is killed.

    Subscribers, with a longer queue than the profile says:
        run_start (builtin_interfaces/Time, `LATEST`)
        <player>/control (trajectory_msgs/MultiDOFJointTrajectory, `LATEST`): one for each player
            that is simulated, and the robot.
        <player>/odom (nav_msgs/Odometry, `RECENT`, or `SENSOR` if external): one for each player.
        <robot>/cmd_vel (geometry_msgs/TwistStamped, `COMMAND`)
        robot_strategy (std_msgs/Float64MultiArray, `RECENT`)
        map_strategy (std_msgs/Float64MultiArray, `RECENT`)
        map_equilibrium (trajectory_msgs/MultiDOFJointTrajectory, `RECENT`)
        belief (std_msgs/Float64MultiArray, `STREAM`)
        markers (visualization_msgs/MarkerArray, `RECENT`)
        /diagnostics (diagnostic_msgs/DiagnosticArray, `DIAGNOSTICS`)
        /clock (rosgraph_msgs/Clock, `CLOCK`)
        joint_state (sensor_msgs/MultiDOFJointState, `STREAM`): once it hears all others.
            A simulator that waits for this subscriber starts when nothing can be missed.

    Args:
        folder: where the bag goes; it does not exist yet or is empty.
        scenario_file: file of the scenario that is played; the bag gets a copy.
        label: what the bag is to say of the run; namespace and topics are filled in.
        name: name of the node.
        node_options: passed on to `rclpy.node.Node`.

    Attributes:
        failure: why the bag could not be written to the end; None if nothing went wrong.
        lost: messages that were published but did not arrive, by topic.

    Raises:
        OSError: the bag cannot be made.
    """

    def __init__(
        self,
        folder: Path,
        scenario_file: Path,
        label: BagLabel,
        name: str = "bag_recorder",
        **node_options: Any,
    ) -> None:
        super().__init__(name, **node_options)
        self.failure: Exception | None = None
        self.lost: Counter[str] = Counter()
        self._label = label
        self._types = get_typestore(Stores.ROS2_JAZZY)
        self._connections: dict[str, Connection] = {}
        self._newest: Counter[str] = Counter()
        self._topics: dict[str, Subscription] = {}
        self._last_arrival = 0.0
        self._incomplete = time.monotonic()  # when somebody was last not heard yet
        self._end = 0.0  # counts when closing begins
        self._ends = Event()
        self._thread = Thread(target=self._record, name=name, daemon=True)

        folder = folder.resolve()
        if folder.exists():
            folder.rmdir()  # it is empty; the writer insists on making it
        self._writer = Writer(
            folder, version=Writer.VERSION_LATEST, storage_plugin=StoragePlugin.MCAP
        )
        self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._writer.open()
        copyfile(scenario_file, folder / SCENARIO_FILE)

        self._subscribe(Time, "run_start", qos.LATEST)
        players = Scenario.load(scenario_file).game.players.names
        for i, player in enumerate(players):
            external = player in label.external
            if i == ROBOT or not external:
                self._subscribe(MultiDOFJointTrajectory, f"{player}/control", qos.LATEST)
            self._subscribe(Odometry, f"{player}/odom", qos.SENSOR if external else qos.RECENT)
        self._subscribe(TwistStamped, f"{players[ROBOT]}/cmd_vel", qos.COMMAND)
        self._subscribe(Float64MultiArray, "robot_strategy", qos.RECENT)
        self._subscribe(Float64MultiArray, "map_strategy", qos.RECENT)
        self._subscribe(MultiDOFJointTrajectory, "map_equilibrium", qos.RECENT)
        self._subscribe(Float64MultiArray, "belief", qos.STREAM)
        self._subscribe(MarkerArray, "markers", qos.RECENT)
        # Every node has one of these, and one of /diagnostics that it made before.
        self._expected = tuple(self._topics)
        #: Topics that nodes of others publish too, or alone.
        self._shared = {"/diagnostics", "/clock", *(f"{p}/odom" for p in label.external)}
        self._subscribe(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
        self._subscribe(Clock, "/clock", qos.CLOCK)
        unfinished_bag.mark(folder, self._custom_data())

    def start(self) -> None:
        """Record from now on."""
        self._thread.start()

    def close(self) -> None:
        """Write what still arrives of nodes that have ended, for `END` at most; close the bag."""
        self._last_arrival = time.monotonic()
        self._end = self._last_arrival + END
        self._ends.set()
        self._thread.join()

    @property
    def messages(self) -> int:
        """Number of messages recorded so far."""
        return sum(self._writer.counts.values())

    def _subscribe(self, message_type: Any, topic: str, profile: QoSProfile) -> None:
        self._topics[topic] = self.create_subscription(
            message_type,
            topic,
            partial(self._on_message, message_type, topic, profile),
            qos.queued(profile),
            raw=True,
        )

    def _on_message(
        self,
        message_type: Any,
        topic: str,
        profile: QoSProfile,
        data: bytes,
        info: Mapping[str, int],
    ) -> None:
        if topic not in self._shared:  # others go on when this run has ended
            self._last_arrival = time.monotonic()
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                self._topics[topic].topic_name,
                f"{message_type.__module__.split('.')[0]}/msg/{message_type.__name__}",
                typestore=self._types,
                offered_qos_profiles=[_offered(profile)],
            )
        # Some middlewares leave times out, as 0.
        arrival = info["received_timestamp"] or info["source_timestamp"] or time.time_ns()
        self._writer.write(self._connections[topic], arrival, data)
        self._check_whole(topic, info["publication_sequence_number"])

    def _check_whole(self, topic: str, number: int | None) -> None:
        """Find gaps in the numbers that one publisher gives to its messages, from 1 on."""
        if number is None or topic in self._shared:
            return  # of many publishers, or best effort
        expected = self._newest[topic] + 1
        self._newest[topic] = number
        if number > expected:
            self.lost[topic] += number - expected
            self.get_logger().error(
                f"{self.lost[topic]} published on {topic} did not arrive: the bag is not whole"
            )

    def _record(self) -> None:
        executor = SingleThreadedExecutor(context=self.context)
        executor.add_node(self)
        last_flush = time.monotonic()
        try:
            while not self._ends.is_set() or time.monotonic() < self._quiet_at:
                # No timer: with simulated time, it would wait for a simulator that waits for us.
                if "joint_state" not in self._topics and self._hears_all_others():
                    self._subscribe(MultiDOFJointState, "joint_state", qos.STREAM)
                executor.spin_once(timeout_sec=0.1)
                if time.monotonic() > last_flush + FLUSH:
                    self._flush()
                    last_flush = time.monotonic()
            self._close()
        except Exception as error:  # whatever it is, the run must learn of it
            self.failure = error
            with suppress(Exception):  # as a full disk, again
                self._writer.abort()

    @property
    def _quiet_at(self) -> float:
        return min(self._last_arrival + QUIET, self._end)

    def _hears_all_others(self) -> bool:
        if not all(self._topics[topic].get_publisher_count() for topic in self._expected):
            self._incomplete = time.monotonic()
        return time.monotonic() > self._incomplete + SETTLE

    def _flush(self) -> None:
        """Hand over to the system what has arrived, so that it stays when we are killed."""
        storage = self._writer.storage
        assert isinstance(storage, McapWriter)
        if storage.chunk.msgs:
            storage.close_chunk()
            storage.bio.flush()

    def _close(self) -> None:
        for key, value in self._custom_data().items():
            self._writer.set_custom_data(key, value)
        self._writer.close()
        unfinished_bag.unmark(self._writer.path)

    def _custom_data(self) -> dict[str, str]:
        topics = {name: self.resolve_topic_name(name) for name in (*self._topics, "joint_state")}
        label = replace(self._label, namespace=self.get_namespace(), topics=topics)
        return replace(label, lost=dict(self.lost)).encode()


def _offered(profile: QoSProfile) -> Qos:
    """The profile in the terms of the bag."""
    unlimited = QosTime(9223372036, 854775807)
    return Qos(
        QosHistory[profile.history.name],
        profile.depth,
        QosReliability[profile.reliability.name],
        QosDurability[profile.durability.name],
        unlimited,
        unlimited,
        QosLiveliness.AUTOMATIC,
        unlimited,
        False,
    )
