from __future__ import annotations

import numpy as np
import pytest
from scripted import Fickle
from solving import GameFactory, Start
from strategies import assert_same

from gameinfer_ros.games import Game
from gameinfer_ros.inference import CosineSeeds
from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver, Strategy, brake

SEEDS = CosineSeeds(low=(-0.3, -0.3), high=(0.3, 0.3))


@pytest.fixture
def game(make_game: GameFactory) -> Game:
    return make_game("ud", horizon=10)


@pytest.fixture
def x0(game: Game, start: Start) -> np.ndarray:
    return start(game) + 0.3  # in motion


def player_of(solver: GameSolver) -> EquilibriumPlayer:
    return EquilibriumPlayer(solver, SEEDS, np.random.default_rng(0))


def make(scenario: Scenario, seed: int) -> EquilibriumPlayer:
    solver = GameSolver(scenario.game, scenario.solver)
    return EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seed))


def test_players_with_other_seeds_may_disagree(two_player: Scenario) -> None:
    x = two_player.initial_state
    ends = [make(two_player, seed).solve(0, x).x_ref[50, :, 0] for seed in range(6)]
    assert max(np.abs(end - ends[0]).max() for end in ends) > 0.5


def test_a_player_follows_the_equilibrium_of_its_seed(two_player: Scenario) -> None:
    player, x = make(two_player, 9), two_player.initial_state
    game = two_player.game
    assert (player.converged, player.iterations) == (False, 0)
    first = player.solve(0, x)
    cold = player.iterations
    assert player.converged and cold > 3
    seed = two_player.seeds.sample(np.random.default_rng(9), game.players, game.horizon, 1)
    expected = GameSolver(game, two_player.solver).solve(x, Strategy.from_inputs(0, x, seed))
    np.testing.assert_array_equal(first.x_ref, expected.strategy.x_ref)
    for step in range(1, 4):
        strategy = player.solve(step, first.x_ref[step, :, 0])
        assert player.converged and player.iterations < cold
        assert np.abs(strategy.x_ref[: 101 - step, :, 0] - first.x_ref[step:, :, 0]).max() < 0.5


def test_going_back_in_time_is_refused(two_player: Scenario) -> None:
    player = make(two_player, 0)
    player.solve(3, two_player.initial_state)
    with pytest.raises(ValueError, match="step: 2 is not allowed"):
        player.solve(2, two_player.initial_state)


# What is played when no equilibrium is known


def test_a_player_brakes_until_the_game_is_solved_for_the_first_time(
    game: Game, x0: np.ndarray
) -> None:
    solver = Fickle(game)
    player, x = player_of(solver), x0
    solver.fail(1)
    for step in range(13):  # also beyond the horizon of the first strategy
        strategy = player.solve(step, x)
        assert not player.converged
        assert_same(strategy, brake(game, step, x))
        x = game.step(x, strategy.inputs(step, x)[:, 0]) + 0.05 * np.cos(np.arange(8))
    solver.failures = {}
    strategy = player.solve(13, x)
    assert player.converged
    assert np.abs(strategy.u_ref - brake(game, 13, x).u_ref).max() > 0.01


def test_a_player_who_has_known_an_equilibrium_sticks_to_it(game: Game, x0: np.ndarray) -> None:
    solver = Fickle(game)
    player = player_of(solver)
    first = player.solve(0, x0)
    assert player.converged
    solver.fail(1)
    for step in (1, 2):
        strategy = player.solve(step, first.x_ref[step, :, 0])
        assert not player.converged
        kept = 10 - step
        np.testing.assert_allclose(
            strategy.x_ref[: kept + 1], first.x_ref[step:], rtol=0, atol=1e-9
        )


@pytest.mark.parametrize("steps", [[10], [1, 5, 9, 10, 11], [25]])
def test_an_equilibrium_is_known_until_its_horizon_is_over(
    steps: list[int], game: Game, x0: np.ndarray
) -> None:
    solver = Fickle(game)
    player = player_of(solver)
    first = player.solve(0, x0)
    assert player.converged and first.end == 10
    solver.fail(1)
    for step in steps:
        strategy = player.solve(step, x0)
        if step >= 10:
            assert_same(strategy, brake(game, step, x0))
        else:
            assert np.abs(strategy.P).max() > 0.0
            assert np.abs(strategy.u_ref - brake(game, step, x0).u_ref).max() > 0.01


def test_a_strategy_that_is_not_finite_is_not_played(game: Game, x0: np.ndarray) -> None:
    player = player_of(GameSolver(game))
    first = player.solve(0, x0)
    assert player.converged
    # From so far away, what is known leads beyond all numbers, and nothing can be solved.
    far = x0.copy()
    far[0], far[4:] = 1e306, 1e306
    with np.errstate(all="ignore"):
        strategy = player.solve(1, far)
        assert not player.converged
        assert_same(strategy, brake(game, 1, far))
    assert all(np.isfinite(array).all() for array in strategy.arrays)
    # The player resumes as soon as the game can be solved again.
    strategy = player.solve(2, first.x_ref[2, :, 0])
    assert player.converged
    assert all(np.isfinite(array).all() for array in strategy.arrays)
