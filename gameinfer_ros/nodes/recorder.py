"""The node that records a run in memory."""

from collections import defaultdict
from typing import Any

from typing_extensions import override

from gameinfer_ros.nodes.base.follower_node import FollowerNode, Observation
from gameinfer_ros.nodes.base.run_statuses import MOST_NODES
from gameinfer_ros.runs.record import RunRecord
from msg_adapters import MessageError, belief, diagnostics, qos

_Figures = defaultdict[str, dict[int, Any]]


class Recorder(FollowerNode):
    """Fills a `RunRecord` from the topics of a run.

    A recorder that joins late also receives the earlier states and beliefs, up to 200. Each run
    gets a new record. Statuses of an earlier run are ignored.

    Subscribers:
        joint_state (sensor_msgs/MultiDOFJointState, `STREAM`)
        belief (std_msgs/Float64MultiArray, `STREAM`)
        /diagnostics (diagnostic_msgs/DiagnosticArray, `DIAGNOSTICS`)

    Attributes:
        record: the record of the present run.
        figures: newest values in `/diagnostics` of each node in the same namespace, by the full
            name of the node.
        solve_ms: solve time at each step, in ms, by the full name of the node and by step.
        safety: number of inputs that the safety layer has replaced by braking and has limited until
            each step, by the full name of the node and by step.
    """

    def __init__(self, name: str = "recorder", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self.record = RunRecord(self.vehicles)
        self.figures: dict[str, dict[str, str]] = {}
        self.solve_ms: defaultdict[str, dict[int, float]] = defaultdict(dict)
        self.safety: defaultdict[str, dict[int, tuple[int, int]]] = defaultdict(dict)
        self.subscribe_state(self._on_state, qos.STREAM)
        self.subscribe_belief(self._on_belief)
        self.subscribe_statuses(self._on_status, qos.DIAGNOSTICS, shared=True)

    @override
    def begin(self) -> None:
        self.solve_ms.clear()
        self.safety.clear()
        self.record = RunRecord(self.vehicles)

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

    def _on_belief(self, step: int, summary: belief.BeliefSummary, waited: float) -> None:
        self.record.beliefs[step] = summary.probabilities
        self.record.maps[step] = summary.map

    def _on_status(self, status: diagnostics.NodeStatus) -> None:
        diagnostics.whole_number(status, "late_steps")
        step = diagnostics.whole_number(status, "step")
        solve_ms = diagnostics.number(status, "solve_ms")
        braked = diagnostics.whole_number(status, "safety_braked")
        limited = diagnostics.whole_number(status, "safety_limited")
        self.figures[status.name] = dict(status.values)
        if step is not None and solve_ms is not None:
            self._store(self.solve_ms, status.name, step, solve_ms)
        if step is not None and braked is not None and limited is not None:
            self._store(self.safety, status.name, step, (braked, limited))

    def _store(self, known: _Figures, name: str, step: int, figure: Any) -> None:
        """Store a value of a node, unless there are more than the nodes can have reported."""
        of_node, count = known[name], sum(map(len, known.values()))
        most = MOST_NODES * (len(self.record.states) + 2)  # a status may arrive before its state
        if step not in of_node and count >= most:
            raise MessageError(f"{name}: step: {step} is ignored: {count} steps are already stored")
        of_node[step] = figure
