"""A robot that watches all players and predicts their positions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gameinfer_ros.inference import Belief
from gameinfer_ros.names.choices import BASELINE
from gameinfer_ros.planning import Deliberation, EquilibriumPlayer
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import IterativeLQ

#: Name of the predictor that infers the equilibrium; the other one is `BASELINE`.
INFERENCE = "inference"


def watch(scenario: Scenario, predictor: str, seed: int) -> np.ndarray:
    """Let all players play one equilibrium, predict their positions, and measure the errors.

    The robot is one of the players. It makes its first prediction after one step. The players
    continue for one horizon after the run, so that the last predictions have errors too.

    Args:
        scenario: the scenario to play.
        predictor: `inference` (the most likely equilibrium, given the observations) or `baseline`
            (an equilibrium drawn at random). Both are re-solved from each state.
        seed: number of the run; its humans are those of the closed loop with this number.

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
    solver, positions = IterativeLQ(scenario.game, scenario.solver), scenario.game.players.positions
    rng = np.random.default_rng(RunSeeds.of_run(seed).planner)
    baseline = EquilibriumPlayer(solver, scenario.seeds, rng)
    belief, mind = watcher(scenario, solver, seed)
    actual, predictions = [], []
    for step, seen, w in played(scenario, solver, seed, scenario.steps + scenario.horizon):
        x = scenario.vehicles.game_state(seen)
        actual.append(positions(x))
        if step <= scenario.steps:
            if predictor == INFERENCE:
                mind.observe(step, seen, w)
                mind.update()
                strategy = belief.equilibrium.strategy
            else:
                strategy = baseline.solve(step, x)
            predictions.append(positions(strategy.x_ref[..., 0]))
    return squared_errors(np.array(actual)[1:], np.array(predictions)[1:])


def watcher(scenario: Scenario, solver: IterativeLQ, seed: int) -> tuple[Belief, Deliberation]:
    """Create the mind of a robot that watches all players of a run, and its belief."""
    rng = np.random.default_rng(RunSeeds.of_run(seed).inference)
    belief = Belief(solver, scenario.seeds, scenario.inference, rng, robot_plays=False)
    return belief, Deliberation(scenario.vehicles, belief, planner=None)


def played(
    scenario: Scenario, solver: IterativeLQ, seed: int, steps: int
) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Let all players play the equilibrium of the humans of a run.

    Yields:
        Each step from 0 to `steps`, the joint state (ns,) of the vehicles that is seen, and the
        joint input (nw,) that led to it.
    """
    vehicles, rng = scenario.vehicles, np.random.default_rng(RunSeeds.of_run(seed).humans)
    players = EquilibriumPlayer(solver, scenario.seeds, rng)
    s = seen = scenario.initial_vehicle_state
    w = np.zeros(vehicles.n_inputs)
    for step in range(steps + 1):
        seen = vehicles.seen(s, seen)
        yield step, seen, w
        x = vehicles.game_state(seen)
        w = vehicles.vehicle_input(seen, players.solve(step, x).inputs(step, x)[:, 0])
        s = vehicles.step(s, w)


def squared_errors(actual: np.ndarray, predictions: np.ndarray) -> np.ndarray:
    """Compute the squared errors of predicted positions, summed over all players.

    Args:
        actual: positions (S + T, N, 2) of N players, in m.
        predictions: positions (S, T + 1, N, 2), in m, predicted at each of the first S steps for
            that step and the next T.

    Returns:
        Squared errors (S, T + 1), in m^2.
    """
    windows = np.lib.stride_tricks.sliding_window_view(actual, predictions.shape[1], axis=0)
    return np.asarray(((predictions - np.moveaxis(windows, -1, 1)) ** 2).sum(axis=(2, 3)))
