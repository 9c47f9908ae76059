"""A robot that watches all players and predicts their positions."""

import numpy as np

from gameinfer_ros.inference import Belief
from gameinfer_ros.names.choices import BASELINE
from gameinfer_ros.planning import Deliberation, EquilibriumPlayer
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver

#: Name of the predictor that infers the equilibrium; the other one is `BASELINE`.
INFERENCE = "inference"


def watch(scenario: Scenario, predictor: str, seed: int) -> np.ndarray:
    """Let all players play one equilibrium, predict their positions, and measure the errors.

    The robot is one of the players. It makes its first prediction after one step, by `inference`
    (the most likely equilibrium, given the observations) or `baseline` (an equilibrium drawn at
    random), re-solved from each state. The players continue for one horizon after the run, so that
    the last predictions have errors too. Their equilibrium is that of the closed loop with the same
    seed.

    Returns:
        Squared errors (steps, T + 1) in m^2, summed over all players. Row k belongs to the
        prediction after step k + 1; columns are look-aheads in steps.

    Raises:
        ValueError: there is no such predictor.
    """
    if predictor not in (INFERENCE, BASELINE):
        raise ValueError(
            f"predictor: '{predictor}' is not allowed: it must be {INFERENCE} or {BASELINE}"
        )
    game, vehicles, seeds = scenario.game, scenario.vehicles, RunSeeds.of_run(seed)
    solver = GameSolver(game, scenario.solver)
    players = EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seeds.humans))
    baseline = EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seeds.planner))
    belief = Belief(
        solver, scenario.seeds, scenario.inference, np.random.default_rng(seeds.inference),
        robot_plays=False,
    )  # fmt: skip
    mind = Deliberation(vehicles, belief, planner=None)
    s = seen = scenario.initial_vehicle_state
    w = np.zeros(vehicles.n_inputs)
    actual, predictions = [], []
    for step in range(scenario.steps + scenario.horizon + 1):
        seen = vehicles.seen(s, seen)
        x = vehicles.game_state(seen)
        actual.append(game.players.positions(x))
        if step <= scenario.steps:
            if predictor == INFERENCE:
                mind.observe(step, seen, w)
                mind.update()
                strategy = belief.equilibrium.strategy
            else:
                strategy = baseline.solve(step, x)
            predictions.append(game.players.positions(strategy.x_ref[..., 0]))
        w = vehicles.vehicle_input(seen, players.solve(step, x).inputs(step, x)[:, 0])
        s = vehicles.step(s, w)
    return squared_errors(np.array(actual)[1:], np.array(predictions)[1:])


def squared_errors(actual: np.ndarray, predictions: np.ndarray) -> np.ndarray:
    """Compute squared errors (S, T + 1) of predicted positions, in m^2, summed over all players.

    The actual positions (S + T, N, 2) are compared with predictions (S, T + 1, N, 2), made at each
    of the first S steps for that step and the next T.
    """
    windows = np.lib.stride_tricks.sliding_window_view(actual, predictions.shape[1], axis=0)
    return np.asarray(((predictions - np.moveaxis(windows, -1, 1)) ** 2).sum(axis=(2, 3)))
