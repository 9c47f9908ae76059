"""Runs are recorded as bags, which other tools read, and which agree with the runs."""

from __future__ import annotations

import json
import signal
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml_text
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from passing import write_scenario
from recorded_run import STEPS, TYPES
from rosbags.rosbag2 import Reader
from run_command import Command

from gameinfer_ros.bags.label import KEY, BagLabel
from gameinfer_ros.bags.run_bag import RunBag
from gameinfer_ros.commands import cli
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.scenario import Scenario

#: Topics of two players, and how often nodes publish them in a run.
EVERY_STATE = {
    *("/joint_state", "/robot/odom", "/human_1/odom"),
    *("/belief", "/map_strategy", "/robot_strategy"),
}
NOT_AFTER_THE_END = {"/map_equilibrium", "/markers", "/robot/control", "/human_1/control"}


def test_rosbags_reads_every_topic_of_the_run_whole(run: Path) -> None:
    with Reader(run / "bag") as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
        others = {"/run_start", "/diagnostics", "/clock", "/robot/cmd_vel"}
        assert set(counts) == {*EVERY_STATE, *NOT_AFTER_THE_END, *others}
        assert counts["/run_start"] == 1
        for topic in EVERY_STATE:
            assert counts[topic] == STEPS + 1, topic
        for topic in NOT_AFTER_THE_END:  # nodes are stopped after the last belief
            assert STEPS <= counts[topic] <= STEPS + 1, topic
        # Before the planner ends, it slows the base down.
        commands = [c for c in reader.connections if c.topic == "/robot/cmd_vel"]
        sent = [TYPES.deserialize_cdr(d, c.msgtype).twist for c, _, d in reader.messages(commands)]
        assert len(sent) > STEPS and sent[STEPS - 1].linear.x != 0.0
        assert sent[-1].linear.x == sent[-1].angular.z == 0.0
        # Each node reports on every step, and says now and then that it waits.
        told = [c for c in reader.connections if c.topic == "/diagnostics"]
        reports = [TYPES.deserialize_cdr(d, c.msgtype) for c, _, d in reader.messages(told)]
        steps = [any(v.key == "step" for v in r.status[0].values) for r in reports]
        assert 4 * STEPS <= sum(steps) <= 4 * STEPS + 3
        for connection in reader.connections:
            definition, _ = TYPES.generate_msgdef(connection.msgtype, ros_version=2)
            assert connection.msgdef.data == definition
            assert connection.digest == TYPES.hash_rihs01(connection.msgtype)
        for connection, _, data in reader.messages():
            TYPES.deserialize_cdr(data, connection.msgtype)
        offered = {c.topic: c.ext.offered_qos_profiles[0] for c in reader.connections}
        assert offered["/joint_state"].depth == 200
        assert offered["/joint_state"].durability.name == "TRANSIENT_LOCAL"
        assert offered["/robot/cmd_vel"].durability.name == "VOLATILE"
        assert offered["/clock"].reliability.name == "BEST_EFFORT"


def test_the_mcap_library_reads_the_same(run: Path) -> None:
    with Reader(run / "bag") as reader:
        wanted = [
            (c.topic, time, TYPES.deserialize_cdr(data, c.msgtype))
            for c, time, data in reader.messages()
        ]
    (file,) = (run / "bag").glob("*.mcap")
    found: dict[str, list[tuple[int, Any]]] = {}
    with file.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for schema, channel, record, message in reader.iter_decoded_messages():
            assert schema is not None and schema.encoding == "ros2msg"
            found.setdefault(channel.topic, []).append((record.log_time, message))
    assert sum(len(messages) for messages in found.values()) == len(wanted)
    taken = Counter[str]()
    for topic, time, message in wanted:
        log_time, other = found[topic][taken[topic]]
        taken[topic] += 1
        assert log_time == time
        if topic in ("/belief", "/map_strategy", "/robot_strategy"):
            np.testing.assert_array_equal(message.data, other.data)
        elif topic == "/joint_state":
            for one, another in zip(message.transforms, other.transforms, strict=True):
                assert one.translation.x == another.translation.x
                assert one.rotation.w == another.rotation.w


def test_the_metadata_is_that_of_rosbag2(run: Path) -> None:
    metadata = yaml_text.load((run / "bag" / "metadata.yaml").read_text())
    information = metadata["rosbag2_bagfile_information"]
    assert information["version"] == 9
    assert information["storage_identifier"] == "mcap"
    assert information["relative_file_paths"] == ["bag.mcap"]
    label = BagLabel.decode(information["custom_data"])
    assert (label.scenario, label.planner, label.time) == ("passing", "map", "lockstep")
    assert (label.seed, label.particles, label.namespace) == (5, 5, "/")
    assert label.ros_args == ["-p", "publish_clock:=true"]
    assert (run / "bag" / "scenario.yaml").read_text() == (run / "passing.yaml").read_text()


def test_the_bag_agrees_with_the_record_of_the_run(run: Path) -> None:
    found = RunBag(run / "bag").record()
    wanted = RunRecord.load(run, Scenario.load(run / "passing.yaml").vehicles)
    assert np.array(found.states).tobytes() == np.array(wanted.states).tobytes()
    assert np.array(found.inputs).tobytes() == np.array(wanted.inputs).tobytes()
    assert len(found.states) == STEPS + 1
    assert found.beliefs == wanted.beliefs
    assert found.maps == wanted.maps
    assert found.step_ms[: len(wanted.step_ms)] == wanted.step_ms
    assert found.summary() == wanted.summary()


@pytest.mark.parametrize("content", ["file", "full"])
def test_a_folder_that_holds_something_is_refused(
    content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "bag"
    if content == "file":
        folder.write_text("")
    else:
        folder.mkdir()
        (folder / "diary").write_text("")
    for overwrite in ([], ["--overwrite"]):
        assert cli.main(["run", "--record", str(folder), *overwrite]) == 2
    told = capsys.readouterr().err
    for word in ("--record", str(folder), "does not exist yet or is empty"):
        assert word in told


def test_a_folder_that_cannot_be_made_is_refused(
    tmp_path: Path, start: Callable[..., Command]
) -> None:
    (tmp_path / "file").write_text("")
    folder = tmp_path / "file" / "bag"
    command = start("--scenario", write_scenario(tmp_path), "--record", folder)
    assert command.exit_code() == 2
    for word in ("--record", str(folder)):
        assert word in command.stderr
    assert "Traceback" not in command.stderr


@pytest.mark.parametrize("when", ["First controls", "Loading compiled code"])
def test_an_interrupted_run_leaves_a_bag_that_can_be_read(
    when: str, start: Callable[..., Command], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()  # an empty one is allowed
    command = start(
        *("--scenario", write_scenario(tmp_path), "--time", "realtime", "--steps", 10**6),
        *("--record", folder, "--ros-args", "-r", "__ns:=/demo"),
        *("-p", "publish_clock:=true", "-p", "use_sim_time:=true"),
    )
    command.until(lambda: when in command.stdout and (folder / "scenario.yaml").exists())
    command.process.send_signal(signal.SIGINT)
    assert command.exit_code() == 130, command.stdout + command.stderr
    assert command.leftovers() == {}
    record = RunBag(folder).record()
    capsys.readouterr()
    assert cli.main(["inspect", str(folder), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    if when == "First controls":
        assert record.steps == found["steps"] >= 1
        assert found["topics"]["/demo/joint_state"] == record.steps + 1
        assert found["topics"]["/clock"] > 0
        assert found["solve_ms"]["longest"] > 0


def test_a_label_with_other_fields_is_refused() -> None:
    label = BagLabel("s", "map", "lockstep", 0)
    assert BagLabel.decode(label.encode()) == label
    for content in ("[]", '{"scenario": "s"}', "no JSON"):
        with pytest.raises(ValueError):
            BagLabel.decode({KEY: content})
