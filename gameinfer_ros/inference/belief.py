"""A belief over equilibria, carried by particles."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import njit

from gameinfer_ros.games import ROBOT
from gameinfer_ros.inference.observation import GaussianObservation
from gameinfer_ros.inference.particles import Particles
from gameinfer_ros.inference.seeds import SeedDistribution
from gameinfer_ros.inference.settings import BeliefSettings
from gameinfer_ros.inference.transition import predict
from gameinfer_ros.lanes.lanes import Array
from gameinfer_ros.solver import IterativeLQ, RecedingHorizon, Strategy, brake


class MapEquilibrium(NamedTuple):
    """The most likely equilibrium.

    Attributes:
        particle: number of the seed that it comes of; `NO_PARTICLE` if all brake.
        probability: its weight.
        strategy: strategies (of one particle) of all players.
    """

    particle: int
    probability: float
    strategy: Strategy


#: Stands for the number of a particle where there is none to speak of.
NO_PARTICLE = -1


class Belief:
    """Particles, each an equilibrium, with log weights (Peters et al. 2020, algorithm 1).

    At every step, call `weigh` with the states before and after, then `combine_duplicates`, and
    read the result; then call `solve` with the newest state. Only `solve` takes long: a strategy
    is available before the equilibria are brought up to date, and if there is no time for that,
    any number of states can be weighed one after the other with the strategies there are.

    A call of `solve` can be bounded, by iterations and by a deadline. The heaviest particles come
    first then, those that are solved already take one or two iterations, and what remains undone
    is gone on with in the next call. A particle is settled if the last call found its equilibrium
    anew; what is played is the equilibrium of a settled one, or the one that was played before.

    Args:
        solver: solver of the game that all play.
        seeds: distribution that the seeds are drawn from.
        settings: number of particles and tolerances.
        rng: where the seeds come from.
        robot_plays: whether the robot goes its own way. Then the humans' states alone are
            weighed; else the robot only watches, and the states of all players are.

    Attributes:
        particles: the particles.
    """

    def __init__(
        self,
        solver: IterativeLQ,
        seeds: SeedDistribution,
        settings: BeliefSettings,
        rng: np.random.Generator,
        robot_plays: bool = True,
    ) -> None:
        self._solver, self.game = solver, solver.game
        self.settings = settings
        players, count = self.game.players, settings.particles
        self._horizon = RecedingHorizon(solver, settings.patience)
        self.particles = Particles.equally_probable(
            seeds.sample(rng, players, self.game.horizon, count)
        )
        self._robot_plays = robot_plays
        first_row = players.states(ROBOT).stop if robot_plays else 0
        self._observation = GaussianObservation(
            settings.observation_noise, np.arange(first_row, players.n_states)
        )
        self._before: MapEquilibrium  # the solve: what was the MAP, and until which step
        self._before_ends = -1
        _first_alike(np.zeros((1, 1)), self.ids[:0], 0, 0.0)  # compiled before time matters

    def __len__(self) -> int:
        """Number of particles K that are left."""
        return len(self.particles)

    @property
    def ids(self) -> np.ndarray:
        """Number of the seed that each particle represents (K,)."""
        return self.particles.ids

    @property
    def log_weights(self) -> np.ndarray:
        """Normalised logarithm of each particle's probability (K,)."""
        return self.particles.log_weights

    @property
    def strategy(self) -> Strategy:
        """Strategies of all particles.

        Raises:
            RuntimeError: `solve` has not been called.
        """
        if self.particles.strategy is None:
            raise RuntimeError("the belief has no strategies before its first solve")
        return self.particles.strategy

    @property
    def converged(self) -> np.ndarray:
        """Whether each particle's strategy is a converged one (K,)."""
        return self.particles.converged

    @property
    def costs(self) -> np.ndarray:
        """Cost of each particle's trajectory to each player, along its horizon (N, K)."""
        strategy = self.strategy
        per_step = self.game.costs(strategy.x_ref, strategy.u_ref, strategy.first_step)
        return np.asarray(per_step.sum(axis=1))

    @property
    def iterations(self) -> np.ndarray:
        """Iterations that the last solve took for each particle (K,)."""
        return self.particles.iterations

    @property
    def weights(self) -> np.ndarray:
        """Probability of each particle (K,)."""
        return self.particles.weights

    @property
    def effective_sample_size(self) -> float:
        """1 / sum_k w_k^2: how many particles share the belief."""
        return float(1.0 / np.sum(self.weights**2))

    @property
    def updated(self) -> np.ndarray:
        """Whether the last solve reached each particle (K,)."""
        return self.particles.updated

    @property
    def settled(self) -> np.ndarray:
        """Whether the last solve found each particle's equilibrium anew (K,)."""
        return self.updated & self.converged

    @property
    def map_index(self) -> int | None:
        """Index of the heaviest of the settled particles; None if all of them are impossible."""
        candidates = np.where(self.settled, self.log_weights, -np.inf)
        heaviest = int(np.argmax(candidates))
        return None if np.isneginf(candidates[heaviest]) else heaviest

    @property
    def equilibrium(self) -> MapEquilibrium:
        """The equilibrium of the MAP particle, from the step of the last solve on.

        If that solve did not settle the particle that was the MAP before it, what is known of its
        equilibrium stays valid for its horizon: it is the one, as long as it is more probable than
        the settled ones. Where there is neither, everybody brakes.

        Raises:
            RuntimeError: `solve` has not been called.
        """
        strategy, heaviest, weights = self.strategy, self.map_index, self.weights
        before = self._before.particle
        probability = float(weights[self.ids == before].sum())
        if heaviest is None or weights[heaviest] < probability:
            return MapEquilibrium(before, probability, self._before.strategy)
        return MapEquilibrium(
            int(self.ids[heaviest]), float(weights[heaviest]), strategy.take([heaviest])
        )

    def solve(self, step: int, x: np.ndarray, deadline: float = np.inf) -> None:
        """Re-solve the game for the particles, as far as the bounds allow.

        Args:
            step: the step that `x` belongs to.
            x: joint state (nx,).
            deadline: value of `time.perf_counter()` from which on no iteration begins. The first
                solve does not heed it, nor does one after the end of the strategies' horizon.
        """
        before = None if self.particles.strategy is None else self.equilibrium
        if before is not None and before.strategy is not self._before.strategy:
            self._before_ends = before.strategy.end
        all_allowed = self._solver.settings.max_iterations
        light = self.settings.max_iterations or all_allowed
        granted = np.where(self.weights < self.settings.heavy, light, all_allowed)
        order = np.argsort(-self.log_weights, kind="stable")
        self.particles = self._horizon.solve(self.particles, step, x, order, granted, deadline)
        if before is not None and step < self._before_ends and before.strategy.finite.all():
            self._before = before._replace(strategy=before.strategy.advanced(step))
        else:
            self._before = MapEquilibrium(NO_PARTICLE, 0.0, brake(self.game, step, x))

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
            self._set_log_weights(log_weights)

    def combine_duplicates(self) -> None:
        """Make one particle of those with the same trajectories, and add up their weights.

        The heaviest of them stays, or the heaviest that is settled if there is one.
        """
        trajectories, _, _ = self.strategy.flat
        log_weights = self.log_weights.copy()
        kept: list[int] = []
        for k in np.lexsort((-self.log_weights, ~self.settled)).tolist():
            same = _first_alike(
                trajectories, np.array(kept, dtype=int), k, self.settings.duplicate_tolerance
            )
            if same >= 0:
                log_weights[same] = np.logaddexp(log_weights[same], log_weights[k])
                if self._before.particle == self.ids[k]:
                    self._before = self._before._replace(particle=int(self.ids[same]))
            else:
                kept.append(k)
        kept.sort()
        self.particles = self.particles.take(kept)
        self._set_log_weights(log_weights[kept])

    def _set_log_weights(self, log_weights: np.ndarray) -> None:
        # Rounding must not make a probability larger than 1.
        normalised = np.minimum(log_weights - np.logaddexp.reduce(log_weights), 0.0)
        self.particles = replace(self.particles, log_weights=normalised)


@njit(cache=True)
def _first_alike(trajectories: Array, among: Array, k: int, tolerance: float) -> int:
    """The first of these trajectories that nowhere differs by more from the k-th; -1 if none.

    Args:
        trajectories: all of them (K, rows).
        among: indices of those that are compared.
        k: index of the one that they are compared with.
        tolerance: how much a number may differ.
    """
    rows = trajectories.shape[1]
    for other in among:
        alike = True
        # Most differ in the middle: both start from the same state, and many end at a goal.
        for j in range(rows):
            row = (j + rows // 2) % rows
            if not abs(trajectories[other, row] - trajectories[k, row]) <= tolerance:
                alike = False
                break
        if alike:
            return other
    return -1
