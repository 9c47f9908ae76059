"""Small scenarios, in files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml_text

ScenarioFile = Callable[..., Path]


@pytest.fixture
def scenario_file(tmp_path: Path) -> ScenarioFile:
    """Writes small scenarios: players side by side who want to go 1 m ahead."""

    def write(
        kinds: str = "ud",
        dt: float = 0.1,
        steps: int = 8,
        horizon: int = 10,
        particles: int = 4,
        heading: float = 0.0,
        duplicate_tolerance: float = 0.0,
    ) -> Path:
        players: dict[str, Any] = {}
        goals: dict[str, list[float]] = {}
        ahead = [float(np.cos(heading)), float(np.sin(heading))]
        for i, kind in enumerate(kinds):
            name, y = "robot" if i == 0 else f"human_{i}", 1.0 * i
            dynamics, initial, goal = {
                "u": ("unicycle", [0.0, y, heading, 0.5], [ahead[0], y + ahead[1], heading, 0.0]),
                "d": ("double_integrator", [0.0, 0.5, y, 0.0], [1.0, 0.0, y, 0.0]),
                "f": ("flat_unicycle", [0.0, y, heading, 0.0], [1.0, 0.0, y, 0.0]),
                "c": ("car", [0.0, y, heading, 0.5, 0.1], [1.0, y, heading, 0.0, 0.0]),
            }[kind]
            players[name] = {"dynamics": {"kind": dynamics}, "initial": initial}
            if kind == "c":
                players[name]["dynamics"]["wheelbase"] = 0.8
            goals[name] = goal
        content = {
            "dt": dt,
            "horizon": horizon,
            "steps": steps,
            "players": players,
            "costs": [
                {"kind": "quadratic_input", "weights": [10, 10]},
                {"kind": "proximity", "radius": 0.8, "weight": 50},
                *(
                    {**cost, "players": [name]}
                    for name, goal in goals.items()
                    for cost in (
                        {"kind": "quadratic_state", "weights": [0, 0, 0, 5, 1][: len(goal)]},
                        {
                            "kind": "goal",
                            "weights": [30, 30, 30, 0, 0][: len(goal)],
                            "active_from": (steps - 1.5) * dt,
                            "goals": {name: goal},
                        },
                    )
                ),
            ],
            "seeds": {"kind": "cosine", "low": [-0.2, 0.05], "high": [0.2, 0.1]},
            # The iterations of the paper, whose particles differ by what they leave undone.
            "solver": {"method": "iterative_lq"},
            "inference": {"particles": particles, "duplicate_tolerance": duplicate_tolerance},
        }
        path = tmp_path / f"{kinds}.yaml"
        path.write_text(yaml_text.dump(content))
        return path

    return write
