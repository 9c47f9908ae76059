"""The vehicles that the players of a game really are."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gameinfer_ros.games import heading
from gameinfer_ros.games.dynamics.dynamics import Vehicle
from gameinfer_ros.games.game import Game
from gameinfer_ros.games.players import Players


class Vehicles(Players):
    """Where the players of a game really are, how they move, and what the game sees of it.

    Their joint state s (..., ns) and joint input w (..., nw) are made up like the x (..., nx) and
    u (..., nu) of the game. Where all players are modelled as the vehicles that they are, both
    are the same.

    Args:
        game: the game that is played with these vehicles.
        limits: lowest and highest value of inputs of vehicles, by the name of the player and of
            the input; those that are not there have none.

    Attributes:
        low: lowest joint input (nw,); -inf where there is no limit.
        high: highest joint input (nw,); inf where there is none.
    """

    dynamics: tuple[Vehicle, ...]

    def __init__(
        self, game: Game, limits: Mapping[str, Mapping[str, tuple[float, float]]] | None = None
    ) -> None:
        models = zip(game.players.names, game.players.dynamics, strict=True)
        vehicles = {name: model.vehicle for name, model in models}
        super().__init__(vehicles)
        self.game = game
        self._world = Game(vehicles, [], game.dt, 1)
        self._alone = [Game({name: v}, [], game.dt, 1) for name, v in vehicles.items()]
        self.low, self.high = np.full(self.n_inputs, -np.inf), np.full(self.n_inputs, np.inf)
        for name, bounds in (limits or {}).items():
            i = self.index(name)
            for j, input_name in enumerate(self.dynamics[i].input_names, self.inputs(i).start):
                self.low[j], self.high[j] = bounds.get(input_name, (-np.inf, np.inf))

    def step(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Joint state (ns,) one time step after `s` (ns,) under the joint input `w` (nw,)."""
        return self._world.step(s, w)

    # --- One of them ----------------------------------------------------------------------------

    def step_alone(self, i: int, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        """State (n,) of player i's vehicle one step after its state `s` (n,) under `w` (m,)."""
        return self._alone[i].step(s, w)

    def within_limits(self, i: int, w: np.ndarray) -> np.ndarray:
        """The inputs (..., m) of player i's vehicle next to `w` (..., m) that it can do."""
        own = self.inputs(i)
        return np.clip(w, self.low[own], self.high[own])

    def braking_input(self, i: int, s: np.ndarray) -> np.ndarray:
        """Input (m,) by which player i's vehicle, in its state `s` (n,), brakes for one step.

        It comes to rest in that step, or as far as its limits allow.
        """
        return self.within_limits(i, self.dynamics[i].braking_input(s, self.game.dt))

    # --- What the game sees ---------------------------------------------------------------------

    def game_state(self, s: np.ndarray) -> np.ndarray:
        """Joint state (..., nx) in the game of vehicles in the joint states `s` (..., ns)."""
        return np.concatenate(
            [
                model.game_state(s[..., self.states(i)])
                for i, model in enumerate(self.game.players.dynamics)
            ],
            axis=-1,
        )

    def game_input(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Joint input (..., nu) that does in the game what `w` (..., nw) does in `s` (..., ns)."""
        return np.concatenate(
            [
                model.game_input(s[..., self.states(i)], w[..., self.inputs(i)], self.game.dt)
                for i, model in enumerate(self.game.players.dynamics)
            ],
            axis=-1,
        )

    def vehicle_input(self, s: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Joint input (..., nw) that does in `s` (..., ns) what `u` (..., nu) does in the game."""
        players = self.game.players
        return np.concatenate(
            [
                model.vehicle_input(s[..., self.states(i)], u[..., players.inputs(i)], self.game.dt)
                for i, model in enumerate(players.dynamics)
            ],
            axis=-1,
        )

    def along(self, x: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Joint states (S, ns) of the vehicles along a trajectory of the game.

        Args:
            x: joint states (S, nx) in the game.
            near: joint state (ns,) of the vehicles a moment before; it settles what the game does
                not say, such as the heading at a standstill.
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
        """What the vehicle of player i does if it follows a plan of the game from now on.

        Args:
            i: index of the player.
            s: joint state (ns,) of the vehicles now.
            u: inputs (S, m) of the player in the game, one for each step.

        Returns:
            States (S + 1, n) and inputs (S, m) of its vehicle.
        """
        model, own, inputs = self.game.players.dynamics[i], self.states(i), self.inputs(i)
        states, w = [s[own]], np.zeros((len(u), self.n_inputs))
        for k in range(len(u)):
            w[k, inputs] = model.vehicle_input(s[own], u[k], self.game.dt)
            s = self.step(s, w[k])
            states.append(s[own])
        return np.array(states), w[:, inputs]

    # --- What others see ------------------------------------------------------------------------

    def joints_of(self, i: int) -> tuple[str, ...]:
        """Names of the parts of player i's vehicle: the player's, then those of its joints."""
        name = self.names[i]
        return (name, *(f"{name}/{joint}" for joint in self.dynamics[i].joints))

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the parts of all vehicles: N bodies, named as the players, then J joints."""
        every = [self.joints_of(i) for i in range(len(self))]
        return (*self.names, *(joint for names in every for joint in names[1:]))

    def poses(self, s: np.ndarray) -> np.ndarray:
        """Poses (..., N + J, 3) in the joint states `s` (..., ns): x, y in m, yaw in rad."""
        return _bodies_first([d.poses(s[..., self.states(i)]) for i, d in enumerate(self.dynamics)])

    def twists(self, s: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Rates (..., N + J, 3) in the joint states `s` (..., ns) after the inputs `w`."""
        return _bodies_first(
            [
                d.twists(s[..., self.states(i)], w[..., self.inputs(i)])
                for i, d in enumerate(self.dynamics)
            ]
        )

    def accelerations(self, w: np.ndarray) -> np.ndarray:
        """Accelerations (..., N + J, 3) that the joint inputs `w` (..., nw) command."""
        return _bodies_first(
            [d.accelerations(w[..., self.inputs(i)]) for i, d in enumerate(self.dynamics)]
        )

    def state(self, poses: np.ndarray, twists: np.ndarray) -> np.ndarray:
        """Joint state (ns,) with these poses and rates (N + J, 3)."""
        rows = self._rows_of_parts()
        return np.concatenate(
            [d.state(poses[r], twists[r]) for d, r in zip(self.dynamics, rows, strict=True)]
        )

    def input(self, twists: np.ndarray, accelerations: np.ndarray) -> np.ndarray:
        """Joint input (nw,) that commands these rates and accelerations (N + J, 3)."""
        rows = self._rows_of_parts()
        return np.concatenate(
            [d.input(twists[r], accelerations[r]) for d, r in zip(self.dynamics, rows, strict=True)]
        )

    def seen(self, s: np.ndarray, near: np.ndarray) -> np.ndarray:
        """The joint state (ns,) that others make of poses and rates of vehicles in `s` (ns,).

        Poses carry headings as quaternions, which costs their last bits and whole turns; angles
        come out next to those of the joint state `near` (ns,).
        """
        poses = self.poses(s).copy()
        for pose in poses:
            pose[2] = heading.yaw(*heading.quaternion(pose[2]))
        return self.unwrap(self.state(poses, self.twists(s, np.zeros(self.n_inputs))), near)

    def observed(self, i: int, pose: np.ndarray, twist: np.ndarray, near: np.ndarray) -> np.ndarray:
        """State (n,) of player i's vehicle, whose body is seen at a pose (3,) with rates (3,).

        What the body does not tell is as in the joint state `near` (ns,) of a moment ago.
        """
        vehicle, own = self.dynamics[i], near[self.states(i)]
        return vehicle.unwrap(vehicle.observed(pose, twist, own), own)

    def input_between(self, i: int, s: np.ndarray, s_next: np.ndarray) -> np.ndarray:
        """Input (m,) of player i that best explains, by least squares, one step of its vehicle.

        Args:
            i: index of the player.
            s: joint state (ns,) before the step.
            s_next: joint state (ns,) after it.
        """
        own, inputs, h = self.states(i), self.inputs(i), 1e-4
        w = np.zeros(self.n_inputs)
        for _ in range(2):  # Gauss and Newton: most inputs only drive states, linearly
            predicted = self.step(s, w)[own]
            B = np.empty((own.stop - own.start, inputs.stop - inputs.start))
            for j in range(B.shape[1]):
                varied = w.copy()
                varied[inputs.start + j] += h
                B[:, j] = (self.step(s, varied)[own] - predicted) / h
            w[inputs] += np.linalg.lstsq(B, s_next[own] - predicted, rcond=None)[0]
        return w[inputs]

    def _rows_of_parts(self) -> list[list[int]]:
        """For each player, where its body and its joints stand among all of them."""
        every = self.joint_names
        return [[every.index(name) for name in self.joints_of(i)] for i in range(len(self))]

    def unwrap(self, s: np.ndarray, near: np.ndarray) -> np.ndarray:
        """The joint state `s` (ns,) with each angle moved by whole turns next to that in `near`."""
        return np.concatenate(
            [d.unwrap(s[self.states(i)], near[self.states(i)]) for i, d in enumerate(self.dynamics)]
        )


def _bodies_first(parts: list[np.ndarray]) -> np.ndarray:
    """All parts (..., N + J, 3) from those (..., L, 3) of each player."""
    return np.concatenate([p[..., :1, :] for p in parts] + [p[..., 1:, :] for p in parts], axis=-2)
