"""The safety layer: the last check of the robot's inputs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from gameinfer_ros.games import ROBOT, Vehicles
from gameinfer_ros.games.moving_points import MovingPoints
from gameinfer_ros.games.registry import NonNegative, Positive
from gameinfer_ros.lanes.array import WIDE

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
        description="distance to keep between the robot and others, in m, from edge to edge if "
        "players have a radius",
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
    when it applies the input and then brakes within its limits, keeps the clearance from all others
    during the look-ahead. Distances are measured from edge to edge. A plan ends before the first
    input that does not pass. If that is the first input of the plan, the vehicle brakes. There are
    two exceptions if braking would violate the clearance too. Both compare distances from the end
    of the first step on:

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
        self._radii = vehicles.radii[i] + np.delete(vehicles.radii, i)

    def warm_up(self) -> None:
        """Load the compiled code, and compile what the disk cache does not contain."""
        # An unknown state violates any clearance, so that the plan is compared with braking too.
        unknown = np.full(self._vehicles.n_states, np.nan)
        self.check(unknown, np.zeros((2, self._vehicles.dynamics[self._i].n_inputs)))

    @np.errstate(over="ignore", invalid="ignore")
    def check(
        self, s: np.ndarray, inputs: np.ndarray, states: np.ndarray | None = None
    ) -> SafePlan:
        """Check a plan.

        Args:
            s: current joint state (ns,) of the vehicles.
            inputs: planned inputs (S, m) of the vehicle for the next steps.
            states: states (S + 1, n) of the vehicle with these inputs, from its state in `s` on, if
                they are known.

        Returns:
            The part of the plan that may be executed, or a braking input.
        """
        vehicles, own = self._vehicles, s[self._vehicles.states(self._i)]
        finite = np.isfinite(inputs).all(axis=1)
        n = len(inputs) if finite.all() else int(np.argmin(finite))
        if n == 0:
            return self._braking(own, "the plan is not finite")
        w = vehicles.within_limits(self._i, inputs[:n])
        if states is None or not np.array_equal(w, inputs[:n]):
            states = vehicles.motions[self._i].states(own, w, n)
        others = self._others(s)
        safe = self._safe(states[:n], w, others)
        reason = self._clipping(inputs[0], w[0])
        action = LIMITED if reason else PASSES
        if safe == 0:
            unsafe, why = self._on_violation(own, w, others)
            if unsafe == BRAKES:
                return self._braking(own, why)
            if unsafe == GOES_ON:
                action, reason = GOES_ON, f"{why}{reason and ', ' + reason}"
            safe = 1
        return SafePlan(states[: safe + 1], w[:safe], action, reason)

    def _safe(self, states: np.ndarray, w: np.ndarray, others: MovingPoints) -> int:
        """Return the number of inputs after each of which the vehicle can brake in time.

        Args:
            states: states (S, n) of the vehicle before the inputs.
            w: inputs (S, m) of the vehicle.
            others: the other vehicles.
        """
        for k in range(0, len(w), WIDE):  # in parts, which bounds the memory
            part = slice(k, k + WIDE)
            distances = self._distances(states[part].T, w[part].T[None], others, k)
            smallest = distances.min(axis=(0, 1), initial=np.inf)
            violated = ~(smallest >= self._settings.clearance)
            if violated.any():
                return k + int(np.argmax(violated))
        return len(w)

    def _on_violation(
        self, own: np.ndarray, w: np.ndarray, others: MovingPoints
    ) -> tuple[str, str]:
        """Return the action for a plan whose first input violates the clearance, and the reason.

        Args:
            own: current state (n,) of the vehicle.
            w: inputs (S, m) of the plan, within the limits.
            others: the other vehicles.
        """
        clearance = self._settings.clearance
        braking, first, plan = (
            self._distances(own[:, None], w[:applied, :, None], others)[..., 0]
            for applied in (0, 1, len(w))
        )
        # The first step does not count: it starts at the same distance, whatever the input.
        after_braking = braking[1:].min()
        braking_is_safe = braking.min() >= clearance
        if not braking_is_safe and first[1:].min() >= after_braking - _ROUNDING:
            return PASSES, ""
        if not after_braking >= clearance and plan[1:].min() >= after_braking + _MARGIN:
            return GOES_ON, (
                f"braking leaves {self._smallest(braking)}; the plan leaves {plan.min():.2f} m"
            )
        return BRAKES, f"the input leaves {self._smallest(first)}"

    def _braking(self, own: np.ndarray, reason: str) -> SafePlan:
        # If the state is not finite, the input is 0, which is always within the limits.
        w = np.nan_to_num(self._vehicles.braking_input(self._i, own))[None]
        return SafePlan(self._vehicles.motions[self._i].states(own, w, 1), w, BRAKES, reason)

    def _others(self, s: np.ndarray) -> MovingPoints:
        """Predict that all others move straight ahead at constant speed."""
        vehicles = self._vehicles
        bodies = [j for j in range(len(vehicles)) if j != self._i]
        poses = vehicles.poses(s)[bodies]
        forward, left = vehicles.twists(s, np.zeros(vehicles.n_inputs))[bodies, :2].T
        c, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        velocities = np.stack([c * forward - sine * left, sine * forward + c * left], axis=-1)
        return MovingPoints(poses[:, :2].copy(), velocities)

    def _distances(
        self, s: np.ndarray, w: np.ndarray, others: MovingPoints, first: int = 0
    ) -> np.ndarray:
        """Return the smallest distances (T, N - 1, K) to all others during each step.

        Args:
            s: states (n, K) of the vehicle at steps `first`, `first` + 1, and so on.
            w: inputs (S, m, K) of the vehicle in the first S steps; then it brakes.
            others: the other vehicles.
            first: step of the first of the states.
        """
        start = first + np.arange(s.shape[1], dtype=float)
        motion = self._vehicles.motions[self._i]
        between = motion.distances(s, w, self._steps, others, start)
        return between - self._radii[:, None]

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
