"""A cost term of the user's own in a scenario: everything that a new kind needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, ClassVar, Literal

import numpy as np
import pytest
from scenario_content import GOOD, edited

from gameinfer_ros.games import CostTerm, Players
from gameinfer_ros.games.costs.cost_term import BoundTerm
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.lanes.lanes import Array
from gameinfer_ros.scenario import Scenario, ScenarioError
from gameinfer_ros.solver import GameSolver, Strategy


@kernel
def leash_cost(t: float, x: Array, u: Array, index: Array, params: Array) -> Array:
    dx, dy = x[index[0]] - x[index[2]], x[index[1]] - x[index[3]]
    return 0.5 * params[0] * (dx * dx + dy * dy)


@kernel
def leash_quadraticise(
    t: float, x: Array, u: Array, index: Array, params: Array,
    Q: Array, q: Array, R: Array, r: Array,
) -> None:  # fmt: skip
    for axis in range(2):
        own, other = index[axis], index[2 + axis]
        pull = params[0] * (x[own] - x[other])
        q[own] += pull
        q[other] -= pull
        Q[own, own] += params[0]
        Q[other, other] += params[0]
        Q[own, other] -= params[0]
        Q[other, own] -= params[0]


@pytest.fixture
def leash() -> Iterator[type[CostTerm]]:
    """1/2 w d^2 for the distance d to another player; forgotten after the test."""

    class Leash(CostTerm):
        kind: Literal["leash"] = "leash"
        to: str
        weight: float
        cost_kernel: ClassVar[Any] = leash_cost
        quadraticise_kernel: ClassVar[Any] = leash_quadraticise

        def bind(self, players: Players, i: int) -> list[BoundTerm]:
            rows = players.position_rows(i) + players.position_rows(players.index(self.to))
            return [BoundTerm(self, rows, (self.weight,))]

    yield Leash
    del CostTerm.family["leash"]
    Scenario.model_rebuild(force=True)


def test_a_cost_term_of_the_users_own_is_known_by_its_kind(
    leash: type[CostTerm], load: Callable[..., Scenario]
) -> None:
    term = {"kind": "leash", "to": "robot", "weight": 20.0, "players": ["ana"]}
    loaded = load(edited(lambda c: c["costs"].append(term)))
    assert isinstance(loaded.costs[-1], leash)

    x, u = loaded.initial_state[None], np.zeros((1, 4))
    difference = loaded.game.costs(x, u) - load(GOOD).game.costs(x, u)
    np.testing.assert_allclose(difference, [[0.0], [0.5 * 20.0 * 2.0]])

    seeds = np.zeros((20, 4, 1))
    distances = []
    for scenario in (loaded, load(GOOD)):
        solution = GameSolver(scenario.game, scenario.solver).solve(
            scenario.initial_state, Strategy.from_inputs(0, scenario.initial_state, seeds)
        )
        assert solution.converged.all(), solution.reason(0)
        distances.append(scenario.game.players.distances(solution.strategy.x_ref[..., 0]).mean())
    assert distances[0] < distances[1], "the leash must keep them together"


def test_a_cost_term_of_the_users_own_is_validated(
    leash: type[CostTerm], load: Callable[..., Scenario]
) -> None:
    term = {"kind": "leash", "weight": 20.0}
    with pytest.raises(ScenarioError, match=r"costs\[4\]\.to: is missing"):
        load(edited(lambda c: c["costs"].append(term)))
