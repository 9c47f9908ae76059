"""The players of a game and their parts of the joint state and input."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gameinfer_ros.games.dynamics.dynamics import Dynamics

#: Index of the robot among the players.
ROBOT = 0


class Players:
    """The players of a game, in order; player 0 is the robot.

    The joint state x (..., nx) consists of the states of player 0, those of player 1, and so on.
    The joint input u (..., nu) is ordered in the same way.

    Args:
        dynamics: dynamics of each player by its name.
        radii: radius of players by their names, in m; that of the others is 0. A player is a disc
            around its position.

    Attributes:
        names: names of the players.
        dynamics: dynamics of the players.
        radii: radius of each player (N,), in m.
        n_states: number of states nx of all players.
        n_inputs: number of inputs nu of all players.
        is_angle: whether each state is an angle modulo a turn (nx,).

    Raises:
        ValueError: there is no player, or `radii` names a player that does not exist or contains a
            negative or infinite number.
    """

    def __init__(
        self, dynamics: Mapping[str, Dynamics], radii: Mapping[str, float] | None = None
    ) -> None:
        if not dynamics:
            raise ValueError("players: there must be at least one player")
        self.names = tuple(dynamics)
        self.dynamics = tuple(dynamics.values())
        self._state_offset = np.cumsum([0] + [d.n_states for d in self.dynamics])
        self._input_offset = np.cumsum([0] + [d.n_inputs for d in self.dynamics])
        self.n_states = int(self._state_offset[-1])
        self.n_inputs = int(self._input_offset[-1])
        self.radii = np.zeros(len(dynamics))
        for name, radius in (radii or {}).items():
            if not 0 <= radius < np.inf:
                raise ValueError(
                    f"players.{name}.radius: {radius} is not allowed: it must be a finite number "
                    "of at least 0"
                )
            self.radii[self.index(name)] = radius
        self.is_angle = np.zeros(self.n_states, dtype=bool)
        for first, d in zip(self._state_offset.tolist(), self.dynamics, strict=False):
            self.is_angle[[first + j for j in d.angles]] = True

    def __len__(self) -> int:
        return len(self.names)

    def index(self, name: str) -> int:
        """Return the index of a player.

        Raises:
            ValueError: there is no player with this name.
        """
        if name not in self.names:
            raise ValueError(f"'{name}' is not allowed: the players are {', '.join(self.names)}")
        return self.names.index(name)

    def states(self, i: int) -> slice:
        """Return the rows of player i's state in the joint state."""
        return slice(int(self._state_offset[i]), int(self._state_offset[i + 1]))

    def inputs(self, i: int) -> slice:
        """Return the rows of player i's input in the joint input."""
        return slice(int(self._input_offset[i]), int(self._input_offset[i + 1]))

    def position_rows(self, i: int) -> list[int]:
        """Return the rows of player i's position (x, y) in the joint state."""
        return [int(self._state_offset[i]) + p for p in self.dynamics[i].position]

    def positions(self, x: np.ndarray) -> np.ndarray:
        """Return the positions (..., N, 2), in m, of all players in joint states (..., nx)."""
        return x[..., [self.position_rows(i) for i in range(len(self))]]

    def distances(self, x: np.ndarray) -> np.ndarray:
        """Return the distances (..., N (N - 1) / 2), in m, between all pairs of players.

        They are measured from edge to edge, and negative if two players overlap.

        Args:
            x: joint states (..., nx).
        """
        first, second = np.triu_indices(len(self), k=1)
        positions = self.positions(x)
        between = np.linalg.norm(positions[..., first, :] - positions[..., second, :], axis=-1)
        return between - (self.radii[first] + self.radii[second])
