"""What the robot does with each state: infer, choose, act."""

from __future__ import annotations

from time import perf_counter
from typing import NamedTuple

import numpy as np

from gameinfer_ros.games import ROBOT, Vehicles
from gameinfer_ros.inference import Belief
from gameinfer_ros.planning.plan import PLAN_LENGTH, plan
from gameinfer_ros.planning.planner import Planner
from gameinfer_ros.planning.safety_filter import SafePlan, SafetyFilter
from gameinfer_ros.solver import Strategy

#: Action of the safety layer where there is none.
OFF = "off"


class State(NamedTuple):
    """A state that was observed.

    Attributes:
        step: the step that it belongs to.
        s: joint state (ns,) of the vehicles.
        x: joint state (nx,) in the game.
    """

    step: int
    s: np.ndarray
    x: np.ndarray


class Deliberation:
    """Infers and chooses: from observed states to the robot's strategy.

    Call `observe` with each state, then `choose`, act on the strategy, and call `update`:

    1. `observe` weighs the particles by the state and combines duplicates. It re-solves the game
       only if no strategy is known for the state's step, as for the first state;
    2. `choose` lets the planner make the robot's strategy from the belief;
    3. `update` re-solves the game for the particles from the newest state. It takes long, so what
       the robot does now does not wait for it.

    Args:
        vehicles: the vehicles of all players.
        belief: the belief; `None` if nothing needs one, neither the planner nor a viewer.
        planner: the robot's planner; `None` if the robot only watches.

    Attributes:
        newest: the newest state; `None` before the first.
        missing: number of states between the newest one and the one before it.
    """

    def __init__(self, vehicles: Vehicles, belief: Belief | None, planner: Planner | None) -> None:
        self._vehicles, self._players = vehicles, vehicles.game.players
        self.belief, self.planner = belief, planner
        self.missing = 0
        self.newest: State | None = None

    def observe(self, step: int, s: np.ndarray, w: np.ndarray) -> None:
        """Weigh the particles by a state, and see to it that strategies for its step are known.

        The weights stay as they are if the state before it is missing.

        Args:
            step: the step that `s` belongs to, later than that of the last state.
            s: joint state (ns,) of the vehicles.
            w: joint input (nw,) of the vehicles that was applied in the step before.
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
        """The robot's strategy (of one particle, for its own inputs) for the newest state.

        Raises:
            RuntimeError: no state has been observed, or the robot only watches.
        """
        if self.newest is None or self.planner is None:
            raise RuntimeError("a strategy needs a state and a planner")
        step, _, x = self.newest
        strategy = self.planner.strategy(self.belief, step, x)
        return strategy.of_inputs(self._players.inputs(ROBOT))

    def update(self, deadline: float = np.inf) -> int:
        """Re-solve the game for the particles from the newest state, unless that has been done.

        Args:
            deadline: value of `time.perf_counter()` from which on no iteration begins.

        Returns:
            How many particles have been re-solved from the newest state.
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
    """Acts: from a player's strategy to inputs of its vehicle that the safety layer lets pass.

    Args:
        vehicles: the vehicles of all players.
        player: index of the player.
        safety: the safety layer; `None` if the plan is executed as it is.
    """

    def __init__(
        self, vehicles: Vehicles, player: int = ROBOT, safety: SafetyFilter | None = None
    ) -> None:
        self._vehicles, self._player = vehicles, player
        self.safety = safety

    def act(
        self, strategy: Strategy, step: int, s: np.ndarray, length: int = PLAN_LENGTH
    ) -> SafePlan:
        """What the vehicle does from a state on.

        Args:
            strategy: strategy of one particle for the player's own inputs; its horizon contains
                `step`.
            step: the step that `s` belongs to.
            s: joint state (ns,) of the vehicles.
            length: number of inputs that are planned at most.

        Returns:
            States and inputs of the player's vehicle. The first input is for now; the others
            bridge the gap until a newer state arrives.
        """
        inputs = plan(strategy, step, self._vehicles.game_state(s), length)
        states, w = self._vehicles.follow(self._player, s, inputs)
        if self.safety is None:
            return SafePlan(states, w, OFF, "")
        return self.safety.check(s, w)
