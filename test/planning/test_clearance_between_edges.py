"""The safety layer measures from edge to edge."""

from __future__ import annotations

import numpy as np
import pytest
from guarded import DT, ROBOTS, make

from gameinfer_ros.games import Game, Vehicles
from gameinfer_ros.planning import BRAKES, GOES_ON, LIMITED, PASSES, SafetyFilter, SafetySettings


def with_radii(
    vehicles: Vehicles, radii: dict[str, float], clearance: float
) -> tuple[Vehicles, SafetyFilter]:
    """The same vehicles with radii, and a layer that keeps this clearance."""
    players = dict(zip(vehicles.names, vehicles.dynamics, strict=True))
    _, limits = ROBOTS["unicycle"]
    same = Vehicles(Game(players, [], DT, 5, radii), {"robot": limits})
    return same, SafetyFilter(same, SafetySettings(clearance=clearance))


def test_the_clearance_is_kept_between_edges() -> None:
    """Players with radii of together 0.5 m keep 0.25 m as points keep 0.75 m, to the last bit."""
    vehicles, _ = make("unicycle", people=2)
    radii = {"robot": 0.25, "human_0": 0.25, "human_1": 0.25}
    _, guard = with_radii(vehicles, radii, 0.25)
    _, of_points = with_radii(vehicles, {}, 0.75)
    rng, actions = np.random.default_rng(1), set()
    for _ in range(500):
        s = rng.normal(scale=1.2, size=vehicles.n_states)
        inputs = rng.normal(scale=1.0, size=(10, 2))
        found, expected = guard.check(s, inputs), of_points.check(s, inputs)
        assert found.action == expected.action
        np.testing.assert_array_equal(found.inputs, expected.inputs)
        np.testing.assert_array_equal(found.states, expected.states)
        actions.add(found.action)
    assert actions == {PASSES, BRAKES, LIMITED, GOES_ON}


def test_the_nearest_player_is_the_one_with_the_nearest_edge() -> None:
    vehicles, _ = make("unicycle", people=2)
    _, guard = with_radii(vehicles, {"robot": 0.2, "human_1": 0.6}, 0.3)
    # Behind the robot, which drives on, a person stands 0.6 m away, and before it one 1.4 m away.
    s = np.array([0.0, 0.0, 0.0, 1.0, -0.6, 0.0, 0.0, 0.0, 1.4, 0.0, 0.0, 0.0])
    found = guard.check(s, np.array([[0.0, 1.0]]))
    assert found.action == BRAKES
    assert "m to human_1 within" in found.reason and "the clearance is 0.3 m" in found.reason


@pytest.mark.parametrize("radius", [0.0, 0.3])
def test_a_robot_that_overlaps_a_person_may_always_move_away(radius: float) -> None:
    vehicles, _ = make("unicycle")
    _, guard = with_radii(vehicles, {"robot": radius, "human_0": radius}, 0.2)
    s = np.array([0.0, 0.0, 0.0, 0.0, -0.15, 0.0, 0.0, 0.0])
    assert guard.check(s, np.array([[0.0, 1.0]])).action == PASSES
    found = guard.check(s, np.array([[0.0, -1.0]]))
    assert found.action == BRAKES
    assert f"the input leaves {'-' if radius else ''}0." in found.reason
