"""Base class of the nodes that control a player."""

from abc import abstractmethod
from typing import Any

import numpy as np
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.base.follower_node import FollowerNode, Observation
from gameinfer_ros.planning import PLAN_LENGTH, Execution
from msg_adapters import control, qos


class PlayerNode(FollowerNode):
    """A node that controls one player.

    Subclasses call `control` once, and implement `on_state`.

    Subscribers:
        joint_state (sensor_msgs/MultiDOFJointState, `RECENT`)

    Publishers:
        <player>/control (trajectory_msgs/MultiDOFJointTrajectory, `LATEST`)
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self.plan_length = self.declare_live(
            "plan_length",
            PLAN_LENGTH,
            "number of inputs in each control message; all but the first are used only if the next "
            "message is late",
            (1, control.LONGEST),
        )

    def control(self, player: int) -> None:
        """Advertise the inputs of a player, and subscribe to the states."""
        self.player = player
        self.own_inputs = self.players.inputs(player)
        self.execution = Execution(self.vehicles, player)
        name = self.players.names[player]
        self._control = self.advertise(MultiDOFJointTrajectory, f"{name}/control", qos.LATEST)
        idle = np.zeros((1, self.players.dynamics[player].n_inputs))
        # Loads the compiled kernels before the first state.
        self.vehicles.follow(player, np.zeros(self.vehicles.n_states), idle)
        # With a depth of 1, states could be missed while the node computes.
        self.subscribe_state(self.on_state, qos.RECENT)

    @abstractmethod
    def on_state(self, observation: Observation) -> None:
        """Called for each new state."""

    def publish_control(self, step: int, w: np.ndarray) -> None:
        """Publish inputs `w` (S, m) of the player's vehicle for S steps, starting with `step`."""
        vehicle = self.vehicles.dynamics[self.player]
        at_rest = np.zeros((len(w), vehicle.n_states))
        stamp = self.clock.stamp(step)
        message = control.Control(stamp, vehicle.twists(at_rest, w), vehicle.accelerations(w))
        joints = self.vehicles.joints_of(self.player)
        self._control.publish(control.encode(message, joints, self.game.dt))
