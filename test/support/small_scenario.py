"""Small scenarios, in files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

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
        players, goals = {}, {}
        for i, kind in enumerate(kinds):
            name = "robot" if i == 0 else f"human_{i}"
            y = 1.0 * i
            if kind == "f":
                players[name] = {
                    "dynamics": {"kind": "flat_unicycle"},
                    "initial": [0.0, y, heading, 0.0],
                }
                goals[name] = [1.0, 0.0, y, 0.0]
            elif kind == "c":
                players[name] = {
                    "dynamics": {"kind": "car", "wheelbase": 0.8},
                    "initial": [0.0, y, heading, 0.5, 0.1],
                }
                goals[name] = [1.0, y, heading, 0.0, 0.0]
            elif kind == "u":
                forward = [float(np.cos(heading)), float(np.sin(heading))]
                players[name] = {
                    "dynamics": {"kind": "unicycle"},
                    "initial": [0.0, y, heading, 0.5],
                }
                goals[name] = [forward[0], y + forward[1], heading, 0.0]
            else:
                players[name] = {
                    "dynamics": {"kind": "double_integrator"},
                    "initial": [0.0, 0.5, y, 0.0],
                }
                goals[name] = [1.0, 0.0, y, 0.0]
        content = {
            "dt": dt,
            "horizon": horizon,
            "steps": steps,
            "players": players,
            "costs": [
                {"kind": "quadratic_input", "weights": [10, 10]},
                {"kind": "proximity", "radius": 0.8, "weight": 50},
                *(
                    cost
                    for name, goal in goals.items()
                    for cost in (
                        {
                            "kind": "quadratic_state",
                            "weights": [0, 0, 0, 5, 1][: len(goal)],
                            "players": [name],
                        },
                        {
                            "kind": "goal",
                            "weights": [30, 30, 30, 0, 0][: len(goal)],
                            "active_from": (steps - 1.5) * dt,
                            "goals": {name: goal},
                            "players": [name],
                        },
                    )
                ),
            ],
            "seeds": {"kind": "cosine", "low": [-0.2, 0.05], "high": [0.2, 0.1]},
            "inference": {"particles": particles, "duplicate_tolerance": duplicate_tolerance},
        }
        path = tmp_path / f"{kinds}.yaml"
        path.write_text(yaml_text.dump(content))
        return path

    return write
