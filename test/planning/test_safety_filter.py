"""The safety layer: which plans pass, and what replaces others."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from guarded import ALONG, CLEARANCE, ROBOTS, make, push, rooms
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from examples import examples
from gameinfer_ros.games import Vehicles
from gameinfer_ros.games.motion import Motion
from gameinfer_ros.planning import BRAKES, LIMITED, PASSES, SafetyFilter, SafetySettings
from gameinfer_ros.runs import closed_loop
from gameinfer_ros.scenario import Scenario


def test_what_the_shipped_robots_do_among_three_is_left_alone(three_player: Scenario) -> None:
    free = closed_loop.run(three_player, "map", 5)
    safe = closed_loop.run(three_player, "map", 5, safety=True)
    np.testing.assert_array_equal(np.array(safe.states), np.array(free.states))
    np.testing.assert_array_equal(np.array(safe.inputs), np.array(free.inputs))
    assert (safe.safety_braked, safe.safety_limited) == (0, 0)
    assert (free.safety_braked, free.safety_limited) == (None, None)


@pytest.mark.parametrize("kind", ROBOTS)
def test_a_plan_in_an_open_space_passes_to_the_last_bit(kind: str) -> None:
    vehicles, guard = make(kind, people=2)
    rng = np.random.default_rng(0)
    for _ in range(20):
        s = np.concatenate([ALONG[kind](0.0, 1.0), [8.0, 8.0, 0.0, 1.0], [-8.0, 8.0, 0.0, 1.0]])
        inputs = rng.uniform(-1.0, 1.0, (10, 2))
        found = guard.check(s, inputs)
        np.testing.assert_array_equal(found.inputs, inputs)
        assert (found.action, found.reason, len(found.states)) == (PASSES, "", 11)
        for k in range(10):
            w = np.concatenate([inputs[k], np.zeros(4)])
            s = vehicles.step(s, w)
            np.testing.assert_array_equal(found.states[k + 1], s[vehicles.states(0)])


def test_a_robot_that_is_alone_has_limits_only() -> None:
    _, guard = make("unicycle", people=0)
    found = guard.check(np.zeros(4), np.array([[0.0, 5.0], [0.0, 1.0]]))
    assert found.action == LIMITED
    np.testing.assert_array_equal(found.inputs, [[0.0, 2.0], [0.0, 1.0]])


anything = st.floats(allow_nan=True, allow_infinity=True)


@settings(max_examples=examples(150), derandomize=True)
@given(kind=st.sampled_from(list(ROBOTS)), data=st.data())
def test_whatever_comes_in_a_vehicle_can_do_what_comes_out(kind: str, data: st.DataObject) -> None:
    vehicles, guard = make(kind)
    s = data.draw(arrays(float, vehicles.n_states, elements=anything))
    inputs = data.draw(arrays(float, (data.draw(st.integers(1, 4)), 2), elements=anything))
    found = guard.check(s, inputs)
    assert 1 <= len(found.inputs) <= len(inputs)
    assert np.isfinite(found.inputs).all()
    assert (found.inputs >= vehicles.low[:2]).all() and (found.inputs <= vehicles.high[:2]).all()
    assert len(found.states) == len(found.inputs) + 1
    assert (found.action == PASSES) == (found.reason == "")


@pytest.mark.parametrize("kind", ROBOTS)
def test_known_states_of_a_plan_change_nothing(kind: str) -> None:
    vehicles, guard = make(kind, people=2)
    rng, actions = np.random.default_rng(3), set()
    for _ in range(200):
        s = rng.normal(scale=1.5, size=vehicles.n_states)
        inputs = rng.normal(scale=rng.choice([0.3, 3.0]), size=(rng.integers(1, 20), 2))
        if rng.random() < 0.3:
            inputs[rng.integers(len(inputs)), 0] = np.nan
        states = vehicles.motions[0].states(s[vehicles.states(0)], inputs, len(inputs))
        found, expected = guard.check(s, inputs, states), guard.check(s, inputs)
        for one, other in zip(found[:2], expected[:2], strict=True):
            np.testing.assert_array_equal(one, other)
        assert found[2:] == expected[2:]
        actions.add(found.action)
    assert actions >= {PASSES, BRAKES}


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The number of particles of each motion that is simulated."""
    found: list[int] = []
    simulate = Motion._simulated

    def count(self: Motion, s: np.ndarray, w: np.ndarray, steps: int) -> np.ndarray:
        found.append(s.shape[-1])
        return simulate(self, s, w, steps)

    monkeypatch.setattr(Motion, "_simulated", count)
    return found


def test_all_inputs_of_a_plan_are_simulated_at_once(
    simulated: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A check with a simulation for each input, or of all vehicles, takes ten times as long."""
    vehicles, guard = make("unicycle", people=2)
    monkeypatch.setattr(Vehicles, "step", None)
    s = np.array([0.0, 0.0, 0.0, 1.0, 8.0, 8.0, 0.0, 1.0, -8.0, 8.0, 0.0, 1.0])
    states, w = vehicles.follow(0, s, np.zeros((8, 2)))
    assert len(guard.check(s, w, states).inputs) == 8
    assert simulated == [1, 8], "once for the plan, and once for braking after each input"


@pytest.mark.parametrize("clearance", [0.0, 0.5])
def test_a_warm_up_loads_the_code_for_one_and_for_several_inputs(
    clearance: float, simulated: list[int]
) -> None:
    vehicles, _ = make("unicycle")
    SafetyFilter(vehicles, SafetySettings(clearance=clearance)).warm_up()
    assert simulated == [1, 2, 1, 1, 1, 1]


@pytest.mark.parametrize("speed", [0.0, 0.5])
@pytest.mark.parametrize("kind", ROBOTS)
def test_a_plan_ends_before_the_first_input_that_fails_wherever_it_is(
    kind: str, speed: float
) -> None:
    vehicles, guard = make(kind)
    inputs = np.tile(push(kind, 0.0), (30, 1))
    ends, sent_walks, longer_walks = set(), [], []
    for ahead in np.linspace(0.6, 4.0, 40):
        s = np.concatenate([ALONG[kind](0.0, 1.0), [(1 + speed) * ahead, 0.0, np.pi, speed]])
        found = guard.check(s, inputs)
        sent = len(found.inputs)
        ends.add(sent)
        if found.action == PASSES:
            sent_walks.append((s, inputs[:sent]))
            if sent < 30:
                longer_walks.append((s, inputs[: sent + 1]))
    assert (rooms(vehicles, sent_walks) > CLEARANCE - 1e-9).all()
    assert (rooms(vehicles, longer_walks) < CLEARANCE + 1e-9).all()
    assert len(ends) > 20 and max(ends) == 30


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("kind", ROBOTS)
def test_a_plan_that_is_no_plan_becomes_a_brake_or_ends_before(kind: str, bad: float) -> None:
    vehicles, guard = make(kind)
    s = np.concatenate([ALONG[kind](0.0, 1.0), [9.0, 9.0, 0.0, 0.0]])
    inputs = np.full((5, 2), 0.1)
    inputs[3, 1] = bad
    found = guard.check(s, inputs)
    np.testing.assert_array_equal(found.inputs, inputs[:3])
    assert found.action == PASSES
    inputs[0, 0] = bad
    found = guard.check(s, inputs)
    np.testing.assert_array_equal(found.inputs, [vehicles.braking_input(0, s[:-4])])
    assert (found.action, found.reason) == (BRAKES, "the plan is not finite")


@pytest.mark.parametrize("kind", ROBOTS)
def test_to_brake_at_rest_is_to_do_nothing(kind: str) -> None:
    _, guard = make(kind)
    s = np.concatenate([ALONG[kind](1.0, 0.0), [9.0, 9.0, 0.0, 0.0]])
    found = guard.check(s, np.full((1, 2), np.nan))
    np.testing.assert_array_equal(found.inputs, [[0.0, 0.0]])
    np.testing.assert_array_equal(found.states[1], found.states[0])


def test_inputs_beyond_the_limits_are_clipped_and_reported() -> None:
    _, guard = make("unicycle")
    found = guard.check(
        np.array([0.0, 0.0, 0.0, 1.0, 9.0, 9.0, 0.0, 0.0]), np.array([[-7.0, 0.5], [1.0, 9.0]])
    )
    assert found.action == LIMITED and found.reason == "omega -7.00 is clipped to -2"
    np.testing.assert_array_equal(found.inputs, [[-2.0, 0.5], [1.0, 2.0]])


def test_several_threads_may_use_one_filter() -> None:
    vehicles, layer = make("unicycle", people=2)
    rng = np.random.default_rng(0)
    tasks = [
        (rng.normal(size=vehicles.n_states), rng.normal(size=(length, 2)))
        for length in (1, 3, 9, 25)
    ]
    expected = [layer.check(*task) for task in tasks]
    together = threading.Barrier(len(tasks))

    def work(number: int) -> None:
        together.wait()
        for _ in range(50):
            found = layer.check(*tasks[number])
            assert found[2:] == expected[number][2:]
            np.testing.assert_array_equal(found.states, expected[number].states)

    with ThreadPoolExecutor(len(tasks)) as threads:
        list(threads.map(work, range(len(tasks))))
