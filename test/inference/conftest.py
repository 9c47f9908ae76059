"""Fixtures of the tests of inference."""

from __future__ import annotations

import numpy as np
import pytest
from beliefs import solved_belief
from solving import GameFactory, Start

from gameinfer_ros.games import Game
from gameinfer_ros.inference import Belief


@pytest.fixture(scope="module")
def game(make_game: GameFactory) -> Game:
    return make_game("ud", horizon=10)


@pytest.fixture(scope="module")
def x0(game: Game, start: Start) -> np.ndarray:
    return start(game)


@pytest.fixture
def belief(game: Game, x0: np.ndarray) -> Belief:
    """A belief at step 0, with different weights."""
    return solved_belief(game, x0)
