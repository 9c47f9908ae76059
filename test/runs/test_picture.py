"""The figure of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from gameinfer_ros.runs import picture
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.scenario import Scenario


def test_players_with_a_radius_are_drawn_where_they_are_closest(
    two_player: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = two_player.model_dump()
    content["players"]["human_1"]["radius"] = 0.4
    scenario = Scenario.model_validate(content)
    states = [scenario.initial_vehicle_state.copy() for _ in range(5)]
    states[3][[4, 5]] = states[3][[0, 1]] + 1.0
    record = RunRecord(scenario.vehicles, states, [np.zeros(4)] * 4)
    drawn: list[Axes] = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: drawn.extend(self.axes))
    picture.draw(record, tmp_path / "run.png", "a title")
    (disc,) = (patch for patch in drawn[0].patches if isinstance(patch, Circle))
    assert disc.get_radius() == 0.4
    np.testing.assert_array_equal(disc.get_center(), states[3][[4, 5]])
    drawn.clear()
    picture.draw(RunRecord(two_player.vehicles, states, record.inputs), tmp_path / "b.png", "b")
    assert not drawn[0].patches
