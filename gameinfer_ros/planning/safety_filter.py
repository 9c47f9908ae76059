"""The last look at what a robot is about to do."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from gameinfer_ros.games import ROBOT, Vehicles
from gameinfer_ros.games.registry import NonNegative, Positive

#: Distances that differ by no more than this, in m, do so by rounding only.
_ROUNDING = 1e-9

#: A plan is gone on with only if it leaves so much more room than braking, in m.
_CLEARLY_MORE = 0.1

#: What became of a plan.
PASSES, LIMITED, BRAKES, GOES_ON = "passes", "limited", "brakes", "goes on"


class SafetySettings(BaseModel):
    """Settings of the safety layer."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    clearance: NonNegative = Field(
        default=0.5, description="distance between centres that the robot keeps, in m"
    )
    look_ahead: Positive = Field(
        default=1.0, le=60.0, description="how far ahead the robot sees to it, in s"
    )


class SafePlan(NamedTuple):
    """What a vehicle may do.

    Attributes:
        states: its states (S + 1, n).
        inputs: its inputs (S, m), at least one. After the last, it brakes.
        action: `PASSES`, `LIMITED` if the first input was cut off at the limits, `BRAKES` if the
            first input is a braking one instead, or `GOES_ON` if it is not, because braking would
            be worse.
        reason: why it does not just pass.
    """

    states: np.ndarray
    inputs: np.ndarray
    action: str
    reason: str


class SafetyFilter:
    """Lets those plans pass after whose every input the vehicle could still brake in time.

    It knows how vehicles move and where everybody is, but nothing of games, costs or beliefs, so
    it does not share the mistakes of what it checks.

    Everybody else is expected to go on straight ahead, as fast as now. An input passes if the
    vehicle, when it does that and then brakes within its limits, keeps the clearance from the
    centres of all others until the look-ahead is over. A first input that does not pass becomes a
    braking one, with two exceptions. It passes if braking would leave no more room from the end of
    the step on: who stands too close may always move away. And it alone is gone on with if braking
    does not keep the clearance either, and the whole plan leaves 0.1 m more. A plan ends before the
    first other input that does not pass.

    Args:
        vehicles: the vehicles of all players, and their limits.
        settings: clearance and look-ahead.
        i: index of the player that is checked.
    """

    def __init__(self, vehicles: Vehicles, settings: SafetySettings, i: int = ROBOT) -> None:
        self._vehicles, self._settings, self._i = vehicles, settings, i
        # Rooms are compared from the end of the first step on, so there must be another one.
        self._steps = max(2, int(np.ceil(settings.look_ahead / vehicles.game.dt - 1e-9)))
        self._names = [name for j, name in enumerate(vehicles.names) if j != i]

    def check(self, s: np.ndarray, inputs: np.ndarray) -> SafePlan:
        """What becomes of a plan.

        Args:
            s: joint state (ns,) of the vehicles now.
            inputs: inputs (S, m) of the vehicle that it plans for the next steps.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            return self._check(s, inputs)

    def _check(self, s: np.ndarray, inputs: np.ndarray) -> SafePlan:
        vehicles, own = self._vehicles, s[self._vehicles.states(self._i)]
        finite = np.isfinite(inputs).all(axis=1)
        n = len(inputs) if finite.all() else int(np.argmin(finite))
        if n == 0:
            return self._braking(own, "the plan is not finite")
        w = vehicles.within_limits(self._i, inputs[:n])
        others = self._others(s, n + self._steps)
        states, rooms = [own], np.empty(0)
        for k in range(n):
            rooms = self._rooms(states[k], w[k : k + 1], others[k : k + self._steps + 1])
            if not rooms.min(initial=np.inf) >= self._settings.clearance:
                break
            states.append(vehicles.step_alone(self._i, states[k], w[k]))
        excess = self._excess(inputs[0], w[0])
        action, reason = LIMITED if excess else PASSES, excess
        if len(states) == 1:
            near = others[: self._steps + 1]
            braking = self._rooms(own, w[:0], near)
            least = braking[1:].min()
            keeps = braking.min() >= self._settings.clearance
            if keeps or not rooms[1:].min() >= least - _ROUNDING:
                enough = least >= self._settings.clearance
                whole = braking if enough else self._rooms(own, w, near)
                if not whole[1:].min() >= least + _CLEARLY_MORE:
                    return self._braking(own, self._closeness(rooms))
                leaves = f"that leaves {self._closeness(braking)}"
                reason = f"{leaves}; the plan leaves {whole.min():.2f} m{excess and ', ' + excess}"
                action = GOES_ON
            states.append(vehicles.step_alone(self._i, own, w[0]))
        return SafePlan(np.array(states), w[: len(states) - 1], action, reason)

    def _braking(self, own: np.ndarray, reason: str) -> SafePlan:
        # Nothing is known of a vehicle whose state is not finite, but that 0 is in its limits.
        w = np.nan_to_num(self._vehicles.braking_input(self._i, own))
        states = np.array([own, self._vehicles.step_alone(self._i, own, w)])
        return SafePlan(states, w[None], BRAKES, reason)

    def _others(self, s: np.ndarray, steps: int) -> np.ndarray:
        """Positions (steps + 1, N - 1, 2) of all others, who go straight ahead as fast as now."""
        vehicles = self._vehicles
        bodies = [j for j in range(len(vehicles)) if j != self._i]
        poses = vehicles.poses(s)[bodies]
        forward, left = vehicles.twists(s, np.zeros(vehicles.n_inputs))[bodies, :2].T
        c, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        velocities = np.stack([c * forward - sine * left, sine * forward + c * left], axis=-1)
        times = vehicles.game.dt * np.arange(steps + 1)
        return poses[:, :2] + times[:, None, None] * velocities

    def _rooms(self, own: np.ndarray, inputs: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Smallest distances (T, N - 1) to all others during each step.

        Args:
            own: state (n,) of the vehicle at the beginning of the first one.
            inputs: its inputs (S, m) in the first S steps; in the others, it brakes.
            others: positions (T + 1, N - 1, 2) of the others.
        """
        vehicles, i = self._vehicles, self._i
        states = [own]
        for k in range(len(others) - 1):
            brakes = k >= len(inputs)
            w = vehicles.braking_input(i, states[-1]) if brakes else inputs[k]
            states.append(vehicles.step_alone(i, states[-1], w))
            if brakes and np.array_equal(states[-1], states[-2]) and not w.any():
                break  # it stays at rest
        states += [states[-1]] * (len(others) - len(states))
        positions = np.array(states)[:, list(vehicles.dynamics[i].position)]
        # During a step, all are taken to move straight ahead and evenly.
        ways = others - positions[:, None]
        starts, moves = ways[:-1], np.diff(ways, axis=0)
        squares = (moves**2).sum(axis=-1)
        towards = -(starts * moves).sum(axis=-1)
        when = np.divide(towards, squares, out=np.zeros_like(squares), where=squares > 0)
        return np.linalg.norm(starts + np.clip(when, 0, 1)[..., None] * moves, axis=-1)

    def _closeness(self, rooms: np.ndarray) -> str:
        step, nearest = np.unravel_index(np.argmin(rooms), rooms.shape)
        return (
            f"{rooms[step, nearest]:.2f} m from {self._names[nearest]} within "
            f"{(step + 1) * self._vehicles.game.dt:.1f} s, and {self._settings.clearance:g} m are "
            "to be kept"
        )

    def _excess(self, wanted: np.ndarray, w: np.ndarray) -> str:
        names = self._vehicles.dynamics[self._i].input_names
        return ", ".join(
            f"{name} {wanted[j]:.2f} is cut off at {w[j]:g}"
            for j, name in enumerate(names)
            if wanted[j] != w[j]
        )
