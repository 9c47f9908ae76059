"""The scene that viewers show: all players, and their predictions by the belief."""

from collections import deque

import numpy as np

from gameinfer_ros.games import ROBOT, Game, goal_positions
from gameinfer_ros.inference import NO_PARTICLE, Belief
from gameinfer_ros.names import colours
from gameinfer_ros.solver import Strategy
from msg_adapters.markers import Arrow, Dots, Path, Shape, Text

#: Steps between the drawn points of a particle's trajectory and of a past path. With every step,
#: creating the message would take longer than a time step of the five-player scenario.
STRIDE = 5

#: Largest number of points of a past path.
PAST = 300

#: Seconds between the labelled dots of a prediction.
LABELLED = 5

#: Offsets of names above players, and of labels beside dots, in m.
_ABOVE, _BESIDE = np.array([0.0, 0.3]), np.array([0.35, 0.0])


class Scene:
    """Shapes of one run, step by step."""

    def __init__(self, game: Game) -> None:
        self._players, self._dt = game.players, game.dt
        self._goals = goal_positions(game)
        self._past: deque[np.ndarray] = deque(maxlen=PAST)
        self._step, self._poses = -1, np.empty((0, 3))

    def follow(self, step: int, poses: np.ndarray) -> None:
        """Update the poses (N + J, 3) of N players, in m and rad; those of J joints are ignored."""
        if self._step % STRIDE == 0:
            self._past.append(self._poses[:, :2])
        self._step, self._poses = step, poses[: len(self._players)]

    def shapes(self, belief: Belief) -> list[Shape]:
        """Shapes at the step of the last `follow`.

        The opacity of a particle's trajectories is its weight. Those of the MAP equilibrium are
        bold, with a dot for the predicted position of each human at each second from now.
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
            shapes.append(Arrow(f"players/{name}", i, opaque, 0.4, pose))
            radius = float(self._players.radii[i])
            if radius > 0:
                disc = Dots(f"bodies/{name}", i, (*rgb, 0.3), 2 * radius, pose[None, :2])
                shapes.append(disc)
            above = np.maximum(_ABOVE, [0.0, radius + 0.15])
            shapes.append(Text(f"names/{name}", i, opaque, 0.2, pose[:2] + above, name))
            if len(self._goals[i]):
                shapes.append(Dots(f"goals/{name}", i, pale, 0.3, self._goals[i]))
            if len(past) > 1:
                shapes.append(Path(f"past/{name}", i, pale, 0.04, past[:, i]))
            for (number, weight), points in zip(particles, paths[:, :, i], strict=True):
                colour = (*rgb, max(0.05, weight))
                shapes.append(Path(f"particles/{name}", number, colour, 0.02, points))
            shapes.append(Path(f"map/{name}", i, opaque, 0.06, likeliest[:, i]))
            if i != ROBOT and likely.particle != NO_PARTICLE:
                shapes += self._prediction(f"prediction/{name}", likeliest[:, i], opaque)
        return shapes

    def _trajectories(self, strategy: Strategy) -> np.ndarray:
        """Predicted positions (K, S, N, 2) of N players at S steps, for K particles, in m."""
        x = strategy.x_ref[self._step - strategy.first_step :]
        return self._players.positions(np.moveaxis(x, -1, 0))

    def _prediction(
        self, namespace: str, path: np.ndarray, colour: tuple[float, float, float, float]
    ) -> list[Shape]:
        """Dots on a path (S, 2) at 1, 2, ... seconds from now, some with a label."""
        times = self._dt * np.arange(len(path))
        seconds = np.arange(1, int(times[-1] + 1e-9) + 1)
        if not len(seconds):
            return []
        points = np.column_stack([np.interp(seconds, times, coordinate) for coordinate in path.T])
        labels = [
            Text(namespace, second, colour, 0.15, points[second - 1] + _BESIDE, f"+{second} s")
            for second in seconds[LABELLED - 1 :: LABELLED].tolist()
        ]
        return [Dots(namespace, 0, colour, 0.12, points), *labels]
