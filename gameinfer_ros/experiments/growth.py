"""How the time of an update grows with particles, players and steps."""

from __future__ import annotations

from typing import Any

from gameinfer_ros.experiments.circle import circle
from gameinfer_ros.experiments.effort import Effort
from gameinfer_ros.experiments.stopwatch import median_ms
from gameinfer_ros.experiments.warm_start import WarmStart, seeds_of, solver_of
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ, Solution

#: Iterations that an update has at most.
ITERATIONS = 2


def measure_growth(
    base: Scenario, warm: dict[int, WarmStart], effort: Effort
) -> dict[str, dict[str, Any]]:
    """Times in ms of updates that start warm and end after `ITERATIONS`.

    Args:
        base: scenario whose costs the players on the circle have.
        warm: for each number of players, what to start from.
        effort: how much to measure.

    Returns:
        By threads, then number of particles: ms per update of three players. By number of
        players, and by number of steps of three players: ms per particle and iteration.
    """
    three = circle(base, 3)
    return {
        "particles": {
            str(threads): _by_count(solver_of(three, threads), warm[3], effort)
            for threads in (1, 2)
        },
        "players": {
            str(players): _iteration_ms(circle(base, players), start, effort)
            for players, start in warm.items()
        },
        "horizon": {
            str(steps): _of_horizon(circle(base, 3, steps), effort) for steps in effort.horizons
        },
    }


def _by_count(solver: IterativeLQ, warm: WarmStart, effort: Effort) -> dict[str, float]:
    """Milliseconds per update, by number of particles."""
    return {
        str(count): median_ms(_Update(solver, warm.of_particles(count)), effort.repetitions)
        for count in effort.counts
    }


def _of_horizon(scenario: Scenario, effort: Effort) -> float:
    return _iteration_ms(scenario, solved(scenario, effort), effort)


def solved(scenario: Scenario, effort: Effort) -> WarmStart:
    """What updates of a scenario start from."""
    solver, seeds = solver_of(scenario), seeds_of(scenario, effort.update_particles)
    x0 = scenario.initial_state
    return WarmStart.of(solver.solve(x0, seeds, None, effort.iterations))


class _Update:
    """One update, which can be called again and again."""

    def __init__(self, solver: IterativeLQ, warm: WarmStart) -> None:
        self._solver, self._warm = solver, warm
        self.iterations = int(self._solve().iterations.sum())

    def __call__(self) -> None:
        self._solve()

    def _solve(self) -> Solution:
        return self._solver.solve(self._warm.x, self._warm.strategy, None, ITERATIONS, step=1)


def _iteration_ms(scenario: Scenario, warm: WarmStart, effort: Effort) -> float:
    update = _Update(solver_of(scenario), warm.of_particles(effort.update_particles))
    return median_ms(update, effort.repetitions) / update.iterations
