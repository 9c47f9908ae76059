from __future__ import annotations

import numpy as np
import pytest
from strategies import assert_same, assert_same_particle

from gameinfer_ros.solver import Strategy

T, NU, NX, K = 6, 2, 3, 4


@pytest.fixture
def strategy() -> Strategy:
    rng = np.random.default_rng(0)
    return Strategy(
        10,
        rng.normal(size=(T + 1, NX, K)),
        rng.normal(size=(T, NU, K)),
        rng.normal(size=(T, NU, NX, K)),
    )


def test_a_strategy_knows_its_size(strategy: Strategy) -> None:
    assert (len(strategy), strategy.horizon) == (K, T)


def test_inputs_react_to_the_state(strategy: Strategy) -> None:
    x = np.array([1.0, -2.0, 0.5])
    for step in range(10, 16):
        u = strategy.inputs(step, x)
        assert u.shape == (NU, K)
        for k in range(K):
            dx = x - strategy.x_ref[step - 10, :, k]
            expected = strategy.u_ref[step - 10, :, k] - strategy.P[step - 10, :, :, k] @ dx
            np.testing.assert_allclose(u[:, k], expected, rtol=1e-12, atol=1e-12)


def test_inputs_may_be_overwritten(strategy: Strategy) -> None:
    before = strategy.u_ref.copy()
    strategy.inputs(10, np.zeros(NX))[:] = 7.0
    np.testing.assert_array_equal(strategy.u_ref, before)


@pytest.mark.parametrize("step", [9, 16, -1, 1000])
def test_steps_outside_the_horizon_are_refused(strategy: Strategy, step: int) -> None:
    with pytest.raises(IndexError, match=rf"step: {step} .* 10 to 15"):
        strategy.inputs(step, np.zeros(NX))
    with pytest.raises(IndexError, match=rf"step: {step} .* 10 to 15"):
        strategy.advanced(step)


@pytest.mark.parametrize("by", range(T))
def test_advancing_keeps_what_is_left_and_adds_rest(strategy: Strategy, by: int) -> None:
    later = strategy.advanced(10 + by)
    assert (later.first_step, later.horizon, len(later)) == (10 + by, T, K)
    left = T - by
    np.testing.assert_array_equal(later.x_ref[: left + 1], strategy.x_ref[by:])
    np.testing.assert_array_equal(later.u_ref[:left], strategy.u_ref[by:])
    np.testing.assert_array_equal(later.P[:left], strategy.P[by:])
    assert (later.x_ref[left + 1 :] == strategy.x_ref[-1]).all()
    assert not later.u_ref[left:].any() and not later.P[left:].any()
    x = np.ones(NX)
    for step in range(10 + by, 16):
        np.testing.assert_array_equal(later.inputs(step, x), strategy.inputs(step, x))


def test_an_advanced_strategy_is_a_copy(strategy: Strategy) -> None:
    before = strategy.take(range(K))
    for array in strategy.advanced(10).arrays:
        array[:] = 0.0
    assert_same(strategy, before)


def test_take_chooses_particles(strategy: Strategy) -> None:
    some = strategy.take([3, 1])
    assert (len(some), some.first_step) == (2, 10)
    for found, array in zip(some.arrays, strategy.arrays, strict=True):
        np.testing.assert_array_equal(found, array[..., [3, 1]])


def test_of_inputs_keeps_the_rows_of_some_inputs(strategy: Strategy) -> None:
    one = strategy.of_inputs(slice(1, 2))
    assert (len(one), one.first_step, one.horizon) == (K, 10, T)
    x = np.array([0.5, -1.0, 2.0])
    # To the bit: a node that sends its own rows and one that knows all rows agree.
    np.testing.assert_array_equal(one.inputs(13, x), strategy.inputs(13, x)[1:])


def test_inputs_are_the_same_to_the_bit_with_any_other_particles(strategy: Strategy) -> None:
    x = np.array([0.5, -1.0, 2.0])
    together = strategy.inputs(13, x)
    for particles in ([0], [3], [2, 1], [1, 1, 1, 2]):
        np.testing.assert_array_equal(
            strategy.take(particles).inputs(13, x), together[:, particles]
        )


def test_assign_overwrites_one_particle(strategy: Strategy) -> None:
    source = strategy.take([0, 2])
    others = [0, 2, 3]
    before = strategy.take(others)
    strategy.assign(1, source, 1)
    assert_same_particle(strategy, 1, source, 1)
    assert_same(strategy.take(others), before)


def test_open_loop_strategies_do_not_react() -> None:
    u = np.random.default_rng(1).normal(size=(T, NU, K))
    x0 = np.array([1.0, 2.0, 3.0])
    strategy = Strategy.from_inputs(4, x0, u)
    assert strategy.first_step == 4
    assert (strategy.x_ref == x0[:, None]).all() and strategy.x_ref.shape == (T + 1, NX, K)
    np.testing.assert_array_equal(strategy.inputs(6, np.full(NX, 99.0)), u[2])
    strategy.u_ref[:] = 0.0
    assert u.any(), "the inputs must have been copied"


def test_one_number_that_is_not_finite_is_enough() -> None:
    for array in range(3):
        for bad in (np.nan, np.inf, -np.inf):
            strategy = Strategy.zeros(0, 4, 3, 2, 5)
            assert strategy.finite.all()
            strategy.arrays[array][..., 2].reshape(-1)[-1] = bad
            np.testing.assert_array_equal(strategy.finite, [True, True, False, True, True])
