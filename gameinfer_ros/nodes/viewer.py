"""The node that shows a run in a web browser."""

import sys
from pathlib import Path
from typing import Any

from typing_extensions import override
from visualization_msgs.msg import Marker, MarkerArray

from gameinfer_ros.names.defaults import VIEW_HOST, VIEW_PORT
from gameinfer_ros.nodes.base.checked_subscription import CheckedSubscription
from gameinfer_ros.nodes.base.follower_node import FollowerNode, Observation
from gameinfer_ros.nodes.base.parameter_node import ParameterError
from gameinfer_ros.nodes.base.spin import spin
from gameinfer_ros.nodes.viewing.run_control import RunControl
from gameinfer_ros.scenario import MOST_STEPS
from gameinfer_ros.view import LiveRun, Trajectory, ViewServer
from msg_adapters import MessageError, belief, diagnostics, markers, qos

#: In bytes. Five players and 150 particles need less than a tenth of it.
_LARGEST_MARKERS = 2**24


class Viewer(FollowerNode):
    """Serves a web page that shows the players and the robot's belief.

    It stores the run, so that a page that is opened late shows all of it. While no page is open, it
    computes nothing and does not subscribe to markers.

    Subscribers:
        joint_state (sensor_msgs/MultiDOFJointState, `STREAM`)
        belief (std_msgs/Float64MultiArray, `STREAM`)
        /diagnostics (diagnostic_msgs/DiagnosticArray, `ANY_DIAGNOSTICS`)
        markers (visualization_msgs/MarkerArray, `LATEST`): while a page is open.

    Clients: those of `RunControl`, if pages can control the run.
    """

    def __init__(self, name: str = "viewer", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        host = self.declare(
            "host",
            VIEW_HOST,
            "name or address to listen on; the default accepts connections from this machine only",
        )
        port = self.declare("port", VIEW_PORT, "port to listen on; 0 for any free port", (0, 65535))
        control = self.declare("control", False, "whether pages can pause and reset the run")
        steps = self.declare(
            "steps", 0, "number of steps of the run; 0 for that of the scenario", (0, MOST_STEPS)
        )
        title = Path(self.get_parameter("scenario").value).stem
        self.run = LiveRun(self.scenario, title, steps or self.scenario.steps)
        self._markers: CheckedSubscription | None = None
        # Subscriptions must change in the thread that spins this node, not in that of the server.
        self._pages_changed = self.create_guard_condition(self._subscribe_markers)
        act = RunControl(self, self.players.names[1:], self.run.set_paused).act if control else None
        try:
            self.server = ViewServer(self.run, host, port, act, self._pages_changed.trigger)
        except (OSError, ValueError) as error:  # ValueError: the host cannot be a name
            raise ParameterError(
                f"host, port: '{host}', {port} is not allowed: it must be a free port of this "
                f"machine: {error}"
            ) from None
        self.subscribe_state(self._on_state, qos.STREAM)
        self.subscribe_belief(self._on_belief)
        self.subscribe_statuses(self._on_status, qos.ANY_DIAGNOSTICS)
        self.get_logger().info(f"ready: {self.server.address}")

    @override
    def close(self) -> None:
        """Tell open pages that the run has ended, and stop the server."""
        self.server.close()

    @override
    def destroy_node(self) -> None:
        self.close()
        super().destroy_node()

    @override
    def begin(self) -> None:
        self.run.begin()
        self.server.tell()

    def _on_state(self, observation: Observation) -> None:
        self.run.add_state(observation.step, observation.s, observation.w)
        self.server.tell()

    def _on_belief(self, step: int, summary: belief.BeliefSummary, waited: float) -> None:
        self.run.add_belief(step, summary.map, summary.probabilities)
        self.server.tell()

    def _on_status(self, status: diagnostics.NodeStatus) -> None:
        step = diagnostics.whole_number(status, "step")
        ms = diagnostics.number(status, "solve_ms")
        if step is not None and ms is not None:
            try:
                self.run.add_solve_time(status.name.rpartition("/")[2], step, ms)
            except ValueError as error:
                raise MessageError(f"{status.name}: {error}") from None
            self.server.tell()

    def _subscribe_markers(self) -> None:
        """Subscribe to the markers only while a page is open; they take time to create."""
        if self.server.pages and self._markers is None:
            self._markers = self.subscribe(
                MarkerArray, "markers", self._on_markers, qos.LATEST, _LARGEST_MARKERS
            )
        elif not self.server.pages and self._markers is not None:
            self.unsubscribe(self._markers)
            self._markers = None

    def _on_markers(self, message: MarkerArray, waited: float) -> None:
        self.run.add_trajectories(
            self._trajectories(message, "particles"), self._trajectories(message, "map")
        )
        self.server.tell()

    def _trajectories(self, message: MarkerArray, kind: str) -> list[Trajectory]:
        """The lines in the namespaces `<kind>/<player>`; other markers are ignored."""
        namespaces = {f"{kind}/{name}": name for name in self.players.names}
        lines = [m for m in message.markers if m.type == Marker.LINE_STRIP and m.ns in namespaces]
        return [
            Trajectory(namespaces[path.namespace], path.number, path.colour[3], path.points)
            for path in markers.decode(MarkerArray(markers=lines))
            if isinstance(path, markers.Path)
        ]


if __name__ == "__main__":
    sys.exit(spin(Viewer, sys.argv[1:]))
