"""The web server of the live page."""

import asyncio
import base64
import hashlib
import ipaddress
import logging
import socket
from collections.abc import Awaitable, Callable
from contextlib import suppress
from importlib.resources import files
from threading import Event, Thread
from typing import NamedTuple
from urllib.parse import urlsplit

from aiohttp import WSCloseCode, web
from aiohttp.http_exceptions import HttpProcessingError
from aiohttp.typedefs import Handler
from typing_extensions import override

from gameinfer_ros.names.text import json_text
from gameinfer_ros.view.live_run import LiveRun, Mark

#: Shortest and longest time between two updates of a page, in s.
SHORTEST, LONGEST = 0.03, 1.0

#: Largest number of simultaneous connections; a page needs two.
MOST_CONNECTIONS = 64

#: Actions that pages may request if they may control the run.
ACTIONS = ("pause", "resume", "reset", "new_seeds")


def _is_worth_logging(record: logging.LogRecord) -> bool:
    """Drop records about malformed requests: the server answers these with status 400."""
    return not (record.exc_info and isinstance(record.exc_info[1], HttpProcessingError))


logging.getLogger("aiohttp.server").addFilter(_is_worth_logging)


class Answer(NamedTuple):
    """The result of an action that a page requested."""

    success: bool
    message: str  # what happened, for the user


class ViewServer:
    """A web server that serves the page, and sends updates to open pages, in its own thread.

    Other web pages in the same browser can neither read nor control the run: the server refuses
    requests whose `Host` is not `localhost`, an IP address or `host`, and requests whose `Origin`
    is another page. It closes connections beyond `MOST_CONNECTIONS`.

    Args:
        run: the run to show.
        host: name or address to listen on.
        port: port to listen on; 0 for any free port.
        control: performs one of the `ACTIONS`; None if pages may not control the run.
        on_pages: called in the thread of the server when a page is opened or closed.

    Raises:
        OSError: the server cannot listen there, for example because the port is in use.
    """

    def __init__(
        self,
        run: LiveRun,
        host: str,
        port: int,
        control: Callable[[str], Awaitable[Answer]] | None,
        on_pages: Callable[[], None],
    ) -> None:
        self._run, self._host, self._control, self._on_pages = run, host, control, on_pages
        self._html = (files("gameinfer_ros.view") / "page.html").read_text(encoding="utf-8")
        self._pages: dict[web.WebSocketResponse, asyncio.Event] = {}
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        self._socket = socket.create_server((host, port), family=family)
        self._loop = asyncio.new_event_loop()
        self._ends = asyncio.Event()
        self._closed = False
        self._serving = Event()
        self._thread = Thread(target=self._serve, name="view", daemon=True)
        self._thread.start()
        self._serving.wait()

    @property
    def address(self) -> str:
        """URL of the page."""
        host = f"[{self._host}]" if ":" in self._host else self._host
        return f"http://{host}:{self._socket.getsockname()[1]}/"

    @property
    def pages(self) -> int:
        """Number of open pages."""
        return len(self._pages)

    def tell(self) -> None:
        """Send what is new to all open pages; safe to call from any thread."""
        if self._pages and not self._closed:
            self._loop.call_soon_threadsafe(self._wake)

    def close(self) -> None:
        """Send a last update to all open pages, and stop the server."""
        if self._closed:
            return
        self._closed = True
        self._loop.call_soon_threadsafe(self._ends.set)
        self._thread.join()

    def _wake(self) -> None:
        for news in self._pages.values():
            news.set()

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._until_closed())
        finally:
            self._serving.set()
            self._loop.close()

    async def _until_closed(self) -> None:
        application = web.Application(middlewares=[self._guard])
        application.add_routes(
            [
                web.get("/", self._page),
                web.get("/live", self._live),
                web.post("/control/{action}", self._act),
            ]
        )
        # Do not wait longer for pages that do not close their connections.
        runner = web.AppRunner(application, access_log=None, shutdown_timeout=1.0)
        await runner.setup()
        server = runner.server
        assert server is not None
        listener = await self._loop.create_server(lambda: _Door(server), sock=self._socket)
        self._serving.set()
        await self._ends.wait()
        self._wake()
        listener.close()
        await runner.cleanup()

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse requests of other web pages, including ones whose host name leads here."""
        host = request.headers.get("Host", "")
        if not self._is_ours(host):
            raise web.HTTPForbidden(
                text=f"Host: '{host}' is not allowed: it must be localhost, an IP address, or "
                f"{self._host}\n"
            )
        origin = request.headers.get("Origin")
        if origin not in (None, f"http://{host}"):
            raise web.HTTPForbidden(
                text=f"Origin: '{origin}' is not allowed: it must be http://{host}\n"
            )
        return await handler(request)

    def _is_ours(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname or ""
            if name in ("localhost", self._host.lower()):
                return True
            ipaddress.ip_address(name)  # an address, unlike a name, cannot be rebound by DNS
        except ValueError:
            return False
        return True

    async def _page(self, request: web.Request) -> web.Response:
        script = self._html.partition("<script>")[2].partition("</script>")[0]
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        return web.Response(
            text=self._html,
            content_type="text/html",
            headers={
                "Cache-Control": "no-store",
                # No content from other hosts, no other script, and no embedding in other pages.
                "Content-Security-Policy": f"default-src 'none'; script-src 'sha256-{digest}'; "
                "style-src 'unsafe-inline'; img-src data:; connect-src 'self'; base-uri 'none'; "
                "form-action 'none'; frame-ancestors 'none'",
                "X-Content-Type-Options": "nosniff",
            },
        )

    async def _act(self, request: web.Request) -> web.Response:
        action = request.match_info["action"]
        if action not in ACTIONS:
            raise web.HTTPNotFound(
                text=f"'{action}' is not allowed: it must be one of {', '.join(ACTIONS)}\n"
            )
        if self._control is None:
            raise web.HTTPForbidden(text="pages may not control this run\n")
        answer = await self._control(action)
        self._wake()
        return web.json_response(answer._asdict())

    async def _live(self, request: web.Request) -> web.WebSocketResponse:
        page = web.WebSocketResponse(heartbeat=10.0, compress=False, max_msg_size=1024)
        await page.prepare(request)
        self._pages[page] = asyncio.Event()
        self._on_pages()
        tasks = [asyncio.create_task(self._feed(page)), asyncio.create_task(_until_left(page))]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        except ConnectionError:
            pass  # the page was closed during an update
        finally:
            for task in tasks:
                task.cancel()
            del self._pages[page]
            if not self._closed:
                self._on_pages()
        return page

    async def _feed(self, page: web.WebSocketResponse) -> None:
        """Send updates to a page until the server ends; a slow page gets fewer, larger updates."""
        mark, news, ended = Mark(), self._pages[page], False
        while not ended:
            news.clear()
            ended = self._ends.is_set()
            update, mark = self._run.since(mark)
            ended = ended and not update["more"]
            update |= {"control": self._control is not None, "ended": ended}
            await page.send_str(json_text(update))
            if not update["more"] and not self._ends.is_set():
                with suppress(asyncio.TimeoutError):
                    await asyncio.wait_for(news.wait(), LONGEST)
                await asyncio.sleep(SHORTEST)
        await page.close(code=WSCloseCode.GOING_AWAY)


class _Door(asyncio.Protocol):
    """A protocol that hands a connection to the server, or closes it if there are too many."""

    def __init__(self, server: web.Server) -> None:
        self._server = server

    @override
    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        if len(self._server.connections) >= MOST_CONNECTIONS:
            transport.close()
            return
        handler = self._server()
        transport.set_protocol(handler)
        handler.connection_made(transport)


async def _until_left(page: web.WebSocketResponse) -> None:
    async for _ in page:
        pass  # messages from pages are ignored
