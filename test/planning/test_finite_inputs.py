"""Whatever the game and whatever happens: beliefs and players hand out inputs that are finite."""

from __future__ import annotations

import numpy as np
from extreme_games import CLASSES, draw
from hypothesis import example, given, settings
from hypothesis import strategies as st

from examples import examples
from gameinfer_ros.games import ROBOT
from gameinfer_ros.inference import Belief, BeliefSettings, ConstantSeeds
from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.solver import GameSolver, Strategy

SEEDS = ConstantSeeds(low=(-3.0, -3.0), high=(3.0, 3.0))
K = 4


def spoil(strategy: Strategy, garbage: Strategy, particles: list[int]) -> None:
    """Overwrite some particles, those that there are."""
    for k in particles:
        if k < len(strategy):
            strategy.assign(k, garbage, k)


@settings(max_examples=examples(150))
@given(
    st.sampled_from(list(CLASSES)),
    st.integers(0, 2**32 - 1),
    st.booleans(),
    st.sampled_from([{}, {"max_iterations": 1, "patience": 2}]),
    st.lists(st.tuples(st.integers(1, 15), st.floats(0.0, 1e6)), min_size=1, max_size=4),
)
@example("not finite", 1153, False, {}, [(1, 16.0), (1, 0.0), (3, 0.0)])
def test_inputs_are_finite(
    kind: str,
    number: int,
    robot_plays: bool,
    bounds: dict[str, int],
    events: list[tuple[int, float]],
) -> None:
    rng = np.random.default_rng(number)
    game, solver_settings, x, garbage = draw(kind, rng, K)
    solver = GameSolver(game, solver_settings)
    belief = Belief(solver, SEEDS, BeliefSettings(particles=K, **bounds), rng, robot_plays)
    player = EquilibriumPlayer(solver, SEEDS, rng)
    belief.solve(0, x)
    played, step = player.solve(0, x), 0
    u = played.inputs(0, x)[:, 0]
    assert np.isfinite(u).all()
    for hop, surprise in events:
        with np.errstate(all="ignore"):  # particles may be spoilt, and states as large as 1e300
            x_next = game.step(x, u) + surprise * rng.normal(size=len(x))
            if not np.isfinite(x_next).all():
                return
            belief.weigh(step, x, x_next, u[game.players.inputs(ROBOT)])
        belief.combine_duplicates()
        assert abs(belief.weights.sum() - 1) < 1e-9
        spoil(belief.strategy, garbage, [0, 2])
        spoil(played, garbage, [0])
        x, step = x_next, step + hop
        belief.solve(step, x)
        u = belief.equilibrium.strategy.inputs(step, x)[:, 0]
        assert np.isfinite(u).all()
        played = player.solve(step, x)
        assert np.isfinite(played.inputs(step, x)).all()
