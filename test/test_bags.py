"""Runs are recorded as bags, which others read, and which tell the same as the runs themselves."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from PIL import Image
from ros_domain import free_domain
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from test_orchestrator import DEADLINE, Command

from gameinfer_ros import cli
from gameinfer_ros.bag_label import KEY, BagLabel
from gameinfer_ros.run_bag import BagError, RunBag
from gameinfer_ros.run_record import RunRecord
from gameinfer_ros.scenario import Scenario

pytestmark = pytest.mark.alone

STEPS = 12
TYPES = get_typestore(Stores.ROS2_JAZZY)
#: Topics of two players, and how often nodes publish them in a run.
EVERY_STATE = {"/joint_state", "/robot/odom", "/human_1/odom", "/belief", "/map_strategy"}
NOT_AFTER_THE_END = {
    "/map_equilibrium",
    "/markers",
    "/robot/control",
    "/robot/cmd_vel",
    "/human_1/control",
}


def write_scenario(folder: Path) -> Path:
    """Two players who pass each other."""
    content = {
        "dt": 0.1,
        "horizon": 15,
        "steps": STEPS,
        "players": {
            "robot": {"dynamics": {"kind": "unicycle"}, "initial": [-1.5, 0.0, 0.1, 0.5]},
            "human_1": {"dynamics": {"kind": "unicycle"}, "initial": [1.5, 0.1, 3.2, 0.5]},
        },
        "costs": [
            {"kind": "quadratic_input", "weights": [10, 10]},
            {"kind": "proximity", "radius": 1.2, "weight": 50},
        ],
        "seeds": {"kind": "cosine", "low": [-0.3, -0.1], "high": [0.3, 0.1]},
        "inference": {"particles": 6},
    }
    path = folder / "passing.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a run in lockstep, with its bag in `bag` and other options than the defaults."""
    folder = tmp_path_factory.mktemp("recorded")
    command = Command(
        folder,
        *("--scenario", write_scenario(folder), "--time", "lockstep", "--seed", 5),
        *("--particles", 5, "--json", "--out", folder, "--record", folder / "bag"),
        *("--animation", folder / "run.gif"),
        *("--ros-args", "-p", "publish_clock:=true"),
    )
    try:
        assert command.exit_code() == 0, command.stdout + command.stderr
        assert command.stderr == "", "messages were lost"
        for name in ("bag", "run.gif"):
            assert str(folder / name) in command.stdout
    finally:
        command.end()
    return folder


@pytest.fixture
def copy(run: Path, tmp_path: Path) -> Callable[..., Path]:
    """Copies the bag, with some messages changed or left out."""

    def make(
        change: Callable[[str, int, Any], Any] = lambda topic, k, message: message,
        **label: Any,
    ) -> Path:
        target, seen = tmp_path / "copy", Counter[str]()
        with Reader(run / "bag") as reader:
            writer = Writer(target, version=9, storage_plugin=StoragePlugin.MCAP)
            writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            with writer:
                custom = reader.storage.metadata.custom or {}
                for key, value in replace(BagLabel.decode(custom), **label).encode().items():
                    writer.set_custom_data(key, value)
                connections = {
                    c.topic: writer.add_connection(c.topic, c.msgtype, typestore=TYPES)
                    for c in reader.connections
                }
                for c, time, data in reader.messages():
                    message = TYPES.deserialize_cdr(data, c.msgtype)
                    message = change(c.topic, seen[c.topic], message)
                    seen[c.topic] += 1
                    if message is not None:
                        data = TYPES.serialize_cdr(message, c.msgtype)
                        writer.write(connections[c.topic], time, data)
        shutil.copy(run / "bag" / "scenario.yaml", target)
        return target

    return make


# --- What is recorded ----------------------------------------------------------------------------


def test_rosbags_reads_every_topic_of_the_run_whole(run: Path) -> None:
    with Reader(run / "bag") as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
        assert set(counts) == {*EVERY_STATE, *NOT_AFTER_THE_END, "/diagnostics", "/clock"}
        for topic in EVERY_STATE:
            assert counts[topic] == STEPS + 1, topic
        for topic in NOT_AFTER_THE_END:  # nodes are stopped after the last belief
            assert STEPS <= counts[topic] <= STEPS + 1, topic
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
        if topic in ("/belief", "/map_strategy"):
            np.testing.assert_array_equal(message.data, other.data)
        elif topic == "/joint_state":
            for one, another in zip(message.transforms, other.transforms, strict=True):
                assert one.translation.x == another.translation.x
                assert one.rotation.w == another.rotation.w


def test_the_metadata_is_that_of_rosbag2(run: Path) -> None:
    metadata = yaml.safe_load((run / "bag" / "metadata.yaml").read_text())
    information = metadata["rosbag2_bagfile_information"]
    assert information["version"] == 9
    assert information["storage_identifier"] == "mcap"
    assert information["relative_file_paths"] == ["bag.mcap"]
    label = BagLabel.decode(information["custom_data"])
    assert (label.scenario, label.planner, label.time) == ("passing", "map", "lockstep")
    assert (label.seed, label.particles, label.namespace) == (5, 5, "/")
    assert label.ros_args == ["-p", "publish_clock:=true"]
    assert (run / "bag" / "scenario.yaml").read_text() == (run / "passing.yaml").read_text()


def test_the_bag_tells_the_same_as_the_record_of_the_run(run: Path) -> None:
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
    with pytest.raises(SystemExit, match="2"):
        cli.main(["run", "--record", str(folder)])
    told = capsys.readouterr().err
    for word in ("--record", str(folder), "does not exist yet or is empty"):
        assert word in told


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    folder = tmp_path / "file" / "bag"
    command = Command(
        tmp_path / "command", "--scenario", write_scenario(tmp_path), "--record", folder
    )
    assert command.exit_code() == 2
    for word in ("--record", str(folder)):
        assert word in command.stderr
    assert "Traceback" not in command.stderr


@pytest.mark.parametrize("when", ["First controls", "Loading compiled code"])
def test_an_interrupted_run_leaves_a_bag_that_can_be_read(
    when: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()  # an empty one is as good as none
    command = Command(
        tmp_path / "command",
        *("--scenario", write_scenario(tmp_path), "--time", "realtime", "--steps", 10**6),
        *("--record", folder, "--ros-args", "-r", "__ns:=/demo"),
        *("-p", "publish_clock:=true", "-p", "use_sim_time:=true"),
    )
    try:
        command.until(lambda: when in command.stdout and (folder / "scenario.yaml").exists())
        command.process.send_signal(signal.SIGINT)
        assert command.exit_code() == 130, command.stdout + command.stderr
        assert command.leftovers() == {}
    finally:
        command.end()
    record = RunBag(folder).record()
    capsys.readouterr()
    assert cli.main(["inspect", str(folder), "--json"]) == 0
    found = json.loads(capsys.readouterr().out.splitlines()[-1])
    if when == "First controls":
        assert record.steps == found["steps"] >= 1
        assert found["topics"]["/demo/joint_state"] == record.steps + 1
        assert found["topics"]["/clock"] > 0
        assert found["solve_ms"]["longest"] > 0


# --- gameinfer inspect ---------------------------------------------------------------------------


def test_inspect_tells_what_the_run_told(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["inspect", str(run / "bag"), "--json"]) == 0
    lines = capsys.readouterr().out.splitlines()
    found, wanted = json.loads(lines[-1]), json.loads((run / "run.json").read_text())
    for key in wanted:
        assert found[key] == wanted[key]
    assert (found["scenario"], found["planner"], found["seed"]) == ("passing", "map", 5)
    assert found["topics"]["/joint_state"] == STEPS + 1
    assert 0 < found["duration_s"] < DEADLINE
    assert 0 < found["solve_ms"]["median"] <= found["solve_ms"]["longest"]
    told = "\n".join(lines[:-1])
    for words in ("passing, planner map, seed 5", "/joint_state", f"Steps: {STEPS}", "robot"):
        assert words in told


def test_inspect_needs_no_ros(run: Path) -> None:
    code = (
        "import sys\n"
        "for name in ('rclpy', 'sensor_msgs', 'std_msgs', 'msg_adapters'):\n"
        "    sys.modules[name] = None\n"
        "from gameinfer_ros import cli\n"
        f"sys.exit(cli.main(['inspect', {str(run / 'bag')!r}]))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=DEADLINE
    )
    assert done.returncode == 0, done.stderr


def no_bag(folder: Path, copy: Callable[..., Path]) -> None:
    """There is no such folder."""


def no_metadata(folder: Path, copy: Callable[..., Path]) -> None:
    folder.mkdir()


def no_label(folder: Path, copy: Callable[..., Path]) -> None:
    copy().rename(folder)
    metadata = folder / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(KEY, "other"))


def no_messages(folder: Path, copy: Callable[..., Path]) -> None:
    copy().rename(folder)
    (file,) = folder.glob("*.mcap")
    file.write_bytes(file.read_bytes()[:1000])


def no_state_3(folder: Path, copy: Callable[..., Path]) -> None:
    def change(topic: str, k: int, message: Any) -> Any:
        return None if (topic, k) == ("/joint_state", 3) else message

    copy(change).rename(folder)


def no_scenario(folder: Path, copy: Callable[..., Path]) -> None:
    copy().rename(folder)
    (folder / "scenario.yaml").unlink()


def other_players(folder: Path, copy: Callable[..., Path]) -> None:
    copy().rename(folder)
    file = folder / "scenario.yaml"
    file.write_text(file.read_text().replace("human_1", "human_2"))


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (no_bag, "does not exist"),
        (no_metadata, "metadata"),
        (no_label, "gameinfer run --record"),
        (no_messages, ""),
        (no_state_3, "the state of step 3 is missing"),
        (no_scenario, "scenario.yaml"),
        (other_players, "human_2"),
    ],
)
@pytest.mark.parametrize("name", ["inspect", "replay"])
def test_what_is_no_bag_of_a_run_is_refused(
    name: str,
    spoil: Callable[[Path, Callable[..., Path]], None],
    words: str,
    copy: Callable[..., Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = tmp_path / "spoiled"
    spoil(folder, copy)
    assert cli.main([name, str(folder)]) == 2
    told = capsys.readouterr().err
    assert str(folder) in told
    assert words in told


def test_a_label_with_other_fields_is_refused() -> None:
    label = BagLabel("s", "map", "lockstep", 0)
    assert BagLabel.decode(label.encode()) == label
    for content in ("[]", '{"scenario": "s"}', "no JSON"):
        with pytest.raises(ValueError):
            BagLabel.decode({KEY: content})


def test_a_message_that_cannot_be_read_is_told(copy: Callable[..., Path]) -> None:
    def change(topic: str, k: int, message: Any) -> Any:
        if (topic, k) == ("/belief", 2):
            message.data = message.data[:-1]
        return message

    bag = RunBag(copy(change))
    with pytest.raises(BagError, match="damaged"):
        bag.record()


# --- gameinfer inspect --animation ---------------------------------------------------------------


def test_the_animation_of_a_bag_is_that_of_the_run(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "again.gif"
    assert cli.main(["inspect", str(run / "bag"), "--animation", str(file), "--json"]) == 0
    *_, line, figures = capsys.readouterr().out.splitlines()
    assert str(file) in line
    assert json.loads(figures)["steps"] == STEPS
    assert file.read_bytes() == (run / "run.gif").read_bytes()
    with Image.open(file) as image:
        assert image.n_frames == STEPS + 1


def test_an_animation_of_nothing_is_refused(
    copy: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = copy(lambda topic, k, message: None if topic == "/joint_state" else message)
    file = tmp_path / "none.gif"
    assert cli.main(["inspect", str(bag), "--animation", str(file)]) == 2
    told = capsys.readouterr().err
    for word in ("--animation", str(bag), "no state"):
        assert word in told
    assert not file.exists()


# --- gameinfer replay ----------------------------------------------------------------------------


@pytest.fixture
def replay(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Iterator[Callable[[Path], tuple[int, dict[str, Any]]]]:
    """Replays a bag; gives exit code and the JSON object."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(free_domain()))

    def play(bag: Path) -> tuple[int, dict[str, Any]]:
        capsys.readouterr()
        code = cli.main(["replay", str(bag), "--json"])
        return code, json.loads(capsys.readouterr().out.splitlines()[-1])

    yield play


def test_a_replay_gives_the_same_beliefs_to_the_last_bit(
    run: Path, replay: Callable[[Path], tuple[int, dict[str, Any]]]
) -> None:
    code, found = replay(run / "bag")
    assert found == {
        "identical": True,
        "steps": STEPS + 1,
        "identical_steps": STEPS + 1,
        "first_difference": None,
    }
    assert code == 0


def move_a_human(topic: str, k: int, message: Any) -> Any:
    if (topic, k) == ("/joint_state", 4):
        message.transforms[1].translation.x += 1e-9
    return message


def weigh_a_particle(topic: str, k: int, message: Any) -> Any:
    if (topic, k) == ("/belief", 4):
        message.data = message.data.copy()
        weight = 3 + 1  # behind stamp, MAP and the first particle's number
        message.data[weight] = np.nextafter(message.data[weight], 0.5)
    return message


@pytest.mark.parametrize("tamper", [move_a_human, weigh_a_particle])
def test_a_bag_that_was_tampered_with_is_found_out(
    tamper: Callable[[str, int, Any], Any],
    copy: Callable[..., Path],
    replay: Callable[[Path], tuple[int, dict[str, Any]]],
) -> None:
    code, found = replay(copy(tamper))
    assert code == 1
    assert not found["identical"]
    # The costs that a state leads to are told with the next belief.
    assert found["first_difference"] in (4, 5)
    assert found["identical_steps"] < found["steps"] == STEPS + 1


def test_a_bag_in_which_an_external_player_was_lost_can_be_used(
    copy: Callable[..., Path], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    def gap(topic: str, k: int, message: Any) -> Any:
        return None if topic in ("/joint_state", "/belief") and k in (4, 5) else message

    bag = copy(gap, external=["human_1"])
    assert cli.main(["inspect", str(bag), "--json", "--animation", str(tmp_path / "a.gif")]) == 0
    found = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (found["missing_steps"], found["steps"]) == (2, STEPS)
    code = cli.main(["replay", str(bag), "--json"])
    found = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert found["steps"] == STEPS - 1
    # Until the gap the belief is the same; then it lacks what the run knew.
    assert (code, found["first_difference"]) == (1, 6)
