"""A client of the viewer, as a web browser is one."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Coroutine
from concurrent.futures import Future
from typing import Any

import aiohttp
from aiohttp import WSMsgType


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
        """The states since the last restart."""
        found: list[dict[str, Any]] = []
        for update in self.updates:
            if "scenario" in update:
                found.clear()
            found += update.get("states", [])
        return found


class Browser:
    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._pages: dict[int, asyncio.Task[None]] = {}

    def request(self, method: str, url: str, **headers: str) -> Future[tuple[int, str, Any]]:
        async def do() -> tuple[int, str, Any]:
            async with (
                aiohttp.ClientSession() as session,
                session.request(method, url, headers=headers) as response,
            ):
                return response.status, await response.text(), response.headers

        return self._submit(do())

    def open(self, url: str) -> Page:
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


def answer(world: Any, future: Future[Any]) -> Any:
    world.until(future.done, "no answer")
    return future.result()
