"""The viewer, seen by a client of its server, and by the nodes whose services it calls."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
import pytest
from aiohttp import WSMsgType
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.publisher import Publisher
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker, MarkerArray

from gameinfer_ros.nodes import run_control
from gameinfer_ros.nodes.parameter_node import ParameterError
from gameinfer_ros.nodes.viewer import Viewer
from gameinfer_ros.run_record import RunRecord
from gameinfer_ros.scenario import Scenario
from msg_adapters import belief, diagnostics, markers, qos

STEPS = 6


class Page:
    """What a page was told."""

    def __init__(self) -> None:
        self.updates: list[dict[str, Any]] = []
        self.closed = False

    def all(self, key: str) -> list[Any]:
        """What all updates say of something."""
        return [update[key] for update in self.updates if key in update]

    @property
    def states(self) -> list[dict[str, Any]]:
        """The states since the page was told to begin anew."""
        found: list[dict[str, Any]] = []
        for update in self.updates:
            if "scenario" in update:
                found.clear()
            found += update.get("states", [])
        return found


class Browser:
    """A client in a thread of its own."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._pages: dict[int, asyncio.Task[None]] = {}

    def request(self, method: str, url: str, **headers: str) -> Future[tuple[int, str, Any]]:
        """Status, body and headers of an answer."""

        async def do() -> tuple[int, str, Any]:
            async with (
                aiohttp.ClientSession() as session,
                session.request(method, url, headers=headers) as response,
            ):
                return response.status, await response.text(), response.headers

        return self._submit(do())

    def open(self, url: str) -> Page:
        """A page that listens to a server."""
        page = Page()

        async def listen() -> None:
            async with (
                aiohttp.ClientSession() as session,
                session.ws_connect(url + "live", origin=url.rstrip("/")) as ws,
            ):
                async for message in ws:
                    if message.type == WSMsgType.TEXT:
                        page.updates.append(json.loads(message.data))
            page.closed = True

        async def start() -> None:
            self._pages[id(page)] = asyncio.create_task(listen())

        self._submit(start()).result()
        return page

    def leave(self, page: Page) -> None:
        self._loop.call_soon_threadsafe(self._pages[id(page)].cancel)

    def end(self) -> None:
        async def stop() -> None:
            for task in self._pages.values():
                task.cancel()
            await asyncio.gather(*self._pages.values(), return_exceptions=True)

        self._submit(stop()).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _submit(self, work: Coroutine[Any, Any, Any]) -> Future[Any]:
        return asyncio.run_coroutine_threadsafe(work, self._loop)


@pytest.fixture
def browser() -> Iterator[Browser]:
    made = Browser()
    yield made
    made.end()


@pytest.fixture
def file(scenario_file: Callable[..., Path]) -> Path:
    return scenario_file("uuc", steps=STEPS)


@pytest.fixture
def viewer(world: Any, file: Path) -> Viewer:
    made: Viewer = world.add(Viewer, scenario=file, port=0, namespace="/demo")
    return made


class Run:
    """Publishes a run."""

    def __init__(self, world: Any, wire: Any, file: Path) -> None:
        scenario = Scenario.load(file)
        self._world, self._wire, self.dt = world, wire(scenario), scenario.dt
        vehicles, rng = scenario.vehicles, np.random.default_rng(0)
        self._publisher: Publisher | None = None
        self.record = RunRecord(vehicles, [scenario.initial_vehicle_state])
        for _ in range(STEPS):
            self.record.inputs.append(rng.uniform(-0.3, 0.3, vehicles.n_inputs))
            s, w = self.record.states[-1], self.record.inputs[-1]
            self.record.states.append(vehicles.step(s, w))

    def publish(self, *steps: int, listeners: int = 1) -> None:
        """Publish the states of these steps."""
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


def answer(world: Any, future: Future[Any]) -> Any:
    world.until(future.done, "no answer")
    return future.result()


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


def test_who_comes_late_sees_the_whole_run(
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


def test_a_new_run_begins_anew_and_the_past_is_rejected(
    viewer: Viewer, browser: Browser, world: Any, run: Run
) -> None:
    page = browser.open(viewer.server.address)
    run.publish(0, 1, 2)
    world.until(lambda: len(page.states) == 3)
    run.publish(1, 0, 1)
    world.until(lambda: len(page.all("scenario")) == 2 and len(page.states) == 2)
    assert [row["step"] for row in page.states] == [0, 1]
    assert viewer.topic_faults.rejected == {"joint_state": 1}


def test_the_belief_and_solve_times_of_its_own_robot(
    viewer: Viewer, browser: Browser, world: Any, run: Run
) -> None:
    page = browser.open(viewer.server.address)
    world.until(lambda: page.updates)
    ids, weights = np.array([4, 2, 9]), np.array([0.5, 0.3, 0.2])
    summary = belief.BeliefSummary(
        5, 4, ids, weights, np.ones(3, dtype=bool), np.full((3, 3), np.inf)
    )
    world.publisher(Float64MultiArray, "/demo/belief", qos.STREAM).publish(
        belief.encode(summary, run.dt)
    )
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
        status = diagnostics.Status(name, "goes on", figures)
        publisher.publish(diagnostics.encode(status, world.tester.get_clock().now().to_msg()))
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
    now = world.tester.get_clock().now().to_msg()
    line, colour = np.array([[0.0, 1.0], [2.0, 3.0004]]), (1.0, 0.0, 0.0, 0.25)
    message = markers.encode(
        [
            markers.Arrow("players/robot", 0, np.zeros(3), colour, 0.4),
            markers.Path("particles/robot", 17, line, colour, 0.02),
            markers.Path("particles/nobody", 17, line, colour, 0.02),
            markers.Path("goals/robot", 17, line, colour, 0.02),
            markers.Path("map/human_2", 2, line, colour, 0.06),
        ],
        now,
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


def test_pages_are_told_when_the_viewer_ends(
    viewer: Viewer, browser: Browser, world: Any, run: Run
) -> None:
    page = browser.open(viewer.server.address)
    run.publish(0, 1)
    world.until(lambda: len(page.states) == 2)
    viewer.close()
    world.until(lambda: page.closed)
    assert [update["ended"] for update in page.updates][-2:] == [False, True]
    viewer.close()  # for the second time


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "https://127.0.0.1:{port}"},
        {"Origin": "http://127.0.0.1:1"},
        {"Host": "evil.example:{port}"},
        {"Host": "evil.example:{port}", "Origin": "http://evil.example:{port}"},
        {"Host": "127.0.0.1.evil.example"},
        {"Host": "[::1"},
        {"Host": ""},
    ],
)
@pytest.mark.parametrize(
    ("method", "path"), [("GET", ""), ("GET", "live"), ("POST", "control/pause")]
)
def test_pages_of_others_are_refused(
    method: str, path: str, headers: dict[str, str], world: Any, file: Path, browser: Browser
) -> None:
    viewer = world.add(Viewer, scenario=file, port=0, control=True)
    url = viewer.server.address
    headers = {k: v.format(port=url.rstrip("/").split(":")[-1]) for k, v in headers.items()}
    status, text, _ = answer(world, browser.request(method, url + path, **headers))
    assert status == 403
    assert "is not allowed: it must be" in text


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost", "192.168.1.5", "[::1]"])
def test_its_own_page_is_served_by_any_address_of_this_machine(
    name: str, viewer: Viewer, browser: Browser, world: Any
) -> None:
    # By another port too, as if it were forwarded.
    headers = {"Host": f"{name}:9000", "Origin": f"http://{name}:9000"}
    status, *_ = answer(world, browser.request("GET", viewer.server.address, **headers))
    assert status == 200


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


class Services:
    """The services of a run's nodes, which the test's own node offers."""

    def __init__(self, world: Any, *names: str) -> None:
        self.called: list[Any] = []
        self._refusing: set[str] = set()
        for name in names:
            world.tester.create_service(Trigger, f"/demo/{name}/reset", self._trigger(name))
        world.tester.create_service(SetBool, "/demo/simulator/pause", self._pause)

    def refuse(self, name: str) -> None:
        self._refusing.add(name)

    def _trigger(self, name: str) -> Callable[..., Any]:
        def serve(request: Any, response: Any) -> Any:
            self.called.append(name)
            response.success = name not in self._refusing
            response.message = "not now" if name in self._refusing else "as new"
            return response

        return serve

    def _pause(self, request: Any, response: Any) -> Any:
        self.called.append(request.data)
        response.success = True
        return response


EVERYBODY = ("simulator", "inference", "robot_planner", "human_1_agent", "human_2_agent")


@pytest.fixture
def ask(world: Any, file: Path, browser: Browser) -> Callable[[str], tuple[int, str]]:
    """Asks a viewer that may control its run."""
    viewer = world.add(Viewer, scenario=file, port=0, control=True, namespace="/demo")

    def do(action: str) -> tuple[int, str]:
        url = f"{viewer.server.address}control/{action}"
        status, text, _ = answer(world, browser.request("POST", url))
        return status, text

    do.viewer = viewer  # type: ignore[attr-defined]
    return do


def test_a_run_is_paused_and_set_back(ask: Any, world: Any, browser: Browser) -> None:
    services = Services(world, *EVERYBODY)
    page = browser.open(ask.viewer.server.address)
    status, text = ask("pause")
    assert status == 200
    assert json.loads(text) == {"success": True, "message": "simulator/pause: done"}
    world.until(lambda: page.updates[-1]["paused"])
    assert page.updates[-1]["control"] is True
    assert ask("resume")[0] == 200
    world.until(lambda: not page.updates[-1]["paused"])
    assert json.loads(ask("reset")[1])["message"] == "simulator/reset: as new"
    assert services.called == [True, False, "simulator"]
    assert ask("stop")[0] == 404


def test_new_seeds_reset_everybody_and_then_the_simulator(ask: Any, world: Any) -> None:
    services = Services(world, *EVERYBODY)
    world.until(
        lambda: all(client.service_is_ready() for client in ask.viewer.clients), "not discovered"
    )
    assert json.loads(ask("new_seeds")[1])["success"]
    assert sorted(services.called) == sorted(EVERYBODY)
    assert services.called[-1] == "simulator"


def test_the_run_goes_on_if_somebody_refuses_new_seeds(ask: Any, world: Any) -> None:
    services = Services(world, *EVERYBODY)
    services.refuse("inference")
    told = json.loads(ask("new_seeds")[1])
    assert told == {"success": False, "message": "inference/reset: not now"}
    assert "simulator" not in services.called


def test_a_human_without_an_agent_is_named(ask: Any, world: Any) -> None:
    Services(world, *EVERYBODY[:-1])
    ready = [client.srv_name for client in ask.viewer.clients]
    assert "human_2_agent/reset" in ready
    world.until(
        lambda: sum(client.service_is_ready() for client in ask.viewer.clients) == len(ready) - 1
    )
    told = json.loads(ask("new_seeds")[1])
    assert told["success"]
    assert "not there: human_2_agent/reset" in told["message"]


def test_a_service_that_nobody_offers_is_named(ask: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_control, "PATIENCE", 0.2)
    told = json.loads(ask("pause")[1])
    assert told == {
        "success": False,
        "message": "simulator/pause: nobody offers this service",
    }


def test_a_port_in_use_is_refused(world: Any, file: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ParameterError, match=rf"port: '127.0.0.1', {port} is not allowed"):
            world.add(Viewer, scenario=file, port=port)


def test_an_address_of_another_machine_is_refused(world: Any, file: Path) -> None:
    with pytest.raises(ParameterError, match=r"host, port: '192\.0\.2\.1', 0 is not allowed"):
        world.add(Viewer, scenario=file, port=0, host="192.0.2.1")
