"""What a robot was seen to do, and whether it keeps what is promised."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from promise import BASE_STANDS_AFTER, STATE_AGE, STRATEGY_AGE, promise

from gameinfer_ros.games import ROBOT, Vehicles
from msg_adapters import control

#: Slower than this, in m/s, is a standstill.
STANDS = 0.01

#: Inputs that differ by no more than this do so by rounding only.
_ROUNDING = 1e-6


class Seen(NamedTuple):
    """Where the robot was at a step.

    Attributes:
        time: when that was heard, by `time.monotonic`, in s.
        step: the step.
        speed: in m/s.
        omega: its turning rate during the step before, in rad/s.
    """

    time: float
    step: int
    speed: float
    omega: float


@dataclass
class Account:
    """What was heard of a robot that is a unicycle.

    Attributes:
        vehicles: what the players are.
        seen: what was seen of the robot, in order of arrival.
        plans: inputs (S, 2) of each message of the planner, by its step.
        strategy_ages: how old the strategy was that the planner followed at each step, in steps.
        lost: number of messages of the planner that were not heard.
        commands: when each velocity was sent to the base, in s, and its speed in m/s.
    """

    vehicles: Vehicles
    seen: list[Seen] = field(default_factory=list)
    plans: defaultdict[int, list[np.ndarray]] = field(default_factory=lambda: defaultdict(list))
    strategy_ages: dict[int, int] = field(default_factory=dict)
    lost: int = 0
    commands: list[tuple[float, float]] = field(default_factory=list)

    def speeds(self, begin: float, end: float) -> np.ndarray:
        """Speeds (S,), in m/s, of all steps that were heard of between two times, in s."""
        return np.abs([s.speed for s in list(self.seen) if begin < s.time <= end])

    def stood_after(self, begin: float, end: float, bound: int) -> dict[str, float]:
        """Steps after which the robot stood, from a loss on until what was lost came back.

        Nothing if less time passed than it may take.
        """
        moving = np.flatnonzero(self.speeds(begin, end) > STANDS)
        if len(self.speeds(begin, end)) <= bound:
            return {}
        after = int(moving.max(initial=-1)) + 1
        promise(after <= bound, f"the robot stands after {after} steps, and not {bound}")
        return {"brake_steps": float(after)}

    def base_stood_after(self, begin: float, end: float) -> dict[str, float]:
        """When a base was last told to move, in s after a loss, until what was lost came back.

        Nothing if less time passed than it may take.
        """
        if end - begin <= BASE_STANDS_AFTER:
            return {}
        commands = list(self.commands)
        moving = [t - begin for t, speed in commands if begin < t < end and speed > STANDS]
        stood = max(moving, default=0.0)
        promise(stood <= BASE_STANDS_AFTER, f"a base is told to move for {stood:.1f} s")
        return {"base_stood_s": stood}

    def check(self) -> dict[str, float]:
        """Check what every input came from, and that the robot can do it; tells the worst."""
        vehicles, own = self.vehicles, self.vehicles.inputs(ROBOT)
        dt = vehicles.game.dt
        oldest_state = oldest_strategy = unknown = 0
        for before, after in zip(self.seen, self.seen[1:], strict=False):
            if after.step != before.step + 1:
                continue  # time has jumped, or begins anew
            w = np.array([after.omega, (after.speed - before.speed) / dt])
            where = f"the input {w.tolist()} of step {before.step}"
            low, high = vehicles.low[own] - _ROUNDING, vehicles.high[own] + _ROUNDING
            promise((low <= w).all() and (w <= high).all(), f"{where} is beyond its limits")
            s = np.array([0.0, 0.0, 0.0, before.speed])
            if np.allclose(w, vehicles.braking_input(ROBOT, s), rtol=0.0, atol=_ROUNDING):
                continue
            ages = self._ages(before.step, w)
            if not ages:
                unknown += 1
                # Each message that was not heard may have had that many inputs that were used.
                enough = unknown <= self.lost * (STATE_AGE + 1)
                promise(enough, f"{where} comes from no plan, and {self.lost} were not heard")
                continue
            state, strategy = min(ages)
            promise(state <= STATE_AGE, f"{where} comes from a state of {state} steps before")
            promise(strategy <= STRATEGY_AGE, f"{where} comes from a strategy {strategy} steps old")
            oldest_state = max(oldest_state, state)
            oldest_strategy = max(oldest_strategy, strategy)
        found = {"oldest_state_steps": oldest_state, "oldest_strategy_steps": oldest_strategy}
        return {**found, **({"unknown_inputs": unknown} if unknown else {})}

    def _ages(self, step: int, w: np.ndarray) -> list[tuple[int, int]]:
        """How old state and strategy were, in steps, of each plan with this input for a step."""
        return [
            (k, k + self.strategy_ages.get(step - k, 0))
            for k in range(control.LONGEST)
            for plan in self.plans.get(step - k, [])
            if k < len(plan) and np.allclose(plan[k], w, rtol=0.0, atol=_ROUNDING)
        ]
