"""Times of the updates of a belief."""

from __future__ import annotations

from time import perf_counter

from gameinfer_ros.experiments.benchmark.effort import Effort
from gameinfer_ros.experiments.benchmark.stopwatch import spread
from gameinfer_ros.experiments.prediction.watching import played, watcher
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ

#: Last step at which a belief typically still has many particles.
EARLY = 10


def measure_beliefs(effort: Effort) -> dict[str, dict[str, float]]:
    """Measure belief updates in a run of each scenario, and of five players with 1 and 2 threads.

    Returns:
        What `measure` returns, by the name of the scenario.
    """
    names = ("three_player", "five_player", "five_player_unicycle")
    scenarios = {name: Scenario.load(name) for name in names}
    five = scenarios["five_player"]
    for threads in (1, 2):
        solver = five.solver.model_copy(update={"threads": threads})
        scenarios[f"five_player_threads_{threads}"] = five.model_copy(update={"solver": solver})
    return {name: measure(scenario, effort) for name, scenario in scenarios.items()}


def measure(scenario: Scenario, effort: Effort) -> dict[str, float]:
    """Measure the belief updates of a robot that watches all players play one equilibrium.

    An update weighs the particles, combines duplicates and re-solves the games.

    Returns:
        Times in ms: `first` of the first solve; `median`, `p99` and `max` of all later updates;
        `max_after_ten` of the updates after step `EARLY`. Also `threads`, `particles` and
        `particles_left` at the end.
    """
    particles = effort.belief_particles or scenario.inference.particles
    inference = scenario.inference.model_copy(update={"particles": particles})
    scenario = scenario.model_copy(update={"inference": inference})
    solver = IterativeLQ(scenario.game, scenario.solver)
    solver.warm_up()
    belief, mind = watcher(scenario, solver, seed=0)
    updates = []
    for step, seen, w in played(scenario, solver, 0, effort.belief_steps or scenario.steps):
        start = perf_counter()
        mind.observe(step, seen, w)
        mind.update()
        updates.append(1e3 * (perf_counter() - start))
    first, *updates = updates
    return {
        "first": first,
        **spread(updates),
        "max_after_ten": max(updates[EARLY:]),
        "threads": scenario.solver.threads,
        "particles": particles,
        "particles_left": len(belief),
    }
