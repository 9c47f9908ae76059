"""Seeds: the initial strategies that stand for latent equilibria."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import Self, override

from gameinfer_ros.games import Players
from gameinfer_ros.games.costs.cost_term import check_length
from gameinfer_ros.games.registry import Kind, Real


class SeedDistribution(Kind):
    """A distribution over initial strategies, the same for every player and independent.

    The inputs of a seed are an amplitude, uniform between `low` and `high`, times a shape over
    the horizon; there is no feedback.
    """

    family: ClassVar[dict[str, type[Kind]]] = {}
    kind: str
    low: tuple[Real, ...] = Field(description="lowest amplitude of each input of a player")
    high: tuple[Real, ...] = Field(description="highest amplitude of each input of a player")

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if len(self.low) != len(self.high):
            raise ValueError(f"low {self.low} and high {self.high} differ in length")
        if any(low > high for low, high in zip(self.low, self.high, strict=True)):
            raise ValueError(f"low {self.low} must not be above high {self.high}")
        return self

    @abstractmethod
    def shape(self, horizon: int) -> np.ndarray:
        """Factor (T,) of the amplitude at each step of a horizon of T steps."""

    def check(self, players: Players) -> None:
        """Check that the amplitudes fit the inputs of every player.

        Raises:
            ValueError: they do not.
        """
        for dynamics in players.dynamics:
            check_length("low", self.low, dynamics.input_names)

    def sample(
        self, rng: np.random.Generator, players: Players, horizon: int, count: int
    ) -> np.ndarray:
        """Inputs (T, nu, K) of K = `count` seeds; seed k does not depend on how many follow."""
        low, high = np.tile(self.low, len(players)), np.tile(self.high, len(players))
        amplitude = rng.uniform(low, high, (count, players.n_inputs)).T
        return self.shape(horizon)[:, None, None] * amplitude


class CosineSeeds(SeedDistribution):
    """Amplitude times cos(pi k / T): first to one side, then to the other."""

    kind: Literal["cosine"] = "cosine"

    @override
    def shape(self, horizon: int) -> np.ndarray:
        return np.cos(np.pi * np.arange(horizon) / horizon)


class ConstantSeeds(SeedDistribution):
    """The amplitude at every step."""

    kind: Literal["constant"] = "constant"

    @override
    def shape(self, horizon: int) -> np.ndarray:
        return np.ones(horizon)
