from __future__ import annotations

import numpy as np
import pytest

from gameinfer_ros.planning import plan
from gameinfer_ros.solver import Strategy

T, FIRST, NX, NU = 8, 20, 12, 6


@pytest.fixture
def strategy() -> Strategy:
    rng = np.random.default_rng(0)
    shapes = (T + 1, NX, 1), (T, NU, 1), (T, NU, NX, 1)
    return Strategy(FIRST, *(rng.normal(size=shape) for shape in shapes))


def test_a_plan_reacts_now_and_follows_the_reference_later(strategy: Strategy) -> None:
    x = np.ones(NX)
    u = plan(strategy, FIRST + 2, x, 4)
    assert u.shape == (4, NU)
    feedback = strategy.u_ref[2, :, 0] - strategy.P[2, :, :, 0] @ (x - strategy.x_ref[2, :, 0])
    np.testing.assert_allclose(u[0], feedback, rtol=1e-12)
    np.testing.assert_array_equal(u[0], strategy.inputs(FIRST + 2, x)[:, 0])
    np.testing.assert_array_equal(u[1:], strategy.u_ref[3:6, :, 0])


def test_the_plan_of_one_player_is_its_part_of_the_plan_of_all(strategy: Strategy) -> None:
    x = np.arange(float(NX))
    everyone = plan(strategy, FIRST, x, 5)
    for own in (slice(0, 2), slice(2, 3), slice(3, 6)):
        alone = plan(strategy.of_inputs(own), FIRST, x, 5)
        np.testing.assert_array_equal(alone, everyone[:, own])


@pytest.mark.parametrize(
    ("step", "length", "given"),
    [(0, 1, 1), (0, 8, 8), (0, 9, 8), (0, 500, 8), (5, 3, 3), (5, 4, 3), (7, 1, 1), (7, 5, 1)],
)
def test_a_plan_ends_with_the_horizon(
    strategy: Strategy, step: int, length: int, given: int
) -> None:
    u = plan(strategy, FIRST + step, np.zeros(NX), length)
    assert u.shape == (given, NU)
    np.testing.assert_array_equal(u[1:], strategy.u_ref[step + 1 : step + given, :, 0])


@pytest.mark.parametrize("step", [FIRST - 1, FIRST + T])
def test_a_step_outside_the_horizon_is_refused(strategy: Strategy, step: int) -> None:
    with pytest.raises(IndexError, match=f"step: {step} is not allowed"):
        plan(strategy, step, np.zeros(NX), 3)


def test_a_plan_is_a_copy(strategy: Strategy) -> None:
    before = strategy.u_ref.copy()
    plan(strategy, FIRST, np.zeros(NX), 3)[:] = 99.0
    np.testing.assert_array_equal(strategy.u_ref, before)
