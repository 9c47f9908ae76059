"""Every kind of dynamics is held against its own differential equation.

A new kind joins the tests by an entry in EXAMPLES.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pydantic import ValidationError
from scipy.integrate import solve_ivp

from examples import examples
from gameinfer_ros.games import Car, DoubleIntegrator, Dynamics, FlatUnicycle, Unicycle, Vehicle
from gameinfer_ros.games.tables import written_items

Rates = Callable[[np.ndarray, np.ndarray], np.ndarray]


def unicycle_rates(x: np.ndarray, u: np.ndarray) -> np.ndarray:
    return np.array([x[3] * np.cos(x[2]), x[3] * np.sin(x[2]), u[0], u[1]])


def double_integrator_rates(x: np.ndarray, u: np.ndarray) -> np.ndarray:
    return np.array([x[1], u[0], x[3], u[1]])


def car_rates(x: np.ndarray, u: np.ndarray) -> np.ndarray:
    theta, v, steering = x[2:]
    return np.array([v * np.cos(theta), v * np.sin(theta), v * np.tan(steering) / 1.5, u[1], u[0]])


@dataclass(frozen=True)
class Example:
    """Dynamics, what they approximate, and how well.

    Attributes:
        dynamics: an instance of the kind.
        rates: d/dt x as a function of x and u.
        step_error: of one step of 0.1 s, with |x| <= `largest` and |u| <= 2, in SI units.
        euler: whether `linearise` follows Euler's rule; else it is the Jacobian of the step.
        largest: absolute value of the states, one for each or one for all.
    """

    dynamics: Dynamics
    rates: Rates
    step_error: float
    euler: bool
    largest: float | tuple[float, ...] = 3.0


EXAMPLES = {
    "unicycle": Example(Unicycle(), unicycle_rates, 1e-7, euler=True),
    "double_integrator": Example(DoubleIntegrator(), double_integrator_rates, 1e-11, euler=False),
    "car": Example(
        Car(wheelbase=1.5), car_rates, 2e-6, euler=True, largest=(3.0, 3.0, 3.0, 3.0, 0.6)
    ),
    "flat_unicycle": Example(FlatUnicycle(), double_integrator_rates, 1e-11, euler=True),
}
KINDS = sorted(Dynamics.family)
VEHICLES = [kind for kind in KINDS if issubclass(Dynamics.family[kind], Vehicle)]

unit = st.floats(-1.0, 1.0, allow_subnormal=False)
vectors = arrays(float, 12, elements=unit)


@pytest.fixture(params=KINDS)
def example(request: pytest.FixtureRequest) -> Example:
    assert request.param in EXAMPLES, f"give an example of the kind '{request.param}' in EXAMPLES"
    return EXAMPLES[request.param]


@pytest.fixture(params=VEHICLES)
def vehicle(request: pytest.FixtureRequest) -> Vehicle:
    return EXAMPLES[request.param].dynamics


def sample(example: Example, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A state and an input from a vector of numbers between -1 and 1."""
    n, m = example.dynamics.n_states, example.dynamics.n_inputs
    return example.largest * np.resize(values, n), 2.0 * np.resize(values[::-1], m)


def step(dynamics: Dynamics, x: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """Next states (n, L) of the states (n, L) under the inputs (m, L)."""
    x_next = np.full_like(x, np.nan)
    type(dynamics).step_kernel(x, u, dt, np.array(dynamics.params, dtype=float), x_next)
    return x_next


def step_one(dynamics: Dynamics, x: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    return step(dynamics, x[:, None], u[:, None], dt)[:, 0]


def linearise(
    dynamics: Dynamics, x: np.ndarray, u: np.ndarray, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """A (n, n, L) and B (n, m, L) at the states (n, L) and inputs (m, L)."""
    n, m = dynamics.n_states, dynamics.n_inputs
    A, B = np.zeros((n, n, x.shape[1])), np.zeros((n, m, x.shape[1]))
    params = np.array(dynamics.params, dtype=float)
    type(dynamics).linearise_kernel(x, u, dt, params, A, B)
    return A, B


def jacobian(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
    h = 1e-5
    columns = [(function(at + h * e) - function(at - h * e)) / (2 * h) for e in np.eye(len(at))]
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=examples(40), derandomize=True)
@given(values=vectors)
def test_step_follows_the_differential_equation(kind: str, values: np.ndarray) -> None:
    example = EXAMPLES[kind]
    x, u = sample(example, values)
    exact = solve_ivp(
        lambda _, state: example.rates(state, u), (0.0, 0.1), x, rtol=1e-12, atol=1e-13
    ).y[:, -1]
    np.testing.assert_allclose(
        step_one(example.dynamics, x, u, 0.1), exact, rtol=0, atol=example.step_error
    )


@pytest.mark.parametrize("kind", ["unicycle", "car"])
def test_wheeled_vehicles_step_by_runge_kutta_4_with_two_sub_steps(kind: str) -> None:
    rng, dynamics, rates = np.random.default_rng(1), EXAMPLES[kind].dynamics, EXAMPLES[kind].rates
    for _ in range(20):
        x0, u = rng.normal(0.0, 3.0, dynamics.n_states), rng.normal(0.0, 3.0, 2)
        x0[4:] /= 6.0  # no car steers by 3 rad
        u[0] /= 1.0 if kind == "unicycle" else 6.0
        x, h = x0.copy(), 0.25
        for _ in range(2):
            k1 = rates(x, u)
            k2 = rates(x + h / 2 * k1, u)
            k3 = rates(x + h / 2 * k2, u)
            k4 = rates(x + h * k3, u)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        np.testing.assert_allclose(step_one(dynamics, x0, u, 2 * h), x, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=examples(30), derandomize=True)
@given(values=vectors)
def test_linearise_follows_its_rule(kind: str, values: np.ndarray) -> None:
    example, dt = EXAMPLES[kind], 0.1
    x, u = sample(example, values)
    if example.euler:
        A = np.eye(len(x)) + dt * jacobian(lambda state: example.rates(state, u), x)
        B = dt * jacobian(lambda control: example.rates(x, control), u)
    else:
        A = jacobian(lambda state: step_one(example.dynamics, state, u, dt), x)
        B = jacobian(lambda control: step_one(example.dynamics, x, control, dt), u)
    A_given, B_given = linearise(example.dynamics, x[:, None], u[:, None], dt)
    np.testing.assert_allclose(A_given[..., 0], A, rtol=0, atol=1e-8)
    np.testing.assert_allclose(B_given[..., 0], B, rtol=0, atol=1e-8)


def test_the_solver_knows_every_item_that_linearise_writes(example: Example) -> None:
    # It leaves out all others: an item that it did not know of would be lost.
    rng, dynamics = np.random.default_rng(8), example.dynamics
    n, m = dynamics.n_states, dynamics.n_inputs
    x = rng.uniform(-1, 1, (300, n)) * example.largest
    u = rng.normal(0, 2, (300, m))
    x[:10], u[:5] = 0.0, 0.0
    A, B = np.full((n, n, 300), np.nan), np.full((n, m, 300), np.nan)
    params = np.array(dynamics.params, dtype=float)
    type(dynamics).linearise_kernel(x.T.copy(), u.T.copy(), 0.1, params, A, B)
    for written, matrix, from_zero in zip(
        written_items(dynamics), (A, B), linearise(dynamics, x.T.copy(), u.T.copy(), 0.1),
        strict=True,
    ):  # fmt: skip
        np.testing.assert_array_equal(~np.isnan(matrix).any(axis=-1), written)
        np.testing.assert_array_equal(~np.isnan(matrix).all(axis=-1), written)
        assert not from_zero[~written].any()
        assert (from_zero[written] != 0.0).any(axis=-1).all(), "none is there in vain"


@pytest.mark.parametrize("lanes", [1, 2, 3, 8, 33])
def test_a_lane_is_the_same_in_any_block(example: Example, lanes: int) -> None:
    rng = np.random.default_rng(3)
    n, m = example.dynamics.n_states, example.dynamics.n_inputs
    x, u = rng.normal(0, 2, (n, 70)), rng.normal(0, 2, (m, 70))
    whole = (step(example.dynamics, x, u, 0.1), *linearise(example.dynamics, x, u, 0.1))
    x[:, 4], u[:, 4] = np.nan, np.inf  # a lane without numbers leaves the others alone
    for first in range(0, 70, lanes):
        block = slice(first, min(first + lanes, 70))
        x_block, u_block = np.ascontiguousarray(x[:, block]), np.ascontiguousarray(u[:, block])
        parts = (
            step(example.dynamics, x_block, u_block, 0.1),
            *linearise(example.dynamics, x_block, u_block, 0.1),
        )
        others = np.arange(70)[block] != 4
        for part, all_lanes in zip(parts, whole, strict=True):
            np.testing.assert_array_equal(part[..., others], all_lanes[..., block][..., others])


@pytest.mark.parametrize("kind", VEHICLES)
@settings(max_examples=examples(30), derandomize=True)
@given(values=vectors)
def test_twist_is_the_rate_of_the_pose_in_the_body_frame(kind: str, values: np.ndarray) -> None:
    dynamics, rates = EXAMPLES[kind].dynamics, EXAMPLES[kind].rates
    x, u = sample(EXAMPLES[kind], values)
    twists = dynamics.twists(x, u)
    for part, pose in enumerate(dynamics.poses(x)):
        rate = jacobian(lambda state, part=part: dynamics.poses(state)[part], x) @ rates(x, u)
        c, s = np.cos(pose[2]), np.sin(pose[2])
        in_part = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ rate
        np.testing.assert_allclose(twists[part], in_part, rtol=0, atol=1e-8)


@pytest.mark.parametrize("kind", VEHICLES)
@settings(max_examples=examples(30), derandomize=True)
@given(values=vectors)
def test_acceleration_is_the_rate_of_the_linear_twist(kind: str, values: np.ndarray) -> None:
    dynamics, rates = EXAMPLES[kind].dynamics, EXAMPLES[kind].rates
    x, u = sample(EXAMPLES[kind], values)
    accelerations = dynamics.accelerations(u)
    for part in range(len(accelerations)):
        rate = jacobian(lambda state, part=part: dynamics.twists(state, u)[part], x) @ rates(x, u)
        np.testing.assert_allclose(accelerations[part, :2], rate[:2], rtol=0, atol=1e-8)


def test_position_is_that_of_the_pose(example: Example) -> None:
    dynamics = example.dynamics
    s = np.random.default_rng(5).normal(size=(6, dynamics.vehicle.n_states))
    np.testing.assert_array_equal(
        dynamics.game_state(s)[:, list(dynamics.position)], dynamics.vehicle.poses(s)[:, 0, :2]
    )


def test_state_and_input_come_back_from_poses_twists_and_accelerations(vehicle: Vehicle) -> None:
    rng, dynamics = np.random.default_rng(6), vehicle
    for shape in ((), (5,), (2, 3)):
        x = rng.normal(size=(*shape, dynamics.n_states))
        u = rng.normal(size=(*shape, dynamics.n_inputs))
        poses, twists = dynamics.poses(x), dynamics.twists(x, u)
        accelerations = dynamics.accelerations(u)
        parts = 1 + len(dynamics.joints)
        assert poses.shape == twists.shape == accelerations.shape == (*shape, parts, 3)
        np.testing.assert_array_equal(dynamics.state(poses, twists), x)
        np.testing.assert_array_equal(dynamics.input(twists, accelerations), u)


def test_braking_input_stops_the_vehicle_within_one_step(vehicle: Vehicle) -> None:
    dynamics = vehicle
    for x in np.random.default_rng(7).normal(size=(10, dynamics.n_states)):
        stopped = step_one(dynamics, x, dynamics.braking_input(x, 0.1), 0.1)
        still = dynamics.twists(stopped, np.zeros(dynamics.n_inputs))
        np.testing.assert_allclose(still, 0.0, rtol=0, atol=1e-12)
        resting = step_one(dynamics, stopped, np.zeros(dynamics.n_inputs), 0.1)
        np.testing.assert_allclose(resting, stopped, rtol=0, atol=1e-12)


@settings(max_examples=examples(60), derandomize=True)
@given(yaw=st.floats(-100, 100), near=st.floats(-100, 100), rest=arrays(float, 3, elements=unit))
def test_unwrap_moves_angles_by_whole_turns_next_to_the_other(
    yaw: float, near: float, rest: np.ndarray
) -> None:
    x = np.array([rest[0], rest[1], yaw, rest[2]])
    unwrapped = Unicycle().unwrap(x, np.array([50.0, 50.0, near, 50.0]))
    np.testing.assert_array_equal(np.delete(unwrapped, 2), rest)
    assert abs(unwrapped[2] - near) <= np.pi + 1e-9
    turns = (unwrapped[2] - yaw) / (2 * np.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)
    assert x[2] == yaw, "the observed state itself must stay as it is"


def test_unwrap_leaves_states_without_angles_alone() -> None:
    x = np.array([100.0, -50.0, 30.0, 9.0])
    np.testing.assert_array_equal(DoubleIntegrator().unwrap(x, np.zeros(4)), x)


def test_a_car_brakes_without_steering() -> None:
    x = np.array([1.0, 2.0, 0.5, 3.0, 0.4])
    stopped = step_one(EXAMPLES["car"].dynamics, x, Car(wheelbase=1.5).braking_input(x, 0.1), 0.1)
    assert stopped[4] == 0.4


def test_a_car_turns_about_the_point_that_its_wheels_stand_across() -> None:
    x = np.array([0.0, 0.0, 0.0, 2.0, 0.3])
    radius = 1.5 / np.tan(0.3)
    for _ in range(40):
        x = step_one(EXAMPLES["car"].dynamics, x, np.zeros(2), 0.1)
        assert np.hypot(x[0], x[1] - radius) == pytest.approx(radius, rel=1e-5)
    assert x[2] == pytest.approx(8.0 / radius, rel=1e-12)


def test_dynamics_are_immutable_and_know_their_fields(example: Example) -> None:
    with pytest.raises(ValidationError, match="frozen"):
        example.dynamics.kind = "other"
    with pytest.raises(ValidationError, match="colour"):
        type(example.dynamics)(colour="red")


def test_whole_turns_of_angles_do_not_change_the_motion(example: Example) -> None:
    dynamics = example.dynamics
    for values in np.random.default_rng(9).uniform(-1, 1, (10, 12)):
        x, u = sample(example, values)
        for i in dynamics.angles:
            turn = 2 * np.pi * 3 * np.eye(len(x))[i]
            turned, plain = step_one(dynamics, x + turn, u, 0.1), step_one(dynamics, x, u, 0.1)
            np.testing.assert_allclose(turned, plain + turn, rtol=0, atol=1e-12)
            for a, b in zip(
                linearise(dynamics, (x + turn)[:, None], u[:, None], 0.1),
                linearise(dynamics, x[:, None], u[:, None], 0.1),
                strict=True,
            ):
                np.testing.assert_allclose(a, b, rtol=0, atol=1e-12)
