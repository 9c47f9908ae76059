"""A goal state, which a player wants to have reached at a given time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from pydantic import Field
from typing_extensions import override

from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm, check_length
from gameinfer_ros.games.costs.quadratic_state import QuadraticState, bind_states
from gameinfer_ros.games.players import Players
from gameinfer_ros.games.registry import NonNegative, Real

if TYPE_CHECKING:
    from gameinfer_ros.games.game import Game


class Goal(CostTerm):
    """The cost 1/2 sum_j w_j (x_j - goal_j)^2 at every step with t >= `active_from`.

    The time t counts from the start of the run, so the term remains active after `active_from`.
    Differences of angles modulo a turn, such as headings, are taken by the short way.
    """

    kind: Literal["goal"] = "goal"
    weights: tuple[NonNegative, ...] = Field(
        description="weights w, one for each state of the player"
    )
    goals: dict[str, tuple[Real, ...]] = Field(
        description="goal state of each player that has the term"
    )
    active_from: Real = Field(
        description="time from which the term is active, in s since the start of the run"
    )
    cost_kernel: ClassVar[Any] = QuadraticState.cost_kernel
    quadraticise_kernel: ClassVar[Any] = QuadraticState.quadraticise_kernel

    @override
    def players_in(self, players: Players) -> list[int]:
        indices = super().players_in(players)
        names = [players.names[i] for i in indices]
        for name in self.goals:
            if name not in names:
                raise ValueError(
                    f"goals.{name}: is not allowed: the players of the term are {', '.join(names)}"
                )
        for name in names:
            if name not in self.goals:
                raise ValueError(f"goals: the goal of {name} is missing")
        return indices

    @override
    def bind(self, players: Players, i: int) -> list[BoundTerm]:
        goal = self.goals[players.names[i]]
        check_length(f"goals.{players.names[i]}", goal, players.dynamics[i].state_names)
        return [bind_states(self, players, i, self.weights, goal, self.active_from)]


def goal_positions(game: Game) -> list[np.ndarray]:
    """Return the positions (G, 2), in m, of the goals of each player.

    A goal counts if both weights of its position are above 0.
    """
    positions = []
    for i, name in enumerate(game.players.names):
        x, y = game.players.dynamics[i].position
        terms = [bound.term for bound in game.terms[i] if isinstance(bound.term, Goal)]
        goals = [(t.goals[name][x], t.goals[name][y]) for t in terms if t.weights[x] * t.weights[y]]
        positions.append(np.array(list(dict.fromkeys(goals))).reshape(-1, 2))
    return positions
