"""The picture of a belief that viewers are sent."""

from __future__ import annotations

import colorsys

import numpy as np

from gameinfer_ros.inference import Belief
from msg_adapters.markers import Arrow, Path

#: Steps between the points that the trajectory of a particle is drawn through. There are many of
#: them: a message with every step would take longer to make than a step of five players.
STRIDE = 5


def scene(belief: Belief, poses: np.ndarray) -> list[Path | Arrow]:
    """Every player at its pose, and where each particle sees it going.

    The opacity of a particle's trajectories is its weight; those of the MAP are drawn bold. The
    players' poses are the first N of `poses` (N + J, 3); joints are not drawn.
    """
    players = belief.game.players
    likeliest = players.positions(belief.equilibrium.strategy.x_ref[..., 0])
    paths = players.positions(np.moveaxis(belief.strategy.x_ref, -1, 0))
    last = paths.shape[1] - 1
    drawn = [*range(0, last, STRIDE), last]
    shapes: list[Path | Arrow] = []
    for i, name in enumerate(players.names):
        red, green, blue = colorsys.hsv_to_rgb(i / len(players), 0.8, 0.9)
        shapes.append(Arrow(f"players/{name}", i, poses[i], (red, green, blue, 1.0), 0.4))
        for k, number in enumerate(belief.ids):
            opacity = max(0.05, float(belief.weights[k]))
            shapes.append(
                Path(
                    f"particles/{name}",
                    int(number),
                    paths[k, drawn, i],
                    (red, green, blue, opacity),
                    0.02,
                )
            )
        shapes.append(Path(f"map/{name}", i, likeliest[:, i], (red, green, blue, 1.0), 0.06))
    return shapes
