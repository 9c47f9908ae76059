"""Pages that pause and reset a run, by services of the nodes of the run."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from browser import Browser, answer
from small_scenario import ScenarioFile
from std_srvs.srv import SetBool, Trigger

from gameinfer_ros.nodes.viewer import Viewer
from gameinfer_ros.nodes.viewing import run_control


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


ALL_NODES = ("simulator", "inference", "human_1_agent", "human_2_agent")


@pytest.fixture
def ask(
    world: Any, scenario_file: ScenarioFile, browser: Browser
) -> Callable[[str], tuple[int, str]]:
    viewer = world.add(
        Viewer, scenario=scenario_file("uuc"), port=0, control=True, namespace="/demo"
    )

    def do(action: str) -> tuple[int, str]:
        url = f"{viewer.server.address}control/{action}"
        status, text, _ = answer(world, browser.request("POST", url))
        return status, text

    do.viewer = viewer  # type: ignore[attr-defined]
    return do


def test_a_run_is_paused_and_set_back(ask: Any, world: Any, browser: Browser) -> None:
    services = Services(world, *ALL_NODES)
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


def test_new_seeds_reset_all_nodes_and_the_simulator_last(ask: Any, world: Any) -> None:
    services = Services(world, *ALL_NODES)
    world.until(
        lambda: all(client.service_is_ready() for client in ask.viewer.clients), "not discovered"
    )
    assert json.loads(ask("new_seeds")[1])["success"]
    assert sorted(services.called) == sorted(ALL_NODES)
    assert services.called[-1] == "simulator"


def test_the_run_continues_if_a_node_refuses_new_seeds(ask: Any, world: Any) -> None:
    services = Services(world, *ALL_NODES)
    services.refuse("inference")
    told = json.loads(ask("new_seeds")[1])
    assert told == {"success": False, "message": "inference/reset: not now"}
    assert "simulator" not in services.called


def test_a_human_without_an_agent_is_named(ask: Any, world: Any) -> None:
    Services(world, *ALL_NODES[:-1])
    ready = [client.srv_name for client in ask.viewer.clients]
    assert "human_2_agent/reset" in ready
    world.until(
        lambda: sum(client.service_is_ready() for client in ask.viewer.clients) == len(ready) - 1
    )
    told = json.loads(ask("new_seeds")[1])
    assert told["success"]
    assert "not available: human_2_agent/reset" in told["message"]


def test_a_missing_service_is_named(ask: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_control, "PATIENCE", 0.2)
    told = json.loads(ask("pause")[1])
    assert told == {"success": False, "message": "simulator/pause: the service is not available"}
