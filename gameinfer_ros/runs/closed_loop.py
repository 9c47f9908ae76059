"""One closed-loop run on the core alone: what the nodes do in lockstep, without ROS."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from gameinfer_ros.games import ROBOT
from gameinfer_ros.inference import Belief
from gameinfer_ros.planning import (
    BASELINE,
    BRAKES,
    LIMITED,
    MAP,
    PLAN_LENGTH,
    EquilibriumPlayer,
    SafetyFilter,
    plan,
)
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ


def run(scenario: Scenario, planner: str, seed: int, safety: bool = False) -> RunRecord:
    """Play a scenario: the humans stick to one equilibrium, the robot plans.

    States and inputs are those of the nodes in lockstep, to the last bit; so are the beliefs, which
    are only kept where the robot needs them.

    Args:
        scenario: what to play, and for how many steps.
        planner: `map`, a robot that aligns with the most likely equilibrium, or `baseline`, one
            that sticks to an equilibrium of its own, drawn at random.
        seed: number of the run, which all random numbers come of.
        safety: whether the robot has a safety layer, the last to see its inputs.

    Raises:
        ValueError: there is no such planner.
    """
    if planner not in (MAP, BASELINE):
        raise ValueError(f"planner: '{planner}' is not allowed: it must be {MAP} or {BASELINE}")
    game, vehicles, seeds = scenario.game, scenario.vehicles, RunSeeds.of_run(seed)
    solver = IterativeLQ(game, scenario.solver)
    humans = EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seeds.humans))
    baseline = EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seeds.baseline))
    belief = Belief(
        solver, scenario.seeds, scenario.inference, np.random.default_rng(seeds.inference)
    )
    own, aligned = game.players.inputs(ROBOT), planner == MAP
    guard = SafetyFilter(vehicles, scenario.safety)
    record, actions = RunRecord(vehicles), []
    s = seen = last_seen = scenario.initial_vehicle_state
    last_x = scenario.initial_state
    for step in range(scenario.steps + 1):
        seen = vehicles.seen(s, seen)
        record.states.append(seen)
        x = vehicles.game_state(seen)
        start = perf_counter()
        if aligned:
            if step > 0:
                u_before = vehicles.game_input(last_seen, record.inputs[-1])[own]
                belief.weigh(step - 1, last_x, x, u_before)
                belief.combine_duplicates()
            if step == 0 or step >= belief.strategy.end:
                belief.solve(step, x)
            weights = zip(belief.ids.tolist(), belief.weights.tolist(), strict=True)
            record.beliefs[step] = dict(weights)
            record.maps[step] = belief.equilibrium.particle
        if step == scenario.steps:
            break
        strategy = belief.equilibrium.strategy if aligned else baseline.solve(step, x)
        u_robot = plan(strategy.of_inputs(own), step, x, PLAN_LENGTH)
        if aligned and belief.strategy.first_step < step:
            belief.solve(step, x)
        record.step_ms.append(1e3 * (perf_counter() - start))
        u = humans.solve(step, x).inputs(step, x)[:, 0]
        u[own] = u_robot[0]
        w = vehicles.vehicle_input(seen, u)
        if safety:
            safe = guard.check(seen, vehicles.follow(ROBOT, seen, u_robot)[1])
            w[vehicles.inputs(ROBOT)] = safe.inputs[0]
            actions.append(safe.action)
        record.inputs.append(w)
        s, last_seen, last_x = vehicles.step(s, w), seen, x
    if safety:
        record.safety_braked = actions.count(BRAKES)
        record.safety_limited = actions.count(LIMITED)
    return record
