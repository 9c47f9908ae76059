"""The safety layer keeps the clearance, and lets who is too close move away."""

from __future__ import annotations

import numpy as np
import pytest
from guarded import (
    ALONG,
    CLEARANCE,
    DT,
    LOOK_AHEAD,
    MARGIN,
    ROBOTS,
    assert_goes_on_rightly,
    make,
    push,
    room,
    rooms,
    speed_of,
)
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from examples import examples
from gameinfer_ros.planning import BRAKES, GOES_ON, PASSES, SafePlan


@settings(max_examples=examples(40), derandomize=True)
@given(
    kind=st.sampled_from(list(ROBOTS)),
    speed=st.floats(0.0, 2.6),  # 3 m/s^2 bring it to rest in the look-ahead without its first step
    more=st.floats(0.0, 1.0),
    wanted=st.floats(-1.0, 50.0),
)
def test_who_drives_at_a_standing_person_stops_before_the_clearance(
    kind: str, speed: float, more: float, wanted: float
) -> None:
    _, guard = make(kind)
    stopping = speed * DT + speed * (speed + 3.0 * DT) / 6.0
    person = CLEARANCE + stopping + more
    s = np.concatenate([ALONG[kind](0.0, speed), [person, 0.0, 1.0, 0.0]])
    for _ in range(60):
        found = guard.check(s, np.array([push(kind, wanted)] * 3))
        s = np.concatenate([found.states[1], s[-4:]])
        assert person - s[0] >= CLEARANCE - 1e-9
    if wanted > 0.5 and kind != "unicycle without limits":
        assert abs(speed_of(kind, s)) < 0.3
        assert person - s[0] < CLEARANCE + 0.35, "stops long before it has to"


@settings(max_examples=examples(100), derandomize=True)
@given(
    bearing=st.floats(-np.pi, np.pi),
    distance=st.floats(0.01, 0.49),
    a=st.floats(0.01, 3.0),
    speed=st.floats(0.0, 2.0),
)
def test_who_stands_too_close_may_always_move_away(
    bearing: float, distance: float, a: float, speed: float
) -> None:
    _, guard = make("double integrator")
    away = np.array([np.cos(bearing), np.sin(bearing)])
    person = [-distance * away[0], -distance * away[1], 0.3, 0.0]
    s = np.array([0.0, speed * away[0], 0.0, speed * away[1], *person])
    inputs = np.array([a * away])
    found = guard.check(s, inputs)
    assert found.action == PASSES
    np.testing.assert_array_equal(found.inputs, inputs)


@pytest.mark.parametrize("turn", [-1.5, 0.0, 1.5])
def test_who_stands_too_close_may_turn_and_back_off_but_not_come_closer(turn: float) -> None:
    _, guard = make("unicycle")
    s = np.array([0.0, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    assert guard.check(s, np.array([[turn, 0.0]])).action == PASSES
    assert guard.check(s, np.array([[turn, -1.0]])).action == PASSES
    found = guard.check(s, np.array([[turn, 1.0]]))
    assert found.action == BRAKES
    assert found.reason.endswith("m to human_0 within 0.2 s, and the clearance is 0.5 m")
    np.testing.assert_array_equal(found.inputs, [[0.0, 0.0]])


def test_a_robot_that_would_be_hit_when_it_stops_does_not_brake() -> None:
    """A person approaches from behind, faster: a robot that brakes would be hit."""
    vehicles, guard = make("unicycle")
    s = np.array([0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.1])
    inputs = np.array([[0.0, 1.0]])
    assert room(vehicles, s, inputs) < CLEARANCE
    found = guard.check(s, inputs)
    assert found.action == PASSES
    np.testing.assert_array_equal(found.inputs, inputs)


def test_where_braking_changes_nothing_a_plan_passes() -> None:
    """A person passes too close in any case; rounding decides between two equal distances."""
    _, guard = make("unicycle")
    for a in np.linspace(-2.0, 2.0, 41):
        s = np.array([0.0, 0.0, 0.0, 0.5, -1.0, 0.3, 0.0, 3.0])
        assert guard.check(s, np.array([[0.0, a]])).action == PASSES


people = st.lists(
    st.tuples(
        st.floats(-2.5, 2.5), st.floats(-2.5, 2.5), st.floats(-np.pi, np.pi), st.floats(0, 1.5)
    ),
    min_size=2,
    max_size=2,
)


@settings(max_examples=examples(80), derandomize=True)
@example(  # 0.49 m, and braking leaves no more
    kind="unicycle",
    speed=-0.625,
    others=[(0.0, 1.0, 0.0, 0.0), (0.0, -0.609375, 1.03125, 0.28125)],
    inputs=np.array([[0.0, -0.5]] + 5 * [[0.0, 0.0]]),
)
@given(
    kind=st.sampled_from(["unicycle", "car", "double integrator"]),
    speed=st.floats(-1.0, 2.0),
    others=people,
    inputs=arrays(float, (6, 2), elements=st.floats(-1.0, 1.0)),
)
def test_a_plan_is_judged_as_a_walk_through_the_seconds_ahead_says(
    kind: str, speed: float, others: list[tuple[float, ...]], inputs: np.ndarray
) -> None:
    vehicles, guard = make(kind, people=2)
    s = np.concatenate([ALONG[kind](0.0, speed), *others])
    found: SafePlan = guard.check(s, inputs)
    # During a step the layer takes curves for straight lines, which are off by millimetres.
    off = 0.01
    of_parts = rooms(vehicles, [(s, inputs[: k + 1]) for k in range(len(inputs))])
    first = room(vehicles, s, inputs[:1], after=DT)
    brake = vehicles.braking_input(0, s[vehicles.states(0)])[None]
    if found.action in (BRAKES, GOES_ON):
        braking = room(vehicles, s, brake, after=DT)
        whole = room(vehicles, s, inputs, after=DT, until=LOOK_AHEAD)
        assert of_parts[0] < CLEARANCE + off
        assert first < braking + off or room(vehicles, s, brake) > CLEARANCE - off
        if found.action == GOES_ON:
            assert_goes_on_rightly(found, inputs, braking, whole)
            return
        assert braking > CLEARANCE - off or whole < braking + MARGIN + 2 * off
        np.testing.assert_array_equal(found.inputs, brake)
        return
    assert found.action == PASSES
    sent = len(found.inputs)
    np.testing.assert_array_equal(found.inputs, inputs[:sent])
    # It may be alone where the room is too small, which the walk does not know to the millimetre.
    allowed = sent == 1 and first > room(vehicles, s, brake, after=DT) - off
    if of_parts[0] < CLEARANCE - off:
        assert allowed
    elif of_parts[0] > CLEARANCE + off or not allowed:
        assert all(found > CLEARANCE - off for found in of_parts[1:sent])
        assert sent == len(inputs) or of_parts[sent] < CLEARANCE + off
