"""A server of the page, without nodes."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from gameinfer_ros.names.defaults import VIEW_HOST
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.view import Answer, LiveRun, ViewServer


@pytest.fixture
def asked() -> list[str]:
    return []


@pytest.fixture
def live_run(three_player: Scenario) -> LiveRun:
    return LiveRun(three_player, "three_player", 100)


@pytest.fixture
def server(live_run: LiveRun, asked: list[str]) -> Iterator[ViewServer]:
    async def act(action: str) -> Answer:
        asked.append(action)
        return Answer(True, action)

    server = ViewServer(live_run, VIEW_HOST, 0, act, lambda: None)
    yield server
    server.close()
