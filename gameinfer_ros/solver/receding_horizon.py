"""Equilibria kept up to date while time goes on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gameinfer_ros.solver.iterative_lq import IterativeLQ
from gameinfer_ros.solver.strategy import Strategy


class RecedingHorizon:
    """K equilibria, each found from its own seed and then re-solved as the horizon recedes.

    The last strategy is the warm start of the next solve, so the equilibrium a seed led to is
    followed through time. A particle whose solve does not converge is solved again from the zero
    seed (no inputs); if that fails too, it keeps its last strategy and is marked.

    Args:
        solver: the solver of the game.
        seeds: inputs (T, nu, K) that the first solve starts from.

    Attributes:
        strategy: the newest strategies; `None` before the first solve.
        converged: whether each particle's newest strategy is a converged one (K,).
        iterations: iterations that the warm start of each particle took in the last call (K,).
    """

    def __init__(self, solver: IterativeLQ, seeds: np.ndarray) -> None:
        self._solver = solver
        self._seeds = seeds
        self.strategy: Strategy | None = None
        self.converged = np.zeros(seeds.shape[2], dtype=bool)
        self.iterations = np.zeros(seeds.shape[2], dtype=int)

    def __len__(self) -> int:
        """Number of particles K."""
        return len(self.converged)

    def solve(self, step: int, x: np.ndarray) -> Strategy:
        """Re-solve every particle from the state `x` (nx,) at `step`.

        The step may be any number of steps later than that of the last call. What the last
        strategies say of it is lost if it is past their horizon: the seeds are used again.

        Raises:
            ValueError: the step is earlier than that of the last call, or `x` does not fit.
        """
        last = self.strategy
        if last is not None and step < last.first_step:
            raise ValueError(f"step {step} is earlier than step {last.first_step} of the last call")
        if last is None or step >= last.end:
            initial = Strategy.from_inputs(step, x, self._seeds)
        else:
            initial = last.advanced(step)
        solution = self._solver.solve(x, initial)
        strategy, converged = solution.strategy, solution.converged
        if not converged.all():
            zero = Strategy.from_inputs(step, x, np.zeros_like(self._seeds[..., :1]))
            again = self._solver.solve(x, zero)
            lost = np.flatnonzero(~converged)
            if again.converged[0]:
                instead = again.strategy.take([0] * len(lost))
            else:
                instead = self._solver.play_out(x, initial.take(lost))
            for j, particle in enumerate(lost.tolist()):
                strategy.assign(particle, instead, j)
            converged = converged | again.converged[0]
        self.strategy, self.converged = strategy, converged
        self.iterations = solution.iterations
        return strategy

    def keep(self, particles: Sequence[int] | np.ndarray) -> None:
        """Go on with the particles with these indices only."""
        self._seeds = np.take(self._seeds, particles, axis=-1)
        self.converged = self.converged[particles]
        self.iterations = self.iterations[particles]
        if self.strategy is not None:
            self.strategy = self.strategy.take(particles)
