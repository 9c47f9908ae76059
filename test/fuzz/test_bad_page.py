"""The page's server survives anything that is sent to it."""

from __future__ import annotations

import asyncio
import socket
import urllib.request

import aiohttp
import numpy as np
import pytest
from nodes_room import memory

from gameinfer_ros.view import LiveRun, ViewServer

METHODS = ("GET", "POST", "PUT", "DELETE", "PATCH", "HEAD", "OPTIONS", "TRACE", "X" * 100)
PATHS = ("/", "/live", "/control/pause", "/control/nothing", "/control/%00", "/" + "a" * 10_000,
         "/../../etc/passwd", "/%2e%2e/", "//", "/live?x=" + "y" * 5000, "/\u00e9")  # fmt: skip


def port(server: ViewServer) -> int:
    return int(server.address.rstrip("/").rpartition(":")[2])


def talk(server: ViewServer, data: bytes) -> bytes:
    with socket.create_connection(("127.0.0.1", port(server)), timeout=30) as peer:
        try:
            peer.sendall(data)
            peer.settimeout(0.05)
            return peer.recv(65536)
        except (ConnectionError, TimeoutError):
            return b""  # it had enough, or wants more


def is_alive(server: ViewServer) -> bool:
    with urllib.request.urlopen(server.address, timeout=60) as answer:
        return answer.status == 200 and b"<html" in answer.read()


def test_bytes_that_are_no_request_do_no_harm(
    server: ViewServer, caplog: pytest.LogCaptureFixture
) -> None:
    rng = np.random.default_rng(0)
    for _ in range(60):
        talk(server, rng.bytes(int(rng.integers(1, 3000))))
        talk(server, b"GET / HTTP/1.1\r\n" + rng.bytes(int(rng.integers(1, 300))))
    assert is_alive(server)
    assert not caplog.records, "any client could fill the log"


def test_methods_paths_headers_and_bodies_of_any_size_do_no_harm(server: ViewServer) -> None:
    host = f"Host: 127.0.0.1:{port(server)}\r\n"
    for method in METHODS:
        for path in PATHS:
            answer = talk(server, f"{method} {path} HTTP/1.1\r\n{host}\r\n".encode())
            assert not answer.startswith(b"HTTP/1.1 500"), (method, path)
    before = memory()
    for _ in range(5):
        talk(server, f"GET / HTTP/1.1\r\n{host}X: {'y' * 10_000_000}\r\n\r\n".encode())
        head = f"POST /control/pause HTTP/1.1\r\n{host}Content-Length: 20000000\r\n\r\n"
        talk(server, head.encode() + b"z" * 20_000_000)
    assert memory() - before < 100e6
    assert is_alive(server)


def test_pages_that_talk_or_never_listen_do_no_harm(server: ViewServer, live_run: LiveRun) -> None:
    run, w = live_run, np.zeros(live_run._vehicles.n_inputs)

    async def visit() -> None:
        async with aiohttp.ClientSession() as session:
            page = await session.ws_connect(f"{server.address}live")
            await page.send_bytes(b"\xff" * 500)
            await page.send_str("{" * 1000)
            await page.send_str("x" * 100_000)  # more than it takes
            while (await asyncio.wait_for(page.receive(), 30)).type not in (
                aiohttp.WSMsgType.CLOSE,
                aiohttp.WSMsgType.CLOSED,
                aiohttp.WSMsgType.ERROR,
            ):
                pass  # fmt: skip
            deaf = await session.ws_connect(f"{server.address}live")
            before = memory()
            for step in range(3000):
                run.add_state(step, run._scenario.initial_vehicle_state, w)
                server.tell()
            await asyncio.sleep(0.5)
            assert memory() - before < 100e6
            await deaf.close()

    asyncio.run(visit())
    assert is_alive(server)
