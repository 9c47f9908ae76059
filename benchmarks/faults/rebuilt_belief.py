"""How good the belief of an inference is that was started anew."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from gameinfer_ros.bags.run_bag import RunBag
from gameinfer_ros.inference import Belief
from gameinfer_ros.solver import IterativeLQ


def worth(bag: Path, out: Path, killed: int) -> dict[str, float]:
    """How far the rebuilt belief is from the one of an undisturbed update at each step.

    Args:
        bag: where the run was recorded.
        out: results of the run.
        killed: a step after which the inference was killed.
    """
    recorded = RunBag(bag)
    scenario, record = recorded.scenario, recorded.record()
    parameters = json.loads((out / "parameters/inference.yaml").read_text())["/**"]
    seed = parameters["ros__parameters"]["seed"]
    solver, vehicles = IterativeLQ(scenario.game, scenario.solver), scenario.vehicles
    belief = Belief(solver, scenario.seeds, scenario.inference, np.random.default_rng(seed))
    own = scenario.game.players.inputs(0)
    gap = sorted(set(range(killed, len(record.states))) - set(record.beliefs))
    rebuilt = next(step for step in sorted(record.beliefs) if step > gap[0])
    before = vehicles.game_state(record.states[0])
    belief.solve(0, before)
    for step in range(1, rebuilt + 1):
        s, w = record.states[step - 1], record.inputs[step - 1]
        x = vehicles.game_state(record.states[step])
        belief.weigh(step - 1, before, x, vehicles.game_input(s, w)[own])
        belief.combine_duplicates()
        belief.solve(step, x)
        before = x
    usual = dict(zip(belief.ids.tolist(), belief.weights.tolist(), strict=True))
    found = record.beliefs[rebuilt]
    far = sum(abs(usual.get(i, 0.0) - found.get(i, 0.0)) for i in {*usual, *found}) / 2
    assert belief.map is not None
    return {
        "without_belief_steps": float(rebuilt - gap[0]),
        "total_variation": far,
        "same_map": float(record.maps[rebuilt] == belief.ids[belief.map]),
    }
