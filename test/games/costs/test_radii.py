"""Cost terms of players with a radius are those of points that keep more distance."""

from __future__ import annotations

import numpy as np
import pytest

from gameinfer_ros.games import (
    CostTerm,
    DoubleIntegrator,
    Game,
    Obstacle,
    Players,
    Proximity,
    QuadraticInput,
    RoadLane,
    Unicycle,
)

DYNAMICS = {"robot": Unicycle(), "ana": DoubleIntegrator(), "ben": Unicycle()}
RADII = {"robot": 0.25, "ben": 0.5}
POINTS = ((-1.0, 0.0), (1.0, 0.5))


def costs(terms: list[CostTerm], radii: dict[str, float] | None = None) -> np.ndarray:
    """Costs (N, S) of players who come close to each other, and to everything."""
    game = Game(DYNAMICS, terms, 0.1, 5, radii)
    x = np.random.default_rng(0).normal(size=(300, 12))
    return game.costs(x, np.zeros((300, 6)))


def test_proximity_is_that_of_edges() -> None:
    x, u = np.zeros(12), np.zeros(6)
    x[[0, 1, 4, 6, 8, 9]] = 0.0, 0.0, 1.0, 0.0, 0.0, 2.0
    game = Game(DYNAMICS, [Proximity(radius=1.5, weight=10.0)], 0.1, 5, RADII)
    # From edge to edge: robot to ana 1 - 0.25, robot to ben 2 - 0.75, ana to ben sqrt(5) - 0.5.
    expected = [10 * (0.75**2 + 0.25**2), 10 * 0.75**2, 10 * 0.25**2]
    np.testing.assert_allclose(game.costs(x[None], u[None])[:, 0], expected, rtol=1e-12)


def test_the_cost_grows_while_players_overlap() -> None:
    game = Game(DYNAMICS, [Proximity(radius=0.1, weight=1.0)], 0.1, 5, RADII)
    x = np.full((4, 12), 50.0)
    x[:, 1] = x[:, 9] = 0.0
    x[:, 0], x[:, 8] = 0.0, [0.9, 0.75, 0.4, 0.0]
    found = game.costs(x, np.zeros((4, 6)))[0]
    np.testing.assert_allclose(found, [0.0, 0.1**2, 0.45**2, 0.85**2], rtol=1e-12)


@pytest.mark.parametrize("name", list(DYNAMICS))
def test_obstacles_and_lanes_see_the_edge_of_a_player(name: str) -> None:
    radius, own = RADII.get(name, 0.0), (name,)
    for term, of_point in (
        (
            Obstacle(center=(0.2, 0.1), radius=1.0, weight=7.0, players=own),
            Obstacle(center=(0.2, 0.1), radius=1.0 + radius, weight=7.0, players=own),
        ),
        (
            RoadLane(points=POINTS, half_width=0.75, weight=7.0, players=own),
            RoadLane(points=POINTS, half_width=0.75 - radius, weight=7.0, players=own),
        ),
        (  # too narrow for ben
            RoadLane(points=POINTS, half_width=0.4, weight=7.0, players=own),
            RoadLane(points=POINTS, half_width=max(0.0, 0.4 - radius), weight=7.0, players=own),
        ),
    ):
        found = costs([term], RADII)
        assert found.any()
        np.testing.assert_array_equal(found, costs([of_point]))


def test_other_terms_do_not_see_the_radius() -> None:
    game = Game(DYNAMICS, [QuadraticInput(weights=(2.0, 3.0))], 0.1, 5, RADII)
    assert game.terms[0][0].params == (2.0, 3.0)


@pytest.mark.parametrize(
    "term",
    [
        Proximity(radius=1.1, weight=3.0),
        Obstacle(center=(0.1, 0.3), radius=0.7, weight=3.0),
        RoadLane(points=POINTS, half_width=0.3, weight=3.0),
    ],
    ids=lambda term: term.kind,
)
def test_without_a_radius_nothing_changes_to_the_last_bit(term: CostTerm) -> None:
    plain, zero = Players(DYNAMICS), Players(DYNAMICS, dict.fromkeys(DYNAMICS, 0.0))
    for players in (plain, zero):
        bound = term.bind(players, 0)
        written = {
            "proximity": (1.1, 3.0),
            "obstacle": (0.1, 0.3, 0.7, 3.0),
            "lane": (0.3, 3.0),
        }[term.kind]
        assert tuple(bound[0].params[: len(written)]) == written
