"""Which items of the linearised dynamics the solver knows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.linalg import block_diag
from solving import GameFactory

from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.games.tables import written_items
from gameinfer_ros.lanes.lanes import Array


def model(linearise: Callable[..., None], n: int = 3, m: int = 2, params: Any = ()) -> Any:
    """All that `written_items` knows of dynamics, without a kind that scenarios could name."""
    made = type("Model", (), {"linearise_kernel": kernel(linearise)})()
    made.n_states, made.n_inputs, made.params = n, m, params
    return made


@pytest.mark.parametrize("seed", range(10))
def test_exactly_the_items_that_are_written_are_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, 7, 2)
    in_A, in_B = rng.random((n, n)) < 0.4, rng.random((n, m)) < 0.4
    constants = rng.normal(size=4)
    # Some items are always 0 in value, some depend on the state, the input or a parameter.
    values = (
        lambda x, u, dt, params: 0.0,
        lambda x, u, dt, params: x[-1] * params[0],
        lambda x, u, dt, params: np.sin(u[0]),
        lambda x, u, dt, params: dt * params[3],
    )

    def linearise(x: Array, u: Array, dt: float, params: Array, A: Array, B: Array) -> None:
        for matrix, where in ((A, in_A), (B, in_B)):
            for r, c in zip(*np.nonzero(where), strict=True):
                matrix[r, c] = values[(r + c) % 4](x, u, dt, params)

    found = written_items(model(linearise, n, m, constants))
    np.testing.assert_array_equal(found[0], in_A)
    np.testing.assert_array_equal(found[1], in_B)


def test_items_that_are_added_to_are_found() -> None:
    def linearise(x: Array, u: Array, dt: float, params: Array, A: Array, B: Array) -> None:
        A[0, 1] += 1.0
        A[2, 2] -= x[0]
        B[1, 0] += dt * u[1]

    A, B = written_items(model(linearise))
    assert np.argwhere(A).tolist() == [[0, 1], [2, 2]]
    assert np.argwhere(B).tolist() == [[1, 0]]


def test_items_that_are_written_only_sometimes_are_found() -> None:
    def linearise(x: Array, u: Array, dt: float, params: Array, A: Array, B: Array) -> None:
        if x[0] == 0.0:
            A[0, 1] = 0.0
            A[1, 0] += 1.0
        else:
            A[2, 0] = 1.0
            B[0, 1] += x[0]
        if u[0] == 0.0:
            B[2, 0] = 0.0
        if np.abs(x[1]) > 5.0:
            A[2, 1] = 1.0

    A, B = written_items(model(linearise))
    assert np.argwhere(A).tolist() == [[0, 1], [1, 0], [2, 0], [2, 1]]
    assert np.argwhere(B).tolist() == [[0, 1], [2, 0]]


def test_a_kernel_that_writes_nothing_has_no_items() -> None:
    def linearise(x: Array, u: Array, dt: float, params: Array, A: Array, B: Array) -> None:
        pass

    A, B = written_items(model(linearise, 4, 1))
    assert A.shape == (4, 4) and B.shape == (4, 1)
    assert not A.any() and not B.any()


@pytest.mark.parametrize("kinds", ["u", "du", "udd"])
def test_the_tables_hold_the_items_of_the_joint_matrices_column_by_column(
    kinds: str, make_game: GameFactory
) -> None:
    game = make_game(kinds)
    written = [written_items(dynamics) for dynamics in game.players.dynamics]
    kernels = game.kernels(8)
    for matrix, (items, columns) in enumerate(
        ((kernels.A_items, kernels.A_columns), (kernels.B_items, kernels.B_columns))
    ):
        blocks = [np.random.default_rng(i).normal(size=w[matrix].shape) for i, w in
                  enumerate(written)]  # fmt: skip
        stored = np.concatenate([values.ravel() for values in blocks])
        expected = block_diag(
            *(values * w[matrix] for values, w in zip(blocks, written, strict=True))
        )
        found = np.zeros_like(expected)
        assert columns[0] == 0 and len(columns) == expected.shape[1] + 1
        for c in range(expected.shape[1]):
            for place, row in items[columns[c] : columns[c + 1]]:
                found[row, c] = stored[place]
        np.testing.assert_array_equal(found, expected)
        assert len(items) == columns[-1] == np.count_nonzero(expected)
