"""What viewers are shown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TypeVar

import numpy as np
import pytest
from solving import GameFactory, Start

from gameinfer_ros.games import Game
from gameinfer_ros.inference import NO_PARTICLE, Belief, BeliefSettings, CosineSeeds
from gameinfer_ros.names import colours
from gameinfer_ros.nodes.viewing.scene import PAST, STRIDE, Scene
from gameinfer_ros.solver import GameSolver, SolverSettings
from msg_adapters.markers import Arrow, Dots, Path, Shape, Text

AnyShape = TypeVar("AnyShape", bound=Shape)
K = 4
NAMES = ("player_0", "player_1", "player_2")


def belief_of(game: Game, x0: np.ndarray, step: int = 0, **settings: float) -> Belief:
    belief = Belief(
        GameSolver(game, SolverSettings(**settings)),
        CosineSeeds(low=(-0.3, -0.3), high=(0.3, 0.3)),
        BeliefSettings(particles=K),
        np.random.default_rng(0),
    )
    belief.solve(step, x0)
    weights = np.log([0.02, 0.08, 0.5, 0.4])
    belief.particles = replace(belief.particles, ids=np.array([2, 3, 5, 7]), log_weights=weights)
    return belief


@pytest.fixture
def game(make_game: GameFactory) -> Game:
    """Two unicycles and a double integrator between them, who plan 2 s ahead."""
    return make_game("udu")


@pytest.fixture
def belief(game: Game, start: Start) -> Belief:
    return belief_of(game, start(game))


def poses(step: float) -> np.ndarray:
    """Poses of three players, and of two joints, which are not drawn."""
    return np.array([[i + 0.1 * step, -i, 0.5 * i] for i in range(5)])


def drawn(belief: Belief, *steps: int) -> list[Shape]:
    """The shapes once these steps were followed."""
    scene = Scene(belief.game)
    for step in steps:
        scene.follow(step, poses(step))
    return scene.shapes(belief)


def of(shapes: list[Shape], kind: type[AnyShape], namespace: str) -> list[AnyShape]:
    return [s for s in shapes if isinstance(s, kind) and s.namespace == namespace]


def test_every_namespace_is_there_and_every_marker_has_a_name_of_its_own(belief: Belief) -> None:
    shapes = drawn(belief, *range(8))
    kinds = ("players", "names", "goals", "past", "particles", "map")
    wanted = {f"{kind}/{name}" for kind in kinds for name in NAMES}
    assert {s.namespace for s in shapes} == wanted | {f"prediction/{name}" for name in NAMES[1:]}
    assert set(Counter((s.namespace, s.number) for s in shapes).values()) == {1}


def test_players_have_the_colours_of_the_pictures(belief: Belief) -> None:
    shapes = drawn(belief, *range(8))
    for i, name in enumerate(NAMES):
        wanted = tuple(int(colours.COLOURS[i][k : k + 2], 16) / 255 for k in (1, 3, 5))
        for shape in shapes:
            if shape.namespace.endswith(f"/{name}"):
                assert shape.colour[:3] == pytest.approx(wanted), shape.namespace


def test_players_are_named_arrows_along_their_headings(belief: Belief) -> None:
    shapes = drawn(belief, 0)
    for i, name in enumerate(NAMES):
        (arrow,) = of(shapes, Arrow, f"players/{name}")
        np.testing.assert_array_equal(arrow.pose, poses(0)[i])
        (text,) = of(shapes, Text, f"names/{name}")
        assert text.text == name
        assert 0.1 < np.linalg.norm(text.position - arrow.pose[:2]) < 0.5


def test_goals_are_in_the_map(belief: Belief, start: Start) -> None:
    shapes = drawn(belief, 0)
    ends = -belief.game.players.positions(start(belief.game))  # on the other side
    for end, name in zip(ends, NAMES, strict=True):
        (goal,) = of(shapes, Dots, f"goals/{name}")
        np.testing.assert_allclose(goal.points, [end])


def test_a_game_without_goals_is_drawn_without_them(game: Game) -> None:
    dynamics = dict(zip(NAMES, game.players.dynamics, strict=True))
    aimless = Game(dynamics, [game.terms[0][0].term], game.dt, game.horizon)
    shapes = drawn(belief_of(aimless, np.ones(12)), 0)
    assert not [s for s in shapes if s.namespace.startswith("goals/")]
    assert of(shapes, Path, "map/player_0")


def test_particles_go_from_where_the_players_are_to_the_end_by_weight(belief: Belief) -> None:
    shapes = drawn(belief, 0)
    positions = belief.game.players.positions(np.moveaxis(belief.strategy.x_ref, -1, 0))
    for i, name in enumerate(NAMES):
        particles = of(shapes, Path, f"particles/{name}")
        assert [p.number for p in particles] == [2, 3, 5, 7]
        np.testing.assert_allclose([p.colour[3] for p in particles], [0.05, 0.08, 0.5, 0.4])
        for k, particle in enumerate(particles):
            np.testing.assert_array_equal(particle.points, positions[k, ::STRIDE, i])
            np.testing.assert_array_equal(particle.points[-1], positions[k, -1, i])
        (bold,) = of(shapes, Path, f"map/{name}")
        np.testing.assert_array_equal(bold.points, positions[belief.map_index, :, i])
        assert bold.size > 2 * particles[0].size
        assert bold.colour[3] == 1.0


def test_what_was_solved_earlier_is_drawn_from_now_on(belief: Belief) -> None:
    at_once, later = drawn(belief, 0), drawn(belief, *range(4))
    for name in NAMES:
        (first,), (then,) = (of(shapes, Path, f"map/{name}") for shapes in (at_once, later))
        np.testing.assert_array_equal(then.points, first.points[3:])
        (first, *_), (then, *_) = (
            of(shapes, Path, f"particles/{name}") for shapes in (at_once, later)
        )
        np.testing.assert_array_equal(then.points[-1], first.points[-1])
    # A prediction counts its seconds from now on, whatever the time is.
    (first,), (then,) = (of(shapes, Dots, "prediction/player_1") for shapes in (at_once, later))
    (path,) = of(at_once, Path, "map/player_1")
    np.testing.assert_allclose(first.points, path.points[[10, 20]])
    np.testing.assert_allclose(then.points, path.points[[13]])


@pytest.mark.parametrize("dt", [0.25, 1 / 3, 0.4, 1.0, 2.5])
def test_predictions_are_of_whole_seconds_on_any_grid(
    dt: float, make_game: GameFactory, start: Start
) -> None:
    game = make_game("udu", horizon=24, dt=dt)
    belief = belief_of(game, start(game))
    shapes = drawn(belief, 0)
    (path,) = of(shapes, Path, "map/player_2")
    (dots,) = of(shapes, Dots, "prediction/player_2")
    assert len(dots.points) == int(24 * dt + 1e-9)
    whole = [k for k in range(1, 25) if abs(k * dt - round(k * dt)) < 1e-9]
    assert whole
    for k in whole:
        np.testing.assert_allclose(dots.points[round(k * dt) - 1], path.points[k], atol=1e-9)
    labels = of(shapes, Text, "prediction/player_2")
    seconds = [5 * (n + 1) for n in range(len(labels))]
    assert [(label.number, label.text) for label in labels] == [(s, f"+{s} s") for s in seconds]
    assert len(dots.points) - 5 < 5 * len(labels) <= len(dots.points)
    for second, label in zip(seconds, labels, strict=True):
        assert 0.1 < np.linalg.norm(label.position - dots.points[second - 1]) < 0.5


def test_a_horizon_of_less_than_a_second_predicts_nothing(
    make_game: GameFactory, start: Start
) -> None:
    game = make_game("udu", horizon=9)
    shapes = drawn(belief_of(game, start(game)), 0)
    assert not [s for s in shapes if s.namespace.startswith("prediction/")]


def test_without_an_equilibrium_nothing_is_predicted(game: Game, start: Start) -> None:
    # No iteration moves a state by as little as this.
    belief = belief_of(game, start(game), max_iterations=1, converged_movement=1e-300)
    assert belief.equilibrium.particle == NO_PARTICLE
    shapes = drawn(belief, 0)
    assert not [s for s in shapes if s.namespace.startswith("prediction/")]
    assert of(shapes, Path, "map/player_1")


# --- Past paths ----------------------------------------------------------------------------------


@pytest.fixture
def past_after(make_game: GameFactory) -> Callable[..., list[float]]:
    """Steps through which the past path is drawn once some steps were followed."""
    game = make_game("u", horizon=2000)
    belief = belief_of(game, np.zeros(4), max_iterations=1)

    def find(*steps: int) -> list[float]:
        paths = of(drawn(belief, *steps), Path, "past/player_0")
        return [step for path in paths for step in (10 * path.points[:, 0]).round(6).tolist()]

    return find


def test_past_paths_lead_from_the_start_to_now(past_after: Callable[..., list[float]]) -> None:
    assert past_after(0) == []  # a line needs two points
    assert past_after(*range(2)) == [0, 1]
    assert past_after(*range(STRIDE + 1)) == [0, STRIDE]
    assert past_after(*range(12)) == [0, 5, 10, 11]
    assert past_after(*range(3, 14)) == [5, 10, 13]  # of a node that came later
    assert past_after(0, 5, 11, 15, 16) == [0, 5, 15, 16]  # with states missing


def test_what_is_kept_of_the_past_is_bounded(past_after: Callable[..., list[float]]) -> None:
    last = STRIDE * (PAST + 20)
    found = past_after(*range(last + 1))
    assert len(found) == PAST + 1
    assert found[-1] == last
    assert found[0] == last - STRIDE * PAST


def lists_without_points(shapes: list[Shape]) -> Iterator[Shape]:
    """Lines of one point and dots of none: viewers complain about them."""
    for shape in shapes:
        if isinstance(shape, Path | Dots) and len(shape.points) < 1 + isinstance(shape, Path):
            yield shape


@pytest.mark.parametrize("steps", [1, 2, 20])
def test_viewers_have_nothing_to_complain_about(steps: int, belief: Belief) -> None:
    assert not list(lists_without_points(drawn(belief, *range(steps))))


def test_players_with_a_radius_are_drawn_as_large_as_they_are(game: Game, start: Start) -> None:
    dynamics = dict(zip(NAMES, game.players.dynamics, strict=True))
    terms = [game.terms[0][0].term]
    large = Game(dynamics, terms, game.dt, game.horizon, {"player_1": 0.45})
    shapes = drawn(belief_of(large, start(game)), 0, 1)
    (body,) = (s for s in shapes if s.namespace.startswith("bodies/"))
    assert isinstance(body, Dots) and body.namespace == "bodies/player_1"
    assert body.size == 0.9 and 0 < body.colour[3] < 1
    np.testing.assert_array_equal(body.points, poses(1)[1:2, :2])
    (text,) = of(shapes, Text, "names/player_1")
    assert np.linalg.norm(text.position - body.points[0]) > 0.45
