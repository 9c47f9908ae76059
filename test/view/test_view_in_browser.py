"""The page of a run, in a browser."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_context import make_context
from ros_domain import free_domain
from run_command import DEADLINE, Command
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.keys import Keys
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool

from gameinfer_ros.names.colours import COLOURS
from gameinfer_ros.nodes.viewer import Viewer
from msg_adapters import belief, diagnostics, qos

NAMES = ["robot", "human_1", "human_2"]
STEPS = 60
OPTIONS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    "--window-size=1280,900",
)


class Browser:
    def __init__(self, binary: str, driver: str, profile: Path) -> None:
        options = webdriver.ChromeOptions()
        options.binary_location = binary
        for option in (*OPTIONS, f"--user-data-dir={profile}"):
            options.add_argument(option)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(driver))

    def leave(self) -> None:
        """Leave the page, its messages and its requests."""
        self.driver.get("about:blank")
        self.errors()
        self.addresses()

    def js(self, expression: str) -> Any:
        return self.driver.execute_script(f"return {expression}")

    def text(self, element: str) -> str:
        return str(self.js(f"document.querySelector('{element}').textContent"))

    def until(self, condition: Callable[[], object], what: str) -> None:
        deadline = time.monotonic() + DEADLINE
        while not condition():
            shown = self.js("document.body.innerText")
            assert time.monotonic() < deadline, f"{what}; the page shows: {shown}"
            time.sleep(0.05)

    @property
    def step(self) -> int:
        found = re.match(r"\d+", self.text("#step"))
        return int(found[0]) if found else -1

    def bars(self) -> tuple[int, dict[str, float], list[str]]:
        """Number of the MAP, weight of each bar, and which bars stand out; of one moment."""
        number, bars, marked = self.js(
            "[document.getElementById('map').dataset.number,"
            " [...document.querySelectorAll('.particle')]"
            "   .map((row) => [row.dataset.number, Number(row.dataset.weight)]),"
            " [...document.querySelectorAll('.particle.map')].map((row) => row.dataset.number)]"
        )
        return int(number), dict(bars), marked

    def values(self, chart: str) -> dict[str, float]:
        """What the legend of a chart says, unrounded."""
        found = self.js(
            f"[...document.querySelectorAll('#{chart} li')]"
            ".map((item) => [item.children[1].textContent, Number(item.dataset.value)])"
        )
        return dict(found)

    def errors(self) -> list[str]:
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def addresses(self) -> set[str]:
        """Whatever the page asked for."""
        found = set()
        for entry in self.driver.get_log("performance"):
            event = json.loads(entry["message"])["message"]
            params = event["params"]
            if params.get("documentURL", "").startswith("chrome:"):
                continue  # a page of the browser's own
            if event["method"] == "Network.requestWillBeSent":
                found.add(params["request"]["url"])
            elif event["method"] == "Network.webSocketCreated":
                found.add(params["url"])
        return found


@pytest.fixture(scope="module")
def started_browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    binary = shutil.which("chromium") or shutil.which("chromium-browser")
    driver = shutil.which("chromedriver")
    if binary is None or driver is None:
        missing = "chromium" if binary is None else "chromedriver"
        words = f"{missing} is not installed, and this test looks at a page in it"
        # Where changes are checked before they land, no test may be left out.
        (pytest.fail if os.environ.get("CI") else pytest.skip)(words)
    made = Browser(binary, driver, tmp_path_factory.mktemp("profile"))
    yield made
    made.driver.quit()


@pytest.fixture
def browser(started_browser: Browser) -> Iterator[Browser]:
    yield started_browser
    started_browser.leave()


class Spun:
    """A node of the test's own, spun in a thread."""

    def __init__(self, domain: int) -> None:
        self.context = make_context(domain)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.node = Node("tester", context=self.context)
        self.executor.add_node(self.node)
        self._thread = Thread(target=self._spin)
        self._thread.start()

    def _spin(self) -> None:
        with suppress(ExternalShutdownException):
            self.executor.spin()

    def end(self) -> None:
        self.context.try_shutdown()
        self._thread.join()


@pytest.fixture
def spun(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[int], Spun]]:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    made: list[Spun] = []

    def make(domain: int) -> Spun:
        made.append(Spun(domain))
        return made[-1]

    yield make
    for one in made:
        one.end()


@pytest.fixture
def start_viewed(start: Callable[..., Command]) -> Callable[..., Command]:
    return partial(start, "--scenario", "three_player", "--time", "realtime", "--view")


def address(command: Command) -> str:
    command.until(lambda: "View: " in command.stdout)
    (found,) = re.findall(r"^View: (http://127\.0\.0\.1:\d+/)$", command.stdout, re.MULTILINE)
    return str(found)


def test_a_run_is_shown_from_start_to_end_and_then_the_next_one_until_its_viewer_dies(
    browser: Browser,
    start_viewed: Callable[..., Command],
    spun: Callable[[int], Spun],
    tmp_path: Path,
) -> None:
    domain, beliefs = free_domain(), []
    spun(domain).node.create_subscription(
        Float64MultiArray, "belief", lambda m: beliefs.append(belief.decode(m, 3)), qos.STREAM
    )
    out = tmp_path / "out"
    command = start_viewed(
        *("--seed", 3, "--steps", STEPS, "--out", out, "--view-port", 0), domain=domain
    )
    url = address(command)
    browser.driver.get(url)
    browser.until(lambda: browser.step >= 5, "no states")
    assert browser.text("#status") == "Live"
    assert browser.text("#title") == "three_player"
    shown = browser.js("[...document.querySelectorAll('#players li')].map((li) => li.textContent)")
    assert shown == NAMES
    assert browser.js("document.getElementById('controls').hidden")
    browser.until(lambda: browser.bars()[1], "no belief")
    number, bars, marked = browser.bars()
    assert marked == [str(number)]
    assert sum(bars.values()) == pytest.approx(1.0)
    drawn = browser.js(
        "[...['back', 'front'].map((id) => document.getElementById(id))].map((canvas) =>"
        " [...new Uint32Array(canvas.getContext('2d')"
        "   .getImageData(0, 0, canvas.width, canvas.height).data.buffer)])"
        ".map((pixels) => [...new Set(pixels)].map((p) => '#' +"
        " [p & 255, (p >> 8) & 255, (p >> 16) & 255]"
        "   .map((c) => c.toString(16).padStart(2, '0')).join('')))"
    )
    for pixels in drawn:
        assert set(COLOURS[:3]) <= set(pixels), "all players, and where they go, are drawn"
    assert browser.errors() == []

    assert command.exit_code() == 0, command.stdout + command.stderr
    browser.until(lambda: "stopped" in browser.text("#status"), "the end is not told")
    assert browser.text("#status") == "Run finished, viewer stopped"
    assert browser.text("#step") == f"{STEPS} / {STEPS}"
    figures = json.loads((out / "run.json").read_text())
    assert browser.values("costs") == pytest.approx(dict(zip(NAMES, figures["cost"], strict=True)))
    assert browser.values("clearance")["smallest so far"] == pytest.approx(
        figures["smallest_distance"]
    )
    assert browser.values("solves").keys() >= {"inference", "human_1_agent", "human_2_agent"}
    number, bars, marked = browser.bars()
    last = beliefs[-1]
    assert last.map == number
    assert marked == [str(number)]
    assert bars == pytest.approx(
        dict(zip(map(str, last.ids.tolist()), last.weights.tolist(), strict=True))
    )
    assert sum(bars.values()) == pytest.approx(1.0)

    port = url.rstrip("/").rpartition(":")[2]
    addresses = browser.addresses()
    assert {url, f"ws://127.0.0.1:{port}/live"} <= addresses
    assert not [a for a in addresses if not a.startswith((url, f"ws://127.0.0.1:{port}/", "data:"))]
    for error in browser.errors():  # it tries again and again
        assert f"'ws://127.0.0.1:{port}/live' failed" in error

    second = start_viewed("--steps", 1000, "--view-port", port, "--control")
    browser.until(lambda: browser.text("#step").endswith("/ 1000"), "the next run is not shown")
    browser.until(lambda: browser.step >= 1, "the next run is not shown")
    assert not browser.js("document.getElementById('controls').hidden")
    # Paused and restarted, it stays at its first state, however late the page is.
    browser.driver.find_element("id", "pause").click()
    browser.until(lambda: browser.text("#pause") == "Resume", "the run is not paused")
    browser.driver.find_element("id", "reset").click()
    browser.until(lambda: browser.step == 0, "the run does not restart")
    assert browser.values("costs") == dict.fromkeys(NAMES), "no step has been played"

    (viewer,) = (pid for pid, line in second.nodes().items() if "nodes.viewer " in line)
    os.kill(viewer, signal.SIGKILL)
    assert second.exit_code() == 1, second.stdout + second.stderr
    assert "node viewer ended with signal SIGKILL" in second.stderr
    assert second.leftovers() == {}
    browser.until(
        lambda: browser.text("#status") == "Connection lost, reconnecting", "the loss is told"
    )


@pytest.fixture
def viewer(spun: Callable[[int], Spun]) -> Iterator[tuple[Viewer, Node]]:
    """A viewer that may control its run, and the node of the test's own."""
    ours = spun(free_domain())
    made = Viewer(
        context=ours.context,
        namespace="/demo",
        parameter_overrides=[Parameter("port", value=0), Parameter("control", value=True)],
    )
    ours.executor.add_node(made)
    yield made, ours.node
    made.close()


def test_buttons_are_for_keyboards_too_and_answers_are_shown(
    browser: Browser, viewer: tuple[Viewer, Node]
) -> None:
    node, tester = viewer
    asked = []

    def pause(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        asked.append(request.data)
        response.success, response.message = request.data, "<b>as you say</b>"
        return response

    tester.create_service(SetBool, "/demo/simulator/pause", pause)
    browser.driver.get(node.server.address)
    browser.until(lambda: not browser.js("document.getElementById('controls').hidden"), "buttons")
    assert browser.text("#status") == "Waiting for the first state"
    focus = browser.driver.switch_to.active_element
    focus.send_keys(Keys.TAB)
    focus = browser.driver.switch_to.active_element
    assert focus.get_attribute("id") == "pause"
    focus.send_keys(Keys.ENTER)
    browser.until(lambda: browser.text("#pause") == "Resume", "not paused")
    assert browser.text("#answer") == "simulator/pause: <b>as you say</b>"
    browser.driver.find_element("id", "pause").send_keys(Keys.SPACE)
    browser.until(lambda: browser.text("#answer").startswith("Failed: "), "no answer")
    assert asked == [True, False]
    assert browser.text("#pause") == "Resume"
    assert browser.errors() == []


def test_names_are_text_and_nothing_else(browser: Browser, viewer: tuple[Viewer, Node]) -> None:
    node, tester = viewer
    browser.driver.get(node.server.address)
    hostile = "<img src=x onerror=document.title='mine'>"
    node.clock.start = 10**9
    figures = {"run": node.clock.run, "step": "1", "solve_ms": "2.5"}
    status = diagnostics.NodeStatus(f"/demo/{hostile}", "", figures)
    publisher = tester.create_publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    browser.until(lambda: publisher.get_subscription_count(), "nobody listens")
    publisher.publish(diagnostics.encode(status, 0))
    browser.until(lambda: browser.values("solves"), "no solve time")
    assert browser.values("solves") == {hostile: 2.5}
    assert browser.js("document.images.length") == 0
    assert browser.js("document.title") == "three_player – gameinfer"
    assert browser.errors() == []


def test_the_page_shows_when_no_state_arrives_and_when_the_viewer_stops(
    browser: Browser, viewer: tuple[Viewer, Node]
) -> None:
    node, _ = viewer
    browser.driver.get(node.server.address)
    vehicles = node.vehicles
    node.run.add_state(0, node.scenario.initial_vehicle_state, np.zeros(vehicles.n_inputs))
    node.server.tell()
    browser.until(lambda: browser.text("#status").startswith("No state for "), "silence is told")
    node.close()
    browser.until(
        lambda: browser.text("#status") == "Viewer stopped during the run", "the end is told"
    )
