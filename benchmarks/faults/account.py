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
        lost_ages: number of reports of the planner, which tell those ages, that were not heard.
        commands: when each velocity was sent to the base, in s, and its speed in m/s.
    """

    vehicles: Vehicles
    seen: list[Seen] = field(default_factory=list)
    plans: defaultdict[int, list[np.ndarray]] = field(default_factory=lambda: defaultdict(list))
    strategy_ages: dict[int, int] = field(default_factory=dict)
    lost: int = 0
    lost_ages: int = 0
    commands: list[tuple[float, float]] = field(default_factory=list)

    def speeds(self, begin: float, end: float) -> np.ndarray:
        """Speeds (S,), in m/s, of all steps that were heard of between two times, in s."""
        return np.abs([s.speed for s in list(self.seen) if begin < s.time <= end])

    def stood_after(self, begin: float, end: float, bound: int) -> dict[str, float]:
        """Steps after which the robot stood, from a loss on until what was lost came back.

        Nothing if less time passed than it may take.
        """
        speeds = self.speeds(begin, end)
        if len(speeds) <= bound:
            enough = (bound + 1) * self.vehicles.game.dt
            promise(end - begin < 2 * enough, f"only {len(speeds)} of its steps were heard of")
            return {}
        moving = np.flatnonzero(speeds > STANDS)
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
        before = [speed for t, speed in commands if t <= begin]
        promise(before and before[-1] > STANDS, "a base was not told to move before")
        moving = [t - begin for t, speed in commands if begin < t < end and speed > STANDS]
        stood = max(moving, default=0.0)
        promise(stood <= BASE_STANDS_AFTER, f"a base is told to move for {stood:.1f} s")
        told = [speed for t, speed in commands if begin < t <= begin + BASE_STANDS_AFTER]
        promise(told and told[-1] <= STANDS, f"a base is not told to stand: {told[-1:]} m/s")
        return {"base_stood_s": stood}

    def check(self, least: int = 0) -> dict[str, float]:
        """Check what every input came from, and that the robot can do it; tells the worst.

        Args:
            least: so many inputs of plans, and so many commands, must have been heard.
        """
        vehicles, own = self.vehicles, self.vehicles.inputs(ROBOT)
        dt = vehicles.game.dt
        oldest_state = oldest_strategy = judged = unknown = unknown_ages = 0
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
            state = self._state_age(before.step, w)
            if state is None:
                unknown += 1
                # Each message that was not heard may have had that many inputs that were used.
                enough = unknown <= self.lost * (STATE_AGE + 1)
                promise(enough, f"{where} comes from no plan, and {self.lost} were not heard")
                continue
            judged += 1
            promise(state <= STATE_AGE, f"{where} comes from a state of {state} steps before")
            oldest_state = max(oldest_state, state)
            age = self.strategy_ages.get(before.step - state)
            if age is None:
                unknown_ages += 1
                # A planner may also have ended before its last report.
                enough = unknown_ages <= (self.lost_ages + 1) * (STATE_AGE + 1)
                promise(enough, f"{where} comes from a strategy of unknown age")
                continue
            strategy = state + age
            promise(strategy <= STRATEGY_AGE, f"{where} comes from a strategy {strategy} steps old")
            oldest_strategy = max(oldest_strategy, strategy)
        known = judged - unknown_ages
        promise(known >= least, f"too little was heard: {known} inputs of plans of known age")
        promise(len(self.commands) >= least, f"too few commands were heard: {len(self.commands)}")
        found = {
            "oldest_state_steps": oldest_state,
            "oldest_strategy_steps": oldest_strategy,
            "judged_inputs": judged,
        }
        unknowns = {"unknown_inputs": unknown, "unknown_ages": unknown_ages}
        return {**found, **{name: count for name, count in unknowns.items() if count}}

    def _state_age(self, step: int, w: np.ndarray) -> int | None:
        """How old the state was, in steps, of the newest plan with this input for a step."""
        found = (
            k
            for k in range(control.LONGEST)
            for plan in self.plans.get(step - k, [])
            if k < len(plan) and np.allclose(plan[k], w, rtol=0.0, atol=_ROUNDING)
        )
        return next(found, None)
