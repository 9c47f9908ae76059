"""A bag, whatever has happened to it, is either read or refused in words."""

from __future__ import annotations

import copy
import itertools
import json
import os
from pathlib import Path
from typing import Any

import bad_bags
import forking
import numpy as np
import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from nodes_room import Run, restamp
from passing import write_scenario
from rclpy.serialization import deserialize_message, serialize_message
from ros_context import make_context
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from wire import START
from world import World

from gameinfer_ros.bags.label import BagLabel
from gameinfer_ros.bags.run_bag import BagError, RunBag
from gameinfer_ros.bags.unfinished import MARK
from gameinfer_ros.commands import cli
from gameinfer_ros.names.exit_codes import BAD_INPUT
from gameinfer_ros.runs.record import MOST_MISSING
from gameinfer_ros.runs.run_clock import RunClock
from msg_adapters import stamp

STEPS = 6
DEADLINE = 60.0
Messages = dict[str, tuple[str, list[bytes]]]
Played = tuple[Path, Messages]
TYPES = {
    "/run_start": Time,
    "/joint_state": MultiDOFJointState,
    "/belief": Float64MultiArray,
    "/diagnostics": DiagnosticArray,
}


@pytest.fixture(scope="module")
def played_once(tmp_path_factory: pytest.TempPathFactory) -> Played:
    file = write_scenario(tmp_path_factory.mktemp("scenario"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        world = World(make_context())
    try:
        run = Run(world, file, STEPS, listeners=1)
        run.listen()
        world.until(
            lambda: run.done and all(len(run.heard[t]) > STEPS for t in ("/joint_state", "/belief"))
        )
    finally:
        world.end()
    packages = {topic: kind.__module__.partition(".")[0] for topic, kind in TYPES.items()}
    return file, {
        topic: (f"{packages[topic]}/msg/{kind.__name__}", run.heard[topic])
        for topic, kind in TYPES.items()
    }


@pytest.fixture
def played(played_once: Played) -> Played:
    """A scenario, and what the nodes said of states and beliefs in a run of it."""
    return copy.deepcopy(played_once)


@pytest.mark.parametrize("state", bad_bags.STATES)
def test_a_spoiled_bag_is_read_or_refused(
    state: str, played: Played, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "bag"
    bad_bags.write(bag, *played, state)
    assert bad_bags.outcome(bag) == "accepted"
    rng, outcomes = np.random.default_rng(0), []
    for k in range(80):
        copy = tmp_path / f"copy_{k}"
        bad_bags.spoil(bag, copy, rng)
        outcomes.append(bad_bags.outcome(copy))
        if outcomes[-1] == "rejected" and k % 20 == 0:
            for command in ("inspect", "replay"):
                assert cli.main([command, str(copy)]) == BAD_INPUT
                assert capsys.readouterr().err.startswith(f"{copy}: ")
    assert "rejected" in outcomes


def test_a_recording_that_was_cut_off_anywhere_is_read_up_to_there(
    played: Played, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    bad_bags.write(bag, *played, bad_bags.CUT_OFF)
    (file,) = bag.glob("*.mcap")
    content, whole = file.read_bytes(), RunBag(bag).record().states
    assert len(whole) == STEPS + 1
    sizes = []
    for end in [*range(0, len(content), 211), len(content)]:
        file.write_bytes(content[:end])
        assert bad_bags.outcome(bag) == "accepted", end
        states = RunBag(bag).record().states
        np.testing.assert_array_equal(states, whole[: len(states)])
        sizes.append(len(states))
    assert sizes == sorted(sizes) and set(sizes) == set(range(STEPS + 2))


@pytest.mark.parametrize(
    "content", ["", "{", "[]", "7", "null", '{"gameinfer_ros": 7}', "[" * 100_000, None]
)
def test_a_mark_that_says_nothing_is_refused(
    content: str | None, played: Played, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    bad_bags.write(bag, *played, bad_bags.CUT_OFF)
    if content is None:
        (bag / MARK).unlink()  # and there is no metadata.yaml
    else:
        (bag / MARK).write_text(content)
    assert bad_bags.outcome(bag) == "rejected"


@pytest.mark.parametrize(
    ("name", "state"),
    [
        (MARK, bad_bags.CUT_OFF),
        ("bag.mcap", bad_bags.CUT_OFF),
        ("metadata.yaml", bad_bags.FINISHED),
        ("scenario.yaml", bad_bags.FINISHED),
    ],
)
def test_no_command_waits_for_a_pipe_in_place_of_a_file(
    name: str, state: str, played: Played, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    bad_bags.write(bag, *played, state)
    (bag / name).unlink(missing_ok=True)
    os.mkfifo(bag / name)
    done = forking.gameinfer("inspect", str(bag), timeout=DEADLINE)
    assert done.returncode == BAD_INPUT
    assert done.stderr.startswith(f"{bag}: ") and f"{name} is not a regular file" in done.stderr


def stamped(messages: Messages, steps: list[int]) -> Messages:
    """Messages of a run whose states are those of these steps, whatever theirs were."""
    kind, states = messages["/joint_state"]
    made = []
    for data, step in zip(itertools.cycle(states), steps, strict=False):
        message = deserialize_message(data, MultiDOFJointState)
        message.header.stamp = stamp.encode(START + step * 10**8)
        made.append(serialize_message(message))
    start = serialize_message(stamp.encode(START))
    return {
        **messages,
        "/joint_state": (kind, made),
        "/run_start": (messages["/run_start"][0], [start]),
    }


@pytest.mark.parametrize(
    "steps",
    [[0, 1, MOST_MISSING + 3], [0, 1, 3 * 10**9], [0, *range(90_000, 1_200_000, 90_000)]],
    ids=["far", "farthest", "many small jumps"],
)
@pytest.mark.parametrize("state", [bad_bags.FINISHED, bad_bags.CUT_OFF])
def test_stamps_of_the_far_future_take_no_memory(
    steps: list[int], state: str, played: Played, tmp_path: Path
) -> None:
    file, messages = played
    bag = tmp_path / "bag"
    # States may be missing.
    bad_bags.write(bag, file, stamped(messages, steps), state, external=("human_1",))
    # Nothing is damaged.
    with pytest.raises(BagError, match=rf"^{bag}: joint_state: step \d+ is not allowed"):
        RunBag(bag).record()


def test_the_states_of_a_day_may_be_missing(played: Played, tmp_path: Path) -> None:
    file, messages = played
    day = 864_000  # at ten steps a second
    messages = stamped(messages, [0, 1, day, day + 1])
    messages = {topic: messages[topic] for topic in ("/run_start", "/joint_state")}
    bad_bags.write(tmp_path / "bag", file, messages, external=("human_1",))
    record = RunBag(tmp_path / "bag").record()
    assert (record.steps, record.missing_steps) == (day + 1, day - 2)


def test_two_simulators_at_once_are_detected(played: Played, tmp_path: Path) -> None:
    file, messages = played
    kind, states = messages["/joint_state"]
    messages["/joint_state"] = kind, [*states, *states[2:5]]
    bad_bags.write(tmp_path / "bag", file, messages)
    with pytest.raises(BagError, match="there are several states of step 2"):
        RunBag(tmp_path / "bag").record()


def later(messages: Messages, seconds: float) -> Messages:
    """The messages of a run as they would be if it had started later."""
    before, after = RunClock(0.1), RunClock(0.1)
    before.start = stamp.decode(deserialize_message(messages["/run_start"][1][0], Time))
    after.start = before.start + round(seconds * stamp.SECOND)
    start = serialize_message(stamp.encode(after.start))
    made = {"/run_start": (messages["/run_start"][0], [start])}
    for topic, (kind, every) in list(messages.items())[1:]:
        again = [deserialize_message(data, TYPES[topic]) for data in every]
        for message in again:
            restamp(message, before, after)
        made[topic] = kind, [serialize_message(message) for message in again]
    return made


@pytest.mark.parametrize("state", [bad_bags.FINISHED, bad_bags.CUT_OFF])
def test_of_several_runs_the_last_is_reported_and_how_many_there_are(
    state: str, played: Played, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, messages = played
    once, thrice = tmp_path / "once", tmp_path / "thrice"
    bad_bags.write(once, file, messages, state)
    second, third = later(messages, 20), later(messages, 40)
    runs = {t: [*messages[t][1], *second[t][1][:4], *third[t][1][:2]] for t in messages}
    bad_bags.write(thrice, file, {t: (messages[t][0], runs[t]) for t in messages}, state)
    for bag, count, steps in ((once, 1, STEPS), (thrice, 3, 1)):
        assert cli.main(["inspect", str(bag), "--json"]) == 0
        printed = capsys.readouterr()
        found, told = json.loads(printed.out), printed.err.splitlines()
        assert (found["runs"], found["steps"]) == (count, steps)
        words = f"The bag contains {count} runs; this is the last one."
        assert (words in told) == (count > 1)


OF_1, OF_2 = [(1, step) for step in range(STEPS + 1)], [(2, step) for step in range(3)]


@pytest.mark.parametrize(
    ("states", "beliefs", "told"),
    [
        ([*OF_1, *OF_2], OF_1, []),
        ([*OF_1, *OF_2], [*OF_1, *OF_2[:2]], [0, 1]),
        ([*OF_1, *OF_2], [*OF_1[:4], *OF_2[:2], *OF_1[4:]], [0, 1]),
        ([*OF_1, *OF_2], [*OF_1, *OF_2[1:]], [1, 2]),
        (OF_1, OF_1[3:], [3, 4, 5, 6]),
    ],
    ids=["cut off before any", "some", "out of order", "not from the beginning",
         "not from the beginning of one"],
)  # fmt: skip
@pytest.mark.parametrize("back", [False, True], ids=["later", "by a clock that was set back"])
@pytest.mark.parametrize("state", [bad_bags.FINISHED, bad_bags.CUT_OFF])
def test_the_last_run_contains_nothing_of_an_earlier_one(
    states: list[tuple[int, int]],
    beliefs: list[tuple[int, int]],
    told: list[int],
    back: bool,
    state: str,
    played: Played,
    tmp_path: Path,
) -> None:
    file, first = played
    second = later(first, -500.0000003 if back else 500.0)
    runs = {1: first, 2: second} if states != OF_1 else {1: first}
    steps = {"/joint_state": states, "/belief": beliefs}
    made = {
        t: (first[t][0], [runs[run][t][1][step] for run, step in every])
        for t, every in steps.items()
    }
    made["/run_start"] = first["/run_start"][0], [m["/run_start"][1][0] for m in runs.values()]
    kind, every = first["/diagnostics"]
    solved = [data for data in every if b"solve_ms" in data and b"/inference" in data]
    made["/diagnostics"] = kind, solved[: STEPS + 1]
    bad_bags.write(tmp_path / "bag", file, made, state)
    bag = RunBag(tmp_path / "bag")
    record = bag.record()
    assert list(record.beliefs) == list(record.maps) == list(bag.serialized("belief")) == told
    assert len(record.states) == (3 if len(runs) > 1 else STEPS + 1)
    assert bool(record.step_ms) == (len(runs) == 1)


@pytest.mark.parametrize("state", [bad_bags.FINISHED, bad_bags.CUT_OFF])
def test_a_bag_from_before_runs_were_named_is_refused(
    state: str, played: Played, tmp_path: Path
) -> None:
    file, messages = played
    del messages["/run_start"]
    bad_bags.write(tmp_path / "bag", file, messages, state)
    with pytest.raises(
        BagError, match=r"run_start: has no message, but joint_state has some: .* recorded again"
    ):
        RunBag(tmp_path / "bag").record()


@pytest.mark.parametrize(
    ("field", "value"),
    [("seed", "x"), ("seed", -1), ("seed", 2**63), ("particles", None), ("topics", []),
     ("external", "human_1"), ("external", [3]), ("ros_args", {}), ("namespace", 7)],
)  # fmt: skip
def test_a_label_with_a_value_of_another_type_is_refused(field: str, value: Any) -> None:
    label = BagLabel("x", "map", "lockstep", 1)
    content = json.loads(label.encode()["gameinfer_ros"]) | {field: value}
    with pytest.raises(
        ValueError, match=rf"custom_data\.gameinfer_ros\.{field}: .* is not allowed"
    ):
        BagLabel.decode({"gameinfer_ros": json.dumps(content)})
