"""Games of any number of players on a circle."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.games import ROBOT
from gameinfer_ros.scenario import Scenario

#: Radius of the circle, in m.
RADIUS = 3.0


def circle(base: Scenario, players: int, horizon: int | None = None) -> Scenario:
    """The scenario of `players` who start on a circle and want to reach its other side.

    No two of them want to swap places. Dynamics, costs, seeds and settings are those of `base`,
    whose robot is a unicycle, to which the game may give flat coordinates.

    Args:
        base: a scenario in which all players have the same dynamics and the same costs.
        players: number of players.
        horizon: number of steps T, if not as in `base`; goals count from as late on as there.
    """
    dynamics = list(base.players.values())[ROBOT].dynamics
    horizon = horizon or base.horizon
    specs, goals = {}, {}
    for i, angle in enumerate(angles(players)):
        name = f"human_{i}" if i else "robot"
        x, y = RADIUS * np.cos(angle), RADIUS * np.sin(angle)
        specs[name] = {"dynamics": dynamics, "initial": (-x, -y, angle, 0.0)}
        goals[name] = tuple(dynamics.game_state(np.array([x, y, angle, 0.0])).tolist())
    content = base.model_dump()
    for cost in content["costs"]:
        if cost["kind"] == "goal":
            cost["goals"] = goals
            cost["active_from"] += (horizon - base.horizon) * base.dt
    return Scenario.model_validate({**content, "players": specs, "horizon": horizon})


def angles(players: int) -> list[float]:
    """Heading of each player at the start, in rad: evenly spaced, and none opposite to another."""
    places = players if players % 2 else players + 1
    if players == 2:
        places = 4  # their ways cross at a right angle
    return [2 * float(np.pi) * i / places for i in range(players)]
