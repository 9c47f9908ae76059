"""Games of any number of players on a circle."""

import numpy as np

from gameinfer_ros.games import ROBOT
from gameinfer_ros.scenario import Scenario

#: Radius of the circle, in m.
RADIUS = 3.0


def circle(base: Scenario, players: int, horizon: int | None = None) -> Scenario:
    """Create a scenario of players who start on a circle and have their goals on its other side.

    No two players swap places. Dynamics, costs, seeds and settings are those of `base`, whose
    robot is a unicycle, possibly with flat coordinates in the game.

    Args:
        base: a scenario in which all players have the same dynamics and the same costs.
        players: number of players.
        horizon: number of steps T; None for that of `base`. The goal costs begin at the same time
            before the end of the horizon as in `base`.
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
    """Return the heading of each player at the start, in rad: evenly spaced, none opposite."""
    places = players if players % 2 else players + 1
    if players == 2:
        places = 4  # so that their paths cross at a right angle
    return [2 * float(np.pi) * i / places for i in range(players)]
