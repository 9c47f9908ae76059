"""A goal: where a player wants to be from some time on."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field, NonNegativeFloat
from typing_extensions import override

from gameinfer_ros.games.cost_term import BoundTerm, CostTerm, check_length
from gameinfer_ros.games.players import Players
from gameinfer_ros.games.quadratic_state import QuadraticState, bind_states


class Goal(CostTerm):
    """1/2 sum_j w_j (x_j - goal_j)^2 at every step with t >= `active_from`.

    The time t is that of the run, so the term stays on once the horizon recedes past it.
    """

    kind: Literal["goal"] = "goal"
    weights: tuple[NonNegativeFloat, ...] = Field(description="w, one for each state")
    goals: dict[str, tuple[float, ...]] = Field(description="the goal state of each player")
    active_from: float = Field(description="in s since the start of the run")
    cost_kernel: ClassVar[Any] = QuadraticState.cost_kernel
    quadraticise_kernel: ClassVar[Any] = QuadraticState.quadraticise_kernel

    @override
    def players_in(self, players: Players) -> list[int]:
        for name in self.goals:
            if name not in players.names:
                raise ValueError(
                    f"goals.{name}: no player is called so; there are {', '.join(players.names)}"
                )
        for i in super().players_in(players):
            if players.names[i] not in self.goals:
                raise ValueError(f"goals: has no goal for {players.names[i]}")
        return super().players_in(players)

    @override
    def bind(self, players: Players, i: int) -> list[BoundTerm]:
        goal = self.goals[players.names[i]]
        check_length(f"goals.{players.names[i]}", goal, players.dynamics[i].state_names)
        return [bind_states(self, players, i, self.weights, goal, self.active_from)]
