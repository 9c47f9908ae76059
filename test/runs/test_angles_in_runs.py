"""Runs take headings modulo a turn."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gameinfer_ros.runs import closed_loop
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.scenario import Scenario

Play = Callable[[float, float], RunRecord]


@pytest.fixture
def play(load: Callable[..., Scenario]) -> Play:
    """Plays a robot that starts and is to end with these headings, 4 m farther."""

    def run(initial: float, goal: float) -> RunRecord:
        content: dict[str, Any] = {
            "dt": 0.1,
            "horizon": 40,
            "steps": 50,
            "players": {
                "robot": {"dynamics": {"kind": "unicycle"}, "initial": [2.0, 0.0, initial, 0.5]}
            },
            "costs": [
                {"kind": "quadratic_input", "weights": [10, 10]},
                {"kind": "quadratic_state", "weights": [0, 0, 0, 30]},
                {
                    "kind": "goal",
                    "weights": [300, 300, 300, 0],
                    "active_from": 3.85,
                    "goals": {"robot": [-2.0, 0.0, goal, 0.0]},
                },
            ],
            "seeds": {"kind": "constant", "low": [-0.1, 0.0], "high": [0.1, 0.1]},
            "inference": {"particles": 4},
        }
        return closed_loop.run(load(content), "map", seed=1)

    return run


@pytest.mark.parametrize(
    ("initial", "goal", "way"),
    [
        (3.1, -3.1, 2 * np.pi - 6.2),
        (-3.1, 3.1, 6.2 - 2 * np.pi),
        (3.1 + 2 * np.pi, 3.1, 0.0),
        (3.0, 3.2 - 20 * np.pi, 0.2),
    ],
)
def test_a_run_takes_the_short_way_and_costs_what_it_costs_without_whole_turns(
    play: Play, initial: float, goal: float, way: float
) -> None:
    record, plain = play(initial, goal), play(initial, initial + way)
    headings = np.array(record.states)[:, 2]
    assert headings[-1] - initial == pytest.approx(way, abs=0.01)
    assert np.ptp(headings) < 0.3
    np.testing.assert_allclose(record.costs, plain.costs, rtol=1e-6)
    whole_turns = np.array([0.0, 0.0, 8 * np.pi, 0.0])
    turned = RunRecord(record.vehicles, [s + whole_turns for s in record.states], record.inputs)
    np.testing.assert_allclose(turned.costs, record.costs, rtol=1e-9)


def test_a_robot_that_starts_whole_turns_away_does_not_spin(play: Play) -> None:
    record, plain = play(180.0, np.pi), play(180.0 - 58 * np.pi, np.pi)
    assert np.ptp(np.array(record.states)[:, 2]) < np.pi
    np.testing.assert_allclose(record.costs, plain.costs, rtol=1e-6)
