"""Publisher of a belief and of what follows from it."""

import numpy as np
from rclpy.publisher import Publisher
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.games import ROBOT
from gameinfer_ros.inference import Belief
from gameinfer_ros.nodes.base.follower_node import Observation
from gameinfer_ros.nodes.base.game_node import GameNode
from gameinfer_ros.solver import Strategy
from msg_adapters import belief as belief_message
from msg_adapters import equilibrium, qos
from msg_adapters import strategy as strategy_message


class BeliefPublisher:
    """Publishes a belief, its MAP equilibrium, and the strategy that a planner derives from it."""

    def __init__(self, node: GameNode) -> None:
        self._node, self._vehicles, self._players = node, node.vehicles, node.players
        self._robot_strategy = node.advertise(Float64MultiArray, "robot_strategy", qos.RECENT)
        self._map_strategy = node.advertise(Float64MultiArray, "map_strategy", qos.RECENT)
        self._map_equilibrium = node.advertise(
            MultiDOFJointTrajectory, "map_equilibrium", qos.RECENT
        )
        self._belief = node.advertise(Float64MultiArray, "belief", qos.STREAM)

    def publish(
        self, observation: Observation, belief: Belief, particle: int, chosen: Strategy
    ) -> None:
        """Publish what follows from a state.

        Args:
            observation: the state.
            belief: the belief after it.
            particle: number of the particle that the robot's strategy belongs to, -1 if to none.
            chosen: the robot's strategy.
        """
        step, likely = observation.step, belief.equilibrium
        self._publish_strategy(self._robot_strategy, step, particle, chosen)
        own = likely.strategy.of_inputs(self._players.inputs(ROBOT))
        self._publish_strategy(self._map_strategy, step, likely.particle, own)
        self._belief.publish(
            belief_message.encode(
                belief_message.BeliefSummary(
                    self._node.clock.stamp(step),
                    likely.particle,
                    belief.ids,
                    belief.weights,
                    belief.settled,
                    belief.costs.T,
                )
            )
        )
        if self._map_equilibrium.get_subscription_count():
            self._publish_equilibrium(observation, likely.strategy)

    def _publish_strategy(
        self, publisher: Publisher, step: int, particle: int, strategy: Strategy
    ) -> None:
        k = step - strategy.first_step
        x, u, P = (a[k:, ..., 0] for a in (strategy.x_ref, strategy.u_ref, strategy.P))
        stamp = self._node.clock.stamp(step)
        message = strategy_message.AffineStrategy(stamp, particle, u, P, x[:-1])
        publisher.publish(strategy_message.encode(message))

    def _publish_equilibrium(self, observation: Observation, strategy: Strategy) -> None:
        vehicles, k = self._vehicles, observation.step - strategy.first_step
        x, u = strategy.x_ref[k:, :, 0], strategy.u_ref[k:, :, 0]
        s = vehicles.along(x, observation.s)
        w = vehicles.vehicle_input(s, np.vstack([u, np.zeros(self._players.n_inputs)]))
        message = equilibrium.Equilibrium(
            self._node.clock.stamp(observation.step),
            vehicles.poses(s),
            vehicles.twists(s, w),
            vehicles.accelerations(w),
        )
        names = vehicles.joint_names
        self._map_equilibrium.publish(equilibrium.encode(message, names, self._node.game.dt))
