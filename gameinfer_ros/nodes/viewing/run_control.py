"""Control of a run from a web page."""

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.client import Client
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from gameinfer_ros.view import Answer

#: Timeout for the discovery of a service, and for its response, in s.
PATIENCE = 5.0

#: Timeout for the discovery of the service of an agent, in s. External players have none.
GRACE = 3.0


class RunControl:
    """Pauses, resumes and resets a run by calling services of the other nodes.

    The node that calls the services must be spun in another thread. Humans without an agent of this
    package are not reset. `on_pause` gets True when the run is paused and False when it resumes.

    Clients:
        simulator/pause (std_srvs/srv/SetBool)
        simulator/reset (std_srvs/srv/Trigger)
        inference/reset, <human>_agent/reset (std_srvs/srv/Trigger): to draw new seeds.
    """

    def __init__(self, node: Node, humans: Sequence[str], on_pause: Callable[[bool], None]) -> None:
        self._pause = node.create_client(SetBool, "simulator/pause")
        self._restart = node.create_client(Trigger, "simulator/reset")
        self._inference = node.create_client(Trigger, "inference/reset")
        self._agents = [node.create_client(Trigger, f"{name}_agent/reset") for name in humans]
        self._on_pause = on_pause
        self._one_at_a_time = asyncio.Lock()

    async def act(self, action: str) -> Answer:
        """Perform one of the actions `pause`, `resume`, `reset` and `new_seeds`."""
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
        """Reset the inference node and all available agents, then the simulator."""
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
            return Answer(answer.success, f"{answer.message} (not available: {', '.join(missing)})")
        return answer


async def _is_there(client: Client, seconds: float) -> bool:
    """Whether a service is available within some seconds; discovery may take time."""
    loop = asyncio.get_running_loop()
    deadline = loop.time() + seconds
    while not client.service_is_ready():
        if loop.time() > deadline:
            return False
        await asyncio.sleep(0.05)
    return True


async def _call(client: Client, request: Any) -> Answer:
    """Call a service; returns its response, or why there is none."""
    if not await _is_there(client, PATIENCE):
        return Answer(False, f"{client.srv_name}: the service is not available")
    loop, answered = asyncio.get_running_loop(), asyncio.Event()
    future = client.call_async(request)
    future.add_done_callback(lambda _: loop.call_soon_threadsafe(answered.set))
    try:
        await asyncio.wait_for(answered.wait(), PATIENCE)
    except asyncio.TimeoutError:
        client.remove_pending_request(future)
        return Answer(False, f"{client.srv_name}: no response within {PATIENCE:.0f} s")
    response = future.result()
    done = "done" if response.success else "refused"
    return Answer(response.success, f"{client.srv_name}: {response.message or done}")
