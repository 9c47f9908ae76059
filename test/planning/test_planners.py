"""The family of planners: one file each, found by name without importing the solver."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

from gameinfer_ros.games import ROBOT
from gameinfer_ros.inference import NO_PARTICLE, Belief
from gameinfer_ros.names.planners import planners
from gameinfer_ros.planning import EquilibriumPlayer, Planner, make_planner
from gameinfer_ros.runs import closed_loop
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver, Strategy, brake

KINDS = list(planners())


@pytest.fixture(scope="module")
def solver(two_player: Scenario) -> GameSolver:
    return GameSolver(two_player.game, two_player.solver)


@pytest.fixture
def belief(two_player: Scenario, solver: GameSolver) -> Belief:
    settings = two_player.inference.model_copy(update={"particles": 4})
    made = Belief(solver, two_player.seeds, settings, np.random.default_rng(0))
    made.solve(0, two_player.initial_state)
    return made


@pytest.fixture
def own_planner() -> Iterator[type[Planner]]:
    class Idle(Planner):
        """Brakes, whatever the belief says."""

        kind = "idle"

        def strategy(self, belief: Belief | None, step: int, x: np.ndarray) -> Strategy:
            return brake(belief.game, step, x)

    yield Idle
    del Planner.family["idle"]


def test_files_are_the_family() -> None:
    assert {"map", "baseline"} <= set(KINDS)
    assert set(Planner.family) == set(KINDS)
    for kind, purpose in planners().items():
        assert Planner.family[kind].kind == kind
        assert 10 < len(purpose) <= 80 and not purpose.endswith(".")


def test_names_are_known_without_the_solver() -> None:
    code = (
        "import sys; from gameinfer_ros.names.planners import planners; assert planners();"
        "assert not {'numpy', 'numba', 'gameinfer_ros.planning'} & sys.modules.keys()"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("kind", KINDS)
def test_a_strategy_reaches_its_step(
    kind: str, two_player: Scenario, solver: GameSolver, belief: Belief
) -> None:
    planner = make_planner(kind, solver, two_player.seeds, np.random.default_rng(1))
    assert planner.particle == NO_PARTICLE
    x = two_player.initial_state
    for step in range(2):
        strategy = planner.strategy(belief, step, x)
        assert strategy.first_step <= step < strategy.end
        assert len(strategy) == 1
        inputs = strategy.inputs(step, x)
        assert np.isfinite(inputs).all()
        if planner.particle == NO_PARTICLE:
            braking = brake(two_player.game, step, x).inputs(step, x)
            own = two_player.game.players.inputs(ROBOT)
            np.testing.assert_array_equal(inputs[own], braking[own])
        x = two_player.game.step(x, strategy.inputs(step, x)[:, 0])


def test_map_plays_the_heaviest_equilibrium(
    two_player: Scenario, solver: GameSolver, belief: Belief
) -> None:
    planner = make_planner("map", solver, two_player.seeds, np.random.default_rng(1))
    strategy = planner.strategy(belief, 0, two_player.initial_state)
    assert planner.particle == belief.equilibrium.particle
    np.testing.assert_array_equal(strategy.u_ref, belief.equilibrium.strategy.u_ref)


def test_the_baseline_plays_its_seed_and_needs_no_belief(
    two_player: Scenario, solver: GameSolver
) -> None:
    planner = make_planner("baseline", solver, two_player.seeds, np.random.default_rng(1))
    player = EquilibriumPlayer(solver, two_player.seeds, np.random.default_rng(1))
    assert not planner.needs_belief
    x = two_player.initial_state
    for own, its in zip(
        planner.strategy(None, 0, x).arrays, player.solve(0, x).arrays, strict=True
    ):
        np.testing.assert_array_equal(own, its)
    assert planner.particle == 0


def test_a_planner_of_ones_own_plays_in_the_closed_loop(
    own_planner: type[Planner], two_player: Scenario
) -> None:
    scenario = two_player.model_copy(update={"steps": 5})
    record = closed_loop.run(scenario, planner="idle", seed=0)
    at_rest = scenario.initial_vehicle_state[scenario.vehicles.states(0)]
    for state in record.states:
        np.testing.assert_allclose(state[scenario.vehicles.states(0)], at_rest, atol=1e-9)


def test_an_unknown_planner_is_refused(two_player: Scenario) -> None:
    with pytest.raises(ValueError, match=r"planner: 'best' is not allowed.*one of .*\bmap\b"):
        closed_loop.run(two_player, planner="best", seed=0)
