"""Watches a run and keeps a record of it."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Float64MultiArray
from typing_extensions import override

from gameinfer_ros.inference import MOST_PARTICLES
from gameinfer_ros.nodes.base.game_node import GameNode, Observation
from gameinfer_ros.nodes.base.status_order import StatusOrder
from gameinfer_ros.nodes.base.step_order import StepOrder
from gameinfer_ros.runs.record import RunRecord
from msg_adapters import MessageError, belief, diagnostics, multi_array, qos


class Recorder(GameNode):
    """Fills a `RunRecord` with what the other nodes publish.

    It joins late without a loss: states and beliefs since the start of the run reach it too. When
    a new run begins, it begins a new record; what nodes still say of the run before does not count.

    Subscribers:
        joint_state (sensor_msgs/MultiDOFJointState, `STREAM`)
        belief (std_msgs/Float64MultiArray, `STREAM`)
        /diagnostics (diagnostic_msgs/DiagnosticArray, `DIAGNOSTICS`)

    Attributes:
        record: the record so far.
        figures: newest figures that each node in our namespace gave of itself, by its full name.
        solve_ms: how long each node took to solve games at each step, likewise.
        safety: how often the safety layer of each node has braked and limited until each step.
    """

    def __init__(self, name: str = "recorder", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self._beliefs, self._statuses = StepOrder(), StatusOrder()
        self.record = RunRecord(self.vehicles)
        self.figures: dict[str, dict[str, str]] = {}
        self.solve_ms: defaultdict[str, dict[int, float]] = defaultdict(dict)
        self.safety: defaultdict[str, dict[int, tuple[int, int]]] = defaultdict(dict)
        self.subscribe_state(self._on_state, qos.STREAM)
        largest = multi_array.largest(MOST_PARTICLES, 3 + len(self.players))
        self.subscribe(Float64MultiArray, "belief", self._on_belief, qos.STREAM, largest)
        self.subscribe(DiagnosticArray, "/diagnostics", self._on_diagnostics, qos.DIAGNOSTICS)

    @override
    def begin(self) -> None:
        self._statuses.begin()
        self.solve_ms.clear()
        self.safety.clear()
        before, self.record = self.record, RunRecord(self.vehicles)
        if self._beliefs.newest == 0:  # it came before its state
            self.record.beliefs[0], self.record.maps[0] = before.beliefs[0], before.maps[0]
        else:
            self._beliefs.forget()

    def _on_state(self, observation: Observation) -> None:
        expected = len(self.record.states)
        try:
            self.record.add_state(observation.step, observation.s, observation.w)
        except ValueError as error:
            raise MessageError(f"stamp: {error}") from None
        if observation.step != expected:
            self.get_logger().warn(
                f"the states of steps {expected} to {observation.step - 1} are missing"
            )

    def _on_belief(self, message: Float64MultiArray, waited: float) -> None:
        summary = belief.decode(message, len(self.players), self.game.dt)
        if summary.step == 0:
            self._beliefs.forget()
        self._beliefs.admit(summary.step, len(self.record.states) - 1)
        self.record.beliefs[summary.step] = dict(
            zip(summary.ids.tolist(), summary.weights.tolist(), strict=True)
        )
        self.record.maps[summary.step] = summary.map

    def _on_diagnostics(self, message: DiagnosticArray, waited: float) -> None:
        namespace = self.get_namespace().rstrip("/") + "/"
        for status in diagnostics.decode(message):
            if status.name.rpartition("/")[0] + "/" != namespace:
                continue  # the topic is that of all robots
            diagnostics.whole_number(status, "late_steps")
            step = diagnostics.whole_number(status, "step")
            solve_ms = diagnostics.number(status, "solve_ms")
            braked = diagnostics.whole_number(status, "safety_braked")
            limited = diagnostics.whole_number(status, "safety_limited")
            if not self._statuses.admits(status, len(self.record.states) - 1):
                continue
            self.figures[status.name] = dict(status.values)
            if step is not None and solve_ms is not None:
                self.solve_ms[status.name][step] = solve_ms
            if step is not None and braked is not None and limited is not None:
                self.safety[status.name][step] = braked, limited
