"""The node that records a run in a bag."""

import time
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
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
from gameinfer_ros.runs.folder import lock
from gameinfer_ros.scenario import Scenario
from msg_adapters import qos

#: Period at which received messages are passed to the operating system, in s.
FLUSH = 1.0

#: Other nodes may discover these subscriptions this much later than this node discovers their
#: publishers, in s. Until then, topics that are published on demand stay silent.
SETTLE = 0.5

#: After the nodes have ended, recording stops when nothing arrives for this time, in s.
QUIET = 0.5

#: After the nodes have ended, recording stops after this time at the latest, in s.
END = 5.0


class BagRecorder(Node):
    """Records all topics of a run in a rosbag2 bag with MCAP storage.

    It runs in its own thread, so that Ctrl-C cannot interrupt a write. Received messages are passed
    to the operating system every second; a kill loses no more than that.

    Subscribers, with a longer queue than the profile:
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
        /diagnostics (diagnostic_msgs/DiagnosticArray, `ANY_DIAGNOSTICS`)
        /clock (rosgraph_msgs/Clock, `CLOCK`)
        joint_state (sensor_msgs/MultiDOFJointState, `STREAM`): after all other publishers have been
            discovered. A simulator that waits for this subscriber starts when no message can be
            missed.

    Args:
        folder: folder of the bag. It must not exist or be empty.
        scenario_file: scenario file of the run, copied into the bag.
        label: settings of the run. The recorder fills in the namespace and the topics.
        name: name of the node.
        node_options: passed to `rclpy.node.Node`.

    Attributes:
        failure: why writing the bag failed; None if it did not.
        lost: number of published messages that did not arrive, by topic.

    Raises:
        OSError: the bag cannot be created.
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
        self._incomplete = time.monotonic()  # when a publisher was last found missing
        self._end = 0.0  # set by close
        self._ends = Event()
        self._thread = Thread(target=self._record, name=name, daemon=True)

        folder = folder.resolve()
        if folder.exists():
            folder.rmdir()  # the writer requires that it does not exist
        self._writer = Writer(
            folder, version=Writer.VERSION_LATEST, storage_plugin=StoragePlugin.MCAP
        )
        self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._writer.open()
        self._unlock = lock(folder, "--record")
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
        # Each node has a publisher of one of these, created after that of /diagnostics.
        self._expected = tuple(self._topics)
        #: Topics that nodes outside the run may publish.
        self._shared = {"/diagnostics", "/clock", *(f"{p}/odom" for p in label.external)}
        self._subscribe(DiagnosticArray, "/diagnostics", qos.ANY_DIAGNOSTICS)
        self._subscribe(Clock, "/clock", qos.CLOCK)
        unfinished_bag.mark(folder, self._custom_data())

    def start(self) -> None:
        """Start recording."""
        self._thread.start()

    def close(self) -> None:
        """Record the last messages of nodes that have ended, for at most `END`; close the bag."""
        self._last_arrival = time.monotonic()
        self._end = self._last_arrival + END
        self._ends.set()
        self._thread.join()
        self._unlock()

    @property
    def size(self) -> int:
        """Size of the bag, in bytes."""
        return sum(path.stat().st_size for path in self._writer.path.glob("*"))

    @property
    def messages(self) -> int:
        """Number of recorded messages."""
        return sum(self._writer.counts.values())

    def _subscribe(self, message_type: Any, topic: str, profile: QoSProfile) -> None:
        type_name = f"{message_type.__module__.split('.')[0]}/msg/{message_type.__name__}"

        def receive(data: bytes, info: Mapping[str, int]) -> None:
            if topic not in self._shared:  # other publishers continue after this run
                self._last_arrival = time.monotonic()
            if topic not in self._connections:
                self._connections[topic] = self._writer.add_connection(
                    self._topics[topic].topic_name,
                    type_name,
                    typestore=self._types,
                    offered_qos_profiles=[_offered(profile)],
                )
            # Some middlewares set missing times to 0.
            arrival = info["received_timestamp"] or info["source_timestamp"] or time.time_ns()
            self._writer.write(self._connections[topic], arrival, data)
            self._check_whole(topic, info["publication_sequence_number"])

        self._topics[topic] = self.create_subscription(
            message_type, topic, receive, qos.queued(profile), raw=True
        )

    def _check_whole(self, topic: str, number: int | None) -> None:
        """Count gaps in the sequence numbers of a publisher, which start at 1."""
        if number is None or topic in self._shared:
            return  # the topic has several publishers, or is best effort
        expected = self._newest[topic] + 1
        self._newest[topic] = number
        if number > expected:
            self.lost[topic] += number - expected
            self.get_logger().error(
                f"{self.lost[topic]} messages on {topic} were lost: the bag is incomplete"
            )

    def _record(self) -> None:
        executor = SingleThreadedExecutor(context=self.context)
        executor.add_node(self)
        last_flush = time.monotonic()
        try:
            while not self._ends.is_set() or time.monotonic() < self._quiet_at:
                # A timer in simulated time would deadlock: the simulator waits for this subscriber.
                if "joint_state" not in self._topics and self._has_all_publishers():
                    self._subscribe(MultiDOFJointState, "joint_state", qos.STREAM)
                executor.spin_once(timeout_sec=0.1)
                if time.monotonic() > last_flush + FLUSH:
                    self._flush()
                    last_flush = time.monotonic()
            self._close()
        except Exception as error:  # the run reports it, whatever it is
            self.failure = error
            with suppress(Exception):  # the disk may be full
                self._writer.abort()

    @property
    def _quiet_at(self) -> float:
        return min(self._last_arrival + QUIET, self._end)

    def _has_all_publishers(self) -> bool:
        if not all(self._topics[topic].get_publisher_count() for topic in self._expected):
            self._incomplete = time.monotonic()
        return time.monotonic() > self._incomplete + SETTLE

    def _flush(self) -> None:
        """Pass received messages to the operating system, so that a kill does not lose them."""
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
    """Convert a profile to the type of rosbags."""
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
