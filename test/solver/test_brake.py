"""Without an equilibrium, players come to rest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from examples import examples
from gameinfer_ros.games import (
    Car,
    DoubleIntegrator,
    Dynamics,
    FlatUnicycle,
    Game,
    Unicycle,
    Vehicles,
)
from gameinfer_ros.solver import Strategy, brake

MODELS: dict[str, Dynamics] = {
    "unicycle": Unicycle(),
    "double_integrator": DoubleIntegrator(),
    "flat_unicycle": FlatUnicycle(),
    "car": Car(wheelbase=1.5),
}
T = 6
vectors = arrays(float, 20, elements=st.floats(-10.0, 10.0, allow_subnormal=False))


@pytest.fixture(scope="module", params=[*MODELS, "all"])
def game(request: pytest.FixtureRequest) -> Game:
    models = MODELS if request.param == "all" else {"robot": MODELS[request.param]}
    return Game(models, [], dt=0.1, horizon=T)


def vehicle_state(game: Game, values: np.ndarray) -> np.ndarray:
    """A joint state of the vehicles from numbers between -10 and 10."""
    vehicles, s = Vehicles(game), []
    for i, vehicle in enumerate(vehicles.dynamics):
        own = values[vehicles.states(i)].copy()
        own[4:] /= 20.0  # no car steers by 10 rad
        s.append(own[: vehicle.n_states])
    return np.concatenate(s)


def check_rest(game: Game, strategy: Strategy, step: int, s: np.ndarray) -> None:
    """Whoever follows the strategy from a step and state on is at rest after it, and stays."""
    vehicles = Vehicles(game)
    start, first = vehicles.poses(s), None
    for k in range(step, strategy.end):
        w = vehicles.vehicle_input(s, strategy.inputs(k, vehicles.game_state(s))[:, 0])
        s = vehicles.step(s, w)
        first = s if first is None else first
        twists = vehicles.twists(s, np.zeros(vehicles.n_inputs))
        np.testing.assert_allclose(twists, 0.0, rtol=0, atol=1e-7)
        np.testing.assert_allclose(vehicles.poses(s), vehicles.poses(first), rtol=0, atol=1e-7)
    # Speeds up to 10 m/s (14 m/s along both axes) fall to 0 evenly within the one step.
    moved = np.linalg.norm(vehicles.poses(s)[:, :2] - start[:, :2], axis=1)
    assert (moved <= 0.5 * 15.0 * game.dt).all()


@settings(max_examples=examples(40), derandomize=True)
@given(values=vectors, others=vectors, step=st.integers(0, 50), late=st.integers(0, T - 1))
def test_players_come_to_rest_within_a_step_and_stay_also_from_other_states_at_later_steps(
    game: Game, values: np.ndarray, others: np.ndarray, step: int, late: int
) -> None:
    s = vehicle_state(game, values)
    strategy = brake(game, step, Vehicles(game).game_state(s))
    assert (strategy.first_step, strategy.horizon, len(strategy)) == (step, T, 1)
    check_rest(game, strategy, step, s)
    check_rest(game, strategy, step + late, vehicle_state(game, others))


def test_who_stands_still_does_nothing(game: Game) -> None:
    vehicles = Vehicles(game)
    s = vehicle_state(game, np.random.default_rng(1).uniform(-3, 3, 20))
    for i, vehicle in enumerate(vehicles.dynamics):
        for row, name in enumerate(vehicle.state_names):
            if name in ("v", "vx", "vy"):
                s[vehicles.states(i).start + row] = 0.0
    strategy = brake(game, 0, vehicles.game_state(s))
    assert not strategy.u_ref.any()


def test_a_car_keeps_its_steering_while_it_brakes() -> None:
    game = Game({"robot": MODELS["car"]}, [], dt=0.1, horizon=T)
    s = np.array([1.0, 2.0, 0.5, 3.0, 0.4])
    strategy = brake(game, 0, s)
    assert not strategy.u_ref[:, 0].any() and not strategy.P[:, 0].any()
