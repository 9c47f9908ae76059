"""Equilibria that stay up to date while time goes on."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np
from typing_extensions import Self

from gameinfer_ros.solver.iterative_lq import IterativeLQ
from gameinfer_ros.solver.solution import Status
from gameinfer_ros.solver.strategy import Strategy


@dataclass(frozen=True, kw_only=True)
class Equilibria:
    """K particles: the seeds that they started from, and what was solved from each.

    The particle is the last axis of every array, also of those that a subclass adds.

    Attributes:
        seeds: inputs (T, nu, K) that the first solve starts from.
        strategy: newest strategies; `None` before the first solve.
        converged: whether each particle's newest strategy is a converged one (K,).
        updated: whether the last solve reached each particle (K,).
        iterations: iterations of each particle's warm start in the last solve (K,).
        unconverged_iterations: iterations in a row without convergence, over several solves (K,).
    """

    seeds: np.ndarray
    strategy: Strategy | None
    converged: np.ndarray
    updated: np.ndarray
    iterations: np.ndarray
    unconverged_iterations: np.ndarray

    @classmethod
    def from_seeds(cls, seeds: np.ndarray, **others: np.ndarray) -> Self:
        """Particles that have not been solved yet.

        Args:
            seeds: inputs (T, nu, K).
            others: what a subclass adds (..., K).
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
        """The particles with these indices (K',), in this order; an index may repeat."""
        index = np.asarray(index, dtype=int)
        if np.array_equal(index, np.arange(len(self))):
            return self
        taken: dict[str, Any] = {}
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, Strategy):
                taken[f.name] = value.take(index)
            elif value is not None:
                taken[f.name] = np.take(value, index, axis=-1)
        return replace(self, **taken)


Particles = TypeVar("Particles", bound=Equilibria)


class RecedingHorizon:
    """Re-solves equilibria from each new state as the horizon recedes.

    The last strategy is the warm start of the next solve, so the equilibrium that a seed led to is
    followed through time. A particle that cannot be solved is solved again from the zero seed (no
    inputs); if that fails too, it keeps its last strategy and is marked.

    Solving may be bounded. A particle that needs more iterations than it was granted resumes in
    the next call, and one that was not reached keeps its strategy until then; both are marked. A
    particle counts as one that cannot be solved only when it has not converged within `patience`
    iterations over several calls, or within those of one call if these are more. The zero seed may
    take several calls too: meanwhile it replaces the particle's last strategy.

    Args:
        solver: solver of the game.
        patience: number of iterations; by default, those that the solver's settings allow.
    """

    def __init__(self, solver: IterativeLQ, patience: int | None = None) -> None:
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

        The step may be any number of steps later than that of the last solve. Past the horizon of
        the last strategies, nothing that they say is of use: the seeds are used again. That solve,
        like the first one, is never bounded.

        Args:
            equilibria: the particles (K).
            step: the step that `x` belongs to.
            x: joint state.
            order: indices (K,) of the particles, the most important one first.
            max_iterations: granted to all particles or to each (K,) in this call; by default, as
                in the solver's settings.
            deadline: value of `time.perf_counter()` from which on no iteration begins.

        Returns:
            The same particles with strategies from `step` on.

        Raises:
            ValueError: the step is earlier than that of the last solve, `x` does not fit, or a
                particle is granted no iteration.
        """
        last, limit = equilibria.strategy, self._solver.settings.max_iterations
        if last is not None and step < last.first_step:
            raise ValueError(f"step {step} is earlier than step {last.first_step} of the last call")
        if last is None or step >= last.end:
            initial = Strategy.from_inputs(step, x, equilibria.seeds)
            max_iterations, deadline = limit, np.inf
        else:
            initial = last
        granted = np.full(len(equilibria), limit)
        if max_iterations is not None:
            granted = np.minimum(granted, max_iterations)
        solution = self._solver.solve(x, initial, order, granted, deadline, step)
        strategy, status = solution.strategy, solution.status
        updated = status != Status.NOT_REACHED
        converged = np.where(updated, solution.converged, equilibria.converged)
        in_a_row = np.where(converged, 0, equilibria.unconverged_iterations + solution.iterations)
        patience = np.maximum(granted, self._patience)
        unfinished = (status == Status.ITERATION_LIMIT) & (in_a_row < patience)
        lost = np.flatnonzero(updated & ~converged & ~unfinished)
        if len(lost):
            zero = Strategy.from_inputs(step, x, np.zeros_like(equilibria.seeds[..., :1]))
            again = self._solver.solve(x, zero, None, int(granted[lost].max()), deadline)
            begun = (again.status == Status.ITERATION_LIMIT) & (again.iterations < limit)
            if again.converged[0] or begun[0]:
                instead = again.strategy.take([0] * len(lost))
            else:
                instead = self._solver.play_out(x, initial.take(lost).advanced(step))
            for j, particle in enumerate(lost.tolist()):
                strategy.assign(particle, instead, j)
            converged[lost], in_a_row[lost] = again.converged[0], 0
        return replace(
            equilibria,
            strategy=strategy,
            converged=converged,
            updated=updated,
            iterations=solution.iterations,
            unconverged_iterations=in_a_row,
        )
