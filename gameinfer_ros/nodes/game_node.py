"""What all nodes have in common."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from time import time_ns
from typing import Any, NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import MultiDOFJointState

from gameinfer_ros.choices import LOCKSTEP, REALTIME
from gameinfer_ros.scenario import Scenario
from msg_adapters import MessageError, diagnostics, joint_state, qos, stamp


class ParameterError(ValueError):
    """A parameter has a value that is not allowed; the message names both, and what is allowed."""


class Observation(NamedTuple):
    """Where the players are, as it was observed.

    Attributes:
        step: the step that it belongs to.
        x: joint state (nx,) in the game.
        s: joint state (ns,) of the vehicles.
        w: joint input (nw,) of the vehicles applied during the step before.
        waited: time between the arrival of the message and its handling, in s.
    """

    step: int
    x: np.ndarray
    s: np.ndarray
    w: np.ndarray
    waited: float


class GameNode(Node):
    """A node that takes part in a game.

    Parameters:
        scenario (string, read-only): name or file of the scenario.
        time (string, read-only): `lockstep`, where every step waits for all who take part in it,
            or `realtime`, where no one waits for anyone.

    Publishers:
        /diagnostics (diagnostic_msgs/DiagnosticArray, `DIAGNOSTICS`)

    Args:
        name: name of the node.
        node_options: passed on to `rclpy.node.Node`, such as `context`, `namespace` and
            `parameter_overrides`.

    Raises:
        ScenarioError: the scenario cannot be used.
        ParameterError: a parameter has a value that is not allowed.
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        super().__init__(name, **node_options)
        scenario = self.declare("scenario", "three_player", "name or file of the scenario")
        self.time = self.declare_choice(
            "time", LOCKSTEP, (LOCKSTEP, REALTIME), "who waits for whom at each step"
        )
        self.scenario = Scenario.load(scenario)
        self.game = self.scenario.game
        self.players, self.vehicles = self.game.players, self.scenario.vehicles
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
        self._rejected: Counter[str] = Counter()

    @property
    def lockstep(self) -> bool:
        """Whether every step waits for all who take part in it."""
        return bool(self.time == LOCKSTEP)

    def declare(
        self,
        name: str,
        default: Any,
        description: str,
        limits: tuple[float, float] | None = None,
        constraints: str = "",
    ) -> Any:
        """Declare a read-only parameter and return its value."""
        integers, doubles = [], []
        if limits is not None and isinstance(default, float):
            doubles = [FloatingPointRange(from_value=limits[0], to_value=limits[1])]
        elif limits is not None:
            integers = [IntegerRange(from_value=limits[0], to_value=limits[1], step=1)]
        descriptor = ParameterDescriptor(
            description=description,
            additional_constraints=constraints or "",
            read_only=True,
            integer_range=integers,
            floating_point_range=doubles,
        )
        return self.declare_parameter(name, default, descriptor).value

    def declare_choice(
        self, name: str, default: str, choices: tuple[str, ...], description: str
    ) -> str:
        """Declare a read-only parameter with one of some values.

        Raises:
            ParameterError: it has another.
        """
        allowed = f"one of {', '.join(choices)}"
        value = self.declare(name, default, description, constraints=allowed)
        if value not in choices:
            raise ParameterError(f"{name}: '{value}' is not allowed: it must be {allowed}")
        return str(value)

    def declare_seed(self, description: str) -> np.random.Generator:
        """Declare the read-only parameter `seed`; returns the generator that it stands for."""
        limits = (0, 2**63 - 1)
        return np.random.default_rng(self.declare("seed", 0, description, limits))

    def subscribe(
        self,
        message_type: Any,
        topic: str,
        handle: Callable[[Any, float], None],
        profile: QoSProfile,
    ) -> None:
        """Subscribe to a topic; a message that cannot be used is reported and then forgotten.

        `handle` gets each message, and for how many seconds it waited to be handled.
        """

        def receive(message: Any, info: Mapping[str, int]) -> None:
            try:
                # Some middlewares leave times out, as 0.
                arrival = info["received_timestamp"] or info["source_timestamp"] or time_ns()
                handle(message, 1e-9 * (time_ns() - arrival))
            except MessageError as error:
                self._rejected[topic] += 1
                self.get_logger().error(
                    f"message on {topic} rejected: {error}", throttle_duration_sec=1.0
                )

        self.create_subscription(message_type, topic, receive, profile)

    def subscribe_state(self, handle: Callable[[Observation], None], profile: QoSProfile) -> None:
        """Subscribe to `joint_state`; `handle` gets each state that is newer than the last."""
        last_step, last_s = -1, self.scenario.initial_vehicle_state

        def receive(message: MultiDOFJointState, waited: float) -> None:
            nonlocal last_step, last_s
            vehicles = self.vehicles
            decoded = joint_state.decode(message, vehicles.joint_names, self.game.dt)
            stamp.check_newer(decoded.step, last_step)
            # A pose tells the heading only up to whole turns, but the goals count them.
            s = vehicles.unwrap(vehicles.state(decoded.poses, decoded.twists), last_s)
            w = vehicles.input(decoded.twists, decoded.accelerations)
            last_step, last_s = decoded.step, s
            handle(Observation(decoded.step, vehicles.game_state(s), s, w, waited))

        self.subscribe(MultiDOFJointState, "joint_state", receive, profile)

    def report(
        self, message: str, values: Mapping[str, object], level: bytes = diagnostics.OK
    ) -> None:
        """Publish how the node is doing."""
        figures = {key: str(value) for key, value in values.items()}
        figures["rejected_messages"] = str(self._rejected.total())
        status = diagnostics.Status(self.get_fully_qualified_name(), message, figures, level)
        self._diagnostics.publish(diagnostics.encode(status, self.get_clock().now().to_msg()))
