"""Equilibria kept up to date while time goes on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gameinfer_ros.solver.iterative_lq import IterativeLQ
from gameinfer_ros.solver.solution import Status
from gameinfer_ros.solver.strategy import Strategy


class RecedingHorizon:
    """K equilibria, each found from its own seed and then re-solved as the horizon recedes.

    The last strategy is the warm start of the next solve, so the equilibrium a seed led to is
    followed through time. A particle that cannot be solved is solved again from the zero seed (no
    inputs); if that fails too, it keeps its last strategy and is marked.

    Solving may be bounded. A particle that needs more iterations than it was granted goes on
    where it stopped in the next call, and one that was not reached keeps its strategy until then;
    both are marked. Only when it has not converged within `patience` iterations over several
    calls, or within those of one call if that are more, it counts as one that cannot be solved.
    The zero seed may take several calls too: it then stands in for the particle's last strategy.

    Args:
        solver: the solver of the game.
        seeds: inputs (T, nu, K) that the first solve starts from.
        patience: number of iterations; those that the solver's settings allow if not given.

    Attributes:
        strategy: the newest strategies; `None` before the first solve.
        converged: whether each particle's newest strategy is a converged one (K,).
        updated: whether the last call reached each particle (K,).
        iterations: iterations that the warm start of each particle took in the last call (K,).
    """

    def __init__(self, solver: IterativeLQ, seeds: np.ndarray, patience: int | None = None) -> None:
        self._solver = solver
        limit = solver.settings.max_iterations
        self._patience = min(patience or limit, limit)
        self._seeds = seeds
        K = seeds.shape[2]
        self.strategy: Strategy | None = None
        self.converged = np.zeros(K, dtype=bool)
        self.updated = np.zeros(K, dtype=bool)
        self.iterations = np.zeros(K, dtype=int)
        self._iterations_in_a_row = np.zeros(K, dtype=int)  # without convergence

    def __len__(self) -> int:
        """Number of particles K."""
        return len(self.converged)

    def solve(
        self,
        step: int,
        x: np.ndarray,
        order: np.ndarray | None = None,
        max_iterations: int | np.ndarray | None = None,
        deadline: float = np.inf,
    ) -> Strategy:
        """Re-solve every particle from the state `x` (nx,) at `step`.

        The step may be any number of steps later than that of the last call. What the last
        strategies say of it is lost if it is past their horizon: the seeds are used again. That,
        like the first solve, is never bounded.

        Args:
            step: the step that `x` belongs to.
            x: state.
            order: indices (K,) of the particles, the most important one first.
            max_iterations: granted to all particles or to each (K,) in this call; as in the
                solver's settings if not given.
            deadline: value of `time.perf_counter()` from which on no iteration begins.

        Raises:
            ValueError: the step is earlier than that of the last call, `x` does not fit, or a
                particle is granted no iteration.
        """
        last, limit = self.strategy, self._solver.settings.max_iterations
        if last is not None and step < last.first_step:
            raise ValueError(f"step {step} is earlier than step {last.first_step} of the last call")
        if last is None or step >= last.end:
            initial = Strategy.from_inputs(step, x, self._seeds)
            max_iterations, deadline = limit, np.inf
        else:
            initial = last
        granted = np.full(len(self), limit)
        if max_iterations is not None:
            granted = np.minimum(granted, max_iterations)
        solution = self._solver.solve(x, initial, order, granted, deadline, step)
        strategy, status = solution.strategy, solution.status
        self.updated = status != Status.NOT_REACHED
        converged = np.where(self.updated, solution.converged, self.converged)
        in_a_row = np.where(converged, 0, self._iterations_in_a_row + solution.iterations)
        patience = np.maximum(granted, self._patience)
        unfinished = (status == Status.ITERATION_LIMIT) & (in_a_row < patience)
        lost = np.flatnonzero(self.updated & ~converged & ~unfinished)
        if len(lost):
            zero = Strategy.from_inputs(step, x, np.zeros_like(self._seeds[..., :1]))
            again = self._solver.solve(x, zero, None, int(granted[lost].max()), deadline)
            begun = (again.status == Status.ITERATION_LIMIT) & (again.iterations < limit)
            if again.converged[0] or begun[0]:
                instead = again.strategy.take([0] * len(lost))
            else:
                instead = self._solver.play_out(x, initial.take(lost).advanced(step))
            for j, particle in enumerate(lost.tolist()):
                strategy.assign(particle, instead, j)
            converged[lost], in_a_row[lost] = again.converged[0], 0
        self.strategy, self.converged, self._iterations_in_a_row = strategy, converged, in_a_row
        self.iterations = solution.iterations
        return strategy

    def keep(self, particles: Sequence[int] | np.ndarray) -> None:
        """Go on with the particles with these indices only."""
        particles = np.asarray(particles, dtype=int)
        self._seeds = np.take(self._seeds, particles, axis=-1)
        self.converged = self.converged[particles]
        self.updated = self.updated[particles]
        self.iterations = self.iterations[particles]
        self._iterations_in_a_row = self._iterations_in_a_row[particles]
        if self.strategy is not None:
            self.strategy = self.strategy.take(particles)
