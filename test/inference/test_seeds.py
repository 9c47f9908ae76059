from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from gameinfer_ros.games import DoubleIntegrator, Players, Unicycle
from gameinfer_ros.inference import ConstantSeeds, CosineSeeds, SeedDistribution

#: The factor of the amplitude at step k of T, for every kind of seeds.
SHAPES = {"cosine": lambda k, T: np.cos(np.pi * k / T), "constant": lambda k, T: 1.0}
LOW, HIGH = (-0.25, 0.075), (0.5, 0.125)
PLAYERS = Players({"robot": Unicycle(), "ana": DoubleIntegrator()})


@pytest.fixture(params=sorted(SeedDistribution.family))
def seeds(request: pytest.FixtureRequest) -> SeedDistribution:
    assert request.param in SHAPES, f"say in SHAPES what shape '{request.param}' has"
    return SeedDistribution.family[request.param](low=LOW, high=HIGH)


def test_seeds_have_the_shape_of_their_kind_and_uniform_amplitudes(seeds: SeedDistribution) -> None:
    T, K = 8, 4000
    u = seeds.sample(np.random.default_rng(0), PLAYERS, T, K)
    assert u.shape == (T, 4, K)
    shape = np.array([SHAPES[seeds.kind](k, T) for k in range(T)])
    amplitude = u[0] / shape[0]
    np.testing.assert_allclose(u, shape[:, None, None] * amplitude, rtol=0, atol=1e-12)
    for row in range(4):
        low, high = LOW[row % 2], HIGH[row % 2]
        assert low <= amplitude[row].min() and amplitude[row].max() <= high
        quantiles = np.quantile(amplitude[row], [0.1, 0.5, 0.9])
        np.testing.assert_allclose(
            quantiles, low + (high - low) * np.array([0.1, 0.5, 0.9]), atol=0.03 * (high - low)
        )
    correlation = np.corrcoef(amplitude) - np.eye(4)
    assert np.abs(correlation).max() < 0.06, "inputs and players must be independent"


def test_the_same_generator_state_gives_the_same_seeds(seeds: SeedDistribution) -> None:
    one, other, another = (
        seeds.sample(np.random.default_rng(state), PLAYERS, 10, 5) for state in (7, 7, 8)
    )
    np.testing.assert_array_equal(one, other)
    assert (one[0] != another[0]).all()


@pytest.mark.parametrize("count", [1, 2, 49])
def test_the_first_seeds_do_not_depend_on_how_many_follow(
    seeds: SeedDistribution, count: int
) -> None:
    few = seeds.sample(np.random.default_rng(1), PLAYERS, 10, count)
    many = seeds.sample(np.random.default_rng(1), PLAYERS, 10, 50)
    np.testing.assert_array_equal(few, many[..., :count])


def test_no_amplitude_is_no_input(seeds: SeedDistribution) -> None:
    zero = type(seeds)(low=(0.0, 0.0), high=(0.0, 0.0))
    assert not zero.sample(np.random.default_rng(2), PLAYERS, 10, 3).any()


def test_equal_limits_fix_the_amplitude() -> None:
    u = ConstantSeeds(low=(0.3, -1.0), high=(0.3, -1.0)).sample(
        np.random.default_rng(3), PLAYERS, 5, 2
    )
    np.testing.assert_array_equal(u, np.tile([[0.3], [-1.0], [0.3], [-1.0]], (5, 1, 2)))


def test_amplitudes_must_fit_the_inputs() -> None:
    CosineSeeds(low=LOW, high=HIGH).check(PLAYERS)
    with pytest.raises(ValueError, match=r"low: \[0\.0\].*2.*omega, a"):
        CosineSeeds(low=(0.0,), high=(0.0,)).check(PLAYERS)


@pytest.mark.parametrize(
    "fields",
    [
        {"low": (0.0, 0.2), "high": (0.1, 0.1)},
        {"low": (0.0,), "high": (0.1, 0.1)},
        {"low": (0.0, np.nan), "high": (0.1, 0.1)},
        {"low": (0.0, 0.0), "high": (0.1, np.inf)},
        {"low": (0.0, 0.0)},
        {"low": (0.0, 0.0), "high": (0.1, 0.1), "colour": "red"},
    ],
)
def test_limits_that_make_no_distribution_are_refused(
    seeds: SeedDistribution, fields: dict[str, object]
) -> None:
    with pytest.raises(ValidationError):
        type(seeds)(**fields)
