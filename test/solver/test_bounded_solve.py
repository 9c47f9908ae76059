"""Threads, bounds and deadlines of the solver."""

from __future__ import annotations

import itertools
import threading
from concurrent.futures import ThreadPoolExecutor
from time import perf_counter
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from solving import PAPER, GameFactory, Start, paper, random_inputs

from gameinfer_ros.games import Game
from gameinfer_ros.lanes.blocks import WIDE
from gameinfer_ros.solver import GameSolver, Solution, Status, Strategy
from gameinfer_ros.solver.batch import Batch

Crowd = tuple[Game, np.ndarray, Strategy]


def check_same_solution(one: Solution, other: Solution) -> None:
    for a, b in zip(
        (*one.strategy.arrays, one.status, one.iterations, one.step_size, one.movement),
        (*other.strategy.arrays, other.status, other.iterations, other.step_size, other.movement),
        strict=True,
    ):
        np.testing.assert_array_equal(a, b)


@pytest.fixture
def crowd(make_game: GameFactory, start: Start) -> Crowd:
    """A game, a state, and as many particles as keep three threads busy for some rounds."""
    game = make_game("ud", horizon=10)
    u = random_inputs(game, 5 * WIDE + 3, size=1.0)
    u[..., 7] = np.nan
    return game, start(game), Strategy.from_inputs(0, start(game), u)


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("order", ["as they are", "backwards", "shuffled"])
def test_solutions_depend_neither_on_threads_nor_on_the_order(
    threads: int, order: str, crowd: Crowd
) -> None:
    game, x0, initial = crowd
    limits: dict[str, Any] = {"max_iterations": 11, "max_movement": 0.5, "converged_movement": 0.01}
    expected = GameSolver(game, paper(**limits)).solve(x0, initial)
    assert len(np.unique(expected.iterations)) > 2, "particles must drop out at different times"
    assert len(np.unique(expected.status)) > 2
    particles = np.arange(len(initial))
    indices = {
        "as they are": None,
        "backwards": particles[::-1],
        "shuffled": np.random.default_rng(0).permutation(particles),
    }[order]
    solver = GameSolver(game, paper(threads=threads, **limits))
    for _ in range(3):  # threads take turns as they like
        check_same_solution(solver.solve(x0, initial, indices), expected)


@pytest.mark.parametrize("count", [1, 2, WIDE, WIDE + 1])
def test_threads_make_no_difference_to_a_few_particles_either(count: int, crowd: Crowd) -> None:
    game, x0, initial = crowd
    few = initial.take(np.arange(count))
    expected = GameSolver(game, PAPER).solve(x0, few)
    check_same_solution(GameSolver(game, paper(threads=3)).solve(x0, few), expected)


@pytest.mark.parametrize("threads", [0, -1, 65, 1.5])
def test_a_number_of_threads_that_makes_no_sense_is_refused(threads: float) -> None:
    with pytest.raises(ValidationError, match="threads"):
        paper(threads=threads)


def test_an_exception_in_a_thread_comes_out(crowd: Crowd, monkeypatch: pytest.MonkeyPatch) -> None:
    game, x0, initial = crowd
    solver = GameSolver(game, paper(threads=2))
    expected = solver.solve(x0, initial)
    iterate, helper_works = Batch.iterate, threading.Event()

    def failing(block: Batch, first_step: int, lanes: np.ndarray) -> None:
        if threading.current_thread() is not threading.main_thread():
            helper_works.set()
            raise ArithmeticError("from the helper")
        assert helper_works.wait(60.0)
        iterate(block, first_step, lanes)

    with monkeypatch.context() as patched:
        patched.setattr(Batch, "iterate", failing)
        with pytest.raises(ArithmeticError, match="from the helper"):
            solver.solve(x0, initial)
    check_same_solution(solver.solve(x0, initial), expected)


def test_each_of_several_threads_gets_its_own_solution(crowd: Crowd) -> None:
    game, x0, initial = crowd
    solver = GameSolver(game, paper(threads=2))
    tasks = [
        (x0 + shift, initial if count is None else initial.take(np.arange(count)))
        for shift, count in ((0.0, None), (0.1, None), (0.2, 1), (0.3, 1), (0.4, WIDE))
    ]
    expected = [solver.solve(*task) for task in tasks]
    rolled_out = [solver.play_out(*task) for task in tasks]
    together = threading.Barrier(len(tasks))

    def work(number: int) -> None:
        together.wait()
        for _ in range(10):
            check_same_solution(solver.solve(*tasks[number]), expected[number])
            found = solver.play_out(*tasks[number])
            for a, b in zip(found.arrays, rolled_out[number].arrays, strict=True):
                np.testing.assert_array_equal(a, b)

    with ThreadPoolExecutor(len(tasks)) as threads:
        for future in [threads.submit(work, number) for number in range(len(tasks))]:
            future.result()


@pytest.mark.parametrize("limit", [1, 2, 5, 12])
def test_a_cap_is_as_good_as_a_setting(limit: int, crowd: Crowd) -> None:
    game, x0, initial = crowd
    capped = GameSolver(game, PAPER).solve(x0, initial, max_iterations=limit)
    expected = GameSolver(game, paper(max_iterations=limit)).solve(x0, initial)
    check_same_solution(capped, expected)
    assert capped.iterations.max() <= limit


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("ago", [0.0, 1.0, np.inf])
def test_after_the_deadline_nothing_is_reached(ago: float, threads: int, crowd: Crowd) -> None:
    game, x0, initial = crowd
    solver = GameSolver(game, paper(threads=threads))
    solution = solver.solve(x0, initial, deadline=perf_counter() - ago)
    assert (solution.status == Status.NOT_REACHED).all()
    assert not solution.converged.any() and not solution.iterations.any()
    assert np.isnan(solution.step_size).all()
    for found, given in zip(solution.strategy.arrays, initial.arrays, strict=True):
        np.testing.assert_array_equal(found, given)
        assert not np.shares_memory(found, given)
    assert solution.reason(3) == "not reached: the deadline came before the first iteration"


class Clock:
    """A clock that advances by 1 whenever it is read."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._ticks = itertools.count()
        monkeypatch.setattr("gameinfer_ros.solver.lq_search.perf_counter", self)

    def __call__(self) -> float:
        return float(next(self._ticks))


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("deadline", [1, 2, 3, 5, 9, 17, 40])
def test_a_deadline_leaves_what_whole_iterations_have_led_to(
    deadline: int, threads: int, crowd: Crowd, monkeypatch: pytest.MonkeyPatch
) -> None:
    game, x0, initial = crowd
    initial = initial.take(np.arange(3 * WIDE))
    solver = GameSolver(game, paper(threads=threads, converged_movement=0.01))
    capped = {
        int(n): solver.solve(x0, initial, max_iterations=int(n))
        for n in range(1, solver.solve(x0, initial).iterations.max() + 1)
    }
    clock = Clock(monkeypatch)
    solution = solver.solve(x0, initial, deadline=deadline)
    assert clock() <= deadline + 3 * threads, "no thread continues for long"
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
            np.testing.assert_array_equal(solution.step_size[k], capped[n].step_size[k])
            source = capped[n].strategy
        if k != 7:
            for found, given in zip(solution.strategy.arrays, source.arrays, strict=True):
                np.testing.assert_array_equal(found[..., k], given[..., k])
    if deadline < 10:
        assert (solution.status == Status.NOT_REACHED).any()
    assert (solution.iterations > 0).any()


@pytest.mark.parametrize("rounds", [1, 2, 4])
def test_those_who_come_first_in_the_order_are_reached_first(
    rounds: int, crowd: Crowd, monkeypatch: pytest.MonkeyPatch
) -> None:
    game, x0, initial = crowd
    order = np.random.default_rng(1).permutation(len(initial))
    order = order[order != 7]  # it would make room at once
    Clock(monkeypatch)
    # A state moves in any iteration, so none is done before the cap, and all start together.
    solver = GameSolver(game, paper(converged_movement=1e-300))
    # The clock is looked at once at the start, and once after each iteration.
    solution = solver.solve(x0, initial, order, max_iterations=1, deadline=rounds)
    reached = np.flatnonzero(solution.status != Status.NOT_REACHED)
    assert set(reached.tolist()) == set(order[: rounds * WIDE].tolist())
    assert (solution.iterations[reached] == 1).all()


def test_who_is_not_in_the_order_is_not_reached(crowd: Crowd) -> None:
    game, x0, initial = crowd
    whole = GameSolver(game, PAPER).solve(x0, initial)
    some = np.array([20, 3, 11])
    solution = GameSolver(game, PAPER).solve(x0, initial, some)
    others = np.delete(np.arange(len(initial)), some)
    assert (solution.status[others] == Status.NOT_REACHED).all()
    for found, given, solved in zip(
        solution.strategy.arrays, initial.arrays, whole.strategy.arrays, strict=True
    ):
        np.testing.assert_array_equal(found[..., others], given[..., others])
        np.testing.assert_array_equal(found[..., some], solved[..., some])


def test_an_interrupted_solve_leaves_no_thread_behind(
    crowd: Crowd, monkeypatch: pytest.MonkeyPatch
) -> None:
    game, x0, initial = crowd
    solver = GameSolver(game, paper(threads=3))
    expected = solver.solve(x0, initial)
    iterate, caller_works = Batch.iterate, threading.Event()
    with monkeypatch.context() as patch:

        def interrupted(block: Batch, *arguments: Any) -> None:
            if threading.current_thread() is threading.main_thread():
                caller_works.set()
                raise KeyboardInterrupt
            assert caller_works.wait(60.0)
            iterate(block, *arguments)

        patch.setattr(Batch, "iterate", interrupted)
        with pytest.raises(KeyboardInterrupt):
            solver.solve(x0, initial)
    check_same_solution(solver.solve(x0, initial), expected)


def test_no_iteration_is_no_offer(crowd: Crowd) -> None:
    game, x0, initial = crowd
    with pytest.raises(ValueError, match="max_iterations: 0 is not allowed"):
        GameSolver(game, PAPER).solve(x0, initial, max_iterations=0)
