"""What the nodes that control a player have in common."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
from trajectory_msgs.msg import MultiDOFJointTrajectory

from gameinfer_ros.nodes.base.follower_node import FollowerNode, Observation
from gameinfer_ros.planning import PLAN_LENGTH, Execution
from msg_adapters import control, qos


class PlayerNode(FollowerNode):
    """A node that controls one player.

    Parameters, in addition to those of `GameNode`:
        plan_length (integer): inputs in each message; all but the first only bridge
            the gap if the next message is late.

    Subscribers:
        joint_state (sensor_msgs/MultiDOFJointState, `RECENT`)

    Publishers:
        <player>/control (trajectory_msgs/MultiDOFJointTrajectory, `LATEST`)
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self.plan_length = self.declare_live(
            "plan_length", PLAN_LENGTH, "inputs in each control message", (1, control.LONGEST)
        )

    def control(self, player: int) -> None:
        """Take control of a player: publish its inputs and observe the states."""
        self.player = player
        self.own_inputs = self.players.inputs(player)
        self.execution = Execution(self.vehicles, player)
        name = self.players.names[player]
        self._control = self.advertise(MultiDOFJointTrajectory, f"{name}/control", qos.LATEST)
        at_rest, idle = np.zeros(self.vehicles.n_states), np.zeros(self.vehicles.n_inputs)
        self.vehicles.step(at_rest, idle)  # loads the kernels before time matters
        # With the newest one only, some could be missed while the node computes.
        self.subscribe_state(self.on_state, qos.RECENT)

    @abstractmethod
    def on_state(self, observation: Observation) -> None:
        """What the player does when a new state arrives."""

    def publish_control(self, step: int, w: np.ndarray) -> None:
        """Publish the inputs `w` (S, m) of the player's vehicle from a step on."""
        vehicle = self.vehicles.dynamics[self.player]
        at_rest = np.zeros((len(w), vehicle.n_states))
        stamp = self.clock.stamp(step)
        message = control.Control(stamp, vehicle.twists(at_rest, w), vehicle.accelerations(w))
        joints = self.vehicles.joints_of(self.player)
        self._control.publish(control.encode(message, joints, self.game.dt))
