"""A belief over equilibria, represented by particles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from threading import RLock
from typing import Concatenate, NamedTuple, ParamSpec, TypeVar

import numpy as np

from gameinfer_ros.games import ROBOT
from gameinfer_ros.inference.observation import GaussianObservation
from gameinfer_ros.inference.particles import Particles
from gameinfer_ros.inference.seeds import SeedDistribution
from gameinfer_ros.inference.settings import BeliefSettings
from gameinfer_ros.inference.transition import predict
from gameinfer_ros.solver import GameSolver, RecedingHorizon, Strategy, brake

#: Particle number that stands for no particle: no equilibrium is known, and all players brake.
NO_PARTICLE = -1


_P = ParamSpec("_P")
_R = TypeVar("_R")


class MapEquilibrium(NamedTuple):
    """The most likely equilibrium (maximum a posteriori).

    Attributes:
        particle: number of its seed; `NO_PARTICLE` if all players brake.
        probability: weight of the particle.
        strategy: strategies (of one particle) of all players.
    """

    particle: int
    probability: float
    strategy: Strategy


def _exclusive(
    method: Callable[Concatenate[Belief, _P], _R],
) -> Callable[Concatenate[Belief, _P], _R]:
    """Refuse to call a method of a belief that another thread is using."""

    @wraps(method)
    def call(self: Belief, /, *args: _P.args, **kwargs: _P.kwargs) -> _R:
        if not self._in_use.acquire(blocking=False):
            raise RuntimeError(
                f"the belief is in use by another thread, so {method.__name__} is not allowed: "
                "call its methods one after the other"
            )
        try:
            return method(self, *args, **kwargs)
        finally:
            self._in_use.release()

    return call


class Belief:
    """A set of weighted particles, each an equilibrium (Peters et al. 2020, algorithm 1).

    Call `solve` with the first state. At every step, call `weigh` with the last two states and
    then `combine_duplicates`, read the result, and call `solve` with the newest state. Only
    `solve` takes long. The robot can act before it; if time is short, several states can be
    weighed before the next `solve`.

    `solve` can be bounded by iterations and by a deadline. It then starts with the heaviest
    particles and resumes unfinished ones in the next call. A particle is *settled* if the last
    `solve` reached it and it converged, so that its equilibrium belongs to the newest state. The
    MAP equilibrium is that of a settled particle, or the previous one; see `equilibrium`.

    Only one thread at a time may use a belief; a method raises `RuntimeError` while another thread
    is in one.

    Args:
        solver: solver of the game.
        seeds: distribution of the seeds.
        settings: number of particles and tolerances.
        rng: generator that draws the seeds.
        robot_plays: whether the robot acts on its own. If so, only the states of the humans are
            weighed. If not, the robot only watches, and the states of all players are weighed.

    Attributes:
        particles: the particles.
    """

    def __init__(
        self,
        solver: GameSolver,
        seeds: SeedDistribution,
        settings: BeliefSettings,
        rng: np.random.Generator,
        robot_plays: bool = True,
    ) -> None:
        self._in_use = RLock()
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
            settings.observation_noise, np.arange(first_row, players.n_states), players.is_angle
        )
        #: The MAP equilibrium before the last solve, and the end of its horizon.
        self._previous: MapEquilibrium
        self._previous_end = -1
        from gameinfer_ros.inference.duplicates import first_duplicate

        self._first_duplicate = first_duplicate
        # Compile before time matters.
        first_duplicate(np.zeros((1, 1)), self.ids[:0], 0, 0.0, players.is_angle)

    def __len__(self) -> int:
        """Number of remaining particles K."""
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
            raise RuntimeError("the belief has no strategies yet: call solve first")
        return self.particles.strategy

    @property
    def converged(self) -> np.ndarray:
        """Whether each particle's newest strategy has converged (K,)."""
        return self.particles.converged

    @property
    def costs(self) -> np.ndarray:
        """Cost of each particle's trajectory for each player, summed over the horizon (N, K)."""
        strategy = self.strategy
        per_step = self.game.costs(strategy.x_ref, strategy.u_ref, strategy.first_step)
        return np.asarray(per_step.sum(axis=1))

    @property
    def iterations(self) -> np.ndarray:
        """Number of iterations of each particle in the last solve (K,)."""
        return self.particles.iterations

    @property
    def weights(self) -> np.ndarray:
        """Probability of each particle (K,)."""
        return self.particles.weights

    @property
    def effective_sample_size(self) -> float:
        """1 / sum_k w_k^2: K if all weights are equal, 1 if one particle has all the weight."""
        return float(1.0 / np.sum(self.weights**2))

    @property
    def updated(self) -> np.ndarray:
        """Whether the last solve reached each particle (K,)."""
        return self.particles.updated

    @property
    def settled(self) -> np.ndarray:
        """Whether the last solve reached each particle and it converged (K,)."""
        return self.updated & self.converged

    @property
    def map_index(self) -> int | None:
        """Index of the heaviest settled particle; `None` if none has a probability above 0."""
        candidates = np.where(self.settled, self.log_weights, -np.inf)
        heaviest = int(np.argmax(candidates))
        return None if np.isneginf(candidates[heaviest]) else heaviest

    @property
    @_exclusive
    def equilibrium(self) -> MapEquilibrium:
        """The MAP equilibrium, from the step of the last solve on.

        It is that of the heaviest settled particle. If the previous MAP particle is not settled,
        its last known equilibrium remains in use until its horizon ends, while it is more probable
        than every settled particle. If there is neither, all players brake.

        Raises:
            RuntimeError: `solve` has not been called.
        """
        strategy, heaviest, weights = self.strategy, self.map_index, self.weights
        previous = self._previous.particle
        probability = float(weights[self.ids == previous].sum())
        if heaviest is None or weights[heaviest] < probability:
            return MapEquilibrium(previous, probability, self._previous.strategy)
        return MapEquilibrium(
            int(self.ids[heaviest]), float(weights[heaviest]), strategy.take([heaviest])
        )

    @_exclusive
    def solve(self, step: int, x: np.ndarray, deadline: float = np.inf) -> None:
        """Re-solve the game for the particles, within the bounds.

        Args:
            step: step of `x`.
            x: joint state (nx,).
            deadline: value of `time.perf_counter()` after which no iteration starts. It is ignored
                in the first solve and if `step` is past the horizon of the strategies.
        """
        previous = None if self.particles.strategy is None else self.equilibrium
        if previous is not None and previous.strategy is not self._previous.strategy:
            self._previous_end = previous.strategy.end
        limit = self._solver.settings.max_iterations
        light = self.settings.max_iterations or limit
        granted = np.where(self.weights < self.settings.heavy, light, limit)
        order = np.argsort(-self.log_weights, kind="stable")
        self.particles = self._horizon.solve(self.particles, step, x, order, granted, deadline)
        if previous is not None and step < self._previous_end and previous.strategy.finite.all():
            self._previous = previous._replace(strategy=previous.strategy.advanced(step))
        else:
            self._previous = MapEquilibrium(NO_PARTICLE, 0.0, brake(self.game, step, x))

    @_exclusive
    def weigh(
        self, step: int, x: np.ndarray, x_next: np.ndarray, u_robot: np.ndarray | None = None
    ) -> None:
        """Multiply each weight by the likelihood of the observed transition.

        If no particle could have led to `x_next`, the weights do not change.

        Args:
            step: step of `x`; the horizon of `strategy` must contain it.
            x: joint state (nx,).
            x_next: joint state (nx,) one step later.
            u_robot: input (m_0,) that the robot applied; required if the robot plays.

        Raises:
            ValueError: the robot plays and `u_robot` is `None`.
        """
        if self._robot_plays and u_robot is None:
            raise ValueError(
                "u_robot: None is not allowed: the robot plays, so the input that it applied is "
                "required"
            )
        x_hat = predict(self.game, self.strategy, step, x, u_robot if self._robot_plays else None)
        log_weights = self.log_weights + self._observation.log_likelihood(x_next, x_hat)
        if np.isfinite(log_weights).any():
            self._set_log_weights(log_weights)

    @_exclusive
    def combine_duplicates(self) -> None:
        """Merge particles with the same trajectories, and add their weights.

        Each group keeps its heaviest settled particle, or its heaviest one if none is settled.
        """
        trajectories, _, _ = self.strategy.flat
        tolerance, is_angle = self.settings.duplicate_tolerance, self.game.players.is_angle
        log_weights = self.log_weights.copy()
        kept: list[int] = []
        for k in np.lexsort((-self.log_weights, ~self.settled)).tolist():
            candidates = np.array(kept, dtype=int)
            same = self._first_duplicate(trajectories, candidates, k, tolerance, is_angle)
            if same >= 0:
                log_weights[same] = np.logaddexp(log_weights[same], log_weights[k])
                if self._previous.particle == self.ids[k]:
                    self._previous = self._previous._replace(particle=int(self.ids[same]))
            else:
                kept.append(k)
        kept.sort()
        self.particles = self.particles.take(kept)
        self._set_log_weights(log_weights[kept])

    def _set_log_weights(self, log_weights: np.ndarray) -> None:
        # Rounding could make a probability larger than 1.
        normalised = np.minimum(log_weights - np.logaddexp.reduce(log_weights), 0.0)
        self.particles = replace(self.particles, log_weights=normalised)
