from __future__ import annotations

import numpy as np
import pytest

from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ, Strategy


def make(scenario: Scenario, seed: int) -> EquilibriumPlayer:
    solver = IterativeLQ(scenario.game, scenario.solver)
    return EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seed))


def test_players_with_the_same_generator_state_agree(three_player: Scenario) -> None:
    one, other = make(three_player, 5), make(three_player, 5)
    x = three_player.initial_state
    for step in range(5):
        mine, theirs = one.solve(step, x), other.solve(step, x)
        for a, b in ((mine.x_ref, theirs.x_ref), (mine.u_ref, theirs.u_ref), (mine.P, theirs.P)):
            np.testing.assert_array_equal(a, b)
        # The world does not quite go as planned.
        x = three_player.game.step(x, mine.inputs(step, x)[:, 0]) + 0.01 * np.cos(np.arange(12))


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
    expected = IterativeLQ(game).solve(x, Strategy.from_inputs(0, x, seed))
    np.testing.assert_array_equal(first.x_ref, expected.strategy.x_ref)
    for step in range(1, 4):
        strategy = player.solve(step, first.x_ref[step, :, 0])
        assert player.converged and player.iterations < cold
        assert np.abs(strategy.x_ref[: 101 - step, :, 0] - first.x_ref[step:, :, 0]).max() < 0.5


def test_going_back_in_time_is_refused(two_player: Scenario) -> None:
    player = make(two_player, 0)
    player.solve(3, two_player.initial_state)
    with pytest.raises(ValueError, match="step 2"):
        player.solve(2, two_player.initial_state)
