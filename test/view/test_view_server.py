"""The server of the page, and hostile requests."""

from __future__ import annotations

import re
import socket

import pytest

from gameinfer_ros.names.defaults import VIEW_HOST
from gameinfer_ros.view import ViewServer
from gameinfer_ros.view.view_server import MOST_CONNECTIONS

DEADLINE = 60.0
SECRET = b"root:"
CLOSE = "Connection: close\r\n"
HANDSHAKE = (
    "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)


def connect(server: ViewServer) -> socket.socket:
    return socket.create_connection(server._socket.getsockname(), timeout=DEADLINE)


def answer(server: ViewServer, request: str) -> tuple[int, bytes]:
    with connect(server) as connection:
        connection.sendall(request.encode("latin-1"))
        received = b""
        while True:
            try:
                piece = connection.recv(65536)
            except (ConnectionResetError, TimeoutError):
                break
            if not piece:
                break
            received += piece
            connection.settimeout(0.5)  # it may be kept open
    found = re.match(rb"HTTP/1\.[01] (\d+) ", received)
    return (int(found[1]) if found else 0), received


def get(target: str, method: str = "GET", host: str = "localhost", more: str = "") -> str:
    return f"{method} {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{more}\r\n"


def test_it_listens_on_this_machine_only(server: ViewServer) -> None:
    assert server._socket.getsockname()[0] == "127.0.0.1"
    assert answer(server, get("/"))[0] == 200


@pytest.mark.parametrize(
    "target",
    [
        "//etc/passwd",
        "/../../../../../../etc/passwd",
        "/%2e%2e/%2e%2e/%2e%2e/%2e%2e/etc/passwd",
        "/..%2f..%2f..%2f..%2fetc%2fpasswd",
        "/%2fetc%2fpasswd",
        "/..\\..\\etc\\passwd",
        "/static/../../etc/passwd",
        "/page.html",
        "/view_server.py",
        "/live/../etc/passwd",
        "/control/..%2f..%2fetc%2fpasswd",
        "/control/",
        "file:///etc/passwd",
        "etc/passwd",
        "/etc/passwd%00.html",
        "*",
    ],
)
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_no_file_of_the_machine_is_served(target: str, method: str, server: ViewServer) -> None:
    status, text = answer(server, get(target, method))
    assert status in (0, 400, 403, 404, 405), text
    assert SECRET not in text and b"import " not in text


@pytest.mark.parametrize(
    "method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT"]
)
@pytest.mark.parametrize("target", ["/", "/live"])
def test_other_methods_are_refused(method: str, target: str, server: ViewServer) -> None:
    status, text = answer(server, get(target, method, more="Content-Length: 0\r\n"))
    assert status in (0, 400, 404, 405), text


@pytest.mark.parametrize("method", ["GET", "HEAD", "PUT", "OPTIONS"])
def test_a_run_is_controlled_by_post_only(
    method: str, server: ViewServer, asked: list[str]
) -> None:
    assert answer(server, get("/control/pause", method))[0] in (400, 404, 405)
    assert answer(server, get("/control/destroy", "POST"))[0] == 404
    assert asked == []
    assert answer(server, get("/control/pause", "POST", more="Content-Length: 0\r\n"))[0] == 200
    assert asked == ["pause"]


@pytest.mark.parametrize(
    ("host", "more"),
    [
        ("evil.example", ""),
        ("evil.example:80", ""),
        ("", ""),
        ("[::1", ""),
        ("localhost.evil.example", ""),
        ("127.0.0.1.evil.example", ""),
        ("localhost@evil.example:80", ""),
        ("evil.example:80", "Origin: http://evil.example:80\r\n"),
        ("localhost", "Origin: http://evil.example\r\n"),
        ("localhost", "Origin: null\r\n"),
        ("localhost", "Origin: http://localhost:1\r\n"),
        ("localhost", "Origin: https://localhost\r\n"),
    ],
)
@pytest.mark.parametrize(
    ("target", "method", "own"),
    [("/", "GET", CLOSE), ("/live", "GET", HANDSHAKE), ("/control/pause", "POST", CLOSE)],
)
def test_other_pages_get_nothing(
    host: str, more: str, target: str, method: str, own: str, server: ViewServer, asked: list[str]
) -> None:
    request = f"{method} {target} HTTP/1.1\r\nHost: {host}\r\n{own}{more}\r\n"
    status, text = answer(server, request)
    assert status in (400, 403), text
    assert status == 400 or b"is not allowed: it must be" in text
    assert b"<script" not in text and asked == [] and server.pages == 0


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "192.168.1.5", "[::1]"])
def test_its_own_page_is_served_by_any_address_of_this_machine(
    host: str, server: ViewServer
) -> None:
    # By another port too, as if it were forwarded.
    request = get("/", host=f"{host}:9000", more=f"Origin: http://{host}:9000\r\n")
    assert answer(server, request)[0] == 200


def test_an_absolute_address_of_elsewhere_is_not_fetched(server: ViewServer) -> None:
    with socket.create_server((VIEW_HOST, 0)) as elsewhere:
        elsewhere.settimeout(0.5)
        port = elsewhere.getsockname()[1]
        answer(server, get(f"http://{VIEW_HOST}:{port}/secret", host="localhost"))
        answer(server, get(f"{VIEW_HOST}:{port}", "CONNECT"))
        with pytest.raises(TimeoutError):
            elsewhere.accept()


def test_a_websocket_of_its_own_page_is_served(server: ViewServer) -> None:
    more = f"{HANDSHAKE}Origin: http://localhost\r\n"
    assert answer(server, f"GET /live HTTP/1.1\r\nHost: localhost\r\n{more}\r\n")[0] == 101


@pytest.mark.parametrize(
    "more", ["X: " + 100_000 * "x" + "\r\n", 20_000 * "X: x\r\n"], ids=["long", "many"]
)
def test_huge_headers_are_refused(more: str, server: ViewServer) -> None:
    assert answer(server, get("/", more=more))[0] in (0, 400, 431)
    assert answer(server, get("/"))[0] == 200


def test_a_huge_body_is_not_read(server: ViewServer, asked: list[str]) -> None:
    status, _ = answer(server, get("/", "POST", more=f"Content-Length: {10**15}\r\n"))
    assert status in (400, 405, 413)
    smuggled = "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n"
    status, _ = answer(server, get("/control/pause", "POST", more=smuggled) + "0\r\n\r\n")
    assert status == 400 and asked == []


def test_slow_and_many_connections_are_bounded(server: ViewServer) -> None:
    kept = [connect(server) for _ in range(MOST_CONNECTIONS)]
    for connection in kept:
        connection.sendall(b"GET / HT")  # and no more
    try:
        with connect(server) as surplus:
            assert surplus.recv(1) == b""
    finally:
        for connection in kept:
            connection.close()
    for _ in range(100):  # places are free again, as soon as the server has noticed
        if answer(server, get("/"))[0] == 200:
            return
    raise AssertionError("no page is served any more")
