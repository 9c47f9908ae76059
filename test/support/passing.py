"""A scenario of two players who pass each other."""

from __future__ import annotations

from pathlib import Path

import yaml_text

#: They go on for a minute.
PASSING = {
    "dt": 0.1,
    "horizon": 20,
    "steps": 60,
    "players": {
        "robot": {
            "dynamics": {"kind": "unicycle"},
            "initial": [-3.0, 0.0, 0.0, 0.5],
            "limits": {"omega": [-2.0, 2.0], "a": [-3.0, 3.0]},
        },
        "human_1": {"dynamics": {"kind": "unicycle"}, "initial": [3.0, 1.5, 3.14, 0.5]},
    },
    "costs": [
        {"kind": "quadratic_input", "weights": [10, 10]},
        {"kind": "quadratic_state", "weights": [0, 0, 0, 50]},
        {"kind": "proximity", "radius": 1.2, "weight": 50},
        {
            "kind": "goal",
            "weights": [1, 1, 1, 0],
            "active_from": 0.0,
            "goals": {"robot": [30.0, 0.0, 0.0, 0.0], "human_1": [-30.0, 1.5, 3.14, 0.0]},
        },
    ],
    "seeds": {"kind": "cosine", "low": [-0.3, -0.1], "high": [0.3, 0.1]},
    "inference": {"particles": 6},
}


def write_scenario(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "passing.yaml"
    file.write_text(yaml_text.dump(PASSING))
    return file
