"""Times of the parts of an iteration."""

import numpy as np

from gameinfer_ros.experiments.benchmark.dgemm import Dgemm
from gameinfer_ros.experiments.benchmark.effort import Effort
from gameinfer_ros.experiments.benchmark.stopwatch import median_ms, milliseconds
from gameinfer_ros.lanes.array import WIDE
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import Strategy
from gameinfer_ros.solver.batch import Batch


def measure_passes(
    scenario: Scenario, strategy: Strategy, effort: Effort, dgemm: Dgemm
) -> dict[str, float]:
    """Measure one iteration and its compiled passes, in ms per particle, on one full block.

    A matrix product is measured right before and after each group of LQ passes. `lq_pass_mflop` is
    the work, in MFLOP, that matrix products do in the time of an LQ pass.
    """
    batch, lanes = Batch(scenario.game, scenario.solver, WIDE), np.arange(WIDE)

    def start() -> None:
        """Reset the strategies, and warm the caches by one iteration."""
        batch.load(lanes, strategy.flat, lanes)
        batch.iterate(0, lanes)
        batch.load(lanes, strategy.flat, lanes)

    rounds = []
    for _ in range(effort.repetitions):
        start()
        before = dgemm.rate()
        lq_pass = median_ms(lambda: batch.lq_pass(0), effort.calls) / WIDE
        rate = (before + dgemm.rate()) / 2
        rollout = median_ms(batch.rollout, effort.calls) / WIDE
        start()
        iteration = milliseconds(lambda: batch.iterate(0, lanes)) / WIDE
        rounds.append((lq_pass, lq_pass * rate, rollout, iteration))
    names = ("lq_pass_ms", "lq_pass_mflop", "rollout_ms", "iteration_ms")
    return dict(zip(names, np.median(rounds, axis=0).tolist(), strict=True))
