"""The node that simulates the players and publishes their states."""

from __future__ import annotations

import sys
from functools import partial
from time import monotonic, perf_counter, time_ns
from typing import Any

import numpy as np
from nav_msgs.msg import Odometry
from rclpy.timer import Timer
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory
from typing_extensions import override

from gameinfer_ros.nodes.base.game_node import GameNode
from gameinfer_ros.nodes.base.spin import spin
from gameinfer_ros.nodes.world import reports
from gameinfer_ros.nodes.world.external_player import (
    ARRIVAL,
    OLDEST,
    STAMP,
    ExternalPlayer,
    parse_names,
)
from gameinfer_ros.nodes.world.state_publisher import StatePublisher
from gameinfer_ros.nodes.world.world import World
from gameinfer_ros.runs.record import MOST_MISSING
from gameinfer_ros.scenario import MOST_STEPS
from msg_adapters import MessageError, control, diagnostics, qos, stamp

#: Period of the check whether the run can start, and of the report why it does not advance, in s.
_LOOK, _REPORT = 0.02, 1.0

#: Largest number of overdue steps that are simulated. With more, the clock has jumped and the steps
#: are skipped.
_MADE_UP = 20

#: Largest number of skipped states of a run. A record allows some more, because it also lacks the
#: states that get lost.
MOST_LEFT_OUT = MOST_MISSING * 9 // 10


class Simulator(GameNode):
    """Simulates the vehicles of all players and publishes their states at each time step.

    When there are enough subscribers, the simulator publishes the start of the run and the state of
    step 0. It then waits for the first input of each player. In lockstep, it advances when all
    inputs for the present step have arrived. In realtime, it advances at the end of each time step.
    If the input of a player is late, its last plan bridges the gap; after the end of that plan, the
    player brakes.

    In realtime, players can be external: their positions come from odometry. The run then starts
    when odometry of all external players has arrived, and does not wait for inputs. Their states
    are interpolated or extrapolated to the time of each step. While the odometry of a player is too
    old, no states are published, steps continue to count, and `/diagnostics` gives the reason. The
    run ends with the state of its last step, or with the first later one.

    The start is the time of the node's clock, and identifies the run. Without external players, it
    is later than all stamps of the previous run; if the clock does not run, as when this node
    publishes `/clock`, it is the system time, or follows the previous run.

    Parameters, in addition to those of `GameNode`:
        steps (integer, read-only): number of steps; 0 for that of the scenario.
        subscribers (integer, read-only): number of subscribers of joint_state to wait for before
            the run starts.
        publish_clock (boolean, read-only): whether to publish the simulated time on /clock.
        external (string, read-only): names of the external players, separated by commas.
        odom_timeout (double): an external player is missing if its newest odometry is older than
            this, in s.
        odom_time (string, read-only): source of the time of odometry: its `stamp`, by this node's
            clock, or its `arrival`.

    Subscribers:
        <player>/control (trajectory_msgs/MultiDOFJointTrajectory, `RECENT`): one for each
            simulated player.
        <player>/odom (nav_msgs/Odometry, `SENSOR`): one for each external player.

    Publishers:
        run_start (builtin_interfaces/Time, `LATEST`)
        joint_state (sensor_msgs/MultiDOFJointState, `STREAM`)
        <player>/odom (nav_msgs/Odometry, `RECENT`): one for each simulated player.
        /clock (rosgraph_msgs/Clock, `CLOCK`): if `publish_clock` is true.

    Services:
        ~/pause (std_srvs/srv/SetBool): pauses or resumes the run; refused with external players.
        ~/reset (std_srvs/srv/Trigger): restarts the run.

    Attributes:
        steps: number of steps of the run.
        world: the state of all players.
    """

    def __init__(self, name: str = "simulator", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        steps = self.declare(
            "steps", 0, "number of steps; 0: that of the scenario", (0, MOST_STEPS)
        )
        self.steps = steps or self.scenario.steps
        self._subscribers = self.declare(
            "subscribers",
            0,
            "number of joint_state subscribers to wait for before the first state",
            (0, 1000),
        )
        publish_clock = self.declare("publish_clock", False, "publish simulated time on /clock")
        external = self.declare(
            "external", "", "names of the external players, separated by commas"
        )
        self._odom_timeout = self.declare_live(
            "odom_timeout", 0.5, "largest age of odometry, in s", (0.01, OLDEST)
        )
        time_from = self.declare(
            "odom_time", STAMP, "source of the time of odometry", choices=(STAMP, ARRIVAL)
        )
        names = parse_names(external, self.players.names, self.lockstep, publish_clock)
        self._external = {self.players.names.index(n): ExternalPlayer(time_from) for n in names}
        simulated = [i for i in range(len(self.players)) if i not in self._external]
        self._states = StatePublisher(self, simulated, publish_clock)
        self._subscribe_players()
        self.create_service(SetBool, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/reset", self._on_restart)
        # This loads the compiled kernels before the first step.
        self.vehicles.step(self.scenario.initial_vehicle_state, np.zeros(self.vehicles.n_inputs))
        self._paused = False
        self._timer: Timer | None = None
        self.begin()
        self.every(_REPORT, self._report_idle)

    def _subscribe_players(self) -> None:
        for i, name in enumerate(self.players.names):
            if i in self._external:
                on_odom = partial(self._on_odom, i)
                self.subscribe(Odometry, f"{name}/odom", on_odom, qos.SENSOR, sole=True)
                continue
            self.subscribe(
                MultiDOFJointTrajectory,
                f"{name}/control",
                partial(self._on_control, i),
                qos.RECENT,  # with a depth of 1, a stray message could replace the newest one
                control.largest(self.vehicles.joints_of(i)),
                sole=True,
            )

    @property
    def done(self) -> bool:
        """Whether the state of the last step has been published."""
        return self.world.published >= self.steps

    @override
    def begin(self) -> None:
        """Restart: reset all players to their initial states, and wait until the run can start."""
        self._drop_timer()
        self.world = World(self.vehicles, self.scenario.initial_vehicle_state, self._external)
        self._lacking = 0
        self._published: float | None = None
        self._runs = False
        self._timer = self.every(_LOOK, self._start)
        self.get_logger().info(f"ready: waits for {', '.join(self.players.names)}")

    def _start(self) -> None:
        """Start the run once all subscribers and external players are present."""
        now = self._now()
        self.world.look(now, self._odom_timeout())
        self._lacking = self._subscribers - self._states.subscribers
        if self.world.missing or self._lacking > 0 or self._lacks_clock:
            return
        self._drop_timer()
        self.clock.start = start = self._new_start()
        self._started, self._noticed, self._ticked = 1e-9 * start, now, monotonic()
        self._states.start(start)
        self._publish_state()
        if self._external:
            # Their clock may be simulated time.
            self._timer = self.create_timer(self.game.dt, self._catch_up)
            self._runs = True

    def _new_start(self) -> int:
        """Choose the start of the next run, in ns."""
        start = int(self.get_clock().now().nanoseconds)
        if not self._external:
            start = max(start or time_ns(), self._states.last_stamp + 1000)
        # Clocks may be coarse. Different digits below a microsecond keep the stamps of two runs
        # apart.
        return start - start % 1000 + time_ns() % 1000

    def _drop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self.destroy_timer(self._timer)
            self._timer = None

    def _now(self) -> float:
        return 1e-9 * float(self.get_clock().now().nanoseconds)

    @property
    def _lacks_clock(self) -> bool:
        """Whether no time has arrived yet from the clock of the external players."""
        return bool(self._external and self._now() == 0.0)

    def _proceed(self) -> None:
        """Advance, or start the clock, if all inputs for the present step have arrived."""
        if self._paused or self._runs or self.done or self._published is None:
            return
        if not self.world.ready:
            return
        if self.lockstep:
            self._advance()
        else:
            self.get_logger().info("all players are ready: time starts")
            self._runs = True
            self._timer = self.every(self.game.dt, self._advance)

    def _catch_up(self) -> None:
        """Simulate all steps that are due on the clock of the external players."""
        now, dt, self._ticked = self._now(), self.game.dt, monotonic()
        if now < self._noticed:
            self._restart("the clock was set back")
            return
        self._noticed = now
        due = int((now - self._started) / dt + 0.1)  # a timer may be a little early
        missing = self.world.unpublished + due - self.world.published - 1
        if missing > MOST_LEFT_OUT:
            self._restart(f"{missing} states are missing, but at most {MOST_LEFT_OUT} are allowed")
            return
        if due > self.world.step + _MADE_UP:
            self.get_logger().warn(
                f"the clock jumped ahead: steps {self.world.step + 1} to {due - 1} are skipped"
            )
            self.world.skip_to(due - 1)
        while not self.done and self.world.step < due:
            self._advance()

    def _restart(self, why: str) -> None:
        self.get_logger().warn(f"{why}: the run restarts")
        for player in self._external.values():
            player.forget()
        self.begin()

    def _report_idle(self) -> None:
        """Report why the run does not advance, if it does not."""
        idle = ""
        if self._published is None:
            waits = reports.absences(self.world, self.players.names)
            idle = reports.missing_odometry(self.world, self.players.names)
            if self._lacks_clock:
                waits.append("/clock")
                idle = "no /clock"
            if self._lacking > 0:
                subscribers = "subscriber" if self._lacking == 1 else "subscribers"
                waits.append(f"{self._lacking} more {subscribers} of joint_state")
            message = f"waits for {'; '.join(waits)}" if waits else ""
        elif self.done:
            return
        elif self._paused:
            message = idle = f"paused at step {self.world.step}"
        elif self._external and monotonic() - self._ticked > max(_REPORT, 2 * self.game.dt):
            message = f"the clock has stopped at {self._now():.1f} s"
            idle = "no /clock"
        elif not self._runs and perf_counter() - self._published > _REPORT:
            silent = reports.silent(self.world, self.players.names)
            message = f"waits for the input of {', '.join(silent)}"
        else:
            return
        if message:
            self.get_logger().info(message, throttle_duration_sec=5.0)
            figures = {"late_steps": self.world.late_steps, "idle": idle}
            self.report(message, figures, diagnostics.WARN)

    def _advance(self) -> None:
        world, names, missing = self.world, self.players.names, self.world.missing
        end = self._started + (world.step + 1) * self.game.dt
        world.advance(end, self._odom_timeout())
        for i in world.missing.keys() - missing.keys():
            self.get_logger().warn(f"{names[i]} is lost: {world.missing[i]}")
        for i in missing.keys() - world.missing.keys():
            self.get_logger().info(f"{names[i]} is back")
        self.report(*reports.last_step(world, names, self._now()))
        if not world.missing:
            self._publish_state()
        if self.done:
            self.get_logger().info(f"done: {world.step} steps, {world.late_steps} of them late")
            self._drop_timer()

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if self._external:
            response.message = "a run with external players cannot be paused"
            return response
        changes = request.data != self._paused
        self._paused = request.data
        if changes and self._runs and not self.done and self._timer is not None:
            if self._paused:
                self._timer.cancel()
            else:
                self._timer.reset()
        response.success = True
        response.message = f"{'paused' if self._paused else 'resumed'} at step {self.world.step}"
        self.get_logger().info(response.message)
        self._proceed()
        return response

    def _on_restart(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = f"the run restarts after {self.world.step} steps"
        self.get_logger().info(f"reset: {response.message}")
        self.begin()
        response.success = True
        return response

    def _on_control(self, i: int, message: MultiDOFJointTrajectory, waited: float) -> None:
        plan = control.decode(message, self.vehicles.joints_of(i))
        if self._published is None:
            raise MessageError(f"stamp: {stamp.text(plan.stamp)} s: the run has not started")
        step = self.clock.step(plan.stamp)
        self.world.simulated[i].receive(step, plan, self.world.step, self._published)
        self._proceed()

    def _on_odom(self, i: int, message: Odometry, waited: float) -> None:
        now = self._now()
        arrival = now if self.get_parameter("use_sim_time").value else now - waited
        self._external[i].receive(message, arrival, now, self._odom_timeout())

    def _publish_state(self) -> None:
        self.world.mark_published()
        time = self.clock.stamp(self.world.step)
        self._published = self._states.publish(time, self.world.s, self.world.w)


def main(args: list[str] | None = None) -> int:
    """Run the node until it is shut down."""
    return spin(Simulator, args)


if __name__ == "__main__":
    sys.exit(main())
