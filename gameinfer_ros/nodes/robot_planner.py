"""The robot: aligned with the most likely equilibrium, or stubborn as the baseline."""

from __future__ import annotations

import sys
from time import perf_counter
from typing import Any

import numpy as np
from geometry_msgs.msg import TwistStamped
from std_msgs.msg import Float64MultiArray
from typing_extensions import override

from gameinfer_ros.games import ROBOT
from gameinfer_ros.nodes.game_node import Observation
from gameinfer_ros.nodes.player_node import PlayerNode
from gameinfer_ros.nodes.spin import spin
from gameinfer_ros.planning import BASELINE, MAP, EquilibriumPlayer
from gameinfer_ros.solver import IterativeLQ, Strategy
from msg_adapters import cmd_vel, diagnostics, qos, stamp
from msg_adapters import strategy as strategy_message


class RobotPlanner(PlayerNode):
    """Controls the robot.

    With the planner `map`, the robot plays its part of the equilibrium that `map_strategy` holds.
    In lockstep it waits for the strategy of the same step as the state; in realtime it reacts to
    a state at once, with the newest strategy it has.

    With the planner `baseline`, it sticks to an equilibrium of its own, drawn at random.

    Parameters, in addition to those of `PlayerNode`:
        planner (string, read-only): `map` or `baseline`.
        seed (integer, read-only): stands for the equilibrium of the baseline.

    Subscribers:
        map_strategy (std_msgs/Float64MultiArray, `LATEST`): with the planner `map`.

    Publishers:
        <robot>/cmd_vel (geometry_msgs/TwistStamped, `COMMAND`)
    """

    def __init__(self, name: str = "robot_planner", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        planner = self.declare_choice(
            "planner", MAP, (MAP, BASELINE), "where the robot's strategy comes from"
        )
        rng = self.declare_seed("stands for the equilibrium of the baseline")
        robot = self.players.names[ROBOT]
        self._cmd_vel = self.create_publisher(TwistStamped, f"{robot}/cmd_vel", qos.COMMAND)
        self._strategy: Strategy | None = None
        self._message, self._level = "plays its part of an equilibrium", diagnostics.OK
        self._waiting: Observation | None = None
        self._equilibrium: EquilibriumPlayer | None = None
        if planner == BASELINE:
            solver = IterativeLQ(self.game, self.scenario.solver)
            solver.warm_up(alone=True)
            self._equilibrium = EquilibriumPlayer(solver, self.scenario.seeds, rng)
        else:
            self.subscribe(Float64MultiArray, "map_strategy", self._on_strategy, qos.LATEST)
        self.control(ROBOT)
        self.get_logger().info(f"ready: {robot} waits for states, planner {planner}")

    @override
    def on_state(self, observation: Observation) -> None:
        self._waiting = observation
        if self._equilibrium is not None:
            start = perf_counter()
            strategy = self._equilibrium.solve(observation.step, observation.x)
            solve_ms = 1e3 * (perf_counter() - start)
            self._strategy = strategy.of_inputs(self.own_inputs)
            self._act(
                {
                    "solve_ms": f"{solve_ms:.2f}",
                    "iterations": self._equilibrium.iterations,
                    "converged": self._equilibrium.converged,
                }
            )
        elif self._covers(observation):
            self._act({})
        elif not self.lockstep:
            self.get_logger().info(
                f"no strategy yet for step {observation.step}", throttle_duration_sec=5.0
            )

    def _on_strategy(self, message: Float64MultiArray, waited: float) -> None:
        m, nx = self.players.dynamics[ROBOT].n_inputs, self.players.n_states
        decoded = strategy_message.decode(message, m, nx, self.game.dt)
        if self._strategy is not None:
            stamp.check_newer(decoded.step, self._strategy.first_step)
        # The state at the end of the horizon is not sent: no input depends on it.
        x_ref = np.concatenate([decoded.x_ref, decoded.x_ref[-1:]])
        self._strategy = Strategy(
            decoded.step, x_ref[..., None], decoded.u_ref[..., None], decoded.P[..., None]
        )
        known = decoded.particle >= 0
        self._message = (
            "plays its part of an equilibrium" if known else "no equilibrium is known: brakes"
        )
        self._level = diagnostics.OK if known else diagnostics.WARN
        if self._waiting is not None and self._covers(self._waiting):
            self._act({})

    def _covers(self, observation: Observation) -> bool:
        """Whether the newest strategy may be used in this state."""
        if self._strategy is None:
            return False
        first, end = self._strategy.first_step, self._strategy.end
        return observation.step == first if self.lockstep else first <= observation.step < end

    def _act(self, figures: dict[str, object]) -> None:
        assert self._waiting is not None and self._strategy is not None
        observation, self._waiting = self._waiting, None
        s, w = self.publish_control(self._strategy, observation)
        velocity = self.vehicles.dynamics[ROBOT].twists(s[1], w[0])[0]
        self._cmd_vel.publish(
            cmd_vel.encode(observation.step, velocity, self.players.names[ROBOT], self.game.dt)
        )
        age = observation.step - self._strategy.first_step
        self.report(
            self._message,
            {"step": observation.step, "strategy_age_steps": age, **figures},
            self._level if age <= 1 else diagnostics.WARN,
        )


def main(args: list[str] | None = None) -> int:
    """Run the node until it is shut down."""
    return spin(RobotPlanner, args)


if __name__ == "__main__":
    sys.exit(main())
