"""Times of the updates of a belief."""

from time import perf_counter

import numpy as np

from gameinfer_ros.experiments.benchmark.effort import Effort
from gameinfer_ros.experiments.benchmark.stopwatch import spread
from gameinfer_ros.inference import Belief
from gameinfer_ros.planning import Deliberation, EquilibriumPlayer
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver

#: Last step at which a belief typically still has many particles.
EARLY = 10


def measure_beliefs(effort: Effort) -> dict[str, dict[str, float]]:
    """Measure belief updates in several scenarios, and with 1 and 2 threads in one of them."""
    names = ("three_player", "five_player", "five_player_unicycle")
    scenarios = {name: Scenario.load(name) for name in names}
    five = scenarios["five_player"]
    for threads in (1, 2):
        solver = five.solver.model_copy(update={"threads": threads})
        scenarios[f"five_player_threads_{threads}"] = five.model_copy(update={"solver": solver})
    return {name: measure(scenario, effort) for name, scenario in scenarios.items()}


def measure(scenario: Scenario, effort: Effort) -> dict[str, float]:
    """Measure the belief updates of a robot that watches all players play one equilibrium, in ms.

    An update weighs the particles, combines duplicates and re-solves the games. The `first` solve
    is not among the other figures. `max_after_ten` is the maximum after step `EARLY`.
    """
    game, vehicles, seeds = scenario.game, scenario.vehicles, RunSeeds.of_run(0)
    solver = GameSolver(game, scenario.solver)
    solver.warm_up()
    players = EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seeds.humans))
    particles = effort.belief_particles or scenario.inference.particles
    settings = scenario.inference.model_copy(update={"particles": particles})
    rng = np.random.default_rng(seeds.inference)
    belief = Belief(solver, scenario.seeds, settings, rng, robot_plays=False)
    mind = Deliberation(vehicles, belief, planner=None)
    s, w, updates = scenario.initial_vehicle_state, np.zeros(vehicles.n_inputs), []
    for step in range((effort.belief_steps or scenario.steps) + 1):
        start = perf_counter()
        mind.observe(step, s, w)
        mind.update()
        updates.append(1e3 * (perf_counter() - start))
        x = vehicles.game_state(s)
        w = vehicles.vehicle_input(s, players.solve(step, x).inputs(step, x)[:, 0])
        s = vehicles.step(s, w)
    first, *updates = updates
    return {
        "first": first,
        **spread(updates),
        "max_after_ten": max(updates[EARLY:]),
        "threads": scenario.solver.threads,
        "particles": particles,
        "particles_left": len(belief),
    }
