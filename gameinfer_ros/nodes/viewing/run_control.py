"""Pauses and resets a run."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.client import Client
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from gameinfer_ros.view import Answer

#: How long a service may take to be found, and then to answer, in s.
PATIENCE = 5.0

#: How long that of an agent may take to be found, which may be none of ours, in s.
GRACE = 3.0


class RunControl:
    """Does what pages ask for, by services of the other nodes.

    Clients:
        simulator/pause (std_srvs/srv/SetBool)
        simulator/reset (std_srvs/srv/Trigger)
        inference/reset, <human>_agent/reset (std_srvs/srv/Trigger): for new seeds.

    Args:
        node: the node that calls them; somebody spins it in another thread.
        humans: names of the humans; those who have no agent of this package keep what they do.
        on_pause: told whether the run has been paused or goes on.
    """

    def __init__(self, node: Node, humans: Sequence[str], on_pause: Callable[[bool], None]) -> None:
        self._pause = node.create_client(SetBool, "simulator/pause")
        self._restart = node.create_client(Trigger, "simulator/reset")
        self._inference = node.create_client(Trigger, "inference/reset")
        self._agents = [node.create_client(Trigger, f"{name}_agent/reset") for name in humans]
        self._on_pause = on_pause
        self._one_at_a_time = asyncio.Lock()

    async def act(self, action: str) -> Answer:
        """Do one of `pause`, `resume`, `reset` and `new_seeds`."""
        async with self._one_at_a_time:
            if action == "new_seeds":
                return await self._draw_new_seeds()
            if action == "reset":
                return await _call(self._restart, Trigger.Request())
            answer = await _call(self._pause, SetBool.Request(data=action == "pause"))
            if answer.success:
                self._on_pause(action == "pause")
            return answer

    async def _draw_new_seeds(self) -> Answer:
        """Reset everybody, then the simulator; an agent that is not there is none of ours."""
        there = await asyncio.gather(*(_is_there(client, GRACE) for client in self._agents))
        agents = [client for client, found in zip(self._agents, there, strict=True) if found]
        clients = [self._inference, *agents]
        answers = await asyncio.gather(*(_call(c, Trigger.Request()) for c in clients))
        failures = [answer.message for answer in answers if not answer.success]
        if failures:
            return Answer(False, "; ".join(failures))
        answer = await _call(self._restart, Trigger.Request())
        missing = [c.srv_name for c in self._agents if c not in agents]
        if missing:
            return Answer(answer.success, f"{answer.message} (not there: {', '.join(missing)})")
        return answer


async def _is_there(client: Client, seconds: float) -> bool:
    """Whether a service is offered, now or within some seconds: it may take time to be found."""
    loop = asyncio.get_running_loop()
    deadline = loop.time() + seconds
    while not client.service_is_ready():
        if loop.time() > deadline:
            return False
        await asyncio.sleep(0.05)
    return True


async def _call(client: Client, request: Any) -> Answer:
    """The answer of a service, or why there is none."""
    if not await _is_there(client, PATIENCE):
        return Answer(False, f"{client.srv_name}: nobody offers this service")
    loop, answered = asyncio.get_running_loop(), asyncio.Event()
    future = client.call_async(request)
    future.add_done_callback(lambda _: loop.call_soon_threadsafe(answered.set))
    try:
        await asyncio.wait_for(answered.wait(), PATIENCE)
    except asyncio.TimeoutError:
        client.remove_pending_request(future)
        return Answer(False, f"{client.srv_name}: no answer within {PATIENCE:.0f} s")
    response = future.result()
    done = "done" if response.success else "refused"
    return Answer(response.success, f"{client.srv_name}: {response.message or done}")
