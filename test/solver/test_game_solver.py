"""The iterative LQ solver, against other ways to solve games."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from solving import PAPER, GameFactory, Start, check_against_reference, random_inputs, solve
from strategies import assert_same_particle

from examples import examples
from gameinfer_ros.games import (
    DoubleIntegrator,
    Game,
    Goal,
    QuadraticInput,
    QuadraticState,
    SoftBound,
    Unicycle,
)
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import (
    GameSolver,
    SolverSettings,
    Status,
    Strategy,
    best_response,
    reference,
)

# Against the reference


@pytest.mark.parametrize("kinds", ["u", "d", "ud", "du", "udu"])
def test_solutions_agree_with_the_reference(
    kinds: str, make_game: GameFactory, start: Start
) -> None:
    game = make_game(kinds)
    assert check_against_reference(game, start(game), random_inputs(game, 4)) >= 3


class Plain(Unicycle):
    """A unicycle of which nobody has written derivatives."""

    linearise_kernel: ClassVar[Any] = None


def test_steps_are_differentiated_if_dynamics_give_no_linearisation(
    make_game: GameFactory, start: Start
) -> None:
    game = make_game("uu")
    names = game.players.names
    terms = {id(bound.term): bound.term for terms in game.terms for bound in terms}
    costs = list(terms.values())
    plain = Game({name: Plain() for name in names}, costs, game.dt, game.horizon)
    assert check_against_reference(plain, start(game), random_inputs(game, 4)) >= 3


def test_the_three_player_scenario_agrees_with_the_reference(three_player: Scenario) -> None:
    rng, players = np.random.default_rng(0), three_player.game.players
    u = three_player.seeds.sample(rng, players, 100, examples(12))
    assert check_against_reference(three_player.game, three_player.initial_state, u) >= 2


@pytest.mark.parametrize(
    ("settings", "status"),
    [
        ({"max_iterations": 2}, Status.ITERATION_LIMIT),
        ({"max_movement": 0.02, "converged_movement": 1e-9}, Status.ITERATION_LIMIT),
        ({"max_movement": 0.02, "max_halvings": 1}, Status.LINE_SEARCH_FAILED),
        ({"max_iterations": 4, "first_step_size": 0.3}, Status.ITERATION_LIMIT),
        (
            {"max_iterations": 4, "state_regularisation": 1.0, "input_regularisation": 20.0},
            Status.ITERATION_LIMIT,
        ),
    ],
)
def test_other_settings_agree_with_the_reference(
    settings: dict[str, Any], status: Status, game: Game, x0: np.ndarray
) -> None:
    u, limits = random_inputs(game, 3), {"max_iterations": 12} | settings
    assert check_against_reference(game, x0, u, **limits) >= 2
    assert (solve(game, x0, u, **limits).status == status).all()


def test_a_later_first_step_agrees_with_the_reference(game: Game, x0: np.ndarray) -> None:
    u = random_inputs(game, 1)
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
                weights=(30.0, 20.0, 30.0, 20.0), goals={"robot": goal}, active_from=(T - 0.5) * dt
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
    speed = x[:, dynamics.state_names.index(names[0])]
    steer = u[:, dynamics.input_names.index(names[1])]
    assert (speed > 0.33).any() and (steer > 0.4).any(), "the bounds must matter"
    best = best_response(game, x0, solution.strategy, 0)
    assert best.cost == pytest.approx(cost)
    assert best.best_cost <= cost <= best.best_cost * (1 + excess)
    assert np.abs(best.u - u).max() <= distance


# How a solution ends


def test_every_particle_that_converged_says_so(game: Game, x0: np.ndarray) -> None:
    solution = solve(game, x0, random_inputs(game, 5))
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
    again = GameSolver(game, PAPER).solve(x0, strategy)
    assert (again.iterations == 1).all()
    np.testing.assert_allclose(again.strategy.x_ref, strategy.x_ref, rtol=0, atol=1e-7)


def test_the_iteration_limit_is_reported(game: Game, x0: np.ndarray) -> None:
    solution = solve(game, x0, random_inputs(game, 2), max_iterations=1)
    assert (solution.status == Status.ITERATION_LIMIT).all()
    assert (solution.iterations == 1).all()
    assert not solution.converged.any()
    assert (solution.step_size == 0.5).all()
    assert "iteration limit" in solution.reason(1)


def test_a_failed_line_search_is_reported_and_keeps_what_could_be_played(
    game: Game, x0: np.ndarray
) -> None:
    u = random_inputs(game, 2)
    solution = solve(game, x0, u, max_movement=1e-3, converged_movement=1e-4, max_halvings=1)
    assert (solution.status == Status.LINE_SEARCH_FAILED).all()
    assert (solution.step_size == 0.25).all()
    assert (solution.movement > 1e-3).all()
    assert "line search failed" in solution.reason(0)
    np.testing.assert_array_equal(solution.strategy.u_ref, u)
    np.testing.assert_array_equal(solution.strategy.x_ref[..., 1], play(game, x0, u[..., 1]))


def test_the_line_search_halves_only_where_it_must(game: Game, x0: np.ndarray) -> None:
    u = random_inputs(game, 8)
    tried = np.array(
        [
            solve(
                game, x0, u, max_movement=0.3, max_iterations=n, converged_movement=1e-9
            ).step_size
            for n in range(1, 12)
        ]
    )
    assert set(np.unique(np.log2(tried))) <= set(-np.arange(1.0, 22.0))
    assert (tried == 0.5).any() and (tried < 0.5).any()


def test_the_line_search_may_use_all_its_halvings_and_no_more(game: Game, x0: np.ndarray) -> None:
    u, once = random_inputs(game, 1), {"converged_movement": 1e-9, "max_iterations": 1}
    for limit in (2.0, 0.5, 0.1, 0.01):
        free = solve(game, x0, u, max_movement=limit, **once)
        needed = round(-np.log2(free.step_size[0])) - 1
        for halvings in (needed, needed - 1):
            if halvings < 0:
                continue
            bound = solve(game, x0, u, max_movement=limit, max_halvings=halvings, **once)
            if halvings == needed:
                assert bound.status[0] == Status.ITERATION_LIMIT
                np.testing.assert_array_equal(bound.strategy.x_ref, free.strategy.x_ref)
            else:
                assert bound.status[0] == Status.LINE_SEARCH_FAILED
                # The failure reports what was tried.
                assert bound.step_size[0] == 0.5 ** (halvings + 1)
                assert bound.movement[0] > limit
    assert needed > 3, "the last limit must be a tight one"


def test_no_iteration_moves_farther_than_allowed(game: Game, x0: np.ndarray) -> None:
    u = random_inputs(game, 1)
    last = play(game, x0, u[..., 0])
    for n in range(1, 12):
        solution = solve(game, x0, u, max_movement=0.2, converged_movement=1e-6, max_iterations=n)
        x = solution.strategy.x_ref[..., 0]
        moved = np.abs(x - last).max()
        assert moved <= 0.2
        assert solution.movement[0] == pytest.approx(moved, abs=1e-12)
        last = x


@pytest.mark.parametrize("huge", [1e200, np.inf, np.nan])
def test_numbers_that_overflow_are_reported_and_change_no_other_particle(
    huge: float, game: Game, x0: np.ndarray
) -> None:
    u = random_inputs(game, 3)
    alone = solve(game, x0, u)
    u[..., 1] = huge
    solution = solve(game, x0, u)
    assert list(solution.status) == [Status.CONVERGED, Status.NOT_FINITE, Status.CONVERGED]
    assert "not finite" in solution.reason(1)
    for k in (0, 2):
        np.testing.assert_array_equal(solution.strategy.x_ref[..., k], alone.strategy.x_ref[..., k])


def test_equations_that_overflow_are_reported(make_game: GameFactory) -> None:
    game = make_game("d")
    # The states can be played out, but the products of the Riccati recursion are too large.
    x0, u = np.array([1e306, 0.0, 1e306, 0.0]), np.zeros((20, 2, 1))
    solution = solve(game, x0, u)
    assert solution.status[0] == Status.NOT_FINITE
    assert solution.iterations[0] == 1
    with np.errstate(all="ignore"):
        assert reference.solve(game, x0, u[..., 0], SolverSettings()).status == Status.NOT_FINITE


def test_arrays_that_do_not_fit_the_game_are_refused(game: Game, x0: np.ndarray) -> None:
    solver = GameSolver(game, PAPER)
    good = Strategy.from_inputs(0, x0, random_inputs(game, 2))
    with pytest.raises(ValueError, match=r"x0: .*\(7,\).*\(8,\)"):
        solver.solve(x0[:7], good)
    with pytest.raises(ValueError, match=r"x0: .* it must be finite"):
        solver.solve(np.where(np.arange(8) == 3, np.nan, x0), good)
    for name in ("x_ref", "u_ref", "P"):
        parts = {"x_ref": good.x_ref, "u_ref": good.u_ref, "P": good.P}
        for axis in range(parts[name].ndim - 1):
            bad = parts | {name: np.delete(parts[name], 0, axis=axis)}
            with pytest.raises(ValueError, match="shape"):
                solver.solve(x0, Strategy(0, **bad))


def test_a_solve_leaves_its_arguments_alone(game: Game, x0: np.ndarray) -> None:
    initial = Strategy.from_inputs(0, x0, random_inputs(game, 2))
    before = [array.copy() for array in (x0, *initial.arrays)]
    GameSolver(game, PAPER).solve(x0, initial)
    for one, other in zip(before, (x0, *initial.arrays), strict=True):
        np.testing.assert_array_equal(one, other)


def test_no_particles_are_no_trouble(game: Game, x0: np.ndarray) -> None:
    solution = solve(game, x0, np.zeros((20, 4, 0)))
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
        np.testing.assert_array_equal(batch.step_size[k], one.step_size[0])
        assert_same_particle(batch.strategy, k, one.strategy, 0)
