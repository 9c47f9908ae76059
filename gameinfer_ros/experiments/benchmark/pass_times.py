"""Times of the parts of an iteration."""

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
    """A benchmark of one iteration and its compiled passes, on one full block of particles.

    Args:
        scenario: the scenario.
        strategy: strategies of at least `WIDE` particles, the operating points of the iteration.
    """

    def __init__(self, scenario: Scenario, strategy: Strategy) -> None:
        self._lanes = np.arange(WIDE)
        self._strategy = strategy.take(self._lanes)
        self._batch = Batch(scenario.game, scenario.solver, WIDE)

    def measure(self, effort: Effort, dgemm: Dgemm) -> dict[str, float]:
        """Measure the times per particle, in ms.

        A matrix product is measured right before and after each group of LQ passes.

        Returns:
            `lq_pass_ms`, `rollout_ms` and `iteration_ms`; and `lq_pass_mflop`, the work, in MFLOP,
            that matrix products do in the time of an LQ pass.
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
        """Reset the strategies, and warm the caches by one iteration."""
        self._batch.load(self._lanes, self._strategy.flat, self._lanes)
        self._batch.iterate(0, self._lanes)
        self._batch.load(self._lanes, self._strategy.flat, self._lanes)
