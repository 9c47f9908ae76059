"""Solutions do not depend on how many turns a heading counts, and take the short way."""

from __future__ import annotations

import numpy as np
import pytest
from followed import Followed
from solving import GameFactory, Start, random_inputs, solve
from strategies import assert_same

from gameinfer_ros.games import Car, Game, Goal, QuadraticInput, QuadraticState, Unicycle
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver, Strategy, best_response

TURN = 2 * np.pi


def alone(heading: float, active_from: float = 3.85) -> Game:
    """A unicycle that wants to drive 2 m ahead and then have this heading."""
    costs = [
        QuadraticInput(weights=(10, 10)),
        QuadraticState(weights=(0, 0, 0, 30)),
        Goal(
            weights=(300, 300, 300, 0),
            goals={"robot": (2, 0, heading, 0)},
            active_from=active_from,
        ),
    ]
    return Game({"robot": Unicycle()}, costs, 0.1, 40)


@pytest.fixture
def game(make_game: GameFactory) -> Game:
    return make_game("udu")


@pytest.fixture
def x0(game: Game, start: Start) -> np.ndarray:
    return start(game)


def shift(game: Game, turns: tuple[int, int]) -> np.ndarray:
    rows = np.zeros(game.players.n_states)
    rows[game.players.is_angle] = TURN * np.array(turns)
    return rows


@pytest.mark.parametrize("turns", [(0, 1), (-3, 2)])
def test_a_start_whole_turns_away_leads_to_the_same_solution(
    turns: tuple[int, int], two_player: Scenario
) -> None:
    game, x0, rng = two_player.game, two_player.initial_state, np.random.default_rng(0)
    u, by = two_player.seeds.sample(rng, game.players, game.horizon, 8), shift(game, turns)
    plain, other = solve(game, x0, u), solve(game, x0 + by, u)
    assert plain.converged.all()
    np.testing.assert_array_equal(other.iterations, plain.iterations)
    moved = np.abs(other.strategy.x_ref - by[:, None] - plain.strategy.x_ref).max(axis=(0, 1))
    # Some seeds pass close to where the Riccati recursion is singular, which amplifies rounding.
    assert np.count_nonzero(moved < 1e-5) >= 6 and moved.max() < 0.05


@pytest.mark.parametrize("turns", [(0, 1), (-3, 2)])
def test_a_warm_start_follows_a_heading_that_jumps_by_whole_turns(
    turns: tuple[int, int], game: Game, x0: np.ndarray
) -> None:
    seeds, by = random_inputs(game, 3), shift(game, turns)
    followed, jumping = (Followed(GameSolver(game), seeds) for _ in range(2))
    followed.solve(0, x0)
    jumping.solve(0, x0)
    for step in range(1, 5):
        x = followed.strategy.x_ref[1, :, 0]
        jump = by if step % 2 else 0 * by
        plain, other = followed.solve(step, x), jumping.solve(step, x + jump)
        np.testing.assert_array_equal(other.x_ref[0], np.tile(x + jump, (3, 1)).T)
        assert followed.converged.all() and jumping.converged.all()
        assert jumping.iterations[0] == followed.iterations[0] <= 3
        moved = other.x_ref[..., 0] - jump
        np.testing.assert_allclose(moved, plain.x_ref[..., 0], rtol=0, atol=1e-6)


def test_strategies_near_a_state_are_the_same_unless_they_are_whole_turns_away() -> None:
    rng = np.random.default_rng(0)
    is_angle = np.array([False, True, False])
    strategy = Strategy.zeros(5, 4, 3, 2, 2)
    for array in strategy.arrays:
        array[:] = rng.normal(size=array.shape)
    strategy.x_ref[1, 1] = 0.1, 0.2 + TURN
    near = strategy.near(6, np.array([90.0, 0.15, -80.0]), is_angle)
    np.testing.assert_array_equal(near.x_ref[:, [0, 2]], strategy.x_ref[:, [0, 2]])
    np.testing.assert_array_equal(near.x_ref[..., 0], strategy.x_ref[..., 0])
    np.testing.assert_allclose(near.x_ref[:, 1, 1], strategy.x_ref[:, 1, 1] - TURN)
    assert strategy.x_ref[1, 1, 1] == 0.2 + TURN, "the strategies themselves stay as they are"
    assert near.flat[0].base is not None, "still one particle after the other in memory"
    same = strategy.take([0])
    assert same.near(6, np.array([0.0, -3.0, 0.0]), is_angle) is same
    with pytest.raises(IndexError, match="step: 9"):
        strategy.near(9, np.zeros(3), is_angle)


def test_strategies_that_are_not_finite_spoil_no_others() -> None:
    strategy = Strategy.zeros(0, 2, 2, 1, 3)
    strategy.x_ref[:, 1] = np.nan, 7.0, np.inf
    near = strategy.near(0, np.zeros(2), np.array([False, True]))
    np.testing.assert_allclose(near.x_ref[:, 1, 1], 7.0 - TURN)
    assert not np.isfinite(near.x_ref[:, 1, [0, 2]]).any()


def test_a_best_response_does_not_depend_on_the_number_of_turns(game: Game, x0: np.ndarray) -> None:
    strategy, by = solve(game, x0, random_inputs(game, 1)).strategy, shift(game, (2, -1))
    plain, other = (best_response(game, x, strategy, 0, 20) for x in (x0, x0 + by))
    assert other.cost == pytest.approx(plain.cost, rel=1e-9)
    assert other.best_cost == pytest.approx(plain.best_cost, rel=1e-4)
    np.testing.assert_allclose(other.x[0], x0 + by)


@pytest.mark.parametrize(
    ("heading", "wanted", "way"),
    [
        (3.1, -3.1, TURN - 6.2),
        (6.2832, 0.0, TURN - 6.2832),
        (180.0, 0.0, 29 * TURN - 180.0),
        (0.2, -12.5, 4 * np.pi - 12.7),
        (-2.0, 2.0, -(TURN - 4.0)),
    ],
)
def test_a_heading_turns_by_the_short_way(heading: float, wanted: float, way: float) -> None:
    game = alone(wanted)
    x0 = np.array([0.0, 0.0, heading, 0.5])
    solution = solve(game, x0, np.zeros((40, 2, 1)))
    turn = solution.strategy.x_ref[:, 2, 0] - heading
    assert solution.converged[0]
    assert turn[-1] == pytest.approx(way, abs=0.35)
    nearby = solve(alone(heading + way), x0, np.zeros((40, 2, 1)))
    np.testing.assert_allclose(turn, nearby.strategy.x_ref[:, 2, 0] - heading, atol=1e-6)


@pytest.mark.parametrize("active_from", [3.85, 2.0, 0.0])
@pytest.mark.parametrize("goal", [np.pi, -np.pi, 3 * np.pi])
def test_with_a_goal_exactly_opposite_both_ways_are_equilibria(
    goal: float, active_from: float
) -> None:
    """The seed decides. Mirrored seeds lead to mirrored solutions, in as many iterations."""
    game, x0 = alone(goal, active_from), np.zeros(4)
    turn = np.random.default_rng(0).uniform(0.02, 1.0, 32)
    u = np.zeros((40, 2, 64))
    u[:, 0] = np.concatenate([turn, -turn])
    solution = solve(game, x0, u)
    assert solution.converged.all()
    assert solution.iterations.max() < 30, "the solver must not go to and fro"
    headings = solution.strategy.x_ref[:, 2]
    np.testing.assert_allclose(headings[:, 32:], -headings[:, :32], rtol=0, atol=1e-9)
    assert (headings[-1, :32] > 2.5).all() and (headings[-1, :32] < 3.5).all()
    costs = game.costs(solution.strategy.x_ref, solution.strategy.u_ref).sum(axis=(0, 1))
    np.testing.assert_allclose(costs[32:], costs[:32], rtol=1e-9)


@pytest.mark.parametrize("offset", [0.0, 1e-12, -1e-12, 0.01, -0.01])
def test_the_way_round_stays_as_the_horizon_recedes(offset: float) -> None:
    """Also if noise carries the heading across the point where both ways are equally long."""
    rng = np.random.default_rng(1)
    game, u = alone(np.pi), np.zeros((40, 2, 2))
    u[:, 0] = 0.3, -0.3
    for k, sign in enumerate((1, -1)):
        followed = Followed(GameSolver(game), u[..., [k]])
        x = np.array([0.0, 0.0, offset, 0.0])
        for step in range(40):
            strategy = followed.solve(step, x)
            assert followed.converged.all() and followed.iterations[0] < 30
            assert sign * strategy.x_ref[-1, 2, 0] > 2.0
            x = game.step(x, strategy.inputs(step, x)[:, 0])
            x = x + rng.normal(0.0, 0.02, 4)


def test_a_trajectory_may_turn_more_than_half_a_turn() -> None:
    """A seed that turns round once is an equilibrium of its own, with whole turns in between."""
    game, x0 = alone(0.0), np.zeros(4)
    u = np.zeros((40, 2, 1))
    u[:, 0] = 1.8
    solution = solve(game, x0, u)
    heading = solution.strategy.x_ref[:, 2, 0]
    assert solution.converged[0]
    assert heading[-1] == pytest.approx(TURN, abs=0.5)
    assert np.abs(np.diff(heading)).max() < 0.6, "the trajectory itself does not jump"


def test_the_steering_of_a_car_is_not_turned() -> None:
    strategy = Strategy.zeros(0, 3, 5, 2, 1)
    car = Game({"car": Car(wheelbase=1.0)}, [QuadraticInput(weights=(1, 1))], 0.1, 3)
    x = np.array([0.0, 0.0, 0.0, 0.0, 6.0])
    assert_same(strategy.near(0, x, car.players.is_angle), strategy)
