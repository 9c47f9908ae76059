"""How long the parts of an iteration take."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.experiments.benchmark.dgemm import Dgemm
from gameinfer_ros.experiments.benchmark.effort import Effort
from gameinfer_ros.experiments.benchmark.stopwatch import median_ms, milliseconds
from gameinfer_ros.lanes.blocks import WIDE
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import Strategy
from gameinfer_ros.solver.batch import Batch


class PassTimes:
    """Measures an iteration and the compiled passes that it is made of, on one full block.

    Args:
        scenario: what is played.
        strategy: strategies (of at least `WIDE` particles) around whose trajectories it works.
    """

    def __init__(self, scenario: Scenario, strategy: Strategy) -> None:
        self._lanes = np.arange(WIDE)
        self._strategy = strategy.take(self._lanes)
        self._batch = Batch(scenario.game, scenario.solver, WIDE)

    def measure(self, effort: Effort, dgemm: Dgemm) -> dict[str, float]:
        """Times per particle in ms, and what an LQ pass could have multiplied meanwhile, in MFLOP.

        A matrix product is measured right before and right after each group of LQ passes.
        """
        lq_pass, lq_pass_mflop, rollout, iteration = [], [], [], []
        for _ in range(effort.repetitions):
            self._start()
            before = dgemm.rate()
            ms = median_ms(lambda: self._batch.lq_pass(0), effort.calls) / WIDE
            rate = (before + dgemm.rate()) / 2
            lq_pass.append(ms)
            lq_pass_mflop.append(ms * rate)
            rollout.append(median_ms(self._batch.rollout, effort.calls) / WIDE)
            self._start()
            iteration.append(milliseconds(lambda: self._batch.iterate(0, self._lanes)) / WIDE)
        return {
            "lq_pass_ms": float(np.median(lq_pass)),
            "lq_pass_mflop": float(np.median(lq_pass_mflop)),
            "rollout_ms": float(np.median(rollout)),
            "iteration_ms": float(np.median(iteration)),
        }

    def _start(self) -> None:
        """Go back to the strategies that all repetitions work around, and have everything warm."""
        self._batch.load(self._lanes, self._strategy.flat, self._lanes)
        self._batch.iterate(0, self._lanes)
        self._batch.load(self._lanes, self._strategy.flat, self._lanes)
