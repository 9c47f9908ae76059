"""Fixtures of the tests of runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml_text
from run_command import Command


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Command]]:
    """Starts `gameinfer run` with some arguments."""
    commands: list[Command] = []

    def make(*arguments: object, **options: Any) -> Command:
        commands.append(Command(tmp_path / f"command_{len(commands)}", *arguments, **options))
        return commands[-1]

    yield make
    for command in commands:
        command.end()


@pytest.fixture
def side_by_side(tmp_path: Path) -> Callable[[int], Path]:
    """Writes a scenario of some players who walk side by side."""

    def write(players: int) -> Path:
        names = ["robot", *(f"human_{i}" for i in range(1, players))]
        content = {
            "dt": 0.1,
            "horizon": 10,
            "steps": 20,
            "players": {
                name: {"dynamics": {"kind": "unicycle"}, "initial": [0.0, 1.0 * i, 0.0, 0.5]}
                for i, name in enumerate(names)
            },
            "costs": [
                {"kind": "quadratic_input", "weights": [10, 10]},
                {"kind": "proximity", "radius": 0.8, "weight": 50},
            ],
            "seeds": {"kind": "cosine", "low": [-0.1, 0.0], "high": [0.1, 0.1]},
            "inference": {"particles": 3},
        }
        path = tmp_path / f"{players}_side_by_side.yaml"
        path.write_text(yaml_text.dump(content))
        return path

    return write


@pytest.fixture
def endless(
    start: Callable[..., Command], side_by_side: Callable[[int], Path]
) -> Callable[..., Command]:
    """Starts a run in realtime that does not end by itself."""

    def make(*arguments: object, **options: Any) -> Command:
        return start(
            *("--scenario", side_by_side(2), "--time", "realtime", "--steps", 10**6),
            *arguments,
            **options,
        )

    return make
