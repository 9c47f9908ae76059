"""The vehicles behind a game, what the game sees of them, and what they look like to others."""

from __future__ import annotations

import numpy as np
import pytest

from gameinfer_ros.games import (
    Car,
    DoubleIntegrator,
    Dynamics,
    FlatUnicycle,
    Game,
    Players,
    Unicycle,
    Vehicles,
)


def vehicles_of(**players: Dynamics) -> Vehicles:
    return Vehicles(Game(players, [], 0.1, 5))


@pytest.fixture
def vehicles() -> Vehicles:
    """Of players who are modelled as the vehicles that they are."""
    return vehicles_of(robot=Unicycle(), ana=DoubleIntegrator(), ben=Unicycle())


@pytest.fixture
def mixed() -> Vehicles:
    """Of players of whom the last but one is seen in flat coordinates."""
    return vehicles_of(robot=Unicycle(), ana=DoubleIntegrator(), ben=FlatUnicycle(), cy=Unicycle())


@pytest.fixture
def cars() -> Vehicles:
    return vehicles_of(robot=Car(wheelbase=2.0), ana=Unicycle(), ben=Car(wheelbase=1.0))


def test_joint_state_and_input_come_back_from_poses_rates_and_joints(
    vehicles: Vehicles, cars: Vehicles
) -> None:
    for of, parts in ((vehicles, 3), (cars, 5)):
        rng = np.random.default_rng(0)
        s, w = rng.normal(size=of.n_states), rng.normal(size=of.n_inputs)
        poses, twists, accelerations = of.poses(s), of.twists(s, w), of.accelerations(w)
        assert poses.shape == twists.shape == accelerations.shape == (parts, 3)
        np.testing.assert_array_equal(of.state(poses, twists), s)
        np.testing.assert_array_equal(of.input(twists, accelerations), w)


def test_bodies_stand_before_joints(vehicles: Vehicles, cars: Vehicles) -> None:
    assert vehicles.joint_names == vehicles.names
    assert cars.joint_names == ("robot", "ana", "ben", "robot/steering", "ben/steering")
    assert [cars.joints_of(i) for i in range(3)] == [
        ("robot", "robot/steering"),
        ("ana",),
        ("ben", "ben/steering"),
    ]
    s = np.zeros(14)
    s[[4, 13]] = 0.1, 0.2  # steering
    s[[0, 5, 9]] = 1.0, 2.0, 3.0  # px
    np.testing.assert_array_equal(cars.poses(s)[:3], [[1, 0, 0], [2, 0, 0], [3, 0, 0]])
    # A wheel is seen from the body, one wheelbase ahead.
    np.testing.assert_array_equal(cars.poses(s)[3:], [[2, 0, 0.1], [1, 0, 0.2]])


def test_poses_and_rates_of_a_whole_trajectory(vehicles: Vehicles) -> None:
    rng = np.random.default_rng(1)
    s, w = rng.normal(size=(5, 12)), rng.normal(size=(5, 6))
    for k in range(5):
        np.testing.assert_array_equal(vehicles.poses(s)[k], vehicles.poses(s[k]))
        np.testing.assert_array_equal(vehicles.twists(s, w)[k], vehicles.twists(s[k], w[k]))
        np.testing.assert_array_equal(vehicles.accelerations(w)[k], vehicles.accelerations(w[k]))


def test_unwrap_turns_only_angles(vehicles: Vehicles) -> None:
    near = np.full(12, 20.0)
    s = np.zeros(12)
    expected = np.zeros(12)
    expected[[2, 10]] = 6 * np.pi  # of the multiples of 2 pi, the one next to 20
    np.testing.assert_allclose(vehicles.unwrap(s, near), expected)


def test_others_see_the_state_but_for_the_last_bits_of_angles(cars: Vehicles) -> None:
    rng = np.random.default_rng(1)
    s = rng.normal(scale=4.0, size=cars.n_states)
    seen = cars.seen(s, s)
    angles = [2, 4, 7, 11, 13]  # headings, and how far the cars steer
    np.testing.assert_allclose(seen, s, rtol=0, atol=1e-14)
    others = np.setdiff1d(np.arange(cars.n_states), angles)
    np.testing.assert_array_equal(seen[others], s[others])
    # Whole turns are lost on the way; they come back from where things were before.
    turned = s.copy()
    turned[2] += 6 * np.pi
    np.testing.assert_allclose(cars.seen(s, turned), turned, rtol=0, atol=1e-13)
    # Looking twice changes nothing.
    np.testing.assert_allclose(cars.seen(seen, seen), seen, rtol=0, atol=1e-15)


def test_a_player_modelled_as_its_vehicle_does_the_same_in_both_to_the_bit(
    vehicles: Vehicles,
) -> None:
    rng = np.random.default_rng(2)
    s, w = rng.normal(size=(4, 12)), rng.normal(size=(4, 6))
    np.testing.assert_array_equal(vehicles.game_state(s), s)
    np.testing.assert_array_equal(vehicles.game_input(s, w), w)
    np.testing.assert_array_equal(vehicles.vehicle_input(s, w), w)
    np.testing.assert_array_equal(vehicles.along(s, s[0]), s)
    np.testing.assert_array_equal(vehicles.step(s[0], w[0]), vehicles.game.step(s[0], w[0]))
    states, inputs = vehicles.follow(2, s[0], w[:, 4:])
    np.testing.assert_array_equal(inputs, w[:, 4:])
    np.testing.assert_array_equal(states[1], vehicles.step(s[0], w[0])[8:])
    assert states.shape == (5, 4)


def test_vehicles_have_the_names_and_the_order_of_the_players(mixed: Vehicles) -> None:
    assert isinstance(mixed, Players)
    assert mixed.names == ("robot", "ana", "ben", "cy")
    assert [type(d) for d in mixed.dynamics] == [Unicycle, DoubleIntegrator, Unicycle, Unicycle]


def test_the_game_sees_each_player_in_its_own_coordinates(mixed: Vehicles) -> None:
    rng, flat = np.random.default_rng(3), slice(8, 12)
    s, w = rng.normal(size=(5, 16)), rng.normal(size=(5, 8))
    x, u = mixed.game_state(s), mixed.game_input(s, w)
    np.testing.assert_array_equal(np.delete(x, flat, axis=1), np.delete(s, flat, axis=1))
    np.testing.assert_array_equal(np.delete(u, slice(4, 6), axis=1), np.delete(w, [4, 5], axis=1))
    for k in range(5):
        np.testing.assert_allclose(x[k, flat], FlatUnicycle().game_state(s[k, flat]), rtol=1e-15)
        expected = FlatUnicycle().game_input(s[k, flat], w[k, 4:6], 0.1)
        np.testing.assert_allclose(u[k, 4:6], expected, rtol=1e-12)
    np.testing.assert_array_equal(mixed.positions(s), mixed.game.players.positions(x))


def test_one_plan_after_the_other_is_followed_to_the_velocities_it_aims_at(mixed: Vehicles) -> None:
    rng = np.random.default_rng(4)
    s = rng.normal(size=16)
    s[11] = 0.0  # from a standstill
    plan = rng.normal(size=(6, 2))
    states, w = mixed.follow(2, s, plan)
    np.testing.assert_array_equal(states[0], s[8:12])
    x = mixed.game_state(s)
    for k in range(6):
        u = np.zeros(8)
        u[4:6] = plan[k]
        x = mixed.game.step(x, u)
        joint_w = np.zeros(8)
        joint_w[4:6] = w[k]
        s = mixed.step(s, joint_w)
        np.testing.assert_array_equal(states[k + 1], s[8:12])
        np.testing.assert_allclose(mixed.game_state(s)[[9, 11]], x[[9, 11]], rtol=0, atol=1e-12)


def test_vehicles_along_a_trajectory_are_where_the_game_says(mixed: Vehicles) -> None:
    rng = np.random.default_rng(5)
    x = np.cumsum(0.1 * rng.normal(size=(30, 16)), axis=0)
    x[10:15, [9, 11]] = 0.0  # it stands still for a while
    near = rng.normal(size=16)
    s = mixed.along(x, near)
    np.testing.assert_allclose(mixed.game_state(s), x, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(s[10:15, 10], s[9, 10])
    turns = np.diff(np.concatenate([near[None], s])[:, 10])
    assert (np.abs(turns) <= np.pi / 2 + 1e-12).all()


OBSERVED = {
    "unicycle": (Unicycle(), [1.0, 2.0, 0.5, 0.8], [0.3, -0.2]),
    "double_integrator": (DoubleIntegrator(), [1.0, 0.4, 2.0, -0.3], [0.3, -0.2]),
    "car": (Car(wheelbase=0.8), [1.0, 2.0, 0.5, 0.8, 0.2], [0.3, -0.2]),
    "flat_unicycle": (FlatUnicycle(), [1.0, 2.0, 0.5, 0.8], [0.3, -0.2]),
}


@pytest.mark.parametrize("kind", OBSERVED)
def test_a_state_is_known_from_the_body_and_an_input_from_two_states(kind: str) -> None:
    dynamics, state, w = OBSERVED[kind]
    vehicles = Vehicles(Game({"a": dynamics, "b": Unicycle()}, [], 0.1, 5))
    s = np.array([*state, 5.0, 6.0, 1.0, 0.5])
    poses, twists = vehicles.poses(s), vehicles.twists(s, np.zeros(vehicles.n_inputs))
    near = s + 0.01
    np.testing.assert_allclose(vehicles.observed(0, poses[0], twists[0], near), state, atol=1e-12)
    s_next = vehicles.step(s, np.array([*w, 0.1, 0.1]))
    np.testing.assert_allclose(vehicles.input_between(0, s, s_next), w, atol=1e-6)
    np.testing.assert_allclose(vehicles.input_between(1, s, s_next), [0.1, 0.1], atol=1e-6)


def test_an_observed_heading_is_next_to_the_one_before() -> None:
    vehicles = Vehicles(Game({"a": Unicycle()}, [], 0.1, 5))
    found = vehicles.observed(0, np.array([0, 0, -3.0]), np.zeros(3), np.array([0, 0, 9.0, 0]))
    np.testing.assert_allclose(found, [0.0, 0.0, 4 * np.pi - 3.0, 0.0])


def test_a_player_without_a_heading_takes_velocities_from_a_body_that_has_one() -> None:
    vehicles = Vehicles(Game({"a": DoubleIntegrator()}, [], 0.1, 5))
    pose, twist = np.array([1.0, 2.0, np.pi / 2]), np.array([0.7, 0.1, 0.0])
    found = vehicles.observed(0, pose, twist, np.zeros(4))
    np.testing.assert_allclose(found, [1.0, -0.1, 2.0, 0.7], atol=1e-12)


def test_a_crawling_car_is_taken_to_steer_as_before() -> None:
    vehicles = Vehicles(Game({"a": Car(wheelbase=0.8)}, [], 0.1, 5))
    near = np.array([0.0, 0.0, 0.0, 0.0, 0.3])
    found = vehicles.observed(0, np.zeros(3), np.array([0.05, 0.0, 1.0]), near)
    assert found[4] == 0.3


def limited() -> Vehicles:
    """A unicycle, a car and a double integrator, each of which brakes softly in some way."""
    players = {"robot": Unicycle(), "ana": Car(wheelbase=1.0), "ben": DoubleIntegrator()}
    limits = {
        "robot": {"a": (-3.0, 1.0), "omega": (-2.0, 2.5)},
        "ana": {"a": (-0.5, 4.0)},
        "ben": {"ax": (-1.0, 2.0)},
    }
    return Vehicles(Game(players, [], 0.1, 5), limits)


def test_without_limits_a_vehicle_brakes_within_one_step(mixed: Vehicles) -> None:
    assert np.isneginf(mixed.low).all() and np.isposinf(mixed.high).all()
    s = np.random.default_rng(0).normal(size=mixed.n_states)
    for i, vehicle in enumerate(mixed.dynamics):
        own = s[mixed.states(i)]
        w = mixed.braking_input(i, own)
        np.testing.assert_array_equal(w, vehicle.braking_input(own, 0.1))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("i", [0, 1, 2])
def test_a_vehicle_with_limits_brakes_over_as_many_steps_as_they_ask_for(
    i: int, sign: float
) -> None:
    vehicles = limited()
    vehicle, own = vehicles.dynamics[i], vehicles.inputs(i)
    low, high = vehicles.low[own], vehicles.high[own]
    s = np.zeros(vehicle.n_states)
    moving = [n for n, name in enumerate(vehicle.state_names) if name in ("v", "vx", "vy")]
    brakes = [n for n, name in enumerate(vehicle.input_names) if name in ("a", "ax", "ay")]
    s[moving] = sign * 1.23
    allowed = (-low if sign > 0 else high)[brakes].min()
    steps = 0
    while np.abs(s[moving]).max() > 1e-9:
        before, w = s[moving], vehicles.braking_input(i, s)
        assert (low <= w).all() and (w <= high).all()
        s = vehicles.step_alone(i, s, w)
        assert (np.abs(s[moving]) < np.abs(before)).any() and (s[moving] * sign > -1e-9).all()
        steps += 1
        assert steps < 100, "it never comes to rest"
    assert steps == max(1, int(np.ceil(1.23 / (0.1 * allowed) - 1e-9)))
    rest = s.copy()
    rest[moving] = 0.0
    np.testing.assert_array_equal(vehicles.braking_input(i, rest), np.zeros(vehicle.n_inputs))
    np.testing.assert_array_equal(vehicles.step_alone(i, rest, np.zeros(2)), rest)


def test_a_step_alone_is_that_among_others() -> None:
    vehicles, rng = limited(), np.random.default_rng(3)
    s, w = rng.normal(size=vehicles.n_states), rng.normal(size=vehicles.n_inputs)
    after = vehicles.step(s, w)
    for i in range(len(vehicles)):
        own, inputs = vehicles.states(i), vehicles.inputs(i)
        alone = vehicles.step_alone(i, s[own], w[inputs])
        np.testing.assert_array_equal(alone, after[own])


def test_inputs_within_limits_stay_and_others_are_cut_off_one_by_one() -> None:
    w = np.array([[2.5, 1.0], [-7.0, 0.5], [1.0, 9.0]])
    expected = [[2.5, 1.0], [-2.0, 0.5], [1.0, 1.0]]
    np.testing.assert_array_equal(limited().within_limits(0, w), expected)


def test_vehicles_have_the_radii_of_the_players() -> None:
    game = Game({"robot": Unicycle(), "ana": FlatUnicycle()}, [], 0.1, 5, {"ana": 0.3})
    vehicles, s = Vehicles(game), np.array([0.0, 0.0, 0.0, 0.0, 3.0, 4.0, 0.0, 0.0])
    np.testing.assert_array_equal(vehicles.radii, [0.0, 0.3])
    np.testing.assert_allclose(vehicles.distances(s), [4.7])
    np.testing.assert_array_equal(game.players.distances(vehicles.game_state(s)), [4.7])


def test_an_input_is_estimated_also_from_a_heading_whole_turns_away(vehicles: Vehicles) -> None:
    rng = np.random.default_rng(4)
    s, w = rng.normal(size=12), rng.normal(size=6)
    s_next = vehicles.step(s, w)
    s_next[[2, 10]] += 2 * np.pi * np.array([1, -3])
    for i in range(3):
        np.testing.assert_allclose(
            vehicles.input_between(i, s, s_next), w[vehicles.inputs(i)], rtol=1e-4, atol=1e-6
        )
