"""A robot that watches others, and predicts what they will do."""

from __future__ import annotations

import numpy as np

from gameinfer_ros.inference import Belief
from gameinfer_ros.names.choices import BASELINE
from gameinfer_ros.planning import Deliberation, EquilibriumPlayer
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ

#: The predictor that infers; the other one is the baseline.
INFERENCE = "inference"


def watch(scenario: Scenario, predictor: str, seed: int) -> np.ndarray:
    """Let all players play one equilibrium, and predict at each step how it goes on.

    The robot is one of those who are watched. It predicts after each observed step of the run, so
    for the first time after one time step. The players go on for a horizon after the run has
    ended, so that it is known how right the last predictions are.

    Args:
        scenario: what is played, and for how many steps.
        predictor: `inference`, the equilibrium that is the most likely one after all that was
            observed, or `baseline`, one that was drawn at random and is re-solved from each state.
        seed: number of the run; its humans are those of a closed loop with this number.

    Returns:
        Squared errors (steps, T + 1) in m^2, of the positions of all players together: by the
        step after which a prediction was made, from 1 on, and by how many steps it looks ahead.

    Raises:
        ValueError: there is no such predictor.
    """
    if predictor not in (INFERENCE, BASELINE):
        raise ValueError(
            f"predictor: '{predictor}' is not allowed: it must be {INFERENCE} or {BASELINE}"
        )
    game, vehicles, seeds = scenario.game, scenario.vehicles, RunSeeds.of_run(seed)
    solver = IterativeLQ(game, scenario.solver)
    everybody = EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seeds.humans))
    baseline = EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seeds.planner))
    belief = Belief(
        solver, scenario.seeds, scenario.inference, np.random.default_rng(seeds.inference),
        robot_plays=False,
    )  # fmt: skip
    mind = Deliberation(vehicles, belief, planner=None)
    s = seen = scenario.initial_vehicle_state
    w = np.zeros(vehicles.n_inputs)
    happened, predictions = [], []
    for step in range(scenario.steps + scenario.horizon + 1):
        seen = vehicles.seen(s, seen)
        x = vehicles.game_state(seen)
        happened.append(game.players.positions(x))
        if step <= scenario.steps:
            if predictor == INFERENCE:
                mind.observe(step, seen, w)
                mind.update()
                strategy = belief.equilibrium.strategy
            else:
                strategy = baseline.solve(step, x)
            predictions.append(game.players.positions(strategy.x_ref[..., 0]))
        w = vehicles.vehicle_input(seen, everybody.solve(step, x).inputs(step, x)[:, 0])
        s = vehicles.step(s, w)
    return squared_errors(np.array(happened)[1:], np.array(predictions)[1:])


def squared_errors(happened: np.ndarray, predictions: np.ndarray) -> np.ndarray:
    """Squared errors (S, T + 1) of predictions, in m^2.

    Args:
        happened: positions (S + T, N, 2) of N players, in m.
        predictions: positions (S, T + 1, N, 2), in m, predicted at each of the first S steps for
            that step and the next T.
    """
    windows = np.lib.stride_tricks.sliding_window_view(happened, predictions.shape[1], axis=0)
    return np.asarray(((predictions - np.moveaxis(windows, -1, 1)) ** 2).sum(axis=(2, 3)))
