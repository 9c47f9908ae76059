"""How the time of an update grows with particles, players and steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gameinfer_ros.experiments.benchmark.circle import circle
from gameinfer_ros.experiments.benchmark.effort import Effort
from gameinfer_ros.experiments.benchmark.stopwatch import medians_ms
from gameinfer_ros.experiments.benchmark.warm_start import WarmStart, seeds_of, solver_of
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ, Solution

#: Iterations that an update has at most.
ITERATIONS = 2

#: Numbers of threads that are compared.
THREADS = (1, 2)


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
    horizons = {steps: circle(base, 3, steps) for steps in effort.horizons}
    return {
        "particles": _by_count(three, warm[3], effort),
        "players": _iterations_ms({n: (circle(base, n), warm[n]) for n in warm}, effort),
        "horizon": _iterations_ms(
            {steps: (game, solved(game, effort)) for steps, game in horizons.items()}, effort
        ),
    }


def _by_count(scenario: Scenario, warm: WarmStart, effort: Effort) -> dict[str, dict[str, float]]:
    """Milliseconds per update, by threads and then by number of particles."""
    starts = {count: warm.of_particles(count) for count in effort.counts}
    solvers = {threads: solver_of(scenario, threads) for threads in THREADS}
    updates = {
        (threads, count): Update(solver, start)
        for threads, solver in solvers.items()
        for count, start in starts.items()
    }
    ms = medians_ms(updates, effort.repetitions)
    return {str(n): {str(count): ms[n, count] for count in starts} for n in solvers}


def _iterations_ms(
    games: Mapping[int, tuple[Scenario, WarmStart]], effort: Effort
) -> dict[str, float]:
    """Milliseconds per particle and iteration of updates of some games."""
    updates = {
        name: Update(solver_of(scenario), warm.of_particles(effort.update_particles))
        for name, (scenario, warm) in games.items()
    }
    ms = medians_ms(updates, effort.repetitions)
    return {str(name): ms[name] / update.iterations for name, update in updates.items()}


def solved(scenario: Scenario, effort: Effort) -> WarmStart:
    """What updates of a scenario start from."""
    solver, seeds = solver_of(scenario), seeds_of(scenario, effort.update_particles)
    x0 = scenario.initial_state
    return WarmStart.of(solver.solve(x0, seeds, None, effort.iterations))


class Update:
    """One update, which can be called again and again.

    Args:
        solver: the solver.
        warm: what it starts from.

    Attributes:
        iterations: how many it takes for all particles together.
    """

    def __init__(self, solver: IterativeLQ, warm: WarmStart) -> None:
        self._solver, self._warm = solver, warm
        self.iterations = int(self().iterations.sum())

    def __call__(self) -> Solution:
        """Do it."""
        return self._solver.solve(self._warm.x, self._warm.strategy, None, ITERATIONS, step=1)
