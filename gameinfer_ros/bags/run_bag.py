"""Bags of recorded runs."""

from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from gameinfer_ros.bags import unfinished as unfinished_bag
from gameinfer_ros.bags.label import SCENARIO_FILE, BagLabel
from gameinfer_ros.names.text import shorten
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.runs.run_clock import RunClock
from gameinfer_ros.scenario import Scenario
from msg_adapters import MessageError, belief, diagnostics, joint_state, stamp

#: Topics that a record is built from.
_READ = ("run_start", "joint_state", "belief", "/diagnostics")


class BagError(ValueError):
    """A bag is invalid. The message names the bag, the problem, and what is expected."""


class RunBag:
    """Reads a bag written by `gameinfer run --record`, without ROS.

    If the run was restarted during the recording, the bag contains several runs, and the last one
    is read. If the recording was cut off or is still running, what has been written is read.

    Attributes:
        folder: folder of the bag.
        label: label of the bag.
        scenario_file: scenario file of the run.
        scenario: the scenario.
        counts: number of messages by topic, without empty topics.
        seconds: time between the first and the last message, in s.
        finished: whether the recording was completed.

    Raises:
        BagError: the folder does not exist or is not the bag of a run. Later, any method raises it
            if the bag is damaged, or older than `run_start`.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._types = get_typestore(Stores.ROS2_JAZZY)
        try:
            _check_plain(folder)
            self.finished = not unfinished_bag.is_unfinished(folder)
            if self.finished and not (folder / "metadata.yaml").exists():
                raise ValueError("metadata.yaml does not exist there")
            if self.finished:
                self._open()
            else:
                self._salvage()
            self.scenario_file = folder / SCENARIO_FILE
            self.scenario = Scenario.load(self.scenario_file)
        except Exception as error:  # any kind: see _reading
            raise BagError(
                f"{folder}: cannot be read as the bag of a run: {_words(error)}"
            ) from None

    def _open(self) -> None:
        with Reader(self.folder) as reader:
            self.label = BagLabel.decode(reader.storage.metadata.custom or {})
            self.counts = {c.topic: c.msgcount for c in reader.connections if c.msgcount}
            self.seconds = max(0, reader.duration - 1) / stamp.SECOND

    def _salvage(self) -> None:
        self.label = BagLabel.decode(unfinished_bag.custom_data(self.folder))
        read = {self.label.topics.get(name) for name in _READ}
        self._salvaged: defaultdict[str | None, list[tuple[str, bytes]]] = defaultdict(list)
        counts, times = Counter[str](), []
        for message in unfinished_bag.messages(self.folder):
            counts[message.topic] += 1
            times.append(message.time)
            if message.topic in read:
                self._salvaged[message.topic].append((message.message_type, message.data))
        self.counts = dict(counts)
        self.seconds = (max(times) - min(times)) / stamp.SECOND if times else 0

    def _messages(self, topic: str) -> Iterator[tuple[str, bytes]]:
        """Yield type and serialized data of each message on a topic, in order of arrival."""
        name = self.label.topics.get(topic)
        if not self.finished:
            yield from self._salvaged[name]
            return
        with Reader(self.folder) as reader:
            wanted = [c for c in reader.connections if c.topic == name]
            if wanted:  # an empty list would select all connections
                for connection, _, data in reader.messages(wanted):
                    yield connection.msgtype, bytes(data)

    @contextmanager
    def _reading(self) -> Iterator[None]:
        """Raise `BagError` instead of any other error of a block that reads messages."""
        # Readers, decompressors and types trust a file. If it was changed, they can raise anything.
        try:
            yield
        except BagError:
            raise
        except Exception as error:
            raise BagError(f"{self.folder}: is damaged: {_words(error)}") from None

    def serialized(self, topic: str) -> dict[int, bytes]:
        """Return the serialized messages `joint_state` or `belief` of the last run, by step."""
        with self._reading():
            found = {step: data for step, _, data in self._of_last_run(topic)}
        return dict(sorted(found.items()))

    @cached_property
    def starts(self) -> list[int]:
        """Start of each run in the bag, in ns, in order of arrival."""
        with self._reading():
            found = [stamp.decode(message) for message, _ in self._decoded("run_start")]
            if not found and any(self._messages("joint_state")):
                raise BagError(
                    f"{self.folder}: run_start: has no message, but joint_state has some: bags of "
                    "an earlier version must be recorded again"
                )
        return list(dict.fromkeys(found))

    @property
    def runs(self) -> int:
        """Number of runs in the bag."""
        return len(self.starts)

    @cached_property
    def clock(self) -> RunClock:
        """Clock of the last run, which converts between stamps and steps."""
        clock = RunClock(self.scenario.dt)
        clock.start = self.starts[-1] if self.starts else None
        return clock

    def record(self) -> RunRecord:
        """Return the record of the last run: states, inputs, beliefs and figures.

        Raises:
            BagError: the bag is damaged, a message does not match the scenario, a state is
                duplicated, or too many states are missing (with external players; otherwise any).
        """
        record = RunRecord(self.scenario.vehicles)
        with self._reading():
            self._read_states(record)
            self._read_beliefs(record)
            self._read_diagnostics(record)
        return record

    def _decoded(self, topic: str) -> Iterator[tuple[Any, bytes]]:
        for message_type, data in self._messages(topic):
            yield self._types.deserialize_cdr(data, message_type), data

    def _of_last_run(self, topic: str) -> Iterator[tuple[int, Any, bytes]]:
        """Yield step, content and serialized data of each message of the last run on a topic."""
        scenario = self.scenario
        for message, data in self._decoded(topic):
            content: joint_state.JointState | belief.BeliefSummary
            if topic == "joint_state":
                content = joint_state.decode(message, scenario.vehicles.joint_names)
            else:
                content = belief.decode(message, len(scenario.game.players))
            try:
                step = self.clock.step(content.stamp)
            except MessageError:
                continue  # of another run
            yield step, content, data

    def _read_states(self, record: RunRecord) -> None:
        vehicles = self.scenario.vehicles
        near = self.scenario.initial_vehicle_state
        states = [(step, state) for step, state, _ in self._of_last_run("joint_state")]
        # Messages may be out of order, because the system time may have been set back meanwhile.
        for step, state in sorted(states, key=lambda pair: pair[0]):
            if step < len(record.states):
                raise ValueError(
                    f"joint_state: there are several states of step {step}; only one is allowed"
                )
            if step != len(record.states) and not self.label.external:
                raise ValueError(
                    f"joint_state: the state of step {len(record.states)} is missing: "
                    f"the next one is of step {step}"
                )
            near = vehicles.unwrap(vehicles.state(state.poses, state.twists), near)
            try:
                record.add_state(step, near, vehicles.input(state.twists, state.accelerations))
            except ValueError as error:  # the file is not damaged
                raise BagError(f"{self.folder}: joint_state: {error}") from None

    def _read_beliefs(self, record: RunRecord) -> None:
        for step, summary, _ in self._of_last_run("belief"):
            record.beliefs[step] = summary.probabilities
            record.maps[step] = summary.map

    def _read_diagnostics(self, record: RunRecord) -> None:
        namespace = self.label.namespace.rstrip("/")
        names = ("simulator", "robot_planner", "inference")
        simulator, robot, inference = (f"{namespace}/{name}" for name in names)
        solve_ms: dict[int, float] = {}
        for message, _ in self._decoded("/diagnostics"):
            for status in diagnostics.decode(message):
                # All robots share the topic.
                of_run = status.name in (simulator, robot, inference)
                if not of_run or status.values.get("run") != self.clock.run:
                    continue
                step = diagnostics.whole_number(status, "step")
                late = diagnostics.whole_number(status, "late_steps")
                ms = diagnostics.number(status, "solve_ms")
                if status.name == simulator and late is not None:
                    record.late_steps = late
                if status.name == robot and step is not None:
                    _read_safety(status, step, record)
                if status.name == inference and step is not None and ms is not None:
                    solve_ms[step] = ms
        record.step_ms = list(solve_ms.values())


def _read_safety(status: diagnostics.NodeStatus, step: int, record: RunRecord) -> None:
    """Store how often the safety layer has acted until a step of the record."""
    if status.values.get("safety", "off") != "off" and step < record.steps:
        record.safety_braked = diagnostics.whole_number(status, "safety_braked")
        record.safety_limited = diagnostics.whole_number(status, "safety_limited")


def _check_plain(folder: Path) -> None:
    """Raise `ValueError` unless a bag has only regular files and folders: a pipe could block."""
    for path in folder.iterdir() if folder.is_dir() else ():
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise ValueError(f"{path.name} is not a regular file")


def _words(error: Exception) -> str:
    return shorten(str(error) or type(error).__name__, 500)
