"""Nodes follow the runs of a simulator, in whatever order messages arrive."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from sensor_msgs.msg import MultiDOFJointState
from small_scenario import ScenarioFile
from std_msgs.msg import Float64MultiArray
from wire import START, Wire

from gameinfer_ros.nodes.base import checked_subscription
from gameinfer_ros.nodes.base.follower_node import Observation
from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.viewer import Viewer
from msg_adapters import qos, stamp
from msg_adapters.stamp import SECOND

#: Start of a second run.
LATER = START + 3_333_333_333
#: Every node that follows runs, with parameters that it needs here.
KINDS: dict[Any, dict[str, Any]] = {
    Inference: {},
    RobotPlanner: {},
    HumanAgent: {},
    Recorder: {},
    Viewer: {"port": 0},
}


def noting(kind: Any) -> Any:
    """Nodes of a kind that note which runs began, and which states of which run they handled."""

    class Noting(kind):
        def __init__(self, **options: Any) -> None:
            self.runs: list[int] = []
            self.seen: list[tuple[int, int]] = []
            super().__init__(**options)

        def on_run(self) -> None:
            if self.clock.start is not None:  # and not while it is made
                self.runs.append(self.clock.start)
            super().on_run()

        def subscribe_state(self, handle: Callable[[Observation], None], profile: Any) -> None:
            def note(observation: Observation) -> None:
                handle(observation)
                self.seen.append((self.clock.start, observation.step))

            super().subscribe_state(note, profile)

    return Noting


class Follower:
    def __init__(self, kind: Any, world: Any, wire: Any, file: Path) -> None:
        self.world, self.node = world, world.add(noting(kind), scenario=file, **KINDS[kind])
        self._wire: Callable[..., Wire] = wire
        self._states = world.publisher(MultiDOFJointState, "joint_state", qos.STREAM)

    def start(self, start: int) -> None:
        self.world.start_run(start)

    def see(self, start: int, *steps: int, off: int = 0, far: float = 0.0) -> None:
        """Send states of a run, with stamps that are off by some ns, from far away."""
        wire = self._wire(self.node.scenario)
        wire.clock.start = start + off
        for step in steps:
            message = wire.state(step, self.node.scenario.initial_vehicle_state + far)
            self.world.send(self._states, message)

    @property
    def seen(self) -> list[tuple[int, int]]:
        return self.node.seen

    @property
    def rejected(self) -> dict[str, int]:
        return dict(self.node.topic_faults.rejected)


@pytest.fixture(params=KINDS, ids=lambda kind: kind.__name__)
def follower(
    request: pytest.FixtureRequest, world: Any, wire: Any, scenario_file: ScenarioFile
) -> Follower:
    return Follower(request.param, world, wire, scenario_file("uu", steps=1000))


def test_a_state_that_overtakes_the_start_of_its_run_counts(follower: Follower) -> None:
    follower.see(START, 0, 1)  # of a node that joins late
    assert follower.seen == []
    follower.start(START)
    assert follower.seen == [(START, 0), (START, 1)]
    follower.see(START, 2)
    follower.see(LATER, 0)  # of a run that restarts
    assert follower.seen[3:] == []
    follower.start(LATER)
    follower.see(LATER, 1)
    assert follower.seen[2:] == [(START, 2), (LATER, 0), (LATER, 1)]
    assert follower.rejected == {}
    assert follower.node.runs == [START, LATER]


def test_a_state_of_an_earlier_run_is_rejected_and_says_so(follower: Follower) -> None:
    follower.start(START)
    follower.see(START, 0, 1)
    follower.start(LATER)
    follower.see(START, 2)
    assert follower.rejected == {"joint_state": 1}
    assert "is of an earlier run: the present run began at" in (
        follower.node.topic_faults.last_rejection
    )
    follower.see(LATER, 0)
    assert follower.seen == [(START, 0), (START, 1), (LATER, 0)]


def test_in_a_run_any_later_step_may_come_and_no_earlier_one(follower: Follower) -> None:
    follower.start(START)
    follower.see(START, 400, 401, 5000, 3, 5000, 5001)
    assert follower.seen == [(START, step) for step in (400, 401, 5000, 5001)]
    assert follower.rejected == {"joint_state": 2}
    assert "step 5000 is stale: step 5000 has already been received" in (
        follower.node.topic_faults.last_rejection
    )
    follower.start(LATER)
    follower.see(LATER, 7, 8)
    assert follower.seen[4:] == [(LATER, 7), (LATER, 8)]


def test_a_new_run_may_start_earlier_than_the_last_one_but_not_with_it(follower: Follower) -> None:
    follower.start(LATER)
    follower.see(LATER, 0)
    follower.start(LATER)
    follower.see(LATER, 1)
    follower.start(START)  # by a clock that was set back
    follower.see(START, 0)
    assert follower.seen == [(LATER, 0), (LATER, 1), (START, 0)]
    assert follower.node.runs == [LATER, START]


def test_a_stamp_between_two_steps_is_reported_soon_and_yet_counts_in_its_run(
    follower: Follower,
) -> None:
    follower.start(START)
    follower.see(START, 0)
    follower.see(START, 1, off=12_345)
    assert follower.rejected == {}, "it may be of a run that is not known yet"
    follower.world.until(lambda: follower.rejected == {"joint_state": 1})
    assert "is between two steps of 0.1 s" in follower.node.topic_faults.last_rejection
    follower.world.spin(2.5)
    assert follower.rejected == {"joint_state": 1}, "it is reported once"
    follower.start(START + 12_345)
    assert follower.seen == [(START, 0), (START + 12_345, 1)]


def test_what_is_kept_for_a_run_is_rejected_if_it_is_of_none(follower: Follower) -> None:
    follower.start(START)
    follower.see(LATER, 0)
    follower.start(LATER + SECOND)  # the start of the run in between was lost
    assert follower.seen == []
    assert follower.rejected == {"joint_state": 1}


def test_malformed_states_are_counted_and_states_from_far_away_do_no_harm(
    follower: Follower,
) -> None:
    follower.start(START)
    follower.see(START, 0)
    for _ in range(2):
        follower.see(START, 1, far=np.nan)
    follower.see(START, 1, far=1e11)
    follower.see(START, 2)
    assert follower.seen == [(START, 0), (START, 1), (START, 2)]
    assert follower.rejected == {"joint_state": 2}


def test_a_start_that_is_no_time_is_rejected(follower: Follower) -> None:
    follower.start(-SECOND)
    follower.world.send(follower.world._starts["run_start"], Time(sec=1, nanosec=10**9))
    assert follower.rejected == {"run_start": 2}
    assert follower.node.runs == []


def test_as_many_messages_as_a_queue_holds_are_kept_and_the_rest_is_counted(
    world: Any, wire: Any, scenario_file: ScenarioFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    follower = Follower(HumanAgent, world, wire, scenario_file("uu", steps=1000))
    depth = qos.RECENT.depth
    follower.see(START, *range(depth + 3))
    assert follower.rejected == {"joint_state": 3}
    assert "no run_start has been received" in follower.node.topic_faults.last_rejection
    follower.start(START)
    assert [step for _, step in follower.seen] == list(range(3, depth + 3))
    monkeypatch.setattr(checked_subscription, "_KEPT_BYTES", 2000)
    follower.see(LATER, *range(depth))
    assert 3 < follower.rejected["joint_state"] < 3 + depth
    follower.start(LATER)
    kept = [step for start, step in follower.seen if start == LATER]
    assert kept and kept == list(range(depth - len(kept), depth))


def test_a_node_with_states_of_no_run_says_that_it_waits_for_its_start(
    world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    follower = Follower(HumanAgent, world, wire, scenario_file("uu"))
    reports = world.reports(follower.node)
    follower.see(START, 0)
    world.until(lambda: any(r.message == "waits for run_start" for r in reports))


def test_strategies_wait_for_the_start_of_their_run_and_meet_no_state_of_another(
    world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    node = world.add(
        RobotPlanner,
        scenario=scenario_file("uu", steps=1000, horizon=100),
        time="realtime",
        safety=False,
        brake_after=60.0,
        max_strategy_age=60.0,
    )
    states, reports = world.states(), world.reports(node)
    strategies = world.publisher(Float64MultiArray, "robot_strategy", qos.RECENT)
    s = node.scenario.initial_vehicle_state
    for start, horizon in ((START, 20), (LATER, 40), (LATER + 7_777_777_777, 60)):
        of_run, told = wire(node.scenario), len(reports)
        of_run.clock.start = start
        world.send(strategies, of_run.strategy(0, np.zeros((horizon, 2))))
        world.send(states, of_run.state(0, s))
        world.start_run(start)
        world.until(lambda told=told: len(reports) > told)
        assert [r.values["run"] for r in reports[told:]] == [stamp.text(start)]
        assert [r.values["step"] for r in reports[told:]] == ["0"]
        # This one waits, as the strategy does not reach it; that of the next run would.
        world.send(states, of_run.state(horizon + 5, s))
    assert node.topic_faults.rejected == {}


@pytest.mark.parametrize("kind", [Recorder, Viewer])
def test_beliefs_wait_for_the_start_of_their_run_too(
    kind: Any, world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    node = world.add(kind, scenario=scenario_file("uu"), **KINDS[kind])
    beliefs = world.publisher(Float64MultiArray, "belief", qos.STREAM)
    wire = wire(node.scenario)

    def tell(time: int) -> None:
        wire.clock.start = time
        world.send(beliefs, wire.belief(0))

    def solved() -> set[int]:
        if kind is Recorder:
            return set(node.record.beliefs)
        shown = node.run._belief.get("step")
        return set() if shown is None else {shown}

    tell(START)
    assert solved() == set()
    world.start_run(START)
    assert solved() == {0}
    tell(LATER)
    world.start_run(LATER)
    assert solved() == {0}
    tell(START + SECOND)
    assert node.topic_faults.rejected == {"belief": 1}
    tell(LATER + SECOND)
    assert 10 in solved()


def test_the_past_of_one_run_is_not_drawn_in_the_next(
    world: Any, wire: Any, scenario_file: ScenarioFile
) -> None:
    follower = Follower(Inference, world, wire, scenario_file("uu", steps=1000))
    follower.start(START)
    follower.see(START, *range(7))
    assert len(follower.node._scene._past) == 2
    follower.start(LATER)
    follower.see(LATER, 0, 1)
    assert len(follower.node._scene._past) == 1
