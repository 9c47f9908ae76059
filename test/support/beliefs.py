"""Beliefs to test."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from solving import PAPER

from gameinfer_ros.games import Game
from gameinfer_ros.inference import Belief, BeliefSettings, CosineSeeds
from gameinfer_ros.solver import GameSolver

SEEDS = CosineSeeds(low=(-0.3, -0.3), high=(0.3, 0.3))
K = 6


def make_belief(game: Game, particles: int = K, robot_plays: bool = True, **more: Any) -> Belief:
    return Belief(
        GameSolver(game, PAPER),
        SEEDS,
        BeliefSettings(particles=particles, **more),
        np.random.default_rng(0),
        robot_plays,
    )


def solved_belief(game: Game, x0: np.ndarray) -> Belief:
    belief = make_belief(game)
    belief.solve(0, x0)
    set_weights(belief, np.arange(1.0, K + 1) / np.arange(1.0, K + 1).sum())
    return belief


def spread(belief: Belief, offsets: np.ndarray) -> None:
    """Give all particles one trajectory, but for an offset (K,) of some component somewhere."""
    x_ref = belief.strategy.x_ref
    x_ref[:] = x_ref[..., :1]
    x_ref[4, 5] += offsets


def set_weights(belief: Belief, weights: np.ndarray) -> None:
    with np.errstate(divide="ignore"):
        belief.particles = replace(belief.particles, log_weights=np.log(weights))
