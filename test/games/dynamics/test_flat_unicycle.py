"""The flat unicycle: what the game sees of a unicycle, and what the unicycle does for the game."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from examples import examples
from gameinfer_ros.games import DoubleIntegrator, FlatUnicycle, Unicycle

FLAT, DT = FlatUnicycle(), 0.1

# Standing, hardly moving and moving; towards each other, along and across the heading.
speeds = st.sampled_from((0.0, 1e-300, -1e-12, 1e-6, 0.3)) | st.floats(-3.0, 3.0)
states = st.builds(
    lambda px, py, theta, v: np.array([px, py, theta, v]),
    *(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-20.0, 20.0), speeds),
)
inputs = arrays(float, 2, elements=st.floats(-5.0, 5.0))
many = settings(max_examples=examples(200), derandomize=True)


def drive(s: np.ndarray, w: np.ndarray, dt: float = DT) -> np.ndarray:
    """Where a unicycle in the state (4,) is after a step under the input (2,)."""
    s_next = np.empty((4, 1))
    Unicycle.step_kernel(s[:, None], w[:, None], dt, np.empty(0), s_next)
    return s_next[:, 0]


def play(x: np.ndarray, u: np.ndarray, dt: float = DT) -> np.ndarray:
    """Where the game sees the player after a step."""
    x_next = np.empty((4, 1))
    FlatUnicycle.step_kernel(x[:, None], u[:, None], dt, np.empty(0), x_next)
    return x_next[:, 0]


def stop(s: np.ndarray, dt: float = DT) -> np.ndarray:
    """The input in the game that brings a unicycle to rest."""
    return -FLAT.game_state(s)[[1, 3]] / dt


def random_states(count: int, slowest: float = 0.0) -> np.ndarray:
    rng = np.random.default_rng(0)
    s = rng.uniform(-3.0, 3.0, (count, 4))
    s[:, 3] = rng.choice([-1.0, 1.0], count) * rng.uniform(slowest, 3.0, count)
    return s


def test_it_is_a_unicycle_that_the_game_takes_for_a_double_integrator() -> None:
    assert FLAT.vehicle == Unicycle()
    assert FLAT.state_names == ("px", "vx", "py", "vy") == DoubleIntegrator.state_names
    s = np.array([1.0, 2.0, np.pi / 3, -2.0])
    np.testing.assert_allclose(FLAT.game_state(s), [1.0, -1.0, 2.0, -np.sqrt(3)], rtol=1e-15)


@many
@given(s=states, u=inputs)
@example(s=np.array([0.0, 0.0, 0.0, 0.0]), u=np.zeros(2))
@example(s=np.array([0.0, 0.0, 1.0, 0.0]), u=np.array([0.0, -5.0]))
@example(s=np.array([0.0, 0.0, 0.0, 0.5]), u=np.array([-5.0, 0.0]))  # it just stops
@example(s=np.array([0.0, 0.0, 0.0, 0.5]), u=np.array([-10.0, 0.0]))  # it backs up
def test_it_gets_the_velocity_of_the_game_by_a_quarter_turn_at_most(
    s: np.ndarray, u: np.ndarray
) -> None:
    w = FLAT.vehicle_input(s, u, DT)
    after, expected = FLAT.game_state(drive(s, w)), play(FLAT.game_state(s), u)
    np.testing.assert_allclose(after[[1, 3]], expected[[1, 3]], rtol=0, atol=2e-9)
    assert abs(w[0]) <= np.pi / (2 * DT) + 1e-9
    assert abs(w[1]) <= (2 * abs(s[3]) + np.hypot(*u) * DT) / DT + 1e-9
    # The game gets its input back.
    again = FLAT.game_input(s, w, DT)
    np.testing.assert_allclose(again, u, rtol=0, atol=2e-8)  # 2 * STANDSTILL / DT


@many
@given(s=states, w=arrays(float, 2, elements=st.floats(-5.0, 5.0)))
def test_the_game_sees_what_a_unicycle_really_does(s: np.ndarray, w: np.ndarray) -> None:
    u = FLAT.game_input(s, w, DT)
    after, expected = FLAT.game_state(drive(s, w)), play(FLAT.game_state(s), u)
    np.testing.assert_allclose(after[[1, 3]], expected[[1, 3]], rtol=0, atol=1e-12)


@many
@given(s=states, near=st.floats(-20.0, 20.0))
def test_a_vehicle_is_where_the_game_says_and_turns_no_more_than_it_must(
    s: np.ndarray, near: float
) -> None:
    x = FLAT.game_state(s)
    found = FLAT.vehicle_state(x, np.array([9.0, 9.0, near, 9.0]))
    np.testing.assert_allclose(FLAT.game_state(found), x, rtol=0, atol=2e-9)
    assert abs(found[2] - near) <= np.pi / 2 + 1e-9
    if abs(s[3]) > 1e-6:
        half_turns = (found[2] - s[2]) / np.pi
        assert half_turns == pytest.approx(round(half_turns), abs=1e-8)


def test_it_tends_to_the_continuous_map_as_the_step_gets_short() -> None:
    s = random_states(50, slowest=0.5)
    u = np.random.default_rng(1).uniform(-2.0, 2.0, (50, 2))
    c, sn, v = np.cos(s[:, 2]), np.sin(s[:, 2]), s[:, 3]
    omega = (-sn * u[:, 0] + c * u[:, 1]) / v
    a = c * u[:, 0] + sn * u[:, 1]

    def error(dt: float) -> float:
        return float(np.abs(FLAT.vehicle_input(s, u, dt) - np.stack([omega, a], axis=1)).max())

    assert error(1e-5) < 1e-3
    assert error(1e-4) < 0.11 * error(1e-3) < 0.11 * 0.11 * error(1e-2)


def position_errors(s: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """How far each unicycle (K, 4) is from where the game expects it after a step (K,), in m."""
    errors = [
        FLAT.game_state(drive(own, FLAT.vehicle_input(own, inputs, dt), dt))
        - play(FLAT.game_state(own), inputs, dt)
        for own, inputs in zip(s, u, strict=True)
    ]
    return np.hypot(*np.array(errors)[:, [0, 2]].T)


def test_its_position_is_off_by_little() -> None:
    s = random_states(50, slowest=0.5)
    u = np.random.default_rng(2).uniform(-2.0, 2.0, (50, 2))
    moving = [position_errors(s, u, dt) for dt in (0.1, 0.01)]
    assert moving[0].max() < 2e-3
    assert (moving[1] <= 2e-3 * moving[0].max()).all()  # a tenth of dt: a thousandth of the error
    s[:, 3] = 0.0
    standing = [position_errors(s, u, dt) for dt in (0.1, 0.01)]
    # It turns on its way, where the game goes straight: at most all of u dt^2 / 2 is in error.
    assert (standing[0] <= 0.5 * 0.1**2 * np.hypot(*u.T)).all()
    np.testing.assert_allclose(standing[1], 1e-2 * standing[0], rtol=1e-6)


@pytest.mark.parametrize("speed", [0.0, 1e-17, -1e-17])
def test_from_a_standstill_it_goes_where_the_game_wants_it_to(speed: float) -> None:
    ahead, aside, back = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    s = np.array([0.0, 0.0, 0.0, speed])
    np.testing.assert_allclose(FLAT.vehicle_input(s, ahead, DT), [0.0, 1.0], atol=1e-9)
    np.testing.assert_allclose(
        np.abs(FLAT.vehicle_input(s, aside, DT)), [np.pi / 2 / DT, 1.0], atol=1e-9
    )
    np.testing.assert_allclose(FLAT.vehicle_input(s, back, DT), [0.0, -1.0], atol=1e-9)


@pytest.mark.parametrize("heading", [0.0, 1.0, -2.5, 17.0])
def test_who_stands_or_stops_keeps_the_heading(heading: float) -> None:
    for v in (0.0, 0.7, -0.7):
        s = np.array([1.0, 2.0, heading, v])
        after = drive(s, FLAT.vehicle_input(s, stop(s), DT))
        np.testing.assert_allclose(after[2:], [heading, 0.0], rtol=0, atol=1e-12)
    x = np.array([1.0, 0.0, 2.0, 0.0])
    np.testing.assert_array_equal(
        FLAT.vehicle_state(x, np.array([5.0, 5.0, heading, 3.0])), [1.0, 2.0, heading, 0.0]
    )


def test_many_at_once_are_as_one_by_one() -> None:
    rng = np.random.default_rng(3)
    s, u = rng.normal(size=(3, 4, 4)), rng.normal(size=(3, 4, 2))
    s[0, 0, 3] = 0.0
    x, w = FLAT.game_state(s), FLAT.vehicle_input(s, u, DT)
    near = rng.normal(size=(3, 4, 4))
    for k in np.ndindex(3, 4):
        np.testing.assert_allclose(x[k], FLAT.game_state(s[k]), rtol=1e-15)
        np.testing.assert_allclose(w[k], FLAT.vehicle_input(s[k], u[k], DT), rtol=1e-12)
        np.testing.assert_allclose(
            FLAT.vehicle_state(x, near)[k], FLAT.vehicle_state(x[k], near[k]), rtol=1e-12
        )
        np.testing.assert_allclose(
            FLAT.game_input(s, w, DT)[k], FLAT.game_input(s[k], w[k], DT), rtol=1e-12
        )
