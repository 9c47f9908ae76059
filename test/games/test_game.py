from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from gameinfer_ros.games import (
    DoubleIntegrator,
    Game,
    Goal,
    Proximity,
    QuadraticInput,
    QuadraticState,
    Unicycle,
)


@pytest.fixture
def game() -> Game:
    return Game(
        {"robot": Unicycle(), "ana": DoubleIntegrator()},
        [
            QuadraticInput(weights=(2.0, 4.0)),
            QuadraticState(weights=(0.0, 0.0, 0.0, 6.0), players=("robot",)),
            Proximity(radius=1.0, weight=10.0),
            Goal(
                weights=(0.0, 0.0, 8.0, 0.0),
                goals={"ana": (0.0, 0.0, 1.0, 0.0)},
                active_from=0.25,
                players=("ana",),
            ),
        ],
        dt=0.1,
        horizon=5,
    )


def cost_by_hand(x: np.ndarray, u: np.ndarray, t: float) -> list[float]:
    close = 10.0 * max(0.0, 1.0 - np.hypot(x[0] - x[4], x[1] - x[6])) ** 2
    robot = u[0] ** 2 + 2 * u[1] ** 2 + 3 * x[3] ** 2 + close
    ana = u[2] ** 2 + 2 * u[3] ** 2 + close + (4 * (x[6] - 1) ** 2 if t >= 0.25 else 0.0)
    return [robot, ana]


@pytest.mark.parametrize("first_step", [0, 2, 40])
def test_costs_sum_the_terms_of_each_player_at_each_step(game: Game, first_step: int) -> None:
    rng = np.random.default_rng(0)
    x, u = rng.normal(0, 0.5, (6, 8)), rng.normal(size=(6, 4))
    expected = [cost_by_hand(x[k], u[k], 0.1 * (first_step + k)) for k in range(6)]
    np.testing.assert_allclose(game.costs(x, u, first_step), np.transpose(expected), rtol=1e-12)


def test_the_last_state_may_go_without_an_input(game: Game) -> None:
    rng = np.random.default_rng(1)
    x, u = rng.normal(0, 0.5, (6, 8)), rng.normal(size=(5, 4))
    padded = np.vstack([u, np.zeros(4)])
    np.testing.assert_array_equal(game.costs(x, u), game.costs(x, padded))


def test_particles_cost_what_they_cost_alone(game: Game) -> None:
    rng = np.random.default_rng(2)
    x, u = rng.normal(0, 0.5, (6, 8, 9)), rng.normal(size=(6, 4, 9))
    together = game.costs(x, u, 3)
    assert together.shape == (2, 6, 9)
    for k in range(9):
        np.testing.assert_array_equal(together[..., k], game.costs(x[..., k], u[..., k], 3))


def test_costs_leave_their_arguments_alone(game: Game) -> None:
    x, u = np.ones((6, 8)), np.ones((5, 4))
    game.costs(x, u)
    game.step(x[0], u[0])
    assert (x == 1).all() and (u == 1).all()


def test_a_step_moves_every_player_by_its_own_dynamics(game: Game) -> None:
    rng = np.random.default_rng(3)
    x, u = rng.normal(size=(8, 7)), rng.normal(size=(4, 7))
    x_next = game.step(x, u)
    for lane in range(7):
        np.testing.assert_array_equal(x_next[:, lane], game.step(x[:, lane], u[:, lane]))
        ana = Game({"ana": DoubleIntegrator()}, [], 0.1, 1)
        robot = Game({"robot": Unicycle()}, [], 0.1, 1)
        np.testing.assert_array_equal(x_next[:4, lane], robot.step(x[:4, lane], u[:2, lane]))
        np.testing.assert_array_equal(x_next[4:, lane], ana.step(x[4:, lane], u[2:, lane]))
    # The double integrator is exact: p + v dt + a dt^2 / 2.
    np.testing.assert_allclose(x_next[4], x[4] + 0.1 * x[5] + 0.005 * u[2], rtol=1e-12)


def test_a_game_without_costs_costs_nothing() -> None:
    game = Game({"robot": Unicycle()}, [], 0.1, 3)
    assert not game.costs(np.ones((4, 4)), np.ones((3, 2))).any()


def test_views_that_are_not_contiguous_do_as_well(game: Game) -> None:
    rng = np.random.default_rng(4)
    x, u = rng.normal(size=(3, 8, 6)), rng.normal(size=(3, 4, 6))
    expected = game.costs(x[..., ::2].copy(), u[..., ::2].copy())
    np.testing.assert_array_equal(game.costs(x[..., ::2], u[..., ::2]), expected)
    expected = game.step(x[0, :, ::2].copy(), u[0, :, ::2].copy())
    np.testing.assert_array_equal(game.step(x[0, :, ::2], u[0, :, ::2]), expected)


def test_terms_list_what_each_player_has(game: Game) -> None:
    kinds = [[bound.term.kind for bound in of_player] for of_player in game.terms]
    assert kinds == [
        ["quadratic_input", "quadratic_state", "proximity"],
        ["quadratic_input", "proximity", "goal"],
    ]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"dynamics": {}}, ("at least one player",)),
        ({"dt": 0.0}, ("dt", "0.0", "above 0")),
        ({"dt": -0.1}, ("dt", "-0.1")),
        ({"dt": np.nan}, ("dt", "nan")),
        ({"horizon": 0}, ("horizon", "0", "at least 1")),
    ],
)
def test_a_game_that_makes_no_sense_is_refused(
    changes: dict[str, object], words: tuple[str, ...]
) -> None:
    good = {"dynamics": {"robot": Unicycle()}, "costs": [], "dt": 0.1, "horizon": 5}
    with pytest.raises(ValueError) as caught:
        Game(**(good | changes))
    assert all(word in str(caught.value) for word in words), caught.value


def test_two_goals_of_one_player_add_up() -> None:
    def goal(x: float) -> Goal:
        return Goal(weights=(2.0, 0, 0, 0), goals={"robot": (x, 0, 0, 0)}, active_from=0)

    game = Game({"robot": Unicycle()}, [goal(1.0), goal(3.0)], 0.1, 1)
    assert game.costs(np.zeros((1, 4)), np.zeros((1, 2)))[0, 0] == pytest.approx(1.0 + 9.0)


def test_several_threads_may_use_one_game(game: Game) -> None:
    rng = np.random.default_rng(0)
    tasks = [(rng.normal(size=(30, 8, K)), rng.normal(size=(30, 4, K))) for K in (1, 8, 9, 40)]
    costs = [game.costs(x, u) for x, u in tasks]
    steps = [game.step(x[0], u[0]) for x, u in tasks]
    together = threading.Barrier(len(tasks))

    def work(number: int) -> None:
        together.wait()
        x, u = tasks[number]
        for _ in range(50):
            np.testing.assert_array_equal(game.costs(x, u), costs[number])
            np.testing.assert_array_equal(game.step(x[0], u[0]), steps[number])

    with ThreadPoolExecutor(len(tasks)) as threads:
        list(threads.map(work, range(len(tasks))))
