"""A belief over equilibria."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from beliefs import SEEDS, K, make_belief, set_weights, solved_belief, spread
from followed import Followed
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.stats import norm
from solving import PAPER

from examples import examples
from gameinfer_ros.games import Game
from gameinfer_ros.inference import Belief, BeliefSettings, predict
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver


def test_at_first_all_particles_are_equally_probable(game: Game) -> None:
    belief = make_belief(game, particles=7)
    assert len(belief) == 7
    np.testing.assert_array_equal(belief.ids, np.arange(7))
    np.testing.assert_allclose(belief.weights, np.full(7, 1 / 7))
    assert belief.effective_sample_size == pytest.approx(7.0)


def test_there_are_no_strategies_before_the_first_solve(game: Game, x0: np.ndarray) -> None:
    belief = make_belief(game)
    assert not belief.iterations.any() and not belief.converged.any()
    with pytest.raises(RuntimeError, match="call solve first"):
        _ = belief.strategy
    with pytest.raises(RuntimeError, match="call solve first"):
        _ = belief.equilibrium
    with pytest.raises(RuntimeError, match="call solve first"):
        belief.weigh(0, x0, x0, np.zeros(2))


def test_particles_come_from_the_seeds(game: Game, x0: np.ndarray) -> None:
    belief = make_belief(game)
    belief.solve(3, x0)
    seeds = SEEDS.sample(np.random.default_rng(0), game.players, 10, K)
    expected = Followed(GameSolver(game, PAPER), seeds)
    expected.solve(3, x0)
    np.testing.assert_array_equal(belief.strategy.x_ref, expected.strategy.x_ref)
    np.testing.assert_array_equal(belief.converged, expected.converged)
    assert len(belief.iterations) == K


@pytest.mark.parametrize("robot_plays", [True, False])
def test_weighing_multiplies_by_the_likelihood(
    robot_plays: bool, game: Game, x0: np.ndarray
) -> None:
    belief = make_belief(game, robot_plays=robot_plays, observation_noise=0.2)
    belief.solve(0, x0)
    prior = np.arange(1.0, K + 1)
    set_weights(belief, prior / prior.sum())
    rng = np.random.default_rng(1)
    u_robot = np.array([0.4, -0.3]) if robot_plays else None
    x_next = game.step(x0, rng.normal(0, 0.3, 4)) + rng.normal(0, 0.02, 8)
    x_hat = predict(game, belief.strategy, 0, x0, u_robot)
    rows = np.arange(4, 8) if robot_plays else np.arange(8)
    likelihood = norm.pdf(x_next[rows, None], x_hat[rows], 0.2).prod(axis=0)
    belief.weigh(0, x0, x_next, u_robot)
    posterior = prior * likelihood / (prior * likelihood).sum()
    np.testing.assert_allclose(belief.weights, posterior, rtol=1e-9)
    assert belief.weights.sum() == pytest.approx(1.0)
    assert belief.map_index == np.argmax(posterior)


def test_the_robots_own_state_says_nothing_while_it_plays(belief: Belief, x0: np.ndarray) -> None:
    x_next = x0.copy()
    x_next[:4] += 100.0
    log_weights = belief.log_weights
    belief.weigh(0, x0, x0, np.zeros(2))
    expected = belief.log_weights
    belief.particles = replace(belief.particles, log_weights=log_weights)
    belief.weigh(0, x0, x_next, np.zeros(2))
    np.testing.assert_array_equal(belief.log_weights, expected)


def test_the_robots_input_is_needed_while_it_plays(belief: Belief, x0: np.ndarray) -> None:
    with pytest.raises(ValueError, match="u_robot: None is not allowed: the robot plays"):
        belief.weigh(0, x0, x0)


def test_a_robot_that_only_watches_does_not_need_its_input(game: Game, x0: np.ndarray) -> None:
    weights = []
    for u_robot in (None, np.array([9.0, 9.0])):
        belief = make_belief(game, robot_plays=False)
        belief.solve(0, x0)
        belief.weigh(0, x0, x0, u_robot)
        weights.append(belief.weights)
    np.testing.assert_array_equal(*weights)


def test_states_can_be_weighed_one_after_the_other(belief: Belief, x0: np.ndarray) -> None:
    for step in range(10):
        belief.weigh(step, x0, x0, np.zeros(2))
        assert belief.weights.sum() == pytest.approx(1.0)
    with pytest.raises(IndexError, match="step: 10 is not allowed"):
        belief.weigh(10, x0, x0, np.zeros(2))


def test_many_unlikely_observations_do_not_underflow(belief: Belief, x0: np.ndarray) -> None:
    for _ in range(200):
        belief.weigh(0, x0, x0 + 5.0, np.zeros(2))
    assert np.isfinite(belief.log_weights).all()
    assert belief.weights.sum() == pytest.approx(1.0)
    assert (belief.log_weights <= 0.0).all()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_particle_that_predicts_no_numbers_never_wins(
    value: float, belief: Belief, x0: np.ndarray
) -> None:
    belief.strategy.u_ref[0, 2:, 5] = value
    others = belief.weights[:5] / belief.weights[:5].sum()
    likelihood = norm.pdf(
        x0[4:, None], predict(belief.game, belief.strategy, 0, x0, np.zeros(2))[4:, :5], 0.1
    ).prod(axis=0)
    belief.weigh(0, x0, x0, np.zeros(2))
    assert belief.weights[5] == 0.0
    assert belief.map_index != 5
    expected = others * likelihood / (others * likelihood).sum()
    np.testing.assert_allclose(belief.weights[:5], expected, rtol=1e-9)
    # It stays impossible, and changes no other particle.
    belief.weigh(1, x0, x0, np.zeros(2))
    belief.combine_duplicates()
    assert belief.weights.sum() == pytest.approx(1.0)


def test_an_observation_that_no_particle_explains_is_ignored(
    belief: Belief, x0: np.ndarray
) -> None:
    before = belief.log_weights.copy()
    belief.weigh(0, x0, np.full(8, np.nan), np.zeros(2))
    np.testing.assert_array_equal(belief.log_weights, before)
    belief.strategy.u_ref[0] = np.nan
    belief.weigh(0, x0, x0, np.zeros(2))
    np.testing.assert_array_equal(belief.log_weights, before)


# The heaviest particle

flags = st.lists(st.booleans(), min_size=K, max_size=K)


@settings(max_examples=examples(100), derandomize=True)
@given(
    weights=st.lists(st.integers(0, 5), min_size=K, max_size=K).filter(any),
    converged=flags,
    updated=flags,
)
def test_the_map_is_the_heaviest_particle_that_is_settled_and_possible(
    game: Game, weights: list[int], converged: list[bool], updated: list[bool]
) -> None:
    belief = make_belief(game)
    belief.converged[:], belief.updated[:] = converged, updated
    set_weights(belief, np.array(weights) / sum(weights))
    candidates = [k for k in range(K) if weights[k] and converged[k] and updated[k]]
    if not candidates:
        assert belief.map_index is None
    else:
        assert belief.map_index in candidates
        assert weights[belief.map_index] == max(weights[k] for k in candidates)


def test_the_effective_sample_size_counts_equal_particles(belief: Belief) -> None:
    for count in range(1, K + 1):
        set_weights(belief, np.array([1.0 / count] * count + [0.0] * (K - count)))
        assert belief.effective_sample_size == pytest.approx(count)
    set_weights(belief, np.array([0.5, 0.25, 0.25, 0.0, 0.0, 0.0]))
    assert belief.effective_sample_size == pytest.approx(1 / (0.25 + 2 * 0.0625))


# Duplicates


def test_duplicates_become_the_heaviest_of_them(belief: Belief) -> None:
    spread(belief, np.array([0.0, 0.05, 5.0, 0.02, 5.05, 9.0]))
    strategy, weights = belief.strategy, belief.weights
    belief.combine_duplicates()
    assert list(belief.ids) == [3, 4, 5]
    expected = [weights[[0, 1, 3]].sum(), weights[[2, 4]].sum(), weights[5]]
    np.testing.assert_allclose(belief.weights, expected)
    assert len(belief) == len(belief.strategy) == len(belief.converged) == 3
    np.testing.assert_array_equal(belief.strategy.x_ref, strategy.x_ref[..., [3, 4, 5]])
    np.testing.assert_array_equal(belief.strategy.P, strategy.P[..., [3, 4, 5]])


def test_any_component_at_any_step_tells_particles_apart(game: Game, x0: np.ndarray) -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        belief = solved_belief(game, x0)
        x_ref, k = belief.strategy.x_ref, rng.integers(K)
        x_ref[:] = x_ref[..., :1]
        x_ref[rng.integers(11), rng.integers(8), k] += 0.11
        belief.combine_duplicates()
        assert len(belief) == 2 and k in belief.ids


def test_the_tolerance_is_that_of_the_settings(game: Game, x0: np.ndarray) -> None:
    for tolerance, left in ((0.0, 3), (0.01, 3), (0.035, 2), (0.1, 1)):
        belief = make_belief(game, particles=4, duplicate_tolerance=tolerance)
        belief.solve(0, x0)
        spread(belief, np.array([0.0, 0.0, 0.03, 0.07]))
        belief.combine_duplicates()
        assert len(belief) == left, "identical particles are duplicates at any tolerance"


def test_particles_without_a_trajectory_are_no_duplicates(belief: Belief) -> None:
    spread(belief, np.zeros(K))
    belief.strategy.x_ref[..., [1, 2]] = np.nan
    weights = belief.weights
    belief.combine_duplicates()
    assert list(belief.ids) == [1, 2, 5]
    np.testing.assert_allclose(belief.weights[:2], weights[1:3])


@settings(max_examples=examples(80), derandomize=True)
@given(
    offsets=st.lists(st.integers(0, 30), min_size=K, max_size=K),
    weights=st.lists(st.integers(0, 5), min_size=K, max_size=K).filter(any),
    converged=flags,
    updated=flags,
)
def test_combining_keeps_the_whole_probability_and_no_two_alike(
    game: Game,
    x0: np.ndarray,
    offsets: list[int],
    weights: list[int],
    converged: list[bool],
    updated: list[bool],
) -> None:
    belief = solved_belief(game, x0)
    at = np.array(offsets) * 0.03  # no difference is just the tolerance of 0.1
    spread(belief, at)
    prior = np.array(weights) / sum(weights)
    set_weights(belief, prior)
    belief.converged[:], belief.updated[:] = converged, updated
    settled = [c and u for c, u in zip(converged, updated, strict=True)]
    assert belief.settled.tolist() == settled
    belief.combine_duplicates()

    kept = belief.ids
    assert list(kept) == sorted(set(kept)), "ids stay those of the seeds, in order"
    assert belief.weights.sum() == pytest.approx(1.0)
    assert (belief.log_weights <= 0.0).all()
    assert (belief.weights >= prior[kept] - 1e-12).all()
    distance = np.abs(at[kept][:, None] - at[kept])
    assert (distance[~np.eye(len(kept), dtype=bool)] > 0.1).all()

    def rank(k: int) -> tuple[bool, float]:
        return settled[k], prior[k]

    for k in set(range(K)) - set(kept):
        near = [j for j in kept if abs(at[j] - at[k]) <= 0.1]
        assert any(rank(j) >= rank(k) for j in near), "only a better particle may replace one"

    once = belief.log_weights.copy()
    belief.combine_duplicates()
    np.testing.assert_array_equal(belief.ids, kept)
    np.testing.assert_allclose(np.exp(once), belief.weights)


def test_particles_that_are_left_are_solved_on(belief: Belief, x0: np.ndarray) -> None:
    spread(belief, np.array([0.0, 0.05, 5.0, 0.02, 5.05, 9.0]))
    belief.combine_duplicates()
    belief.solve(1, x0)
    assert len(belief.strategy) == len(belief.iterations) == 3
    assert belief.strategy.first_step == 1


# Inference as a whole


@pytest.mark.parametrize("true_seed", [0, 1, 2, 5])
def test_the_belief_finds_the_equilibrium_that_the_humans_play(
    true_seed: int, two_player: Scenario
) -> None:
    game, solver = two_player.game, GameSolver(two_player.game, two_player.solver)
    chosen = BeliefSettings(particles=12)
    belief = Belief(solver, two_player.seeds, chosen, np.random.default_rng(3))
    seeds = two_player.seeds.sample(np.random.default_rng(3), game.players, game.horizon, 12)
    humans = Followed(solver, seeds[..., [true_seed]])
    x = two_player.initial_state
    robot = game.players.inputs(0)
    belief.solve(0, x)
    first_weights = belief.weights
    for step in range(40):
        human_strategy = humans.solve(step, x)
        u = human_strategy.inputs(step, x)[:, 0]
        u[robot] = belief.strategy.inputs(step, x)[robot, belief.map_index]
        x_next = game.step(x, u)
        belief.weigh(step, x, x_next, u[robot])
        belief.combine_duplicates()
        belief.solve(step + 1, x_next)
        x = x_next
    truth = humans.solve(40, x)
    positions = game.players.positions(np.moveaxis(belief.strategy.x_ref, 2, 0))
    difference = positions - game.players.positions(truth.x_ref[..., 0])
    same_way = np.linalg.norm(difference, axis=-1).max(axis=(1, 2)) < 0.5
    assert same_way[belief.map_index]
    assert belief.weights[same_way].sum() > 0.99
    assert np.ptp(first_weights) == pytest.approx(0.0), "nothing was known in the beginning"
    assert len(belief) < 12 and set(belief.ids) <= set(range(12))


@pytest.mark.parametrize(
    "fields",
    [
        {"particles": 0},
        {"particles": 2.5},
        {"observation_noise": 0.0},
        {"observation_noise": np.nan},
        {"duplicate_tolerance": -0.1},
        {"max_iterations": 0},
        {"max_iterations": 1.5},
        {"colour": "red"},
    ],
)
def test_settings_that_make_no_sense_are_refused(fields: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        BeliefSettings(**fields)


@pytest.mark.parametrize(
    "use",
    [
        lambda belief, x: belief.solve(1, x),
        lambda belief, x: belief.weigh(1, x, x, np.zeros(2)),
        lambda belief, x: belief.combine_duplicates(),
        lambda belief, x: belief.equilibrium,
    ],
)
def test_a_belief_refuses_a_second_thread(
    use: Callable[[Belief, np.ndarray], Any],
    game: Game,
    x0: np.ndarray,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    belief = make_belief(game)
    belief.solve(0, x0)
    entered, may_end, solve = threading.Event(), threading.Event(), GameSolver.solve

    def slowly(*args: Any, **kwargs: Any) -> Any:
        entered.set()
        assert may_end.wait(60)
        return solve(*args, **kwargs)

    with ThreadPoolExecutor(1) as threads, monkeypatch.context() as patched:
        patched.setattr(GameSolver, "solve", slowly)
        first = threads.submit(belief.solve, 1, x0)
        try:
            assert entered.wait(60)
            with pytest.raises(RuntimeError, match="in use by another thread"):
                use(belief, x0)
        finally:
            may_end.set()
        first.result()
    assert belief.strategy.first_step == 1
    use(belief, x0)  # it is free again
