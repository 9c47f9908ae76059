"""Seeds: initial strategies, each of which represents the equilibrium that it leads to."""

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
    """A distribution of seeds, the strategies that the solver starts from.

    A seed has no feedback. Each of its inputs is an amplitude, drawn uniformly between `low` and
    `high`, times a shape over the horizon. The amplitudes of players and inputs are independent.
    """

    family: ClassVar[dict[str, type[Kind]]] = {}
    kind: str
    low: tuple[Real, ...] = Field(
        description="lowest amplitudes, one for each input of a player, in the unit of the input"
    )
    high: tuple[Real, ...] = Field(
        description="highest amplitudes, one for each input of a player, in the unit of the input"
    )

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if len(self.low) != len(self.high):
            raise ValueError(f"low {self.low} and high {self.high} must have the same length")
        if any(low > high for low, high in zip(self.low, self.high, strict=True)):
            raise ValueError(f"low {self.low} must not be above high {self.high}")
        return self

    @abstractmethod
    def shape(self, horizon: int) -> np.ndarray:
        """Return the factor (T,) of the amplitudes at each step of a horizon of T steps."""

    def check(self, players: Players) -> None:
        """Check that there is one amplitude for each input of every player.

        Raises:
            ValueError: a player has another number of inputs.
        """
        for dynamics in players.dynamics:
            check_length("low", self.low, dynamics.input_names)

    def sample(
        self, rng: np.random.Generator, players: Players, horizon: int, count: int
    ) -> np.ndarray:
        """Draw the inputs (T, nu, K) of K = `count` seeds; seed k does not depend on `count`."""
        low, high = np.tile(self.low, len(players)), np.tile(self.high, len(players))
        amplitude = rng.uniform(low, high, (count, players.n_inputs)).T
        return self.shape(horizon)[:, None, None] * amplitude


class CosineSeeds(SeedDistribution):
    """Seeds whose inputs are the amplitude times cos(pi k / T) at step k of a horizon T.

    The inputs change their sign in the middle of the horizon.
    """

    kind: Literal["cosine"] = "cosine"

    @override
    def shape(self, horizon: int) -> np.ndarray:
        return np.cos(np.pi * np.arange(horizon) / horizon)


class ConstantSeeds(SeedDistribution):
    """Seeds whose inputs are the amplitude at every step."""

    kind: Literal["constant"] = "constant"

    @override
    def shape(self, horizon: int) -> np.ndarray:
        return np.ones(horizon)
