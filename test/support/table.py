"""A simulator, with a test in the place of all its players."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from sensor_msgs.msg import MultiDOFJointState
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.simulator import Simulator
from gameinfer_ros.scenario import Scenario
from msg_adapters import diagnostics, qos


class Table:
    def __init__(self, world: Any, wire: Any, scenario: Path, **parameters: Any) -> None:
        self.world, self.scenario = world, Scenario.load(scenario)
        self.game = self.scenario.game
        self.node = world.add(Simulator, scenario=scenario, **parameters)
        self.wire = wire(self.scenario, self.node.clock)
        self.reports: list[diagnostics.NodeStatus] = world.reports(self.node)
        self._hands = {
            name: world.publisher(MultiDOFJointTrajectory, f"{name}/control", qos.LATEST)
            for name in self.game.players.names
        }
        self.heard = world.hear(MultiDOFJointState, "joint_state", qos.STREAM)

    @property
    def states(self) -> list[np.ndarray]:
        return [self.wire.read_state(message) for message in self.heard]

    def wait(self, step: int) -> None:
        self.world.until(lambda: len(self.heard) > step, f"no state of step {step}")

    def play(self, player: str, step: int, inputs: Any) -> None:
        self.world.send(self._hands[player], self.wire.control(player, step, inputs))
