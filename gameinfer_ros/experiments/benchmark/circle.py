"""Games of any number of players on a circle."""

import numpy as np

from gameinfer_ros.games import ROBOT
from gameinfer_ros.scenario import Scenario

#: Radius of the circle, in m.
RADIUS = 3.0


def circle(base: Scenario, players: int, horizon: int | None = None) -> Scenario:
    """Create a scenario of players who start on a circle and have their goals on its other side.

    No two players swap places. Everything else is that of `base`, in which all players must be
    unicycles, possibly with flat coordinates, with the same costs. With another `horizon`, the goal
    costs begin at the same time before its end.
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
