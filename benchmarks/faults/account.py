"""The observed behaviour of a robot, checked against its guarantees."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gameinfer_ros.games import ROBOT, Vehicles
from msg_adapters import control

#: Most steps that the state (`brake_after`) and the strategy (`max_strategy_age`) of an input are
#: old.
STATE_AGE, STRATEGY_AGE = 5, 10

#: Most seconds until a base is told to stand after the loss of states.
BASE_STANDS_AFTER = 1.5

#: A robot below the first speed, in m/s, stands; above the second, it moves.
STANDS, MOVES = 0.01, 0.05

#: Inputs that differ by no more than this do so by rounding only.
_ROUNDING = 1e-6


class BrokenPromiseError(AssertionError):
    """A guarantee is broken."""


def promise(holds: object, what: str) -> None:
    """Raise an exception if a guarantee does not hold."""
    if not holds:
        raise BrokenPromiseError(what)


class Seen(NamedTuple):
    """The state of the robot at a step."""

    time: float  # of arrival, by `time.monotonic`, in s
    step: int
    speed: float  # in m/s
    omega: float  # turning rate during the step before, in rad/s
    run: int  # number of the run, from 0 on


class Plan(NamedTuple):
    """A message of the planner."""

    step: int  # of its first input
    inputs: np.ndarray  # (S, 2)
    run: int


class Report(NamedTuple):
    """A report of the planner about a plan."""

    step: int  # of the plan
    strategy_age: int  # of the strategy that the plan followed, in steps
    run: int


class Done(NamedTuple):
    """The input of the robot in a step, and what it follows from."""

    before: Seen
    after: Seen  # a step later
    input: np.ndarray  # (2,)
    braked: bool  # which needs no plan
    state_age: int | None  # of the state that the input comes from, in steps; None if unknown
    strategy_age: int | None  # likewise


@dataclass
class Account:
    """The received messages of a robot that is a unicycle, in order of arrival."""

    vehicles: Vehicles
    seen: list[Seen] = field(default_factory=list)
    plans: list[Plan] = field(default_factory=list)
    reports: list[Report] = field(default_factory=list)
    unheard: set[int] = field(default_factory=set)  # steps of plans that may have been missed
    lost_reports: int = 0
    #: Arrival of each velocity that was sent to the base, in s, and its speed in m/s.
    commands: list[tuple[float, float]] = field(default_factory=list)

    def speeds(self, begin: float, end: float) -> np.ndarray:
        """Return the speeds (S,), in m/s, of all steps received between two times, in s."""
        return np.abs([s.speed for s in list(self.seen) if begin < s.time <= end])

    def stood_after(self, begin: float, end: float, bound: int) -> dict[str, float]:
        """Return the number of steps until standstill between the loss and the return of data.

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
        """Return the time of the last moving command between loss and return of data, in s.

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

    def resumed(self, since: float) -> float | None:
        """Return when the robot first moved by data newer than a time; both in s.

        It does so by a plan that follows a strategy of a state that was heard of later. None if it
        has not done so yet.
        """
        done = list(self._done())
        known = [(d.before.run, d.before.step) for d in done if d.before.time <= since]
        for before, after, _, braked, state, strategy in done:
            if braked or state is None or strategy is None or abs(after.speed) <= MOVES:
                continue
            if (before.run, before.step - strategy) > max(known, default=(0, -1)):
                return after.time
        return None

    def follows(self, step: int) -> bool:
        """Return whether a plan has followed a strategy of a later step than this one."""
        return any(report.step - report.strategy_age > step for report in list(self.reports))

    def check(self, least: int = 0) -> dict[str, float]:
        """Check the origin and the limits of every input; return the worst figures.

        Args:
            least: smallest number of inputs of plans and of commands to accept.
        """
        vehicles, own = self.vehicles, self.vehicles.inputs(ROBOT)
        low, high = vehicles.low[own] - _ROUNDING, vehicles.high[own] + _ROUNDING
        states, strategies, unknown, unknown_ages = [0], [0], 0, 0
        for before, _, w, braked, state, strategy in self._done():
            where = f"the input {w.tolist()} of step {before.step}"
            promise((low <= w).all() and (w <= high).all(), f"{where} is beyond its limits")
            if braked:
                continue
            if state is None:
                unknown += 1
                lacking = not self.unheard.isdisjoint(before.step - np.arange(STATE_AGE + 1))
                promise(lacking, f"{where} comes from no plan, and none was missed")
                continue
            promise(state <= STATE_AGE, f"{where} comes from a state of {state} steps before")
            states.append(state)
            if strategy is None:
                unknown_ages += 1
                # A planner may also have ended before its last report.
                enough = unknown_ages <= (self.lost_reports + 1) * (STATE_AGE + 1)
                promise(enough, f"{where} comes from a strategy of unknown age")
                continue
            promise(strategy <= STRATEGY_AGE, f"{where} comes from a strategy {strategy} steps old")
            strategies.append(strategy)
        known = len(strategies) - 1
        promise(known >= least, f"too little was heard: {known} inputs of plans of known age")
        promise(len(self.commands) >= least, f"too few commands were heard: {len(self.commands)}")
        unknowns = {"unknown_inputs": unknown, "unknown_ages": unknown_ages}
        return {
            "oldest_state_steps": max(states),
            "oldest_strategy_steps": max(strategies),
            "judged_inputs": len(states) - 1,
            **{name: count for name, count in unknowns.items() if count},
        }

    def _done(self) -> Iterator[Done]:
        """Return the inputs of all steps whose first and last states were received."""
        vehicles = self.vehicles
        plans: defaultdict[tuple[int, int], list[np.ndarray]] = defaultdict(list)
        for plan in list(self.plans):
            plans[plan.run, plan.step].append(plan.inputs)
        ages = {(r.run, r.step): r.strategy_age for r in list(self.reports)}
        for before, after in pairwise(list(self.seen)):
            run = before.run
            if (after.run, after.step) != (run, before.step + 1):
                continue  # time has jumped, or another run has begun
            w = np.array([after.omega, (after.speed - before.speed) / vehicles.game.dt])
            brake = vehicles.braking_input(ROBOT, np.array([0.0, 0.0, 0.0, before.speed]))
            if braked := _same(brake, w):
                yield Done(before, after, w, braked, None, None)
                continue
            # The newest plan with this input counts.
            of_plans = (
                k
                for k in range(control.LONGEST)
                for inputs in plans.get((run, before.step - k), [])
                if k < len(inputs) and _same(inputs[k], w)
            )
            state = next(of_plans, None)
            age = None if state is None else ages.get((run, before.step - state))
            strategy = None if state is None or age is None else state + age
            yield Done(before, after, w, braked, state, strategy)


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.abs(one - other).max() <= _ROUNDING)
