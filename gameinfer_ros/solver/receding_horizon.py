"""Equilibria that are re-solved as the horizon recedes."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np
from typing_extensions import Self

from gameinfer_ros.solver.game_solver import GameSolver
from gameinfer_ros.solver.solution import Status
from gameinfer_ros.solver.strategy import Strategy


@dataclass(frozen=True, kw_only=True)
class Equilibria:
    """K particles: their seeds, and the strategies that were solved from them.

    The particle is the last axis of every array, including those that a subclass adds.

    Attributes:
        seeds: inputs (T, nu, K) from which the first solve starts.
        strategy: newest strategies; `None` before the first solve.
        converged: whether each particle's newest strategy has converged, or is good enough for one
            step (K,).
        updated: whether the last solve reached each particle (K,).
        iterations: number of iterations of each particle in the last solve, without those from
            the zero seed (K,).
        unconverged_iterations: number of consecutive iterations without convergence, over several
            solves (K,).
    """

    seeds: np.ndarray
    strategy: Strategy | None
    converged: np.ndarray
    updated: np.ndarray
    iterations: np.ndarray
    unconverged_iterations: np.ndarray

    @classmethod
    def from_seeds(cls, seeds: np.ndarray, **others: np.ndarray) -> Self:
        """Create particles that have not been solved yet.

        Args:
            seeds: inputs (T, nu, K).
            others: attributes (..., K) that a subclass adds.
        """
        K = seeds.shape[-1]
        return cls(
            seeds=seeds,
            strategy=None,
            converged=np.zeros(K, dtype=bool),
            updated=np.zeros(K, dtype=bool),
            iterations=np.zeros(K, dtype=int),
            unconverged_iterations=np.zeros(K, dtype=int),
            **others,
        )

    def __len__(self) -> int:
        """Number of particles K."""
        return int(self.seeds.shape[-1])

    def take(self, index: np.ndarray | list[int]) -> Self:
        """Return the particles with these indices (K',), in this order; an index may repeat."""
        index = np.asarray(index, dtype=int)
        if np.array_equal(index, np.arange(len(self))):
            return self
        names = (f.name for f in fields(self) if f.name != "strategy")
        arrays: dict[str, Any] = {n: np.take(getattr(self, n), index, axis=-1) for n in names}
        strategy = None if self.strategy is None else self.strategy.take(index)
        return replace(self, strategy=strategy, **arrays)


Particles = TypeVar("Particles", bound=Equilibria)


class RecedingHorizon:
    """Re-solves equilibria from each new state, as the horizon recedes.

    Each particle's last strategy is the warm start of its next solve, so the particle keeps to the
    equilibrium of its seed. A particle that fails restarts from the zero seed (no inputs). If that
    fails too, it keeps its last strategy and is marked as not converged.

    A call can be bounded by iterations and by a deadline. A particle that needs more iterations
    resumes in the next call; until then, it is marked as not converged. A particle that the call
    did not reach keeps its strategy and is marked as not updated. A particle that does not converge
    fails after `patience` consecutive iterations, over several calls, or after those granted in
    one call if these are more. A restart may take several calls too; its unfinished strategies
    replace the particle's last ones.

    Args:
        solver: solver of the game.
        patience: number of iterations; by default, and at most, the solver's `max_iterations`.
    """

    def __init__(self, solver: GameSolver, patience: int | None = None) -> None:
        self._solver = solver
        limit = solver.settings.max_iterations
        self._patience = min(patience or limit, limit)

    def solve(
        self,
        equilibria: Particles,
        step: int,
        x: np.ndarray,
        order: np.ndarray | None = None,
        max_iterations: int | np.ndarray | None = None,
        deadline: float = np.inf,
    ) -> Particles:
        """Re-solve every particle from the state `x` (nx,) at `step`.

        The first solve starts from the seeds, and so does one past the horizon of the last
        strategies. Both ignore the bounds.

        Args:
            equilibria: the particles (K).
            step: step of `x`, not earlier than that of the last solve.
            x: joint state (nx,).
            order: indices (K,) of the particles in order of priority.
            max_iterations: maximum number of iterations in this call, of all particles or of each
                one (K,); by default, and at most, the solver's `max_iterations`.
            deadline: value of `time.perf_counter()` after which no iteration starts.

        Returns:
            The same particles with strategies from `step` on.

        Raises:
            ValueError: `step` is earlier than that of the last solve, `x` does not fit the game,
                or `max_iterations` is below 1.
        """
        initial, limit = equilibria.strategy, self._solver.settings.max_iterations
        if initial is not None and step < initial.first_step:
            raise ValueError(
                f"step: {step} is not allowed: it must be at least {initial.first_step}, the step "
                "of the last solve"
            )
        if initial is None or step >= initial.end:
            initial = Strategy.from_inputs(step, x, equilibria.seeds)
            max_iterations, deadline = None, np.inf
        bound = limit if max_iterations is None else max_iterations
        granted = np.minimum(np.full(len(equilibria), limit), bound)
        solution = self._solver.solve(x, initial, order, granted, deadline, step, for_one_step=True)
        strategy, status = solution.strategy, solution.status
        updated = status != Status.NOT_REACHED
        converged = np.where(updated, solution.usable, equilibria.converged)
        in_a_row = np.where(converged, 0, equilibria.unconverged_iterations + solution.iterations)
        patience = np.maximum(granted, self._patience)
        unfinished = (status == Status.ITERATION_LIMIT) & (in_a_row < patience)
        failed = np.flatnonzero(updated & ~converged & ~unfinished)
        if len(failed):
            restarted, converged[failed] = self._restart(
                initial.take(failed), step, x, int(granted[failed].max()), deadline
            )
            strategy.assign(failed, restarted, slice(None))
            in_a_row[failed] = 0
        return replace(
            equilibria,
            strategy=strategy,
            converged=converged,
            updated=updated,
            iterations=solution.iterations,
            unconverged_iterations=in_a_row,
        )

    def _restart(
        self, failed: Strategy, step: int, x: np.ndarray, max_iterations: int, deadline: float
    ) -> tuple[Strategy, bool]:
        """Solve the game from the zero seed, in place of particles that failed.

        Returns strategies for these particles, and whether they converged. They are those from the
        zero seed, or `failed`, their strategies before this call, if that fails too.
        """
        zero = Strategy.from_inputs(step, x, np.zeros_like(failed.u_ref[..., :1]))
        solution = self._solver.solve(x, zero, None, max_iterations, deadline)
        converged, limit = bool(solution.converged[0]), self._solver.settings.max_iterations
        unfinished = (solution.status == Status.ITERATION_LIMIT) & (solution.iterations < limit)
        if converged or unfinished[0]:
            return solution.strategy.take([0] * len(failed)), converged
        return self._solver.play_out(x, failed.advanced(step)), False
