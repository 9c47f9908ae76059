"""The viewer, seen by a client of its server."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Browser, answer
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.publisher import Publisher
from sensor_msgs.msg import MultiDOFJointState
from small_scenario import ScenarioFile
from std_msgs.msg import Float64MultiArray
from visualization_msgs.msg import Marker, MarkerArray

from gameinfer_ros.nodes.base.parameter_node import ParameterError
from gameinfer_ros.nodes.viewer import Viewer
from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.scenario import Scenario
from msg_adapters import belief, diagnostics, markers, qos

STEPS = 6


@pytest.fixture
def file(scenario_file: ScenarioFile) -> Path:
    return scenario_file("uuc", steps=STEPS)


@pytest.fixture
def viewer(world: Any, file: Path) -> Viewer:
    return world.add(Viewer, scenario=file, port=0, namespace="/demo")


class Run:
    def __init__(self, world: Any, wire: Any, file: Path) -> None:
        scenario = Scenario.load(file)
        self._world, self._wire = world, wire(scenario)
        self.clock = self._wire.clock
        vehicles, rng = scenario.vehicles, np.random.default_rng(0)
        self._publisher: Publisher | None = None
        self.record = RunRecord(vehicles, [scenario.initial_vehicle_state])
        for _ in range(STEPS):
            self.record.inputs.append(rng.uniform(-0.3, 0.3, vehicles.n_inputs))
            s, w = self.record.states[-1], self.record.inputs[-1]
            self.record.states.append(vehicles.step(s, w))

    def start(self, listeners: int = 1) -> None:
        self._world.start_run(self.clock.start, "/demo/run_start", listeners)

    def publish(self, *steps: int, listeners: int = 1) -> None:
        """Publish the start of the run and the states of these steps."""
        self.start(listeners)
        if self._publisher is None:
            self._publisher = self._world.publisher(
                MultiDOFJointState, "/demo/joint_state", qos.STREAM, listeners
            )
        for step in steps:
            w = self.record.inputs[step - 1] if step else None
            self._publisher.publish(self._wire.state(step, self.record.states[step], w))


@pytest.fixture
def run(world: Any, wire: Any, file: Path) -> Run:
    return Run(world, wire, file)


def test_the_page_needs_nothing_from_elsewhere(
    viewer: Viewer, browser: Browser, world: Any
) -> None:
    status, text, headers = answer(world, browser.request("GET", viewer.server.address))
    assert status == 200
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy
    assert "script-src 'sha256-" in policy
    assert text.replace("http://www.w3.org/2000/svg", "").count("http") == 0
    assert "innerHTML" not in text and " src=" not in text


def test_a_page_shows_what_a_record_of_the_run_says(
    viewer: Viewer, browser: Browser, world: Any, run: Run
) -> None:
    page = browser.open(viewer.server.address)
    world.until(lambda: page.all("scenario"))
    scenario = page.all("scenario")[0]
    assert scenario["title"] == "uuc"
    assert [player["name"] for player in scenario["players"]] == ["robot", "human_1", "human_2"]
    run.publish(*range(STEPS + 1))
    world.until(lambda: len(page.states) == STEPS + 1)
    rows, record = page.states, run.record
    costs = np.sum([row["costs"] for row in rows[1:]], axis=0)
    np.testing.assert_allclose(costs, record.costs, rtol=1e-9)
    assert min(row["clearance"] for row in rows) == pytest.approx(record.smallest_distance)
    for row, s in zip(rows, record.states, strict=True):
        found, wanted = np.array(row["poses"]), record.vehicles.poses(s)[:3]
        np.testing.assert_allclose(found[:, :2], wanted[:, :2], atol=1e-9)
        np.testing.assert_allclose(np.cos(found[:, 2] - wanted[:, 2]), 1.0)
    assert page.updates[-1]["over"]


def test_a_late_viewer_shows_the_whole_run(
    world: Any, file: Path, browser: Browser, run: Run
) -> None:
    run.publish(*range(4), listeners=0)
    viewer = world.add(Viewer, scenario=file, port=0, namespace="/demo")
    world.until(lambda: viewer.run.newest == 3, "the viewer comes late")
    page = browser.open(viewer.server.address)
    world.until(lambda: page.states)
    assert [row["step"] for row in page.states] == [0, 1, 2, 3]
    assert page.updates[0]["age"] > 0
    assert not page.updates[0]["over"]


def test_the_belief_and_solve_times_of_its_own_robot(
    viewer: Viewer, browser: Browser, world: Any, run: Run
) -> None:
    page = browser.open(viewer.server.address)
    world.until(lambda: page.updates)
    ids, weights = np.array([4, 2, 9]), np.array([0.5, 0.3, 0.2])
    run.start()
    summary = belief.BeliefSummary(
        run.clock.stamp(5), 4, ids, weights, np.ones(3, dtype=bool), np.full((3, 3), np.inf)
    )
    world.publisher(Float64MultiArray, "/demo/belief", qos.STREAM).publish(belief.encode(summary))
    world.until(lambda: page.all("belief"))
    assert page.all("belief") == [{"step": 5, "map": 4, "weights": [[2, 0.3], [4, 0.5], [9, 0.2]]}]
    publisher = world.publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    for name, figures in (
        ("/other/inference", {"step": "1", "solve_ms": "9"}),
        ("/demonstration/inference", {"step": "1", "solve_ms": "9"}),
        ("/demo/simulator", {"step": "1"}),
        ("/demo/inference", {"step": "1", "solve_ms": "nan"}),
        ("/demo/inference", {"step": "none", "solve_ms": "9"}),
        ("/demo/inference", {"step": "1", "solve_ms": "2.5"}),
    ):
        status = diagnostics.NodeStatus(name, "goes on", {"run": run.clock.run, **figures})
        publisher.publish(diagnostics.encode(status, 0))
    world.until(lambda: page.all("solves"))
    assert page.all("solves") == [[["inference", 1, 2.5]]]
    assert viewer.topic_faults.rejected == {"/diagnostics": 2}


def test_markers_are_asked_for_only_while_a_page_is_open(
    viewer: Viewer, browser: Browser, world: Any
) -> None:
    topic = "/demo/markers"
    assert world.tester.count_subscribers(topic) == 0
    pages = [browser.open(viewer.server.address) for _ in range(2)]
    world.until(lambda: world.tester.count_subscribers(topic) == 1)
    line, colour = np.array([[0.0, 1.0], [2.0, 3.0004]]), (1.0, 0.0, 0.0, 0.25)
    message = markers.encode(
        [
            markers.Arrow("players/robot", 0, colour, 0.4, np.zeros(3)),
            markers.Path("particles/robot", 17, colour, 0.02, line),
            markers.Path("particles/nobody", 17, colour, 0.02, line),
            markers.Path("goals/robot", 17, colour, 0.02, line),
            markers.Path("map/human_2", 2, colour, 0.06, line),
        ],
        0,
    )
    unknown = Marker(header=message.markers[0].header, ns="particles/robot", type=Marker.POINTS)
    message.markers.append(unknown)
    world.publisher(MarkerArray, topic, qos.RECENT).publish(message)
    world.until(lambda: all(page.all("trajectories") for page in pages))
    points = [0.0, 1.0, 2.0, 3.0]
    assert pages[0].all("trajectories") == [
        {
            "particles": [{"player": "robot", "number": 17, "opacity": 0.25, "points": points}],
            "map": [{"player": "human_2", "number": 2, "opacity": 0.25, "points": points}],
        }
    ]
    browser.leave(pages[0])
    world.until(lambda: viewer.server.pages == 1)
    world.spin(0.2)
    assert world.tester.count_subscribers(topic) == 1, "a page is left"
    browser.leave(pages[1])
    world.until(lambda: world.tester.count_subscribers(topic) == 0)


def test_pages_learn_when_the_viewer_stops(
    viewer: Viewer, browser: Browser, world: Any, run: Run
) -> None:
    page = browser.open(viewer.server.address)
    run.publish(0, 1)
    world.until(lambda: len(page.states) == 2)
    viewer.close()
    world.until(lambda: page.closed)
    assert [update["ended"] for update in page.updates][-2:] == [False, True]
    viewer.close()  # for the second time


def test_control_is_refused_unless_it_was_allowed(
    viewer: Viewer, browser: Browser, world: Any
) -> None:
    url = viewer.server.address
    for action in ("pause", "resume", "reset", "new_seeds"):
        status, text, _ = answer(world, browser.request("POST", f"{url}control/{action}"))
        assert status == 403
        assert "may not control" in text
    page = browser.open(url)
    world.until(lambda: page.updates)
    assert page.updates[0]["control"] is False


def test_a_port_in_use_and_an_address_of_another_machine_are_refused(
    world: Any, file: Path
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        for host, port in (taken.getsockname(), ("192.0.2.1", 0)):
            with pytest.raises(ParameterError, match=f"host, port: '{host}', {port} is not allow"):
                world.add(Viewer, scenario=file, host=host, port=port)
