from __future__ import annotations

import numpy as np
import pytest

from gameinfer_ros.games import DoubleIntegrator, FlatUnicycle, Players, Unicycle


@pytest.fixture
def players() -> Players:
    return Players({"robot": Unicycle(), "ana": DoubleIntegrator(), "ben": Unicycle()})


def test_states_and_inputs_stand_one_after_the_other(players: Players) -> None:
    assert (players.n_states, players.n_inputs, len(players)) == (12, 6, 3)
    rows = [r for i in range(3) for r in range(12)[players.states(i)]]
    columns = [c for i in range(3) for c in range(6)[players.inputs(i)]]
    assert (rows, columns) == (list(range(12)), list(range(6)))


def test_a_player_is_found_by_name(players: Players) -> None:
    assert [players.index(name) for name in players.names] == [0, 1, 2]
    with pytest.raises(ValueError, match=r"'eve'.*robot, ana, ben"):
        players.index("eve")


def test_positions_and_distances(players: Players) -> None:
    x = np.zeros((2, 12))
    x[1, [0, 1]] = 3.0, 0.0
    x[1, [4, 6]] = 0.0, 4.0
    x[1, [8, 9]] = 3.0, 4.0
    np.testing.assert_array_equal(players.positions(x)[1], [[3, 0], [0, 4], [3, 4]])
    np.testing.assert_allclose(players.distances(x), [[0, 0, 0], [5, 4, 3]])
    np.testing.assert_allclose(players.distances(x[1]), [5, 4, 3])
    assert Players({"robot": Unicycle()}).distances(np.zeros((7, 4))).shape == (7, 0)


def test_distances_are_from_edge_to_edge() -> None:
    dynamics = {"robot": Unicycle(), "ana": DoubleIntegrator(), "ben": Unicycle()}
    players = Players(dynamics, {"ben": 0.5, "robot": 0.25})
    np.testing.assert_array_equal(players.radii, [0.25, 0.0, 0.5])
    x = np.zeros((2, 12))
    x[1, [0, 1]] = 3.0, 0.0
    x[1, [4, 6]] = 0.0, 4.0
    x[1, [8, 9]] = 3.0, 4.0
    np.testing.assert_allclose(players.distances(x), [[-0.25, -0.75, -0.5], [4.75, 3.25, 2.5]])
    np.testing.assert_array_equal(Players(dynamics).radii, np.zeros(3))


@pytest.mark.parametrize("radius", [-0.1, np.nan, np.inf])
def test_a_radius_is_a_finite_number_of_at_least_0(radius: float) -> None:
    with pytest.raises(ValueError, match=rf"players\.ana\.radius: {radius} is not allowed"):
        Players({"robot": Unicycle(), "ana": Unicycle()}, {"ana": radius})


def test_only_players_have_a_radius() -> None:
    with pytest.raises(ValueError, match="'eve' is not allowed"):
        Players({"robot": Unicycle()}, {"eve": 0.1})


def test_the_dynamics_declare_which_states_are_angles(players: Players) -> None:
    assert np.flatnonzero(players.is_angle).tolist() == [2, 10]
    flat = Players({"robot": FlatUnicycle(), "ana": DoubleIntegrator()})
    assert not flat.is_angle.any()
