"""The safety layer: the last check of the robot's inputs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from gameinfer_ros.games import ROBOT, Vehicles
from gameinfer_ros.games.registry import NonNegative, Positive

#: Largest difference of two distances that can be due to rounding, in m.
_ROUNDING = 1e-9

#: How much more room than braking a plan must leave to continue, in m.
_MARGIN = 0.1

#: Actions of the safety layer; see `SafePlan`.
PASSES, LIMITED, BRAKES, GOES_ON = "passes", "limited", "brakes", "goes on"


class SafetySettings(BaseModel):
    """Settings of the safety layer."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    clearance: NonNegative = Field(
        default=0.5,
        description="distance to keep between the centres of the robot and of others, in m",
    )
    look_ahead: Positive = Field(
        default=1.0, le=60.0, description="time over which the clearance is checked, in s"
    )


class SafePlan(NamedTuple):
    """A plan that the safety layer has checked.

    Attributes:
        states: states (S + 1, n) of the vehicle.
        inputs: inputs (S, m) of the vehicle, at least one. After the last, it brakes.
        action: `PASSES` if the first input is unchanged, `LIMITED` if it was clipped to the
            limits, `BRAKES` if it was replaced by a braking one, or `GOES_ON` if it violates the
            clearance but braking would be worse.
        reason: why the action is not `PASSES`; empty if it is.
    """

    states: np.ndarray
    inputs: np.ndarray
    action: str
    reason: str


class SafetyFilter:
    """A filter of plans, which passes inputs after which the vehicle can still brake in time.

    The filter knows the vehicles and their states, but not the game, its costs or the belief, so
    it does not share their errors.

    It predicts that others move straight ahead at constant speed. An input passes if the vehicle,
    when it applies the input and then brakes within its limits, keeps the clearance from the
    centres of all others during the look-ahead. A plan ends before the first input that does not
    pass. If that is the first input of the plan, the vehicle brakes. There are two exceptions if
    braking would violate the clearance too. Both compare distances from the end of the first step
    on:

    - The input passes if braking would leave no more room. A vehicle that is too close can
      therefore always move away.
    - The vehicle applies the input, but no later one (`GOES_ON`), if the whole plan would leave at
      least 0.1 m more room than braking.

    Args:
        vehicles: the vehicles of all players, with their limits.
        settings: clearance and look-ahead.
        i: index of the player to check.
    """

    def __init__(self, vehicles: Vehicles, settings: SafetySettings, i: int = ROBOT) -> None:
        self._vehicles, self._settings, self._i = vehicles, settings, i
        # Distances are compared from the end of the first step on, so two steps are needed.
        self._steps = max(2, int(np.ceil(settings.look_ahead / vehicles.game.dt - 1e-9)))
        self._names = [name for j, name in enumerate(vehicles.names) if j != i]

    @np.errstate(over="ignore", invalid="ignore")
    def check(self, s: np.ndarray, inputs: np.ndarray) -> SafePlan:
        """Check a plan.

        Args:
            s: current joint state (ns,) of the vehicles.
            inputs: planned inputs (S, m) of the vehicle for the next steps.

        Returns:
            The part of the plan that may be executed, or a braking input.
        """
        vehicles, own = self._vehicles, s[self._vehicles.states(self._i)]
        finite = np.isfinite(inputs).all(axis=1)
        n = len(inputs) if finite.all() else int(np.argmin(finite))
        if n == 0:
            return self._braking(own, "the plan is not finite")
        w = vehicles.within_limits(self._i, inputs[:n])
        others = self._others(s, n + self._steps)
        states, distances = [own], np.empty(0)
        for k in range(n):
            distances = self._distances(states[k], w[k : k + 1], others[k : k + self._steps + 1])
            if not distances.min(initial=np.inf) >= self._settings.clearance:
                break
            states.append(vehicles.step_alone(self._i, states[k], w[k]))
        reason = self._clipping(inputs[0], w[0])
        action = LIMITED if reason else PASSES
        if len(states) == 1:
            unsafe, why = self._on_violation(own, w, others[: self._steps + 1], distances)
            if unsafe == BRAKES:
                return self._braking(own, why)
            if unsafe == GOES_ON:
                action, reason = GOES_ON, f"{why}{reason and ', ' + reason}"
            states.append(vehicles.step_alone(self._i, own, w[0]))
        return SafePlan(np.array(states), w[: len(states) - 1], action, reason)

    def _on_violation(
        self, own: np.ndarray, w: np.ndarray, others: np.ndarray, distances: np.ndarray
    ) -> tuple[str, str]:
        """Return the action for a plan whose first input violates the clearance, and the reason.

        `w` are the inputs (S, m) of the plan, within the limits. `distances` (T, N - 1) are those
        of `_distances` if the vehicle applies the first input and then brakes.
        """
        clearance = self._settings.clearance
        braking = self._distances(own, w[:0], others)
        # The first step does not count: it starts at the same distance, whatever the input.
        after_braking = braking[1:].min()
        braking_is_safe = braking.min() >= clearance
        if not braking_is_safe and distances[1:].min() >= after_braking - _ROUNDING:
            return PASSES, ""
        if not after_braking >= clearance:
            plan = self._distances(own, w, others)
            if plan[1:].min() >= after_braking + _MARGIN:
                return GOES_ON, (
                    f"braking leaves {self._smallest(braking)}; the plan leaves {plan.min():.2f} m"
                )
        return BRAKES, f"the input leaves {self._smallest(distances)}"

    def _braking(self, own: np.ndarray, reason: str) -> SafePlan:
        # If the state is not finite, the input is 0, which is always within the limits.
        w = np.nan_to_num(self._vehicles.braking_input(self._i, own))
        states = np.array([own, self._vehicles.step_alone(self._i, own, w)])
        return SafePlan(states, w[None], BRAKES, reason)

    def _others(self, s: np.ndarray, steps: int) -> np.ndarray:
        """Predict the positions (steps + 1, N - 1, 2) of all others at constant velocity."""
        vehicles = self._vehicles
        bodies = [j for j in range(len(vehicles)) if j != self._i]
        poses = vehicles.poses(s)[bodies]
        forward, left = vehicles.twists(s, np.zeros(vehicles.n_inputs))[bodies, :2].T
        c, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        velocities = np.stack([c * forward - sine * left, sine * forward + c * left], axis=-1)
        times = vehicles.game.dt * np.arange(steps + 1)
        return poses[:, :2] + times[:, None, None] * velocities

    def _distances(self, own: np.ndarray, inputs: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Return the smallest distances (T, N - 1) to all others during each step.

        Args:
            own: state (n,) of the vehicle at the start of the first step.
            inputs: inputs (S, m) of the vehicle in the first S steps; then it brakes.
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
        # Positions are interpolated linearly within a step.
        relative = others - positions[:, None]
        starts, moves = relative[:-1], np.diff(relative, axis=0)
        squares = (moves**2).sum(axis=-1)
        towards = -(starts * moves).sum(axis=-1)
        when = np.divide(towards, squares, out=np.zeros_like(squares), where=squares > 0)
        return np.linalg.norm(starts + np.clip(when, 0, 1)[..., None] * moves, axis=-1)

    def _smallest(self, distances: np.ndarray) -> str:
        """Describe the smallest of the distances (T, N - 1)."""
        step, nearest = np.unravel_index(np.argmin(distances), distances.shape)
        return (
            f"{distances[step, nearest]:.2f} m to {self._names[nearest]} within "
            f"{(step + 1) * self._vehicles.game.dt:.1f} s, and the clearance is "
            f"{self._settings.clearance:g} m"
        )

    def _clipping(self, planned: np.ndarray, w: np.ndarray) -> str:
        """Describe the inputs (m,) that differ from the planned ones; empty if there are none."""
        names = self._vehicles.dynamics[self._i].input_names
        return ", ".join(
            f"{name} {planned[j]:.2f} is clipped to {w[j]:g}"
            for j, name in enumerate(names)
            if planned[j] != w[j]
        )
