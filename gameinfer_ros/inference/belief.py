"""A belief over equilibria, carried by particles."""

from __future__ import annotations

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from gameinfer_ros.games import ROBOT
from gameinfer_ros.games.registry import NonNegative, Positive, PositiveInteger
from gameinfer_ros.inference.observation import GaussianObservation
from gameinfer_ros.inference.seeds import SeedDistribution
from gameinfer_ros.inference.transition import predict
from gameinfer_ros.solver import IterativeLQ, RecedingHorizon, Strategy


class BeliefSettings(BaseModel):
    """Settings of the belief."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    particles: PositiveInteger = Field(default=50, description="number of seeds drawn at the start")
    observation_noise: Positive = Field(
        default=0.1, description="standard deviation of each observed state component"
    )
    duplicate_tolerance: NonNegative = Field(
        default=0.1,
        description="particles are one if no state component differs by more along the horizon",
    )


class Belief:
    """Particles, each an equilibrium, with log weights (Peters et al. 2020, algorithm 1).

    At every step, call `weigh` with the states before and after, then `combine_duplicates`, and
    read the result; then call `solve` with the newest state. Only `solve` takes long: a strategy
    is available before the equilibria are brought up to date, and if there is no time for that,
    any number of states can be weighed one after the other with the strategies there are.

    Args:
        solver: solver of the game that all play.
        seeds: distribution that the seeds are drawn from.
        settings: number of particles and tolerances.
        rng: where the seeds come from.
        robot_plays: whether the robot goes its own way. Then the humans' states alone are
            weighed; else the robot only watches, and the states of all players are.

    Attributes:
        ids: number of the seed that each particle stands for (K,).
        log_weights: normalised logarithm of each particle's probability (K,).
    """

    def __init__(
        self,
        solver: IterativeLQ,
        seeds: SeedDistribution,
        settings: BeliefSettings,
        rng: np.random.Generator,
        robot_plays: bool = True,
    ) -> None:
        self.game = solver.game
        self.settings = settings
        players, count = self.game.players, settings.particles
        self._equilibria = RecedingHorizon(
            solver, seeds.sample(rng, players, self.game.horizon, count)
        )
        self._robot_plays = robot_plays
        first_row = players.states(ROBOT).stop if robot_plays else 0
        self._observation = GaussianObservation(
            settings.observation_noise, np.arange(first_row, players.n_states)
        )
        self.ids = np.arange(count)
        self.log_weights = np.full(count, -np.log(count))

    def __len__(self) -> int:
        """Number of particles K that are left."""
        return len(self.ids)

    @property
    def strategy(self) -> Strategy:
        """Strategies of all particles.

        Raises:
            RuntimeError: `solve` has not been called.
        """
        if self._equilibria.strategy is None:
            raise RuntimeError("the belief has no strategies before its first solve")
        return self._equilibria.strategy

    @property
    def converged(self) -> np.ndarray:
        """Whether each particle's strategy is a converged one (K,)."""
        return self._equilibria.converged

    @property
    def costs(self) -> np.ndarray:
        """Cost of each particle's trajectory to each player, along its horizon (N, K)."""
        strategy = self.strategy
        per_step = self.game.costs(strategy.x_ref, strategy.u_ref, strategy.first_step)
        return np.asarray(per_step.sum(axis=1))

    @property
    def iterations(self) -> np.ndarray:
        """Iterations that the last solve took for each particle (K,)."""
        return self._equilibria.iterations

    @property
    def weights(self) -> np.ndarray:
        """Probability of each particle (K,)."""
        return np.exp(self.log_weights)

    @property
    def effective_sample_size(self) -> float:
        """1 / sum_k w_k^2: how many particles share the belief."""
        return float(1.0 / np.sum(self.weights**2))

    @property
    def map(self) -> int:
        """Index of the heaviest of the converged particles (of all if none converged)."""
        candidates = np.where(self.converged, self.log_weights, -np.inf)
        if np.isneginf(candidates).all():
            candidates = self.log_weights
        return int(np.argmax(candidates))

    def solve(self, step: int, x: np.ndarray) -> None:
        """Re-solve the game for every particle from the state `x` (nx,) at `step`."""
        self._equilibria.solve(step, x)

    def weigh(
        self, step: int, x: np.ndarray, x_next: np.ndarray, u_robot: np.ndarray | None = None
    ) -> None:
        """Multiply each weight by the likelihood of what happened.

        Args:
            step: the step that `x` belongs to; it must be in the horizon of `strategy`.
            x: joint state (nx,).
            x_next: joint state (nx,) one step later.
            u_robot: input (m_0,) that the robot really applied; needed if the robot plays.

        Raises:
            ValueError: the robot plays and `u_robot` is missing.
        """
        if self._robot_plays and u_robot is None:
            raise ValueError("the robot plays, so its real input is needed")
        x_hat = predict(self.game, self.strategy, step, x, u_robot if self._robot_plays else None)
        log_weights = self.log_weights + self._observation.log_likelihood(x_next, x_hat)
        if np.isfinite(log_weights).any():
            self.log_weights = _normalised(log_weights)

    def combine_duplicates(self) -> None:
        """Make one particle of those with the same trajectories, and add up their weights.

        The heaviest of them stays, or the heaviest that converged if there is one.
        """
        trajectories = np.moveaxis(self.strategy.x_ref, -1, 0).reshape(len(self), -1)
        log_weights = self.log_weights.copy()
        kept: list[int] = []
        for k in np.lexsort((-self.log_weights, ~self.converged)).tolist():
            difference = np.abs(trajectories[kept] - trajectories[k]).max(axis=1, initial=0.0)
            same = np.flatnonzero(difference <= self.settings.duplicate_tolerance)
            if len(same):
                first = kept[same[0]]
                log_weights[first] = np.logaddexp(log_weights[first], log_weights[k])
            else:
                kept.append(k)
        kept.sort()
        self._equilibria.keep(kept)
        self.ids, self.log_weights = self.ids[kept], _normalised(log_weights[kept])


def _normalised(log_weights: np.ndarray) -> np.ndarray:
    # Rounding must not make a probability larger than 1.
    return np.minimum(log_weights - np.logaddexp.reduce(log_weights), 0.0)
