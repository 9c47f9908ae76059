"""A closed-loop run without ROS, equal to one of the nodes in lockstep."""

from time import perf_counter

import numpy as np

from gameinfer_ros.games import ROBOT
from gameinfer_ros.inference import Belief
from gameinfer_ros.planning import (
    BRAKES,
    LIMITED,
    Deliberation,
    EquilibriumPlayer,
    Execution,
    SafetyFilter,
    make_planner,
)
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver


def run(scenario: Scenario, planner: str, seed: int, safety: bool = False) -> RunRecord:
    """Play a scenario: the humans play one equilibrium, the robot plans.

    States, inputs and beliefs equal those of the nodes in lockstep, to the last bit. Beliefs are
    recorded only if the planner needs them.

    Args:
        scenario: the scenario to play.
        planner: name of the robot's planner, such as `map` or `baseline`.
        seed: number of the run, which determines all random numbers.
        safety: whether the robot has a safety layer.

    Returns:
        The record of the run.

    Raises:
        ValueError: there is no such planner.
    """
    game, vehicles, seeds = scenario.game, scenario.vehicles, RunSeeds.of_run(seed)
    solver = GameSolver(game, scenario.solver)
    humans = EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seeds.humans))
    chosen = make_planner(planner, solver, scenario.seeds, np.random.default_rng(seeds.planner))
    belief = None
    if chosen.needs_belief:
        rng = np.random.default_rng(seeds.inference)
        belief = Belief(solver, scenario.seeds, scenario.inference, rng)
    mind = Deliberation(vehicles, belief, chosen)
    guard = SafetyFilter(vehicles, scenario.safety) if safety else None
    body = Execution(vehicles, ROBOT, guard)
    record, actions = RunRecord(vehicles), []
    s = seen = scenario.initial_vehicle_state
    w = np.zeros(vehicles.n_inputs)
    for step in range(scenario.steps + 1):
        seen = vehicles.seen(s, seen)
        record.states.append(seen)
        start = perf_counter()
        mind.observe(step, seen, w)
        strategy = mind.choose()
        if belief is not None:
            weights = zip(belief.ids.tolist(), belief.weights.tolist(), strict=True)
            record.beliefs[step] = dict(weights)
            record.maps[step] = belief.equilibrium.particle
        if step == scenario.steps:
            break
        safe = body.act(strategy, step, seen)
        mind.update()
        record.step_ms.append(1e3 * (perf_counter() - start))
        x = vehicles.game_state(seen)
        w = vehicles.vehicle_input(seen, humans.solve(step, x).inputs(step, x)[:, 0])
        w[vehicles.inputs(ROBOT)] = safe.inputs[0]
        actions.append(safe.action)
        record.inputs.append(w)
        s = vehicles.step(s, w)
    if safety:
        record.safety_braked = actions.count(BRAKES)
        record.safety_limited = actions.count(LIMITED)
    return record
