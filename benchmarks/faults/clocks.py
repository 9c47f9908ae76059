"""Clocks that jump, are set back, or stand still."""

from __future__ import annotations

import random
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from account import BASE_STANDS_AFTER
from faulty_run import NODES
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from trial import Fault, Figures, a_run, a_stack, until

from msg_adapters import clock, odometry, qos

#: Debian's package `faketime` has it.
LIBRARY = next(iter(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1")), None)

#: How often the simulated clock ticks, in s.
_TICK = 0.02


class Street(Node):
    """Publishes simulated time, and the odometry of a human who walks by it."""

    def __init__(self, **node_options: Any) -> None:
        super().__init__("street", **node_options)
        self.offset, self.stands_still = 1000.0, False  # lead of the clock, in s
        self._count = 0
        self._time = self.create_publisher(Clock, "/clock", qos.CLOCK)
        self._place = self.create_publisher(Odometry, "human_1/odom", qos.RECENT)
        self.create_timer(_TICK, self._tick)

    def _tick(self) -> None:
        if self.stands_still:
            return
        self._count += 1
        walked = self._count * _TICK
        now = round(1e9 * (self.offset + walked))
        self._time.publish(clock.encode(now))
        pose, twist = np.array([3.0 - 0.3 * walked, 1.5, np.pi]), np.array([0.3, 0.0, 0.0])
        self._place.publish(odometry.encode(now, pose, twist, "human_1"))


def simulated(what: str, folder: Path) -> Figures:
    """The run continues when the clock jumps ahead, and restarts when it is set back."""
    arguments = ("--external", "human_1", "--ros-args", "-p", "use_sim_time:=true")
    with a_run(folder, *arguments, beside=Street) as trial:
        assert trial.beside is not None
        street, begin = trial.beside.node, time.monotonic()
        seen, dt = trial.account.seen, trial.account.vehicles.game.dt
        before = seen[-1].step
        if what == "stands still":
            street.stands_still = True
            time.sleep(random.uniform(BASE_STANDS_AFTER + 0.5, 4.0))
            again = time.monotonic()
            trial.figures |= trial.account.base_stood_after(begin, again)
            street.stands_still = False
            begin = again
        elif what == "jumps ahead":
            jump = random.choice([random.uniform(0.2, 2.0), random.uniform(2.0, 1000.0)])
            street.offset += jump
            until(lambda: seen[-1].step >= before + jump / dt, "a step beyond the jump")
            begin = seen[-1].time
        else:
            street.offset -= random.uniform(0.2, 3.0)
            until(lambda: seen[-1].step < before, "an earlier step")
            begin = seen[-1].time
            trial.run.until(lambda: "The run restarts" in trial.run.stdout)
        trial.until_resumes(begin)
        trial.run.until_goes_on()
    return trial.figures


def of_one_node(node: str, folder: Path) -> Figures:
    """Nothing depends on the time of day: the robot continues."""
    told = folder / "offset"
    told.write_text("+0")
    variables = {
        "LD_PRELOAD": str(LIBRARY),
        "FAKETIME_TIMESTAMP_FILE": str(told),
        "FAKETIME_NO_CACHE": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
        "DONT_FAKE_MONOTONIC": "1",
    }
    with a_stack(folder, environments={node: variables}) as trial:
        begin = time.monotonic()
        for _ in range(3):
            told.write_text(f"{random.choice([-1, 1]) * random.uniform(0.1, 4000.0):+.3f}")
            trial.stack.for_steps(20)
        again = time.monotonic()
        trial.figures["slowest_m_s"] = float(trial.account.speeds(begin, again).min())
        trial.stack.until(lambda: trial.stack.speeds[-1] > 0.1)
        trial.until_resumes(again)
    return trial.figures


FAULTS: dict[str, Fault] = {
    **{
        f"/clock {what}": partial(simulated, what)
        for what in ("jumps ahead", "is set back", "stands still")
    },
    **({f"the time of day jumps: {n}": partial(of_one_node, n) for n in NODES} if LIBRARY else {}),
}
