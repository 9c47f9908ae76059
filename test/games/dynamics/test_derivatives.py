"""Derivatives of dynamics that compiled code finds from their steps, against complex steps."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest
from numba import njit

from gameinfer_ros.games import Car, DoubleIntegrator, Dynamics, FlatUnicycle, Unicycle, Vehicle
from gameinfer_ros.games.derivatives import _curve, _linearise, curved, dependences, exact
from gameinfer_ros.games.kernels import kernel
from gameinfer_ros.lanes.addresses import call
from gameinfer_ros.lanes.blocks import block
from gameinfer_ros.lanes.lanes import Array
from gameinfer_ros.lanes.numbers import part

DT, WIDTH = 0.1, 8


@kernel
def _step(x: Array, u: Array, dt: float, params: Array, x_next: Array) -> None:
    # Products of states and inputs, and a state that only acts from a bound on.
    x_next[0] = x[0] + dt * x[1] * u[0]
    x_next[1] = x[1] + dt * np.maximum(x[2] - params[0], 0.0) * u[0]
    x_next[2] = x[2] + dt * np.sin(x[1] * x[2])


class Coupled(Vehicle):  # it gives no default to `kind`, and so joins no family
    """Dynamics with second derivatives by states and inputs, whose derivatives nobody wrote."""

    state_names: ClassVar[Any] = ("px", "py", "z")
    input_names: ClassVar[Any] = ("w",)
    step_kernel: ClassVar[Any] = _step

    @property
    def params(self) -> tuple[float, ...]:
        return (0.1,)

    def poses(self, s: np.ndarray) -> Any: ...
    def twists(self, s: np.ndarray, w: np.ndarray) -> Any: ...
    def accelerations(self, w: np.ndarray) -> Any: ...
    def state(self, poses: np.ndarray, twists: np.ndarray) -> Any: ...
    def input(self, twists: np.ndarray, accelerations: np.ndarray) -> Any: ...


MODELS: list[Dynamics] = [
    Unicycle(),
    DoubleIntegrator(),
    FlatUnicycle(),
    Car(wheelbase=1.5),
    Coupled(kind="coupled"),
]


@njit
def run_linearise(at, step, x, u, params, offset, A, B):  # type: ignore[no-untyped-def]
    out = block(A, 8), block(B, 8)
    call(at, (step, block(x, 8), block(u, 8), DT, part(params, offset, 0), *out))


@njit
def run_curve(at, step, x, u, params, offset, costates, H):  # type: ignore[no-untyped-def]
    out = block(costates, 8), block(H, 8)
    call(at, (step, block(x, 8), block(u, 8), DT, part(params, offset, 0), *out))


def jacobian(dynamics: Dynamics, z: np.ndarray) -> np.ndarray:
    """Derivatives (n, n + m, width) of the step by states and inputs z, exact to rounding."""
    n = dynamics.n_states
    columns = []
    for j in range(len(z)):
        moved, after = z.astype(complex), np.zeros((n, z.shape[1]), dtype=complex)
        moved[j] += 1e-30j
        params = np.array(dynamics.params)
        type(dynamics).step_kernel(moved[:n], moved[n:], DT, params, after)
        columns.append(after.imag / 1e-30)
    return np.stack(columns, axis=1)


def tables(dynamics: Dynamics) -> tuple[np.ndarray, np.ndarray]:
    return np.array([*dynamics.params, 0.0]), np.array([0, len(dynamics.params)])


def some_point(dynamics: Dynamics) -> np.ndarray:
    return np.random.default_rng(0).normal(0, 0.5, (dynamics.n_states + dynamics.n_inputs, WIDTH))


@pytest.mark.parametrize("dynamics", MODELS, ids=lambda d: d.kind)
def test_the_linearisation_is_the_derivative_of_the_step(dynamics: Dynamics) -> None:
    n, m, z = dynamics.n_states, dynamics.n_inputs, some_point(dynamics)
    A, B = np.full((n, n, WIDTH), np.nan), np.full((n, m, WIDTH), np.nan)
    run_linearise(*exact(dynamics, WIDTH), z[:n].copy(), z[n:].copy(), *tables(dynamics), A, B)
    np.testing.assert_allclose(np.concatenate([A, B], axis=1), jacobian(dynamics, z), atol=1e-14)


@pytest.mark.parametrize("dynamics", MODELS, ids=lambda d: d.kind)
def test_the_curvature_is_the_second_derivative_of_the_step(dynamics: Dynamics) -> None:
    n, size, z = dynamics.n_states, dynamics.n_states + dynamics.n_inputs, some_point(dynamics)
    costates = np.random.default_rng(1).normal(size=(2, n, WIDTH))
    H = np.full((2, size * size, WIDTH), np.nan)
    given = z[:n].copy(), z[n:].copy(), *tables(dynamics)
    run_curve(*curved(dynamics, WIDTH), *given, costates, H)
    steps = 1e-5 * np.eye(size)[..., None]
    slopes = [(jacobian(dynamics, z + s) - jacobian(dynamics, z - s)) / 2e-5 for s in steps]
    expected = np.einsum("icw,acbw->iabw", costates, np.stack(slopes))
    np.testing.assert_allclose(H.reshape(expected.shape), expected, atol=1e-9)


@pytest.mark.parametrize("dynamics", MODELS, ids=lambda d: d.kind)
def test_no_element_that_can_differ_from_zero_is_left_out(dynamics: Dynamics) -> None:
    A, B = dependences(dynamics, DT)
    rng = np.random.default_rng(3)
    z = rng.normal(0, 2.0, (dynamics.n_states + dynamics.n_inputs, 1000))
    nonzero = (np.abs(jacobian(dynamics, z)) > 0.0).any(axis=-1)
    np.testing.assert_array_equal(np.concatenate([A, B], axis=1), nonzero)


def test_functions_for_other_sizes_have_other_names() -> None:
    """In the disk cache, functions with one name and signature would replace each other."""
    names = {make(n, 2).py_func.__qualname__ for make in (_linearise, _curve) for n in (4, 5)}
    assert len(names) == 4
