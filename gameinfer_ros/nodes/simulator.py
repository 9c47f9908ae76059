"""The node that simulates the players and publishes their states."""

import sys
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from rclpy.timer import Timer
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory
from typing_extensions import override

from gameinfer_ros.nodes.base.game_node import GameNode
from gameinfer_ros.nodes.base.spin import spin
from gameinfer_ros.nodes.world.external_clock import ClockError, ExternalClock
from gameinfer_ros.nodes.world.external_player import ARRIVAL, OLDEST, STAMP, external_players
from gameinfer_ros.nodes.world.state_publisher import StatePublisher
from gameinfer_ros.nodes.world.world import World
from gameinfer_ros.scenario import MOST_STEPS
from msg_adapters import MessageError, control, diagnostics, qos, stamp

#: Period of the check whether the run can start, and of the report why it does not advance, in s.
_LOOK, _REPORT = 0.02, 1.0


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
    """

    def __init__(self, name: str = "simulator", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        steps = self.declare(
            "steps", 0, "number of steps; 0 for that of the scenario", (0, MOST_STEPS)
        )
        self.steps = steps or self.scenario.steps
        for warning in self.scenario.late_goals(self.steps):
            self.get_logger().warn(warning)
        subscribers = self.declare(
            "subscribers",
            0,
            "number of subscribers of joint_state to wait for before the run starts",
            (0, 1000),
        )
        publish_clock = self.declare(
            "publish_clock", False, "whether to publish the simulated time on /clock"
        )
        external = self.declare(
            "external", "", "names of the external players, separated by commas"
        )
        odom_timeout = self.declare_live(
            "odom_timeout",
            0.5,
            "an external player is missing if its newest odometry is older than this, in s",
            (0.01, OLDEST),
        )
        time_from = self.declare(
            "odom_time",
            STAMP,
            "source of the time of odometry: its `stamp`, by this node's clock, or its `arrival`",
            choices=(STAMP, ARRIVAL),
        )
        self._external = external_players(self, external, publish_clock, time_from, odom_timeout)
        simulated = [i for i in range(len(self.players)) if i not in self._external]
        for i in simulated:
            self.subscribe(
                MultiDOFJointTrajectory,
                f"{self.players.names[i]}/control",
                partial(self._on_control, i),
                qos.RECENT,  # with a depth of 1, a stray message could replace the newest one
                control.largest(self.vehicles.joints_of(i)),
                sole=True,
            )
        self._states = StatePublisher(self, simulated, publish_clock, subscribers)
        self.create_service(SetBool, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/reset", self._on_restart)
        # This loads the compiled kernels before the first step.
        self.vehicles.step(self.scenario.initial_vehicle_state, np.zeros(self.vehicles.n_inputs))
        self._paused = False
        self._timer: Timer | None = None
        self.begin()
        self.every(_REPORT, self._report_idle)

    @property
    def done(self) -> bool:
        """Whether the state of the last step has been published."""
        return self.world.published >= self.steps

    @override
    def begin(self) -> None:
        """Restart: reset all players to their initial states, and wait until the run can start."""
        self._drop_timer()
        self.world = World(self.vehicles, self.scenario.initial_vehicle_state, self._external)
        self._waits: list[str] = []  # what the start waits for
        self._published: float | None = None
        self._external_clock: ExternalClock | None = None
        self._timer = self.every(_LOOK, self._start)
        self.get_logger().info(f"ready: waits for {', '.join(self.players.names)}")

    def _start(self) -> None:
        """Start the run once all subscribers and external players are present."""
        now = 1e-9 * self.now
        self.world.look(now)
        self._waits = self.world.absences
        if self._external and now == 0.0:
            self._waits.append("/clock")
        if self._states.lacking:
            self._waits.append(self._states.lacking)
        if self._waits:
            return
        self._drop_timer()
        self.clock.start = self._states.start(after_last=not self._external)
        self._publish_state()
        if self._external:
            clock = self._external_clock = ExternalClock(self, self.clock.start)
            self._timer = self.create_timer(self.game.dt, lambda: self._catch_up(clock))

    def _proceed(self) -> None:
        """Advance, or start the clock, if all inputs for the present step have arrived."""
        if self._published is None or self._paused or self.done:
            return
        if self.world.silent or self._timer is not None:  # with a timer, time runs
            return
        if self.lockstep:
            self._advance()
        else:
            self.get_logger().info("all players are ready: time starts")
            self._timer = self.every(self.game.dt, self._advance)

    def _catch_up(self, clock: ExternalClock) -> None:
        """Simulate all steps that are due on the clock of the external players."""
        try:
            due = clock.due(self.world)
        except ClockError as error:
            self.get_logger().warn(f"{error}: the run restarts")
            for player in self._external.values():
                player.forget()
            self.begin()
            return
        while not self.done and self.world.step < due:
            self._advance()

    def _advance(self) -> None:
        world, names, missing = self.world, self.players.names, self.world.missing
        world.advance(1e-9 * self.clock.stamp(world.step + 1))
        for i in world.missing.keys() - missing.keys():
            self.get_logger().warn(f"{names[i]} is lost: {world.missing[i]}")
        for i in missing.keys() - world.missing.keys():
            self.get_logger().info(f"{names[i]} is back")
        self.report(*world.status(1e-9 * self.now))
        if not world.missing:
            self._publish_state()
        if self.done:
            self.get_logger().info(f"done: {world.step} steps, {world.late_steps} of them late")
            self._drop_timer()

    def _publish_state(self) -> None:
        self.world.mark_published()
        time = self.clock.stamp(self.world.step)
        self._published = self._states.publish(time, self.world.s, self.world.w)

    def _drop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self.destroy_timer(self._timer)
            self._timer = None

    def _report_idle(self) -> None:
        """Report why the run does not advance, if it does not."""
        idle = ""
        if self._published is None:
            if not self._waits:
                return
            message = f"waits for {'; '.join(self._waits)}"
            idle = "no /clock" if "/clock" in self._waits else self.world.missing_odometry
        elif self.done:
            return
        elif self._paused:
            message = idle = f"paused at step {self.world.step}"
        elif self._external_clock and self._external_clock.stopped(max(_REPORT, 2 * self.game.dt)):
            message, idle = f"the clock has stopped at {1e-9 * self.now:.1f} s", "no /clock"
        elif self._timer is None and perf_counter() - self._published > _REPORT:
            message = f"waits for the input of {', '.join(self.world.silent)}"
        else:
            return
        self.get_logger().info(message, throttle_duration_sec=5.0)
        figures = {"late_steps": self.world.late_steps, "idle": idle}
        self.report(message, figures, diagnostics.WARN)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if self._external:
            response.message = "a run with external players cannot be paused"
            return response
        changes = request.data != self._paused
        self._paused = request.data
        if changes and self._published is not None and self._timer is not None:
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


if __name__ == "__main__":
    sys.exit(spin(Simulator, sys.argv[1:]))
