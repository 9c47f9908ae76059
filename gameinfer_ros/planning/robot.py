"""What the robot does with each observed state: infer, plan, act."""

from __future__ import annotations

from time import perf_counter
from typing import NamedTuple

import numpy as np

from gameinfer_ros.games import ROBOT, Vehicles
from gameinfer_ros.inference import Belief
from gameinfer_ros.planning.planner import Planner
from gameinfer_ros.planning.safety_filter import SafePlan, SafetyFilter
from gameinfer_ros.solver import Strategy

#: Default number of inputs of a plan.
PLAN_LENGTH = 10

#: Value of `SafePlan.action` without a safety layer.
OFF = "off"


def plan(strategy: Strategy, step: int, x: np.ndarray, length: int) -> np.ndarray:
    """Return the inputs of a strategy from `step` on.

    The first input is the feedback on the state `x`. The others are the reference inputs of the
    following steps, to be applied if no newer state arrives.

    Args:
        strategy: strategy of one particle, for m inputs.
        step: step of `x`; the horizon of `strategy` must contain it.
        x: joint state (nx,).
        length: number of inputs.

    Returns:
        Inputs (S, m), with S = `length`, or fewer if the horizon ends before.

    Raises:
        IndexError: the horizon does not contain `step`.
    """
    first = strategy.inputs(step, x)[:, 0]
    k = step - strategy.first_step
    return np.vstack([first, strategy.u_ref[k + 1 : k + length, :, 0]])


class State(NamedTuple):
    """An observed state.

    Attributes:
        step: its time step.
        s: joint state (ns,) of the vehicles.
        x: joint state (nx,) of the game.
    """

    step: int
    s: np.ndarray
    x: np.ndarray


class Deliberation:
    """Turns observed states into strategies of the robot, by inference and planning.

    For each state, call `observe` and `choose`, act on the strategy, and call `update`:

    1. `observe` weighs the particles with the state and combines duplicates. It re-solves the game
       only if no strategy covers the step of the state, as for the first state.
    2. `choose` lets the planner derive the robot's strategy from the belief.
    3. `update` re-solves the game for the particles from the newest state. This takes long, so the
       robot acts before it.

    Args:
        vehicles: the vehicles of all players.
        belief: the belief; `None` if neither the planner nor a viewer needs one.
        planner: the robot's planner; `None` if the robot only watches.

    Attributes:
        newest: the newest state; `None` before the first one.
        missing: number of missing states between the last two observed ones.
    """

    def __init__(self, vehicles: Vehicles, belief: Belief | None, planner: Planner | None) -> None:
        self._vehicles, self._players = vehicles, vehicles.game.players
        self.belief, self.planner = belief, planner
        self.missing = 0
        self.newest: State | None = None

    def observe(self, step: int, s: np.ndarray, w: np.ndarray) -> None:
        """Weigh the particles with a state, and make sure that strategies cover its step.

        If the state of the previous step is missing, the weights do not change.

        Args:
            step: step of `s`, later than that of the last state.
            s: joint state (ns,) of the vehicles.
            w: joint input (nw,) of the vehicles in the previous step.
        """
        last, x = self.newest, self._vehicles.game_state(s)
        self.newest = State(step, s, x)
        self.missing = 0 if last is None else step - last.step - 1
        if self.belief is None:
            return
        if last is not None and not self.missing:
            u = self._vehicles.game_input(last.s, w)
            self.belief.weigh(last.step, last.x, x, u[self._players.inputs(ROBOT)])
            self.belief.combine_duplicates()
        strategy = self.belief.particles.strategy
        if strategy is None or step >= strategy.end:
            self.belief.solve(step, x)

    def choose(self) -> Strategy:
        """Return the robot's strategy (of one particle, for its own inputs) for the newest state.

        Raises:
            RuntimeError: no state has been observed, or the robot only watches.
        """
        if self.newest is None or self.planner is None:
            raise RuntimeError("choose requires an observed state and a planner")
        step, _, x = self.newest
        strategy = self.planner.strategy(self.belief, step, x)
        return strategy.of_inputs(self._players.inputs(ROBOT))

    def update(self, deadline: float = np.inf) -> int:
        """Re-solve the game for the particles from the newest state, unless `observe` has.

        Args:
            deadline: value of `time.perf_counter()` after which no iteration starts.

        Returns:
            Number of particles that have been re-solved from the newest state.
        """
        belief, newest = self.belief, self.newest
        if belief is None or newest is None:
            return 0
        if belief.strategy.first_step < newest.step:
            if perf_counter() >= deadline:
                return 0
            belief.solve(newest.step, newest.x, deadline)
        return int(belief.updated.sum())


class Execution:
    """Turns a player's strategy into inputs of its vehicle, checked by the safety layer.

    Args:
        vehicles: the vehicles of all players.
        player: index of the player.
        safety: the safety layer; `None` to execute plans unchecked.
    """

    def __init__(
        self, vehicles: Vehicles, player: int = ROBOT, safety: SafetyFilter | None = None
    ) -> None:
        self._vehicles, self._player = vehicles, player
        self.safety = safety

    def act(
        self, strategy: Strategy, step: int, s: np.ndarray, length: int = PLAN_LENGTH
    ) -> SafePlan:
        """Return the plan of the vehicle from a state on.

        Args:
            strategy: strategy of one particle for the player's own inputs; its horizon must
                contain `step`.
            step: step of `s`.
            s: joint state (ns,) of the vehicles.
            length: largest number of inputs.

        Returns:
            States and inputs of the player's vehicle. The first input is for `step`. The others
            bridge the gap if the next state is late.

        Raises:
            IndexError: the horizon of `strategy` does not contain `step`.
        """
        x = self._vehicles.game_state(s)
        near = strategy.near(step, x, self._vehicles.game.players.is_angle)
        inputs = plan(near, step, x, length)
        states, w = self._vehicles.follow(self._player, s, inputs)
        if self.safety is None:
            return SafePlan(states, w, OFF, "")
        return self.safety.check(s, w, states)
