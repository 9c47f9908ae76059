"""How long the parts of an iteration take."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.experiments.dgemm import Dgemm
from gameinfer_ros.experiments.effort import Effort
from gameinfer_ros.experiments.stopwatch import median_ms, milliseconds
from gameinfer_ros.games.blocks import WIDE
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import Strategy
from gameinfer_ros.solver.block import Block
from gameinfer_ros.solver.kernels import passes, workspace_rows


class PassTimes:
    """Measures an iteration and the compiled passes that it is made of, on one full block.

    Args:
        scenario: what is played.
        strategy: strategies (of at least `WIDE` particles) around whose trajectories it works.
    """

    def __init__(self, scenario: Scenario, strategy: Strategy) -> None:
        self._settings = scenario.solver
        self._kernels, self._passes = scenario.game.kernels(WIDE), passes(WIDE)
        self._lanes = np.arange(WIDE)
        self._strategy = strategy.take(self._lanes)
        self._block = Block(scenario.game, self._settings, WIDE)
        self._x, self._u, self._P = (np.ascontiguousarray(array) for array in self._strategy.arrays)
        self._x_new, self._u_new = self._x.copy(), self._u.copy()
        self._alpha = np.zeros_like(self._u)
        self._scale = np.full((1, WIDE), self._settings.first_step_size)
        self._moved = np.zeros((1, WIDE))
        self._workspace = np.empty((workspace_rows(self._kernels), WIDE))

    def measure(self, effort: Effort, dgemm: Dgemm) -> dict[str, float]:
        """Times per particle in ms, and what an LQ pass could have multiplied meanwhile, in MFLOP.

        A matrix product is measured right before and right after each group of LQ passes.
        """
        lq_pass, lq_pass_mflop, rollout, iteration = [], [], [], []
        self._lq_pass()
        self._rollout()
        for _ in range(effort.repetitions):
            before = dgemm.rate()
            ms = median_ms(self._lq_pass, effort.calls) / WIDE
            rate = (before + dgemm.rate()) / 2
            lq_pass.append(ms)
            lq_pass_mflop.append(ms * rate)
            rollout.append(median_ms(self._rollout, effort.calls) / WIDE)
            iteration.append(self._iteration_ms() / WIDE)
        return {
            "lq_pass_ms": float(np.median(lq_pass)),
            "lq_pass_mflop": float(np.median(lq_pass_mflop)),
            "rollout_ms": float(np.median(rollout)),
            "iteration_ms": float(np.median(iteration)),
        }

    def _iteration_ms(self) -> float:
        self._block.load(self._lanes, self._strategy.flat, self._lanes)
        return milliseconds(lambda: self._block.iterate(0, self._lanes))

    def _lq_pass(self) -> None:
        self._passes.lq_pass(
            self._kernels,
            self._x,
            self._u,
            0,
            self._settings.state_regularisation,
            self._settings.input_regularisation,
            self._P,
            self._alpha,
            self._workspace,
        )

    def _rollout(self) -> None:
        self._passes.rollout(
            self._kernels,
            self._x,
            self._u,
            self._P,
            self._alpha,
            self._scale,
            self._x_new,
            self._u_new,
            self._moved,
            self._workspace,
        )
