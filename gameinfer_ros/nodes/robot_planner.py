"""The robot: aligned with the most likely equilibrium, or stubborn as the baseline."""

from __future__ import annotations

import sys
from time import monotonic, perf_counter
from typing import Any

import numpy as np
from geometry_msgs.msg import TwistStamped
from rclpy.parameter import Parameter
from rclpy.subscription import Subscription
from std_msgs.msg import Float64MultiArray
from typing_extensions import override

from gameinfer_ros.games import ROBOT
from gameinfer_ros.nodes.game_node import Observation
from gameinfer_ros.nodes.player_node import PlayerNode
from gameinfer_ros.nodes.spin import spin
from gameinfer_ros.nodes.step_order import StepOrder
from gameinfer_ros.planning import BASELINE, MAP, EquilibriumPlayer
from gameinfer_ros.solver import IterativeLQ, Strategy
from msg_adapters import cmd_vel, diagnostics, multi_array, qos
from msg_adapters import strategy as strategy_message

_STANDSTILL = np.zeros(3)


class RobotPlanner(PlayerNode):
    """Controls the robot.

    With the planner `map`, the robot plays its part of the equilibrium that `map_strategy` holds.
    In lockstep it waits for the strategy of the same step as the state; in realtime it reacts to
    a state at once, with the newest strategy it has.

    With the planner `baseline`, it sticks to an equilibrium of its own, drawn at random.

    A base that is on its way is stopped in realtime when there is nothing to react to: when
    states are missing, or strategies for them. It goes on when they are back.

    Parameters, in addition to those of `PlayerNode`:
        planner (string): `map` or `baseline`; a change counts at once.
        seed (integer): stands for the equilibrium of the baseline; a change counts from the next
            run on.
        brake_after (double): how long after its last reaction the robot brakes, in s; 0 for half
            a second, or five time steps if these are longer.

    Subscribers:
        map_strategy (std_msgs/Float64MultiArray, `RECENT`): with the planner `map`.

    Publishers:
        <robot>/cmd_vel (geometry_msgs/TwistStamped, `COMMAND`)

    Services:
        ~/reset (std_srvs/srv/Trigger): changes over to another equilibrium of the baseline.
    """

    def __init__(self, name: str = "robot_planner", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self._planner = self.declare_live(
            "planner",
            MAP,
            "where the robot's strategy comes from; a change counts at once",
            choices=(MAP, BASELINE),
        )
        self._generator = self.declare_seed("stands for the equilibrium of the baseline")
        self._brake_after = self.declare_live(
            "brake_after", 0.0, "s after the last reaction; 0: 0.5 s, or five steps", (0.0, 60.0)
        )
        self._name = self.players.names[ROBOT]
        self._cmd_vel = self.advertise(TwistStamped, f"{self._name}/cmd_vel", qos.COMMAND)
        self._strategy: Strategy | None = None
        self._order = StepOrder()  # of strategies
        self._message, self._level = "plays its part of an equilibrium", diagnostics.OK
        self._waiting: Observation | None = None
        self._last_reaction: float | None = None
        self._brakes = False
        self._solver = IterativeLQ(self.game, self.scenario.solver)
        self._solver.warm_up(alone=True)  # also for later: the planner may be changed
        self._equilibrium: EquilibriumPlayer | None = None
        self._strategies: Subscription | None = None
        self.begin()
        self.add_post_set_parameters_callback(self._on_planner_set)
        self.control(ROBOT)
        if not self.lockstep:
            self.every(self.game.dt, self._watch)
        self.get_logger().info(f"ready: {self._name} waits for states, planner {self._planner()}")

    @override
    def begin(self) -> None:
        if self._strategy is not None and self._strategy.first_step > 0:
            self._strategy = None  # that of step 0 may have come before its state
            self._order.forget()
        if self._planner() == BASELINE:
            self._equilibrium = EquilibriumPlayer(
                self._solver, self.scenario.seeds, self._generator()
            )
            if self._strategies is not None:
                self.destroy_subscription(self._strategies)
                self._strategies = None
        else:
            self._equilibrium = None
            if self._strategies is None:
                robot, horizon = self.players.dynamics[ROBOT], self.game.horizon
                columns = robot.n_inputs * (1 + self.players.n_states) + self.players.n_states
                self._strategies = self.subscribe(
                    Float64MultiArray,
                    "map_strategy",
                    self._on_strategy,
                    qos.RECENT,  # with the newest one only, a stray one could take its place
                    multi_array.largest(horizon, columns),
                )

    def _on_planner_set(self, parameters: list[Parameter]) -> None:
        if "planner" in (parameter.name for parameter in parameters):
            self._strategy = None
            self._order.forget()
            self.begin()
            if self._waiting is not None:
                self.on_state(self._waiting)

    @override
    def on_state(self, observation: Observation) -> None:
        self._waiting = observation
        if self._equilibrium is not None:
            start = perf_counter()
            strategy = self._equilibrium.solve(observation.step, observation.x)
            solve_ms = 1e3 * (perf_counter() - start)
            self._strategy = strategy.of_inputs(self.own_inputs)
            self._message, self._level = "plays an equilibrium of its own", diagnostics.OK
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
                f"no strategy for step {observation.step} yet: the last plan, if there is one, "
                "goes on",
                throttle_duration_sec=5.0,
            )

    def _on_strategy(self, message: Float64MultiArray, waited: float) -> None:
        m, nx = self.players.dynamics[ROBOT].n_inputs, self.players.n_states
        decoded = strategy_message.decode(message, m, nx, self.game.dt)
        # That of step 0 is the first of a new run, of which no state may have arrived yet.
        if decoded.step == 0:
            self._order.forget()
        self._order.admit(decoded.step)
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
        self._move(self.vehicles.dynamics[ROBOT].twists(s[1], w[0])[0])
        self._last_reaction = monotonic()
        if self._brakes:
            self._brakes = False
            self.get_logger().info(f"{self._name} goes on at step {observation.step}")
        age = observation.step - self._strategy.first_step
        self.report(
            self._message,
            {
                "step": observation.step,
                "waited_ms": f"{1e3 * observation.waited:.2f}",
                "strategy_age_steps": age,
                **figures,
            },
            self._level if age <= 1 else diagnostics.WARN,
        )

    def _watch(self) -> None:
        """Stop the base if it has been left alone for too long."""
        if self._last_reaction is None:
            return
        silence = monotonic() - self._last_reaction
        if silence < (self._brake_after() or max(0.5, 5 * self.game.dt)):
            return
        missing = (
            "joint_state"
            if self._waiting is None
            else f"strategy for the state of step {self._waiting.step}"
        )
        message = f"brakes: no {missing} for {silence:.1f} s"
        if not self._brakes:
            self._brakes = True
            self.get_logger().warn(message)
        self._move(_STANDSTILL)
        self.report(message, {}, diagnostics.WARN)

    def _move(self, velocity: np.ndarray) -> None:
        now = self.get_clock().now().to_msg()
        self._cmd_vel.publish(cmd_vel.encode(now, velocity, self._name))


def main(args: list[str] | None = None) -> int:
    """Run the node until it is shut down."""
    return spin(RobotPlanner, args)


if __name__ == "__main__":
    sys.exit(main())
