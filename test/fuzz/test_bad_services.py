"""Services called at any time, in any order, leave a run that goes on and comes to its end."""

from __future__ import annotations

from typing import Any

import bad_parameters
import numpy as np
import pytest
from nodes_room import Run
from rcl_interfaces.srv import SetParameters
from small_scenario import ScenarioFile
from std_srvs.srv import SetBool, Trigger

STEPS = 8


@pytest.mark.parametrize("time", ["lockstep", "realtime"])
def test_any_calls_at_any_time_and_the_run_comes_to_its_end(
    time: str, world: Any, scenario_file: ScenarioFile
) -> None:
    file, rng = scenario_file("uu", dt=0.02, steps=STEPS), np.random.default_rng(0)
    run = Run(world, file, STEPS, time=time)
    calls = [(SetBool, "/simulator/pause"), *((Trigger, f"{n.get_fully_qualified_name()}/reset")
             for n in (run.simulator, run.inference, run.human))]  # fmt: skip
    clients = [(kind, world.tester.create_client(kind, name)) for kind, name in calls]
    setters = [
        (node, world.tester.create_client(SetParameters, f"{name}/set_parameters"))
        for node in run.nodes
        for name in [node.get_fully_qualified_name()]
    ]
    world.until(lambda: all(c.service_is_ready() for _, c in (*clients, *setters)))
    pending = []
    for _ in range(300):
        if rng.random() < 0.5:
            kind, client = clients[int(rng.integers(len(clients)))]
            request = SetBool.Request(data=bool(rng.integers(2))) if kind is SetBool else None
            pending.append(client.call_async(request or kind.Request()))
        else:
            node, client = setters[int(rng.integers(len(setters)))]
            request = bad_parameters.some(node, rng)
            if request.name != "particles" or request.value.integer_value < 100:  # takes long
                pending.append(client.call_async(SetParameters.Request(parameters=[request])))
        for _ in range(int(rng.integers(8))):
            world._executor.spin_once(timeout_sec=0)
        # The middleware keeps ten requests of a service; it drops the oldest of more.
        world.until(lambda: sum(not future.done() for future in pending) < 10)
    world.until(lambda: all(future.done() for future in pending), "a call is not answered")
    assert all(future.exception() is None for future in pending)

    # Now the run is let go on, from wherever it is.
    resume = clients[0][1].call_async(SetBool.Request(data=False))
    restart = clients[1][1].call_async(Trigger.Request())
    world.until(lambda: resume.done() and restart.done())
    assert resume.result().success and restart.result().success
    world.until(lambda: run.simulator.world.step < STEPS or run.simulator.done)
    world.until(lambda: run.simulator.done, "the run is stuck")
    world.until(lambda: len(run.recorder.record.states) == STEPS + 1)
    np.testing.assert_array_equal(
        run.recorder.record.states[0], run.simulator.scenario.initial_vehicle_state
    )
