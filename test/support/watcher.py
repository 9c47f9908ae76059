"""Watches an inference node in tests."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray

from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.scenario import Scenario
from msg_adapters import belief, diagnostics, qos, strategy


class Watcher:
    def __init__(self, world: Any, wire: Any, scenario: str | Path, **parameters: Any) -> None:
        self.world, self.scenario = world, Scenario.load(scenario)
        self.wire, self.game = wire(self.scenario), self.scenario.game
        self._parameters = {"scenario": scenario, **parameters}
        self.node = world.add(Inference, **self._parameters)
        self.reports: list[diagnostics.NodeStatus] = world.reports(self.node)
        self._states = world.states()
        self._strategies = world.hear(Float64MultiArray, "map_strategy", qos.STREAM)
        self._robot_strategies = world.hear(Float64MultiArray, "robot_strategy", qos.STREAM)
        self._beliefs = world.hear(Float64MultiArray, "belief", qos.STREAM)

    def restart(self) -> None:
        """Have another node in the place of one that was removed."""
        self.node = self.world.add(Inference, **self._parameters)

    def see(self, step: int, x: np.ndarray, u: np.ndarray | None = None) -> None:
        """Show a state and wait for the report on it."""
        count = len(self.reports)
        self.world.send(self._states, self.wire.state(step, x, u))
        self.world.until(
            lambda: (
                len(self.reports) > count
                and len(self._beliefs) >= len(self.reports)
                and len(self._strategies) >= len(self.reports)
            )
        )

    def see_all(self, messages: list[MultiDOFJointState], wait: float | None = None) -> None:
        """Show states at once, and wait for the reports and beliefs once they are old."""
        count = len(self.reports) + len(messages)
        for message in messages:
            self._states.publish(message)
        time.sleep(3 * self.scenario.dt if wait is None else wait)
        self.world.until(lambda: len(self.reports) >= count and len(self._beliefs) >= count)

    @property
    def beliefs(self) -> list[belief.BeliefSummary]:
        players = len(self.game.players)
        return [belief.decode(message, players) for message in self._beliefs]

    @property
    def strategies(self) -> list[strategy.AffineStrategy]:
        return self._decoded(self._strategies)

    @property
    def robot_strategies(self) -> list[strategy.AffineStrategy]:
        return self._decoded(self._robot_strategies)

    def _decoded(self, messages: list[Float64MultiArray]) -> list[strategy.AffineStrategy]:
        nx = self.game.players.n_states
        return [strategy.decode(message, 2, nx) for message in messages]

    def steps(self, told: Sequence[belief.BeliefSummary | strategy.AffineStrategy]) -> list[int]:
        """The steps that beliefs or strategies belong to."""
        return [self.wire.clock.step(one.stamp) for one in told]


class WatcherFactory:
    def __init__(
        self, make_world: Callable[[], Any], wire: Any, scenario_file: Callable[..., Path]
    ) -> None:
        self._make_world, self._wire, self._scenario_file = make_world, wire, scenario_file

    def __call__(
        self,
        kinds: str = "uu",
        horizon: int = 10,
        duplicate_tolerance: float = 0.0,
        **parameters: Any,
    ) -> Watcher:
        scenario = self._scenario_file(
            kinds, horizon=horizon, duplicate_tolerance=duplicate_tolerance
        )
        return Watcher(self._make_world(), self._wire, scenario, seed=3, **parameters)


def walk(watcher: Watcher, steps: int = 4) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """States and inputs of vehicles that turn and accelerate a little."""
    rng = np.random.default_rng(7)
    vehicles = watcher.scenario.vehicles
    x, u = [watcher.scenario.initial_vehicle_state], [np.zeros(vehicles.n_inputs)]
    for _ in range(steps):
        u.append(rng.uniform(-0.3, 0.3, len(u[0])))
        x.append(vehicles.step(x[-1], u[-1]))
    return x, u
