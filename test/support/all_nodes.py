"""All nodes of a run in one process, with a recorder."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from gameinfer_ros.nodes.human_agent import HumanAgent
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.robot_planner import RobotPlanner
from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.scenario import Scenario


class Stack(NamedTuple):
    recorder: Recorder
    inference: Inference
    planner: RobotPlanner
    humans: list[HumanAgent]
    simulator: Simulator

    @property
    def nodes(self) -> list[Any]:
        return [self.recorder, self.inference, self.planner, *self.humans, self.simulator]


def add_stack(
    world: Any,
    scenario: str | Path,
    inference: dict[str, Any] | None = None,
    planner: dict[str, Any] | None = None,
    human_seed: int = 4,
    simulator: dict[str, Any] | None = None,
    listeners: int = 0,
    **common: Any,
) -> Stack:
    """Add the nodes of a run to a world.

    Args:
        world: see `world`.
        scenario: what they play.
        inference: parameters of the inference node.
        planner: parameters of the robot planner.
        human_seed: the seed that the human agents share.
        simulator: parameters of the simulator.
        listeners: subscribers beside these nodes that the simulator waits for.
        common: parameters, namespace and arguments of all nodes.
    """
    common["scenario"] = scenario
    humans = Scenario.load(scenario).game.players.names[1:]
    return Stack(
        world.add(Recorder, **common),
        world.add(Inference, **{"seed": 3, **(inference or {}), **common}),
        world.add(RobotPlanner, **(planner or {}), **common),
        [
            world.add(HumanAgent, f"{name}_agent", player=name, seed=human_seed, **common)
            for name in humans
        ],
        world.add(
            Simulator, subscribers=len(humans) + 3 + listeners, **(simulator or {}), **common
        ),
    )
