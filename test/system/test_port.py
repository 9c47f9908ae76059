"""Ports of pages."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import suppress

import pytest

from gameinfer_ros.commands import cli
from gameinfer_ros.names.defaults import VIEW_HOST, VIEW_PORT
from gameinfer_ros.system import port as view_port


@pytest.fixture
def taken() -> Iterator[int]:
    with socket.create_server((VIEW_HOST, 0)) as server:
        yield server.getsockname()[1]


def test_a_wanted_port_is_taken_if_it_is_free() -> None:
    port = view_port.choose(0)
    assert port > 0
    assert not view_port.answers(port)
    assert view_port.choose(port) == port


def test_a_wanted_port_in_use_is_refused(taken: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert view_port.answers(taken)
    assert cli.main(["run", "--view", "--view-port", str(taken)]) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"--view-port: {taken} is not allowed")
    assert "not in use" in told


def test_without_a_wish_another_port_will_do() -> None:
    with suppress(OSError), socket.create_server((VIEW_HOST, VIEW_PORT)):
        assert view_port.choose(None) not in (0, VIEW_PORT)
