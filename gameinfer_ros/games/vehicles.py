"""The vehicles of the players of a game."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gameinfer_ros.games import heading
from gameinfer_ros.games.dynamics.dynamics import Vehicle
from gameinfer_ros.games.game import Game
from gameinfer_ros.games.players import Players

if TYPE_CHECKING:
    from gameinfer_ros.games.motion import Motion


class Vehicles(Players):
    """The vehicles of all players, and the conversion of their states and inputs to the game.

    The joint state s (..., ns) and input w (..., nw) of the vehicles are ordered like x (..., nx)
    and u (..., nu) of the game. They are the same as these if the dynamics of all players are
    vehicles.

    Args:
        game: the game.
        limits: lowest and highest value of inputs, by the names of the player and the input.
            Inputs that are not included are not limited.

    Attributes:
        game: the game.
        low: lowest joint input (nw,); -inf without a limit.
        high: highest joint input (nw,); inf without a limit.

    Raises:
        ValueError: `limits` names a player that does not exist.
    """

    dynamics: tuple[Vehicle, ...]

    def __init__(
        self, game: Game, limits: Mapping[str, Mapping[str, tuple[float, float]]] | None = None
    ) -> None:
        models = zip(game.players.names, game.players.dynamics, strict=True)
        vehicles = {name: model.vehicle for name, model in models}
        radii = dict(zip(game.players.names, game.players.radii.tolist(), strict=True))
        super().__init__(vehicles, radii)
        self.game = game
        self._world = Game(vehicles, [], game.dt, 1)
        self.low, self.high = np.full(self.n_inputs, -np.inf), np.full(self.n_inputs, np.inf)
        for name, bounds in (limits or {}).items():
            i = self.index(name)
            for j, input_name in enumerate(self.dynamics[i].input_names, self.inputs(i).start):
                self.low[j], self.high[j] = bounds.get(input_name, (-np.inf, np.inf))

    @cached_property
    def motions(self) -> tuple[Motion, ...]:
        """The motion of each vehicle by itself, with its limits."""
        from gameinfer_ros.games.motion import Motion

        return tuple(
            Motion(vehicle, self.game.dt, self.low[self.inputs(i)], self.high[self.inputs(i)])
            for i, vehicle in enumerate(self.dynamics)
        )

    def step(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the joint state (ns,) one step after `s` (ns,) with the joint input `w` (nw,)."""
        return self._world.step(s, w)

    # --- A single vehicle -----------------------------------------------------------------------

    def step_alone(self, i: int, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the state (n,) of player i's vehicle one step after `s` (n,) with `w` (m,)."""
        return self.motions[i].states(s, w[None], 1)[1]

    def within_limits(self, i: int, w: np.ndarray) -> np.ndarray:
        """Clip the inputs `w` (..., m) of player i's vehicle to its limits."""
        own = self.inputs(i)
        return np.clip(w, self.low[own], self.high[own])

    def braking_input(self, i: int, s: np.ndarray) -> np.ndarray:
        """Return the input (m,) with which player i's vehicle brakes from its state `s` (n,).

        The vehicle comes to rest in one step, or as soon as its limits allow.
        """
        return self.within_limits(i, self.dynamics[i].braking_input(s, self.game.dt))

    # --- Conversion to and from the game --------------------------------------------------------

    def game_state(self, s: np.ndarray) -> np.ndarray:
        """Convert joint states (..., ns) of the vehicles to those of the game (..., nx)."""
        models = self.game.players.dynamics
        return _joined(m.game_state(s[..., self.states(i)]) for i, m in enumerate(models))

    def game_input(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Convert joint inputs (..., nw), in joint states (..., ns), to the game (..., nu)."""
        return _joined(
            m.game_input(s[..., self.states(i)], w[..., self.inputs(i)], self.game.dt)
            for i, m in enumerate(self.game.players.dynamics)
        )

    def vehicle_input(self, s: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Convert joint inputs of the game (..., nu), in joint states (..., ns), to (..., nw)."""
        players = self.game.players
        return _joined(
            m.vehicle_input(s[..., self.states(i)], u[..., players.inputs(i)], self.game.dt)
            for i, m in enumerate(players.dynamics)
        )

    def along(self, x: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Convert a trajectory of the game to one of the vehicles.

        Args:
            x: joint states (S, nx) of the game.
            near: joint state (ns,) of the vehicles just before. It determines what the game leaves
                open, such as the heading at a standstill.

        Returns:
            Joint states (S, ns) of the vehicles.
        """
        players = self.game.players
        s = np.empty((len(x), self.n_states))
        for k in range(len(x)):
            for i, model in enumerate(players.dynamics):
                own = self.states(i)
                s[k, own] = model.vehicle_state(x[k, players.states(i)], near[own])
            near = s[k]
        return s

    def follow(self, i: int, s: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Simulate the vehicle of player i while it follows a plan.

        Args:
            i: index of the player.
            s: current joint state (ns,) of the vehicles.
            u: inputs (S, m) of the player in the game.

        Returns:
            States (S + 1, n) and inputs (S, m) of the vehicle.
        """
        model, own = self.game.players.dynamics[i], s[self.states(i)]
        if model is self.dynamics[i]:  # the inputs of the game are those of the vehicle
            return self.motions[i].states(own, u, len(u)), u
        states, w = [own], []
        for k in range(len(u)):
            w.append(model.vehicle_input(states[k], u[k], self.game.dt))
            states.append(self.step_alone(i, states[k], w[k]))
        return np.array(states), np.array(w)

    # --- Poses and rates, as in messages --------------------------------------------------------

    def joints_of(self, i: int) -> tuple[str, ...]:
        """Return the names of the parts of player i's vehicle: its body, then its joints."""
        name = self.names[i]
        return (name, *(f"{name}/{joint}" for joint in self.dynamics[i].joints))

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the parts of all vehicles: N bodies, named like the players, then J joints."""
        every = [self.joints_of(i) for i in range(len(self))]
        return (*self.names, *(joint for names in every for joint in names[1:]))

    def poses(self, s: np.ndarray) -> np.ndarray:
        """Return the poses (..., N + J, 3), x and y in m, yaw in rad, of joint states (..., ns)."""
        return _bodies_first([d.poses(s[..., self.states(i)]) for i, d in enumerate(self.dynamics)])

    def twists(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the rates (..., N + J, 3) in joint states (..., ns) after joint inputs (..., nw).

        They are along the axes of each part, in m/s and rad/s.
        """
        return _bodies_first(
            [
                d.twists(s[..., self.states(i)], w[..., self.inputs(i)])
                for i, d in enumerate(self.dynamics)
            ]
        )

    def accelerations(self, w: np.ndarray) -> np.ndarray:
        """Return the accelerations (..., N + J, 3) that joint inputs (..., nw) command."""
        return _bodies_first(
            [d.accelerations(w[..., self.inputs(i)]) for i, d in enumerate(self.dynamics)]
        )

    def state(self, poses: np.ndarray, twists: np.ndarray) -> np.ndarray:
        """Return the joint state (ns,) with these poses and rates (N + J, 3)."""
        rows = self._rows_of_parts()
        return _joined(
            d.state(poses[r], twists[r]) for d, r in zip(self.dynamics, rows, strict=True)
        )

    def input(self, twists: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
        """Return the joint input (nw,) that commands these rates and accelerations (N + J, 3)."""
        rows = self._rows_of_parts()
        return _joined(
            d.input(twists[r], accelerations[r]) for d, r in zip(self.dynamics, rows, strict=True)
        )

    def seen(self, s: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Return a joint state as it arrives in a message.

        Messages contain headings as quaternions, which lose the last bits and whole turns.

        Args:
            s: joint state (ns,).
            near: joint state (ns,) next to which angles are unwrapped.

        Returns:
            The joint state (ns,) that a receiver gets.
        """
        poses = self.poses(s).copy()
        for pose in poses:
            pose[2] = heading.yaw(*heading.quaternion(pose[2]))
        return self.unwrap(self.state(poses, self.twists(s, np.zeros(self.n_inputs))), near)

    def observed(self, i: int, pose: np.ndarray, twist: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Return the state (n,) of player i's vehicle from a measurement of its body.

        Args:
            i: index of the player.
            pose: pose (3,) of the body in the map frame.
            twist: rates (3,) of the body along its own axes.
            near: joint state (ns,) just before. It determines what the body does not show, and next
                to which values angles are unwrapped.
        """
        vehicle, own = self.dynamics[i], near[self.states(i)]
        return vehicle.unwrap(vehicle.observed(pose, twist, own), own)

    def input_between(self, i: int, s: np.ndarray, s_next: np.ndarray) -> np.ndarray:
        """Estimate the input (m,) of player i from one step of its vehicle, by least squares.

        Args:
            i: index of the player.
            s: joint state (ns,) before the step.
            s_next: joint state (ns,) after the step.
        """
        own, own_next, h = s[self.states(i)], s_next[self.states(i)], 1e-4
        m = self.dynamics[i].n_inputs
        starts = np.repeat(own[:, None], 1 + m, axis=1)
        offsets = h * np.eye(m, 1 + m, k=1)  # the first particle has the input itself
        w = np.zeros(m)
        for _ in range(2):  # Gauss-Newton; two iterations suffice, as inputs act almost linearly
            after = self.motions[i].states(starts, (w[:, None] + offsets)[None], 1)[1]
            B = (after[:, 1:] - after[:, :1]) / h
            moved = self.dynamics[i].unwrap(own_next, after[:, 0]) - after[:, 0]
            w = w + np.linalg.lstsq(B, moved, rcond=None)[0]
        return w

    def _rows_of_parts(self) -> list[list[int]]:
        """Return the rows of each player's body and joints among the parts of all vehicles."""
        every = self.joint_names
        return [[every.index(name) for name in self.joints_of(i)] for i in range(len(self))]

    def unwrap(self, s: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Shift each angle of the joint state `s` (ns,) by whole turns next to that of `near`."""
        own = [self.states(i) for i in range(len(self))]
        return _joined(d.unwrap(s[r], near[r]) for d, r in zip(self.dynamics, own, strict=True))


def _joined(parts: Iterable[np.ndarray]) -> np.ndarray:
    return np.concatenate(list(parts), axis=-1)


def _bodies_first(parts: list[np.ndarray]) -> np.ndarray:
    """Order the parts (..., L, 3) of each player as all bodies, then all joints (..., N + J, 3)."""
    return np.concatenate([p[..., :1, :] for p in parts] + [p[..., 1:, :] for p in parts], axis=-2)
