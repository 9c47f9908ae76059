"""The motion of single vehicles, against one step after the other."""

from __future__ import annotations

import numpy as np
import pytest

from gameinfer_ros.games import Car, DoubleIntegrator, Game, Unicycle, Vehicles
from gameinfer_ros.games.moving_points import MovingPoints
from gameinfer_ros.lanes.blocks import WIDE

DT = 0.1
VEHICLES = {
    "unicycle": (Unicycle(), {"omega": (-2.0, 2.0), "a": (-3.0, 2.0)}),
    "car": (Car(wheelbase=0.5), {"a": (-1.0, 2.0)}),
    "double integrator": (DoubleIntegrator(), {"ax": (-3.0, 3.0)}),
    "without limits": (Unicycle(), {}),
}


@pytest.fixture(params=list(VEHICLES))
def vehicles(request: pytest.FixtureRequest) -> Vehicles:
    """Of a robot and somebody else; the motion of the robot is tested."""
    vehicle, limits = VEHICLES[request.param]
    return Vehicles(Game({"other": Unicycle(), "robot": vehicle}, [], DT, 5), {"robot": limits})


def step_by_step(vehicles: Vehicles, s: np.ndarray, w: np.ndarray, steps: int) -> np.ndarray:
    """States (T + 1, n) of the robot, by steps of all vehicles."""
    joint, own = np.zeros(vehicles.n_states), vehicles.states(1)
    joint[own] = s
    states = [s]
    for k in range(steps):
        joint_input = np.zeros(vehicles.n_inputs)
        braking = vehicles.braking_input(1, joint[own])
        joint_input[vehicles.inputs(1)] = w[k] if k < len(w) else braking
        joint = vehicles.step(joint, joint_input)
        states.append(joint[own])
    return np.array(states)


@pytest.mark.parametrize("given", [0, 1, 3, 12])
@pytest.mark.parametrize("particles", [1, WIDE, 11])
def test_a_motion_is_one_step_after_the_other_to_the_last_bit(
    vehicles: Vehicles, particles: int, given: int
) -> None:
    rng, motion = np.random.default_rng(0), vehicles.motions[1]
    s = rng.normal(size=(vehicles.dynamics[1].n_states, particles))
    w = rng.normal(size=(given, 2, particles))
    found = motion.states(s, w, 8)
    for p in range(particles):
        expected = step_by_step(vehicles, s[:, p], w[..., p], 8)
        np.testing.assert_array_equal(found[..., p], expected)
        np.testing.assert_array_equal(motion.states(s[:, p], w[..., p], 8), expected)


def test_distances_are_those_to_points_that_move_straight_ahead(vehicles: Vehicles) -> None:
    rng, motion = np.random.default_rng(1), vehicles.motions[1]
    s, w = rng.normal(size=(vehicles.dynamics[1].n_states, 10)), rng.normal(size=(2, 2, 10))
    others = MovingPoints(rng.normal(size=(4, 2)), rng.normal(size=(4, 2)))
    start = np.array([0.0, 1.0, 5.0, 2.0, 2.0, 9.0, 3.0, 1.0, 7.0, 4.0])
    found = motion.distances(s, w, 6, others, start)
    assert found.shape == (6, 4, 10)
    positions = motion.states(s, w, 6)[:, list(vehicles.dynamics[1].position)]
    fine = np.linspace(0.0, 1.0, 2001)[:, None]
    for k in range(6):
        for p in range(10):
            own = (1 - fine) * positions[k, :, p] + fine * positions[k + 1, :, p]
            for j in range(4):
                times = DT * (start[p] + k + fine)
                other = others.positions[j] + times * others.velocities[j]
                smallest = np.linalg.norm(other - own, axis=1).min()
                assert found[k, j, p] == pytest.approx(smallest, abs=1e-3)
                assert found[k, j, p] < smallest + 1e-12


def test_a_vehicle_that_rests_beside_a_resting_point_keeps_its_distance(
    vehicles: Vehicles,
) -> None:
    others = MovingPoints(np.array([[3.0, 4.0]]), np.zeros((1, 2)))
    s = np.zeros((vehicles.dynamics[1].n_states, 1))
    found = vehicles.motions[1].distances(s, np.zeros((0, 2, 1)), 4, others, np.zeros(1))
    np.testing.assert_array_equal(found, np.full((4, 1, 1), 5.0))


def test_what_is_not_a_number_is_no_distance(vehicles: Vehicles) -> None:
    others = MovingPoints(np.array([[3.0, 4.0], [np.nan, 0.0]]), np.zeros((2, 2)))
    s = np.zeros((vehicles.dynamics[1].n_states, 2))
    s[vehicles.dynamics[1].position[0], 1] = np.inf
    found = vehicles.motions[1].distances(s, np.zeros((0, 2, 2)), 2, others, np.zeros(2))
    np.testing.assert_array_equal(np.isfinite(found), [[[True, False], [False, False]]] * 2)


def test_without_others_there_are_no_distances(vehicles: Vehicles) -> None:
    nobody = MovingPoints(np.zeros((0, 2)), np.zeros((0, 2)))
    s, w = np.zeros((vehicles.dynamics[1].n_states, 9)), np.zeros((1, 2, 9))
    assert vehicles.motions[1].distances(s, w, 3, nobody, np.zeros(9)).shape == (3, 0, 9)
