from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.linalg import solve_discrete_are
from scipy.optimize import minimize

from gameinfer_ros.games import (
    CostTerm,
    DoubleIntegrator,
    Game,
    Goal,
    Lane,
    Obstacle,
    Proximity,
    QuadraticInput,
    QuadraticState,
    SoftBound,
    Unicycle,
)
from gameinfer_ros.games.blocks import WIDE
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ, Solution, SolverSettings, Status, Strategy, reference
from gameinfer_ros.solver.block import Block

GameFactory = Callable[..., Game]
Start = Callable[[Game], np.ndarray]


def random_inputs(game: Game, count: int, size: float = 0.3, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    shape = np.cos(np.pi * np.arange(game.horizon) / game.horizon)
    return shape[:, None, None] * rng.uniform(-size, size, (game.players.n_inputs, count))


def solve(
    game: Game, x0: np.ndarray, u: np.ndarray, first_step: int = 0, **settings: Any
) -> Solution:
    solver = IterativeLQ(game, SolverSettings(**settings))
    return solver.solve(x0, Strategy.from_inputs(first_step, x0, u))


# Against the reference


def check_against_reference(game: Game, x0: np.ndarray, u: np.ndarray, **settings: Any) -> int:
    """Compare every particle that rounding errors do not carry elsewhere; return their number."""
    compiled = solve(game, x0, u, **settings)
    compared = 0
    for k in range(u.shape[2]):
        one = reference.solve(game, x0, u[..., k], SolverSettings(**settings))
        other = reference.solve(game, x0, u[..., k] * (1 + 1e-14), SolverSettings(**settings))
        # Some seeds pass close to where the Riccati recursion is singular, and there amplify a
        # rounding error to centimetres: no two implementations can agree on these.
        if one.iterations != other.iterations or np.abs(one.x - other.x).max() > 3e-7:
            continue
        compared += 1
        assert compiled.status[k] == one.status
        assert compiled.iterations[k] == one.iterations
        for mine, theirs in (
            (compiled.strategy.x_ref, one.x),
            (compiled.strategy.u_ref, one.u),
            (compiled.strategy.P, one.P),
        ):
            np.testing.assert_allclose(mine[..., k], theirs, rtol=0, atol=1e-6)
    return compared


@pytest.mark.parametrize("kinds", ["u", "d", "ud", "du", "udu"])
def test_solutions_agree_with_the_reference(
    kinds: str, make_game: GameFactory, start: Start
) -> None:
    game = make_game(kinds)
    assert check_against_reference(game, start(game), random_inputs(game, 4)) >= 3


def test_the_three_player_scenario_agrees_with_the_reference(three_player: Scenario) -> None:
    u = three_player.seeds.sample(np.random.default_rng(0), three_player.game.players, 100, 5)
    assert check_against_reference(three_player.game, three_player.initial_state, u) >= 2


@pytest.mark.parametrize(
    ("settings", "status"),
    [
        ({"max_iterations": 2}, Status.ITERATION_LIMIT),
        ({"max_movement": 0.02, "converged_movement": 1e-9}, Status.ITERATION_LIMIT),
        ({"max_movement": 0.02, "max_halvings": 1}, Status.LINE_SEARCH_FAILED),
        (
            {
                "max_iterations": 4,
                "first_step_size": 0.3,
                "state_regularisation": 1.0,
                "input_regularisation": 20.0,
            },
            Status.ITERATION_LIMIT,
        ),
    ],
)
def test_other_settings_agree_with_the_reference(
    settings: dict[str, Any], status: Status, make_game: GameFactory, start: Start
) -> None:
    game, limits = make_game("ud"), {"max_iterations": 12} | settings
    x0, u = start(game), random_inputs(make_game("ud"), 3)
    assert check_against_reference(game, x0, u, **limits) >= 2
    assert (solve(game, x0, u, **limits).status == status).all()


def test_a_later_first_step_agrees_with_the_reference(make_game: GameFactory, start: Start) -> None:
    game = make_game("ud")
    x0, u = start(game), random_inputs(game, 1)
    late = reference.solve(game, x0, u[..., 0], SolverSettings(), first_step=10)
    solution = solve(game, x0, u, first_step=10)
    assert solution.status[0] == late.status
    np.testing.assert_allclose(solution.strategy.x_ref[..., 0], late.x, rtol=0, atol=1e-6)
    # The goals are then active in half of the horizon, and the players there earlier.
    early = solve(game, x0, u)
    assert np.abs(early.strategy.x_ref - solution.strategy.x_ref).max() > 0.1


# Against other ways to solve games


def test_one_player_alone_is_the_linear_quadratic_regulator() -> None:
    weights, prices = (3.0, 1.0, 2.0, 0.5), (0.5, 2.0)
    game = Game(
        {"robot": DoubleIntegrator()},
        [QuadraticState(weights=weights), QuadraticInput(weights=prices)],
        dt=0.1,
        horizon=300,
    )
    h = 0.1
    A = np.kron(np.eye(2), [[1, h], [0, 1]])
    B = np.kron(np.eye(2), [[h * h / 2], [h]])
    Q, R = np.diag(weights), np.diag(prices)
    S = solve_discrete_are(A, B, Q, R)
    gain = np.linalg.solve(R + B.T @ S @ B, B.T @ S @ A)

    x0 = np.array([1.0, 0.0, -1.0, 0.5])
    solution = solve(
        game,
        x0,
        np.zeros((300, 2, 1)),
        state_regularisation=0.0,
        input_regularisation=0.0,
        first_step_size=1.0,
        max_movement=100.0,
        converged_movement=1e-9,
    )
    assert solution.status[0] == Status.CONVERGED
    assert solution.iterations[0] <= 3
    np.testing.assert_allclose(solution.strategy.P[0, :, :, 0], gain, rtol=1e-9, atol=1e-9)
    x = x0
    for k in range(100):
        np.testing.assert_allclose(solution.strategy.x_ref[k, :, 0], x, rtol=0, atol=1e-8)
        x = (A - B @ gain) @ x
    cost = game.costs(solution.strategy.x_ref[..., 0], solution.strategy.u_ref[..., 0]).sum()
    assert cost == pytest.approx(0.5 * x0 @ S @ x0, rel=1e-8)


def play(game: Game, x0: np.ndarray, u: np.ndarray) -> np.ndarray:
    x = [x0]
    for u_k in u:
        x.append(game.step(x[-1], u_k))
    return np.array(x)


def best_inputs(game: Game, x0: np.ndarray, u: np.ndarray) -> Any:
    """Minimum over the inputs (T, nu) of a single player, by a general-purpose optimiser."""

    def cost(flat: np.ndarray) -> float:
        inputs = flat.reshape(u.shape)
        return float(game.costs(play(game, x0, inputs), inputs).sum())

    return minimize(cost, u.ravel(), method="BFGS", options={"gtol": 1e-5})


@pytest.mark.parametrize(
    ("dynamics", "names", "goal", "dt", "excess", "distance"),
    [
        # Exact derivatives lead to the very minimum; Euler's rule leads close to it.
        (DoubleIntegrator(), ("vx", "ay"), (1.5, 0.2, 1.0, 0.1), 0.1, 1e-7, 1e-3),
        (Unicycle(), ("v", "omega"), (0.8, 0.4, 0.6, 0.1), 0.05, 1e-3, 0.05),
    ],
    ids=["double_integrator", "unicycle"],
)
def test_one_player_alone_finds_a_minimum_of_its_cost(
    dynamics: DoubleIntegrator | Unicycle,
    names: tuple[str, str],
    goal: tuple[float, ...],
    dt: float,
    excess: float,
    distance: float,
) -> None:
    T = 12
    game = Game(
        {"robot": dynamics},
        [
            QuadraticInput(weights=(1.0, 1.0)),
            SoftBound(of=names[0], low=-0.5, high=0.33, weight=20.0),
            SoftBound(of=names[1], low=-0.4, high=0.4, weight=20.0),
            Goal(
                weights=(30.0, 20.0, 30.0, 20.0),
                goals={"robot": goal},
                active_from=(T - 0.5) * dt,
            ),
        ],
        dt,
        T,
    )
    x0 = np.array([0.0, 0.1, 0.0, 0.3])
    solution = solve(
        game, x0, np.zeros((T, 2, 1)), first_step_size=1.0, converged_movement=1e-9,
        max_iterations=2000,
    )  # fmt: skip
    assert solution.status[0] == Status.CONVERGED, solution.reason(0)
    x, u = solution.strategy.x_ref[..., 0], solution.strategy.u_ref[..., 0]
    cost = game.costs(x, u).sum()
    speed, steer = (
        x[:, dynamics.state_names.index(names[0])],
        u[:, dynamics.input_names.index(names[1])],
    )
    assert (speed > 0.33).any() and (steer > 0.4).any(), "the bounds must matter"
    for initial in (u, np.zeros_like(u)):
        best = best_inputs(game, x0, initial)
        assert best.fun <= cost + 1e-9
        assert cost <= best.fun * (1 + excess)
        assert np.abs(best.x.reshape(T, 2) - u).max() <= distance


def test_no_player_gains_by_other_inputs_against_the_strategies_of_the_others() -> None:
    # With exact derivatives, a converged solution is a local equilibrium of the game itself, not
    # only of its approximation, and the regularisation must not shift it.
    names = ("robot", "ana")
    goals = {"robot": (1.5, 0.0, 0.1, 0.0), "ana": (0.2, 0.0, 1.5, 0.0)}
    game = Game(
        dict.fromkeys(names, DoubleIntegrator()),
        [
            QuadraticInput(weights=(1.0, 1.0)),
            QuadraticState(weights=(0.0, 2.0, 0.0, 2.0)),
            Proximity(radius=1.0, weight=20.0),
            Goal(weights=(100.0, 10.0, 100.0, 10.0), goals=goals, active_from=1.85),
        ],
        dt=0.1,
        horizon=20,
    )
    x0 = np.array([-1.5, 0.0, -0.1, 0.0, 0.0, 0.0, -1.5, 0.0])
    solution = solve(
        game, x0, random_inputs(game, 1), converged_movement=1e-10, max_iterations=2000
    )
    assert solution.status[0] == Status.CONVERGED, solution.reason(0)
    x_ref, u_ref, P = (
        array[..., 0]
        for array in (solution.strategy.x_ref, solution.strategy.u_ref, solution.strategy.P)
    )
    assert game.players.distances(x_ref).min() < 1.0, "the players must be in each other's way"

    def cost(i: int, extra: np.ndarray) -> float:
        """Cost of player i, who adds `extra` (T, 2) to its reference inputs and does not react."""
        own, x, inputs = game.players.inputs(i), x0, []
        states = [x0]
        for k in range(20):
            u = u_ref[k] - P[k] @ (x - x_ref[k])
            u[own] = u_ref[k, own] + extra[k]
            x = game.step(x, u)
            states.append(x)
            inputs.append(u)
        return float(game.costs(np.array(states), np.array(inputs))[i].sum())

    rng = np.random.default_rng(0)
    for i in range(2):
        at_nash = cost(i, np.zeros((20, 2)))
        for k in range(0, 20, 3):
            for axis in range(2):
                extra = np.zeros((20, 2))
                extra[k, axis] = 1e-4
                slope = (cost(i, extra) - cost(i, -extra)) / 2e-4
                assert slope == pytest.approx(0.0, abs=1e-5)
        for _ in range(30):
            extra = rng.normal(size=(20, 2)) * 10.0 ** rng.uniform(-3, -0.5)
            assert cost(i, extra) > at_nash


# In a corridor with a corner and something in the way

LANE = Lane(
    points=((-2.0, 0.0), (1.5, 0.0), (1.5, 3.0)), half_width=0.5, weight=1000.0, players=("robot",)
)
OBSTACLE = Obstacle(center=(-0.2, 0.1), radius=0.4, weight=1000.0, players=("robot",))


def corridor(*terms: CostTerm) -> tuple[Game, np.ndarray]:
    """A game in which the robot goes from (-2, 0) to (1.5, 2), past a walker, and its start."""
    goals = {"robot": (1.5, 2.0, 0.0, 0.0), "walker": (-1.0, 0.0, -1.5, 0.0)}
    game = Game(
        {"robot": Unicycle(), "walker": DoubleIntegrator()},
        [
            QuadraticInput(weights=(1.0, 1.0)),
            Proximity(radius=0.8, weight=50.0),
            *(
                Goal(weights=weights, goals={name: goals[name]}, active_from=4.85, players=(name,))
                for name, weights in (
                    ("robot", (300.0, 300.0, 0.0, 0.0)),
                    ("walker", (300.0, 0.0, 300.0, 0.0)),
                )
            ),
            *terms,
        ],
        dt=0.1,
        horizon=50,
    )
    return game, np.array([-2.0, 0.0, 0.0, 0.0, 2.0, 0.0, -1.5, 0.0])


def farthest_off_lane_and_nearest_to_obstacle(*terms: CostTerm) -> tuple[np.ndarray, np.ndarray]:
    """Distances (K,) of the robot from the polyline and from the obstacle's centre."""
    game, x0 = corridor(*terms)
    solution = solve(game, x0, random_inputs(game, 9))
    assert solution.converged.all()
    px, py = solution.strategy.x_ref[:, 0], solution.strategy.x_ref[:, 1]
    np.testing.assert_allclose([px[-1], py[-1]], [[1.5] * 9, [2.0] * 9], atol=0.2)
    along_x = np.hypot(px - np.clip(px, -2.0, 1.5), py)
    along_y = np.hypot(px - 1.5, py - np.clip(py, 0.0, 3.0))
    off_lane = np.minimum(along_x, along_y).max(axis=0)
    return off_lane, np.hypot(px - OBSTACLE.center[0], py - OBSTACLE.center[1]).min(axis=0)


def test_a_robot_keeps_to_its_lane_and_out_of_an_obstacle() -> None:
    off_lane, to_obstacle = farthest_off_lane_and_nearest_to_obstacle(LANE, OBSTACLE)
    assert (off_lane <= 0.5 + 0.2).all() and (to_obstacle >= 0.4 - 0.1).all()
    # It would do neither of its own accord.
    off_lane, _ = farthest_off_lane_and_nearest_to_obstacle(OBSTACLE)
    assert (off_lane >= 1.0).all()
    _, to_obstacle = farthest_off_lane_and_nearest_to_obstacle(LANE)
    assert (to_obstacle <= 0.25).all()


def test_lanes_and_obstacles_agree_with_the_reference() -> None:
    game, x0 = corridor(LANE, OBSTACLE)
    assert check_against_reference(game, x0, random_inputs(game, 2), max_iterations=4) == 2


# How a solution ends


def test_every_particle_that_converged_says_so(make_game: GameFactory, start: Start) -> None:
    game = make_game("ud")
    solution = solve(game, start(game), random_inputs(game, 5))
    assert (solution.status == Status.CONVERGED).all() and solution.converged.all()
    assert (solution.movement <= 0.05).all()
    assert "converged" in solution.reason(0)
    assert str(solution.iterations[0]) in solution.reason(0)


def test_a_converged_solution_can_be_played_and_stays(make_game: GameFactory, start: Start) -> None:
    game = make_game("udu")
    x0 = start(game)
    solution = solve(game, x0, random_inputs(game, 8), converged_movement=1e-8)
    assert solution.converged.sum() >= 4
    strategy = solution.strategy.take(np.flatnonzero(solution.converged))
    for k in range(len(strategy)):
        x = play(game, x0, strategy.u_ref[..., k])
        np.testing.assert_allclose(strategy.x_ref[..., k], x, rtol=0, atol=1e-12)
    again = IterativeLQ(game).solve(x0, strategy)
    assert (again.iterations == 1).all()
    np.testing.assert_allclose(again.strategy.x_ref, strategy.x_ref, rtol=0, atol=1e-7)


def test_the_iteration_limit_is_told(make_game: GameFactory, start: Start) -> None:
    game = make_game("ud")
    solution = solve(game, start(game), random_inputs(game, 2), max_iterations=1)
    assert (solution.status == Status.ITERATION_LIMIT).all()
    assert (solution.iterations == 1).all()
    assert not solution.converged.any()
    assert solution.step_sizes.shape == (1, 2)
    assert "iteration limit" in solution.reason(1)


def test_a_failed_line_search_is_told_and_keeps_what_could_be_played(
    make_game: GameFactory, start: Start
) -> None:
    game = make_game("ud")
    x0, u = start(game), random_inputs(game, 2)
    solution = solve(game, x0, u, max_movement=1e-3, converged_movement=1e-4, max_halvings=1)
    assert (solution.status == Status.LINE_SEARCH_FAILED).all()
    assert (solution.step_sizes == 0.25).all()
    assert (solution.movement > 1e-3).all()
    assert "line search failed" in solution.reason(0)
    np.testing.assert_array_equal(solution.strategy.u_ref, u)
    np.testing.assert_array_equal(solution.strategy.x_ref[..., 1], play(game, x0, u[..., 1]))


def test_the_line_search_halves_only_where_it_must(make_game: GameFactory, start: Start) -> None:
    game = make_game("ud")
    solution = solve(game, start(game), random_inputs(game, 8), max_movement=0.3)
    tried = solution.step_sizes[np.isfinite(solution.step_sizes)]
    assert set(np.unique(np.log2(tried))) <= set(-np.arange(1.0, 22.0))
    assert (tried == 0.5).any() and (tried < 0.5).any()
    assert (np.isfinite(solution.step_sizes).sum(axis=0) == solution.iterations).all()


def test_the_line_search_may_use_all_its_halvings_and_no_more(
    make_game: GameFactory, start: Start
) -> None:
    game = make_game("ud")
    x0, u = start(game), random_inputs(game, 1)
    for limit in (2.0, 0.5, 0.1, 0.01):
        free = solve(game, x0, u, max_movement=limit, converged_movement=1e-9, max_iterations=1)
        needed = round(-np.log2(free.step_sizes[0, 0])) - 1
        for halvings in (needed, needed - 1):
            if halvings < 0:
                continue
            bound = solve(
                game, x0, u, max_movement=limit, converged_movement=1e-9, max_iterations=1,
                max_halvings=halvings,
            )  # fmt: skip
            if halvings == needed:
                assert bound.status[0] == Status.ITERATION_LIMIT
                np.testing.assert_array_equal(bound.strategy.x_ref, free.strategy.x_ref)
            else:
                assert bound.status[0] == Status.LINE_SEARCH_FAILED
                # What is told of the failure is what was tried.
                assert bound.step_sizes[0, 0] == 0.5 ** (halvings + 1)
                assert bound.movement[0] > limit
    assert needed > 3, "the last limit must be a tight one"


def test_no_iteration_moves_farther_than_allowed(make_game: GameFactory, start: Start) -> None:
    game = make_game("ud")
    x0, u = start(game), random_inputs(game, 1)
    last = play(game, x0, u[..., 0])
    for n in range(1, 12):
        solution = solve(game, x0, u, max_movement=0.2, converged_movement=1e-6, max_iterations=n)
        x = solution.strategy.x_ref[..., 0]
        moved = np.abs(x - last).max()
        assert moved <= 0.2
        assert solution.movement[0] == pytest.approx(moved, abs=1e-12)
        last = x


@pytest.mark.parametrize("huge", [1e200, np.inf, np.nan])
def test_numbers_that_overflow_are_told_and_harm_nobody_else(
    huge: float, make_game: GameFactory, start: Start
) -> None:
    game = make_game("ud")
    x0, u = start(game), random_inputs(game, 3)
    alone = solve(game, x0, u)
    u[..., 1] = huge
    solution = solve(game, x0, u)
    assert list(solution.status) == [Status.CONVERGED, Status.NOT_FINITE, Status.CONVERGED]
    assert "not finite" in solution.reason(1)
    for k in (0, 2):
        np.testing.assert_array_equal(solution.strategy.x_ref[..., k], alone.strategy.x_ref[..., k])


def test_equations_that_overflow_are_told(make_game: GameFactory) -> None:
    game = make_game("d")
    # The states can be played out, but the products of the Riccati recursion are too large.
    x0, u = np.array([1e306, 0.0, 1e306, 0.0]), np.zeros((20, 2, 1))
    solution = solve(game, x0, u)
    assert solution.status[0] == Status.NOT_FINITE
    assert solution.iterations[0] == 1
    with np.errstate(all="ignore"):
        assert reference.solve(game, x0, u[..., 0], SolverSettings()).status == Status.NOT_FINITE


def test_arrays_that_do_not_fit_the_game_are_refused(make_game: GameFactory, start: Start) -> None:
    game = make_game("ud")
    x0, u = start(game), random_inputs(game, 2)
    solver, good = IterativeLQ(game), Strategy.from_inputs(0, x0, u)
    with pytest.raises(ValueError, match=r"x0 .*\(7,\).*\(8,\)"):
        solver.solve(x0[:7], good)
    with pytest.raises(ValueError, match=r"x0 is not finite"):
        solver.solve(np.where(np.arange(8) == 3, np.nan, x0), good)
    for name in ("x_ref", "u_ref", "P"):
        parts = {"x_ref": good.x_ref, "u_ref": good.u_ref, "P": good.P}
        for axis in range(parts[name].ndim - 1):
            bad = parts | {name: np.delete(parts[name], 0, axis=axis)}
            with pytest.raises(ValueError, match="shape"):
                solver.solve(x0, Strategy(0, **bad))


def test_a_solve_leaves_its_arguments_alone(make_game: GameFactory, start: Start) -> None:
    game = make_game("ud")
    x0, u = start(game), random_inputs(game, 2)
    initial = Strategy.from_inputs(0, x0, u)
    before = x0.copy(), initial.x_ref.copy(), initial.u_ref.copy(), initial.P.copy()
    IterativeLQ(game).solve(x0, initial)
    after = x0, initial.x_ref, initial.u_ref, initial.P
    for one, other in zip(before, after, strict=True):
        np.testing.assert_array_equal(one, other)


def test_no_particles_are_no_trouble(make_game: GameFactory, start: Start) -> None:
    game = make_game("ud")
    solution = solve(game, start(game), np.zeros((20, 4, 0)))
    assert len(solution.strategy) == len(solution.status) == 0


# Many particles at once


@pytest.mark.parametrize("count", [7, 70])
def test_a_batch_is_what_its_particles_are_alone(
    count: int, make_game: GameFactory, start: Start
) -> None:
    game = make_game("udu")
    x0, u = start(game), random_inputs(make_game("udu"), count, size=1.0)
    u[..., 3] = np.nan
    batch = solve(game, x0, u, max_iterations=12)
    assert len(np.unique(batch.iterations)) > 2, "particles must drop out at different times"
    for k in range(0, count, max(1, count // 14)):
        one = solve(game, x0, u[..., k : k + 1], max_iterations=12)
        assert batch.status[k] == one.status[0]
        assert batch.iterations[k] == one.iterations[0]
        np.testing.assert_array_equal(batch.movement[k], one.movement[0])
        n = len(one.step_sizes)
        np.testing.assert_array_equal(batch.step_sizes[:n, k], one.step_sizes[:, 0])
        assert np.isnan(batch.step_sizes[n:, k]).all()
        for mine, theirs in (
            (batch.strategy.x_ref, one.strategy.x_ref),
            (batch.strategy.u_ref, one.strategy.u_ref),
            (batch.strategy.P, one.strategy.P),
        ):
            np.testing.assert_array_equal(mine[..., k], theirs[..., 0])


def test_the_same_seed_leads_to_the_same_equilibrium(three_player: Scenario) -> None:
    def solution() -> Solution:
        rng = np.random.default_rng(11)
        u = three_player.seeds.sample(rng, three_player.game.players, 100, 2)
        return solve(three_player.game, three_player.initial_state, u)

    one, other = solution(), solution()
    np.testing.assert_array_equal(one.strategy.x_ref, other.strategy.x_ref)
    np.testing.assert_array_equal(one.strategy.P, other.strategy.P)


# Threads, bounds and deadlines


def check_same_solution(one: Solution, other: Solution) -> None:
    for a, b in zip(
        (*one.strategy.arrays, one.status, one.iterations, one.step_sizes, one.movement),
        (*other.strategy.arrays, other.status, other.iterations, other.step_sizes, other.movement),
        strict=True,
    ):
        np.testing.assert_array_equal(a, b)


@pytest.fixture
def crowd(make_game: GameFactory, start: Start) -> tuple[Game, np.ndarray, Strategy]:
    """A game, a state, and as many particles as keep three threads busy for some rounds."""
    game = make_game("ud", horizon=10)
    u = random_inputs(game, 5 * WIDE + 3, size=1.0)
    u[..., 7] = np.nan
    return game, start(game), Strategy.from_inputs(0, start(game), u)


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("order", ["as they are", "backwards", "shuffled"])
def test_solutions_depend_neither_on_threads_nor_on_the_order(
    threads: int, order: str, crowd: tuple[Game, np.ndarray, Strategy]
) -> None:
    game, x0, initial = crowd
    limits: dict[str, Any] = {
        "max_iterations": 11,
        "max_movement": 0.5,
        "converged_movement": 0.01,
    }
    expected = IterativeLQ(game, SolverSettings(**limits)).solve(x0, initial)
    assert len(np.unique(expected.iterations)) > 2, "particles must drop out at different times"
    assert len(np.unique(expected.status)) > 2
    particles = np.arange(len(initial))
    indices = {
        "as they are": None,
        "backwards": particles[::-1],
        "shuffled": np.random.default_rng(0).permutation(particles),
    }[order]
    solver = IterativeLQ(game, SolverSettings(threads=threads, **limits))
    for _ in range(3):  # threads take turns as they like
        check_same_solution(solver.solve(x0, initial, indices), expected)


@pytest.mark.parametrize("count", [1, 2, WIDE, WIDE + 1])
def test_threads_make_no_difference_to_a_few_particles_either(
    count: int, crowd: tuple[Game, np.ndarray, Strategy]
) -> None:
    game, x0, initial = crowd
    few = initial.take(np.arange(count))
    expected = IterativeLQ(game).solve(x0, few)
    check_same_solution(IterativeLQ(game, SolverSettings(threads=3)).solve(x0, few), expected)


@pytest.mark.parametrize("threads", [0, -1, 65, 1.5])
def test_a_number_of_threads_that_makes_no_sense_is_refused(threads: float) -> None:
    with pytest.raises(ValidationError, match="threads"):
        SolverSettings(threads=threads)


def test_an_exception_in_a_thread_comes_out(
    crowd: tuple[Game, np.ndarray, Strategy], monkeypatch: pytest.MonkeyPatch
) -> None:
    game, x0, initial = crowd
    solver = IterativeLQ(game, SolverSettings(threads=2))
    expected = solver.solve(x0, initial)
    iterate, helper_works = Block.iterate, threading.Event()

    def failing(block: Block, first_step: int, lanes: np.ndarray) -> None:
        if threading.current_thread() is not threading.main_thread():
            helper_works.set()
            raise ArithmeticError("from the helper")
        assert helper_works.wait(60.0)
        iterate(block, first_step, lanes)

    with monkeypatch.context() as patched:
        patched.setattr(Block, "iterate", failing)
        with pytest.raises(ArithmeticError, match="from the helper"):
            solver.solve(x0, initial)
    check_same_solution(solver.solve(x0, initial), expected)


@pytest.mark.parametrize("limit", [1, 2, 5, 12])
def test_a_cap_is_as_good_as_a_setting(
    limit: int, crowd: tuple[Game, np.ndarray, Strategy]
) -> None:
    game, x0, initial = crowd
    capped = IterativeLQ(game).solve(x0, initial, max_iterations=limit)
    expected = IterativeLQ(game, SolverSettings(max_iterations=limit)).solve(x0, initial)
    check_same_solution(capped, expected)
    assert capped.iterations.max() <= limit and len(capped.step_sizes) <= limit


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("ago", [0.0, 1.0, np.inf])
def test_after_the_deadline_nothing_is_reached(
    ago: float, threads: int, crowd: tuple[Game, np.ndarray, Strategy]
) -> None:
    game, x0, initial = crowd
    solver = IterativeLQ(game, SolverSettings(threads=threads))
    solution = solver.solve(x0, initial, deadline=perf_counter() - ago)
    assert (solution.status == Status.NOT_REACHED).all()
    assert not solution.converged.any() and not solution.iterations.any()
    assert solution.step_sizes.shape == (0, len(initial))
    for found, given in zip(solution.strategy.arrays, initial.arrays, strict=True):
        np.testing.assert_array_equal(found, given)
        assert not np.shares_memory(found, given)
    assert solution.reason(3) == "not reached: the deadline came before the first iteration"


class Clock:
    """A clock that goes on by 1 whenever somebody looks at it, and not by itself."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._ticks = itertools.count()
        monkeypatch.setattr("gameinfer_ros.solver.iterative_lq.perf_counter", self)

    def __call__(self) -> float:
        return float(next(self._ticks))


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("deadline", [1, 2, 3, 5, 9, 17, 40])
def test_a_deadline_leaves_what_whole_iterations_have_led_to(
    deadline: int,
    threads: int,
    crowd: tuple[Game, np.ndarray, Strategy],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    game, x0, initial = crowd
    initial = initial.take(np.arange(3 * WIDE))
    solver = IterativeLQ(game, SolverSettings(threads=threads, converged_movement=0.01))
    capped = {
        int(n): solver.solve(x0, initial, max_iterations=int(n))
        for n in range(1, solver.solve(x0, initial).iterations.max() + 1)
    }
    clock = Clock(monkeypatch)
    solution = solver.solve(x0, initial, deadline=deadline)
    assert clock() <= deadline + 3 * threads, "nobody goes on for long"
    for k, n in enumerate(solution.iterations.tolist()):
        if n == 0:
            # The one that is no strategy takes no time.
            expected = (Status.NOT_FINITE, Status.NOT_REACHED)
            assert solution.status[k] in (expected if k == 7 else expected[1:])
            source = initial
        else:
            assert solution.status[k] == capped[n].status[k]
            assert capped[n].iterations[k] == n
            assert solution.movement[k] == capped[n].movement[k]
            np.testing.assert_array_equal(solution.step_sizes[:n, k], capped[n].step_sizes[:n, k])
            source = capped[n].strategy
        if k != 7:
            for found, given in zip(solution.strategy.arrays, source.arrays, strict=True):
                np.testing.assert_array_equal(found[..., k], given[..., k])
    if deadline < 10:
        assert (solution.status == Status.NOT_REACHED).any()
    assert (solution.iterations > 0).any()


@pytest.mark.parametrize("rounds", [1, 2, 4])
def test_those_who_come_first_in_the_order_are_reached_first(
    rounds: int, crowd: tuple[Game, np.ndarray, Strategy], monkeypatch: pytest.MonkeyPatch
) -> None:
    game, x0, initial = crowd
    order = np.random.default_rng(1).permutation(len(initial))
    order = order[order != 7]  # it would make room at once
    Clock(monkeypatch)
    # A state moves in any iteration, so nobody is done before the cap, and all start together.
    solver = IterativeLQ(game, SolverSettings(converged_movement=1e-300))
    # The clock is looked at once at the start, and once after each iteration.
    solution = solver.solve(x0, initial, order, max_iterations=1, deadline=rounds)
    reached = np.flatnonzero(solution.status != Status.NOT_REACHED)
    assert set(reached.tolist()) == set(order[: rounds * WIDE].tolist())
    assert (solution.iterations[reached] == 1).all()


def test_who_is_not_in_the_order_is_not_reached(crowd: tuple[Game, np.ndarray, Strategy]) -> None:
    game, x0, initial = crowd
    whole = IterativeLQ(game).solve(x0, initial)
    some = np.array([20, 3, 11])
    solution = IterativeLQ(game).solve(x0, initial, some)
    others = np.delete(np.arange(len(initial)), some)
    assert (solution.status[others] == Status.NOT_REACHED).all()
    for found, given, solved in zip(
        solution.strategy.arrays, initial.arrays, whole.strategy.arrays, strict=True
    ):
        np.testing.assert_array_equal(found[..., others], given[..., others])
        np.testing.assert_array_equal(found[..., some], solved[..., some])


def test_an_interrupted_solve_leaves_no_thread_behind(
    crowd: tuple[Game, np.ndarray, Strategy], monkeypatch: pytest.MonkeyPatch
) -> None:
    game, x0, initial = crowd
    solver = IterativeLQ(game, SolverSettings(threads=3))
    expected = solver.solve(x0, initial)
    iterate, caller = Block.iterate, threading.current_thread()
    with monkeypatch.context() as patch:

        def interrupted(block: Block, *arguments: Any) -> None:
            if threading.current_thread() is caller:
                raise KeyboardInterrupt
            iterate(block, *arguments)

        patch.setattr(Block, "iterate", interrupted)
        with pytest.raises(KeyboardInterrupt):
            solver.solve(x0, initial)
    again = solver.solve(x0, initial)
    for found, right in zip(again.strategy.arrays, expected.strategy.arrays, strict=True):
        np.testing.assert_array_equal(found, right)


def test_no_iteration_is_no_offer(crowd: tuple[Game, np.ndarray, Strategy]) -> None:
    game, x0, initial = crowd
    with pytest.raises(ValueError, match="max_iterations: 0 is not at least 1"):
        IterativeLQ(game).solve(x0, initial, max_iterations=0)
