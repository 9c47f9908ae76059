"""The content of a scenario, and how tests change it."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

Content = dict[str, Any]

GOOD: Content = {
    "dt": 0.1,
    "horizon": 20,
    "steps": 21,
    "players": {
        "robot": {"dynamics": {"kind": "unicycle"}, "initial": [-1.0, 0.0, 0.0, 0.0]},
        "ana": {"dynamics": {"kind": "double_integrator"}, "initial": [0.0, 0.0, -1.0, 0.0]},
    },
    "costs": [
        {"kind": "quadratic_input", "weights": [10, 10]},
        {
            "kind": "soft_bound",
            "of": "v",
            "low": 0.0,
            "high": 2,
            "weight": 50,
            "players": ["robot"],
        },
        {"kind": "proximity", "radius": 1.5, "weight": 50},
        {
            "kind": "goal",
            "weights": [300, 300, 300, 0],
            "active_from": 1.85,
            "goals": {"robot": [1.0, 0.0, 0.0, 0.0], "ana": [0.0, 0.0, 1.0, 0.0]},
        },
    ],
    "seeds": {"kind": "cosine", "low": [-0.2, 0.1], "high": [0.2, 0.1]},
    "inference": {"particles": 5, "observation_noise": 0.1, "duplicate_tolerance": 0.1},
    "solver": {"max_iterations": 30},
}


def edited(edit: Callable[[Content], Any]) -> Content:
    content = copy.deepcopy(GOOD)
    edit(content)
    return content


OBSTACLE: Content = {"kind": "obstacle", "center": [0.5, 0], "radius": 1, "weight": 50}
LANE: Content = {"kind": "lane", "points": [[0, 0], [1, 0]], "half_width": 0, "weight": 50}


def with_cost(cost: Content, **fields: Any) -> Callable[[Content], Any]:
    """An edit that adds this term, with other `fields`, as costs[4]."""
    return lambda content: content["costs"].append({**cost, **fields})
