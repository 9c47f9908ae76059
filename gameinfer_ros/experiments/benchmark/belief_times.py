"""How long each update of a belief takes."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.experiments.benchmark.effort import Effort
from gameinfer_ros.experiments.benchmark.stopwatch import milliseconds, spread
from gameinfer_ros.inference import Belief
from gameinfer_ros.planning import Deliberation, EquilibriumPlayer
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ

#: By this step, a belief has made up its mind.
EARLY = 10


def measure_beliefs(effort: Effort) -> dict[str, dict[str, float]]:
    """Times of one closed loop of each scenario, as it says, and of five players by threads."""
    names = ("three_player", "five_player", "five_player_unicycle")
    scenarios = {name: Scenario.load(name) for name in names}
    five = scenarios["five_player"]
    for threads in (1, 2):
        solver = five.solver.model_copy(update={"threads": threads})
        scenarios[f"five_player_threads_{threads}"] = five.model_copy(update={"solver": solver})
    return {name: measure(shortened(scenario, effort)) for name, scenario in scenarios.items()}


def shortened(scenario: Scenario, effort: Effort) -> Scenario:
    """The scenario with as many particles and steps as the effort allows."""
    particles = effort.belief_particles or scenario.inference.particles
    inference = scenario.inference.model_copy(update={"particles": particles})
    steps = effort.belief_steps or scenario.steps
    return scenario.model_copy(update={"inference": inference, "steps": steps})


def measure(scenario: Scenario) -> dict[str, float]:
    """Times in ms of updates (weigh, combine, solve as the scenario says) of a robot that watches.

    All players, the robot too, play one equilibrium.

    Returns:
        The time of the first solve; median, 99th percentile and maximum of all updates after it;
        the maximum after step `EARLY`; threads, particles at the start and at the end.
    """
    game, vehicles, seeds = scenario.game, scenario.vehicles, RunSeeds.of_run(0)
    solver = IterativeLQ(game, scenario.solver)
    solver.warm_up()
    everybody = EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seeds.humans))
    rng = np.random.default_rng(seeds.inference)
    belief = Belief(solver, scenario.seeds, scenario.inference, rng, robot_plays=False)
    mind = Deliberation(vehicles, belief, planner=None)
    s, w, updates = scenario.initial_vehicle_state, np.zeros(vehicles.n_inputs), []
    for step in range(scenario.steps + 1):

        def update(step: int = step, s: np.ndarray = s, w: np.ndarray = w) -> None:
            mind.observe(step, s, w)
            mind.update()

        updates.append(milliseconds(update))
        x = vehicles.game_state(s)
        w = vehicles.vehicle_input(s, everybody.solve(step, x).inputs(step, x)[:, 0])
        s = vehicles.step(s, w)
    first, *updates = updates
    return {
        "first": first,
        **spread(updates),
        "max_after_ten": max(updates[EARLY:]),
        "threads": scenario.solver.threads,
        "particles": scenario.inference.particles,
        "particles_left": len(belief),
    }
