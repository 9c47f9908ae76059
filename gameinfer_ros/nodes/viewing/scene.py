"""The scene that viewers are sent: where all players are, and what the belief expects of them."""

from __future__ import annotations

from collections import deque

import numpy as np

from gameinfer_ros.games import ROBOT, Game, goal_positions
from gameinfer_ros.inference import NO_PARTICLE, Belief
from gameinfer_ros.names import colours
from gameinfer_ros.solver import Strategy
from msg_adapters.markers import Arrow, Dots, Path, Shape, Text

#: Steps between the points that the trajectory of a particle and a past path are drawn through.
#: There are many of them: a message with every step would take longer to make than a step of five
#: players.
STRIDE = 5

#: Points of a past path: what was longer ago is forgotten.
PAST = 300

#: Every so many seconds, a dot of a prediction is labelled.
LABELLED = 5

#: Where names and labels stand, against what they belong to, in m.
_ABOVE, _BESIDE = np.array([0.0, 0.3]), np.array([0.35, 0.0])


class Scene:
    """Draws one run, step by step.

    Args:
        game: the game that is played.
    """

    def __init__(self, game: Game) -> None:
        self._players, self._dt = game.players, game.dt
        self._goals = goal_positions(game)
        self._past: deque[np.ndarray] = deque(maxlen=PAST)
        self._step, self._poses = -1, np.empty((0, 3))

    def follow(self, step: int, poses: np.ndarray) -> None:
        """See the players move.

        Args:
            step: the step that the poses belong to, later than the last one.
            poses: their first N of (N + J, 3), in m and rad, are the players'; joints are not
                drawn.
        """
        if self._step % STRIDE == 0:
            self._past.append(self._poses[:, :2])
        self._step, self._poses = step, poses[: len(self._players)]

    def shapes(self, belief: Belief) -> list[Shape]:
        """What there is to draw at the step that was followed last.

        The opacity of a particle's trajectories is its weight; those of the MAP are drawn bold.
        On the latter, a dot for each second from now on predicts where a human will be.
        """
        likely = belief.equilibrium
        (likeliest,) = self._trajectories(likely.strategy)
        paths = self._trajectories(belief.strategy)
        last = paths.shape[1] - 1
        paths = paths[:, [*range(0, last, STRIDE), last]]
        particles = list(zip(belief.ids.tolist(), belief.weights.tolist(), strict=True))
        past = np.array([*self._past, self._poses[:, :2]])

        shapes: list[Shape] = []
        for i, name in enumerate(self._players.names):
            rgb, pose = colours.rgb(colours.of_player(i)), self._poses[i]
            opaque, pale = (*rgb, 1.0), (*rgb, 0.5)
            shapes.append(Arrow(f"players/{name}", i, pose, opaque, 0.4))
            shapes.append(Text(f"names/{name}", i, pose[:2] + _ABOVE, name, opaque, 0.2))
            if len(self._goals[i]):
                shapes.append(Dots(f"goals/{name}", i, self._goals[i], pale, 0.3))
            if len(past) > 1:
                shapes.append(Path(f"past/{name}", i, past[:, i], pale, 0.04))
            for (number, weight), points in zip(particles, paths[:, :, i], strict=True):
                colour = (*rgb, max(0.05, weight))
                shapes.append(Path(f"particles/{name}", number, points, colour, 0.02))
            shapes.append(Path(f"map/{name}", i, likeliest[:, i], opaque, 0.06))
            if i != ROBOT and likely.particle != NO_PARTICLE:
                shapes += self._prediction(f"prediction/{name}", likeliest[:, i], opaque)
        return shapes

    def _trajectories(self, strategy: Strategy) -> np.ndarray:
        """Positions (K, S, N, 2) of all players from now on, as K particles see them."""
        x = strategy.x_ref[self._step - strategy.first_step :]
        return self._players.positions(np.moveaxis(x, -1, 0))

    def _prediction(
        self, namespace: str, path: np.ndarray, colour: tuple[float, float, float, float]
    ) -> list[Shape]:
        """Dots on a path (S, 2) where it will be in 1, 2, ... seconds; some labelled."""
        times = self._dt * np.arange(len(path))
        seconds = np.arange(1, int(times[-1] + 1e-9) + 1)
        if not len(seconds):
            return []
        points = np.column_stack([np.interp(seconds, times, coordinate) for coordinate in path.T])
        labels = [
            Text(namespace, second, points[second - 1] + _BESIDE, f"+{second} s", colour, 0.15)
            for second in seconds[LABELLED - 1 :: LABELLED].tolist()
        ]
        return [Dots(namespace, 0, points, colour, 0.12), *labels]
