"""A bag that holds one run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from gameinfer_ros.bags import unfinished as unfinished_bag
from gameinfer_ros.bags.label import SCENARIO_FILE, BagLabel
from gameinfer_ros.games import heading
from gameinfer_ros.names.text import shorten
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.scenario import Scenario

_NANOSECONDS = 1_000_000_000
#: Topics that a record is made of.
_READ = ("joint_state", "belief", "/diagnostics")


class BagError(ValueError):
    """A bag cannot be used; the message names it, what is wrong with it, and what is needed."""


class RunBag:
    """Reads a bag that `gameinfer run --record` wrote; needs no ROS.

    If the run was begun anew while it was recorded, the bag holds several; what counts is the last
    beginning. If the recording was cut off, or still goes on, the bag holds what has been written
    so far.

    Args:
        folder: the bag.

    Attributes:
        folder: the bag.
        label: what it says of its run.
        scenario_file: the scenario that was played.
        scenario: the same, read.
        counts: number of messages on each topic that has any.
        seconds: time between the first message and the last.
        finished: whether the recording came to its end.

    Raises:
        BagError: there is none, or it is none of a run.
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
        except Exception as error:  # see _damaged
            raise BagError(
                f"{folder}: cannot be read as the bag of a run: {_words(error)}"
            ) from None

    def _open(self) -> None:
        with Reader(self.folder) as reader:
            # Without metadata.yaml there is no custom data.
            self.label = BagLabel.decode(reader.storage.metadata.custom or {})
            self.counts = {c.topic: c.msgcount for c in reader.connections if c.msgcount}
            self.seconds = max(0, reader.duration - 1) / _NANOSECONDS

    def _salvage(self) -> None:
        self.label = BagLabel.decode(unfinished_bag.custom_data(self.folder))
        read = {self.label.topics.get(name) for name in _READ}
        self._salvaged: list[unfinished_bag.BagMessage] = []
        counts, times = Counter[str](), []
        for message in unfinished_bag.messages(self.folder):
            counts[message.topic] += 1
            times.append(message.time)
            if message.topic in read:
                self._salvaged.append(message)
        self.counts = dict(counts)
        self.seconds = (max(times) - min(times)) / _NANOSECONDS if times else 0

    def serialized(self, topic: str) -> dict[int, bytes]:
        """Messages by their step, as they were on the wire.

        Args:
            topic: `joint_state` or `belief`.

        Raises:
            BagError: the bag is damaged.
        """
        found = {}
        try:
            for message, data in self._last_run(topic):
                found[self.step_of(message)] = data
        except Exception as error:
            raise self._damaged(error) from None
        return dict(sorted(found.items()))

    def _messages(self, *topics: str) -> Iterator[tuple[str, str, bytes]]:
        """Topic, type and serialized bytes of each message on these, in order of arrival."""
        names = {self.label.topics.get(topic): topic for topic in topics}
        if not self.finished:
            for message in self._salvaged:
                if message.topic in names:
                    yield names[message.topic], message.message_type, message.data
            return
        with Reader(self.folder) as reader:
            wanted = [c for c in reader.connections if c.topic in names]
            if wanted:  # none would mean all
                for connection, _, data in reader.messages(wanted):
                    yield names[connection.topic], connection.msgtype, bytes(data)

    @cached_property
    def runs(self) -> int:
        """How many runs begin in the bag: how often it has a state of step 0.

        Raises:
            BagError: the bag is damaged.
        """
        try:
            return sum(self.step_of(message) == 0 for _, message, _ in self._decoded("joint_state"))
        except Exception as error:
            raise self._damaged(error) from None

    def record(self) -> RunRecord:
        """States, inputs and beliefs as the run's own record has them.

        Raises:
            BagError: the bag is damaged, a state is missing, or too many are, or a message is not
                of this scenario.
        """
        record = RunRecord(self.scenario.vehicles)
        try:
            self._read_states(record)
            self._read_beliefs(record)
            self._read_diagnostics(record)
        except BagError:
            raise
        except Exception as error:
            raise self._damaged(error) from None
        return record

    def _damaged(self, error: Exception) -> BagError:
        # Readers, decompressors and types trust a file: what they raise if it has been changed can
        # be anything.
        return BagError(f"{self.folder}: is damaged: {_words(error)}")

    def _last_run(self, topic: str) -> list[tuple[Any, bytes]]:
        """The messages on a topic since the last beginning, and the same serialized.

        If the bag holds one run, all are of that. If it holds several, beliefs count from the last
        one of step 0 on. It may have come before its state, but after the last state of the run
        before: else it is of an earlier run, and the last one has no beliefs. So no belief is
        taken for that of another run; if an inference came so late that it has none of step 0,
        those that it has are left aside.
        """
        found: list[tuple[Any, bytes]] = []
        runs = begin = newest = last_before = 0  # places in what is found
        for name, message, data in self._decoded("joint_state", topic):
            if name == "joint_state":
                if self.step_of(message) == 0:
                    runs, begin, last_before = runs + 1, len(found), newest
                newest = len(found)
            if name == topic:
                found.append((message, data))
        if runs < 2:
            return found
        if topic != "belief":
            return found[begin:]
        since = found[last_before:]
        first = [i for i, (message, _) in enumerate(since) if self.step_of(message) == 0]
        return since[first[-1] :] if first else []

    def _decoded(self, *topics: str) -> Iterator[tuple[str, Any, bytes]]:
        for topic, message_type, data in self._messages(*topics):
            yield topic, self._types.deserialize_cdr(data, message_type), data

    def _read_states(self, record: RunRecord) -> None:
        vehicles = self.scenario.vehicles
        near = self.scenario.initial_vehicle_state
        # The clock that tells when a message arrived may have been set meanwhile.
        messages = [message for message, _ in self._last_run("joint_state")]
        for message in sorted(messages, key=self.step_of):
            step = self.step_of(message)
            if 0 <= step < len(record.states):
                raise ValueError(
                    f"joint_state: there are several states of step {step}: it must be the only one"
                )
            if step != len(record.states) and not self.label.external:
                raise ValueError(
                    f"joint_state: the state of step {len(record.states)} is missing: "
                    f"one of step {step} stands in its place"
                )
            if tuple(message.joint_names) != vehicles.joint_names:
                raise ValueError(
                    f"joint_state: joint_names: {message.joint_names} is not allowed: "
                    f"{list(vehicles.joint_names)} is expected"
                )
            poses = np.array(
                [
                    (t.translation.x, t.translation.y, heading.yaw(r.x, r.y, r.z, r.w))
                    for t in message.transforms
                    for r in [t.rotation]
                ]
            )
            twists = np.array([(t.linear.x, t.linear.y, t.angular.z) for t in message.twist])
            accelerations = np.array([(w.force.x, w.force.y, w.torque.z) for w in message.wrench])
            if not np.isfinite([*poses.ravel(), *twists.ravel(), *accelerations.ravel()]).all():
                raise ValueError(f"joint_state: step {step}: a number is not finite")
            near = vehicles.unwrap(vehicles.state(poses, twists), near)
            try:
                record.add_state(step, near, vehicles.input(twists, accelerations))
            except ValueError as error:  # nothing is wrong with the file
                raise BagError(f"{self.folder}: joint_state: {error}") from None

    def _read_beliefs(self, record: RunRecord) -> None:
        for message, _ in self._last_run("belief"):
            prefix, table = np.split(message.data, [message.layout.data_offset])
            rows = table.reshape(-1, message.layout.dim[1].size)
            step = self.step_of(message)
            record.beliefs[step] = {int(row[0]): float(row[1]) for row in rows}
            record.maps[step] = int(prefix[2])

    def _read_diagnostics(self, record: RunRecord) -> None:
        namespace = self.label.namespace.rstrip("/")
        solve_ms: dict[str, float] = {}
        for message, _ in self._last_run("/diagnostics"):
            for status in message.status:
                figures = {value.key: value.value for value in status.values}
                if status.name == f"{namespace}/simulator":
                    record.late_steps = int(figures["late_steps"])
                if status.name == f"{namespace}/robot_planner":
                    _read_safety(figures, record)
                if status.name == f"{namespace}/inference" and "solve_ms" in figures:
                    if figures["step"] == "0":  # of a new run
                        solve_ms.clear()
                    solve_ms[figures["step"]] = float(figures["solve_ms"])
        record.step_ms = list(solve_ms.values())

    def step_of(self, message: Any) -> int:
        """The step that a state or a belief belongs to."""
        if hasattr(message, "header"):
            seconds, nanoseconds = message.header.stamp.sec, message.header.stamp.nanosec
        else:
            seconds, nanoseconds = (int(number) for number in message.data[:2])
        return round((seconds * _NANOSECONDS + nanoseconds) / (self.scenario.dt * _NANOSECONDS))


def _read_safety(figures: Mapping[str, str], record: RunRecord) -> None:
    """Take over how often a safety layer has acted until a step that was played."""
    if figures.get("safety", "off") != "off" and int(figures["step"]) < record.steps:
        record.safety_braked = int(figures["safety_braked"])
        record.safety_limited = int(figures["safety_limited"])


def _check_plain(folder: Path) -> None:
    """Check that a bag has no file that one could wait for, as a pipe, before any is opened.

    Raises:
        ValueError: it has.
    """
    for path in folder.iterdir() if folder.is_dir() else ():
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise ValueError(f"{path.name} is no plain file")


def _words(error: Exception) -> str:
    return shorten(str(error) or type(error).__name__, 500)
