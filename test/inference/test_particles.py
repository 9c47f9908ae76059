"""Particles: one structure whose `take` serves merging, resampling and death."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gameinfer_ros.inference import Particles
from gameinfer_ros.solver import Strategy

K, T, NU, NX = 5, 3, 2, 4


def particles(rng: np.random.Generator) -> Particles:
    return Particles(
        seeds=rng.normal(size=(T, NU, K)),
        strategy=Strategy(
            7,
            rng.normal(size=(T + 1, NX, K)),
            rng.normal(size=(T, NU, K)),
            rng.normal(size=(T, NU, NX, K)),
        ),
        converged=rng.random(K) < 0.5,
        updated=rng.random(K) < 0.5,
        iterations=rng.integers(9, size=K),
        unconverged_iterations=rng.integers(9, size=K),
        ids=np.arange(10, 10 + K),
        log_weights=rng.normal(size=K),
    )


def numbers(made: Particles, k: int) -> list[np.ndarray]:
    found = []
    for field in fields(made):
        value = getattr(made, field.name)
        arrays = value.arrays if isinstance(value, Strategy) else [value]
        found += [np.asarray(array[..., k]) for array in arrays]
    return found


@given(st.lists(st.integers(0, K - 1), max_size=2 * K), st.integers(0, 2**32))
def test_taken_particles_bring_all_their_numbers_along(index: list[int], seed: int) -> None:
    made = particles(np.random.default_rng(seed))
    taken = made.take(index)
    assert len(taken) == len(index)
    assert taken.strategy is not None and taken.strategy.first_step == 7
    for place, k in enumerate(index):
        for own, its in zip(numbers(taken, place), numbers(made, k), strict=True):
            np.testing.assert_array_equal(own, its)


def test_particles_that_repeat_do_not_share_memory(rng_seed: int = 0) -> None:
    taken = particles(np.random.default_rng(rng_seed)).take([1, 1])
    taken.strategy.x_ref[..., 0] = 0.0
    assert taken.strategy.x_ref[..., 1].any()


def test_particles_are_equally_probable_at_first() -> None:
    made = Particles.equally_probable(np.zeros((T, NU, K)))
    assert made.weights.sum() == pytest.approx(1.0)
    assert made.ids.tolist() == list(range(K))
    assert made.strategy is None and made.take([3]).strategy is None
