"""The world: moves the players, or hears where they are, and tells everybody."""

from __future__ import annotations

import sys
from functools import partial
from time import monotonic, perf_counter, time_ns
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry
from rclpy.publisher import Publisher
from rclpy.timer import Timer
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import MultiDOFJointState
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory
from typing_extensions import override

from gameinfer_ros.nodes.base.game_node import GameNode
from gameinfer_ros.nodes.base.parameter_node import ParameterError
from gameinfer_ros.nodes.base.spin import spin
from gameinfer_ros.nodes.world.external_player import ARRIVAL, OLDEST, STAMP, ExternalPlayer
from gameinfer_ros.nodes.world.world import World
from gameinfer_ros.runs.record import MOST_MISSING
from gameinfer_ros.scenario import MOST_STEPS
from msg_adapters import (
    MessageError,
    clock,
    control,
    diagnostics,
    joint_state,
    odometry,
    qos,
    stamp,
)

#: How often the simulator looks whether it can begin, and says why it does not go on, in s.
_LOOK, _TELL = 0.02, 1.0

#: Steps that are made up for when time was not noticed to go on; if there are more, they are left
#: out, because the clock has jumped.
_MADE_UP = 20

#: So many states of a run are left out at most. A record takes some more, because those that get
#: lost are missing there as well.
MOST_LEFT_OUT = MOST_MISSING * 9 // 10


class Simulator(GameNode):
    """Simulates the vehicles of all players on the grid of time steps.

    Once there are enough subscribers, it publishes the start of the run and the state of step 0,
    and waits until each player has sent an input for it. From then on, in lockstep, it goes on to
    the next step whenever all inputs for the present one have arrived. In realtime it goes on when
    the time of the step is over: a player whose input has not come is late, its last plan bridges
    the gap, and when that ends the player brakes.

    In realtime, any player can be external: somebody else moves it and tells where it is by
    odometry. Then time starts as soon as every external player has been heard, and waits for
    nobody. Each is read off at the time of each step. While one of them has not been heard for
    too long, no state is published, and `/diagnostics` says why; steps go on being counted. The
    run ends with the first state of its last step or a later one.

    The start is a time on this node's clock, and identifies the run. Without external players it is
    later than every stamp of the run before; if the clock is at 0, as when this node is to publish
    `/clock`, it is system time.

    Parameters, in addition to those of `GameNode`:
        steps (integer, read-only): steps to simulate; 0 for as many as the scenario says.
        subscribers (integer, read-only): subscribers of joint_state to wait for at the start.
        publish_clock (boolean, read-only): whether to publish the simulated time on /clock.
        external (string, read-only): names of the external players, with commas between them.
        odom_timeout (double): how old odometry of an external player may be, in s.
        odom_time (string, read-only): whether odometry is of the time of its `stamp`, on this
            node's clock, or of its `arrival`.

    Subscribers:
        <player>/control (trajectory_msgs/MultiDOFJointTrajectory, `RECENT`): one for each player
            that is simulated.
        <player>/odom (nav_msgs/Odometry, `SENSOR`): one for each external player.

    Publishers:
        run_start (builtin_interfaces/Time, `LATEST`)
        joint_state (sensor_msgs/MultiDOFJointState, `STREAM`)
        <player>/odom (nav_msgs/Odometry, `RECENT`): one for each player that is simulated.
        /clock (rosgraph_msgs/Clock, `CLOCK`): if asked for.

    Services:
        ~/pause (std_srvs/srv/SetBool): stops time, or lets it go on; not with external players.
        ~/reset (std_srvs/srv/Trigger): begins the run anew.
    """

    def __init__(self, name: str = "simulator", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        steps = self.declare(
            "steps", 0, "steps to simulate; 0: as the scenario says", (0, MOST_STEPS)
        )
        self.steps = steps or self.scenario.steps
        self._subscribers = self.declare(
            "subscribers",
            0,
            "joint_state subscribers to wait for before the first state",
            (0, 1000),
        )
        publish_clock = self.declare("publish_clock", False, "publish simulated time on /clock")
        external = self.declare(
            "external", "", "players that are not simulated, with commas between their names"
        )
        self._odom_timeout = self.declare_live(
            "odom_timeout", 0.5, "s; how old odometry of an external player may be", (0.01, OLDEST)
        )
        time_from = self.declare(
            "odom_time", STAMP, "what time odometry is of", choices=(STAMP, ARRIVAL)
        )
        names = self._external_names(external, publish_clock)
        self._run_start = self.advertise(Time, "run_start", qos.LATEST)
        self._joint_state = self.advertise(MultiDOFJointState, "joint_state", qos.STREAM)
        self._last_stamp = 0  # of all runs so far
        self._clock_publisher = None
        if publish_clock:
            self._clock_publisher = self.advertise(Clock, "/clock", qos.CLOCK)
        self._external: dict[int, ExternalPlayer] = {}
        self._odom: dict[int, Publisher] = {}
        self._take_up_players(names, time_from)
        self.create_service(SetBool, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/reset", self._on_restart)
        # Loads the kernels before time matters.
        self.vehicles.step(self.scenario.initial_vehicle_state, np.zeros(self.vehicles.n_inputs))
        self._paused = False
        self._timer: Timer | None = None
        self.begin()
        self.every(_TELL, self._tell_why_idle)

    def _external_names(self, parameter: str, publish_clock: bool) -> list[str]:
        names = [name.strip() for name in parameter.split(",")] if parameter.strip() else []
        for name in names:
            if name not in self.players.names:
                raise ParameterError(
                    f"external: '{name}' is not allowed: the players are "
                    f"{', '.join(self.players.names)}"
                )
        if names and self.lockstep:
            raise ParameterError(
                f"external: '{parameter}' is not allowed with the time lockstep, but with "
                "realtime: external players wait for nobody"
            )
        if names and publish_clock:
            raise ParameterError(
                f"external: '{parameter}' is not allowed with publish_clock: external players "
                "have a clock of their own"
            )
        return names

    def _take_up_players(self, external: list[str], time_from: str) -> None:
        for i, name in enumerate(self.players.names):
            if name in external:
                self._external[i] = ExternalPlayer(time_from)
                on_odom = partial(self._on_odom, i)
                self.subscribe(Odometry, f"{name}/odom", on_odom, qos.SENSOR, sole=True)
                continue
            self._odom[i] = self.advertise(Odometry, f"{name}/odom", qos.RECENT)
            self.subscribe(
                MultiDOFJointTrajectory,
                f"{name}/control",
                partial(self._on_control, i),
                qos.RECENT,  # with the newest one only, a stray one could take its place
                control.largest(self.vehicles.joints_of(i)),
                sole=True,
            )

    @property
    def done(self) -> bool:
        """Whether all steps have been simulated."""
        return self.world.told >= self.steps

    @override
    def begin(self) -> None:
        """Begin the run anew: put all players to where they start, and wait until all are there."""
        self._drop_timer()
        self.world = World(self.vehicles, self.scenario.initial_vehicle_state, self._external)
        self._lacking = 0
        self._published: float | None = None
        self._runs = False
        self._timer = self.every(_LOOK, self._start)
        self.get_logger().info(f"ready: waits for {', '.join(self.players.names)}")

    # --- Time -----------------------------------------------------------------------------------

    def _start(self) -> None:
        """Publish the first state once all who are to see it, or are in it, are there."""
        now = self._now()
        self.world.look(now, self._odom_timeout())
        self._lacking = self._subscribers - self._joint_state.get_subscription_count()
        if self.world.missing or self._lacking > 0 or self._lacks_clock:
            return
        self._drop_timer()
        self.clock.start = start = self._new_start()
        self._started, self._noticed, self._ticked = 1e-9 * start, now, monotonic()
        self._run_start.publish(stamp.encode(start))
        self._publish_state()
        if self._external:
            # Their clock may be a simulated one.
            self._timer = self.create_timer(self.game.dt, self._catch_up)
            self._runs = True

    def _new_start(self) -> int:
        """Start of the next run, in ns."""
        start = int(self.get_clock().now().nanoseconds)
        if not self._external:
            start = max(start or time_ns(), self._last_stamp + 1000)
        # Clocks may be coarse. By digits below a microsecond that differ, no stamp of one run is
        # taken for one of another.
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
        """Whether the clock of the external players has not told a time yet."""
        return bool(self._external and self._now() == 0.0)

    def _proceed(self) -> None:
        """Go on if all inputs for the present step have come."""
        if self._paused or self._runs or self.done or self._published is None:
            return
        if not self.world.ready:
            return
        if self.lockstep:
            self._advance()
        else:
            self.get_logger().info("all players are there: time starts")
            self._runs = True
            self._timer = self.every(self.game.dt, self._advance)

    def _catch_up(self) -> None:
        """Simulate all steps whose time has come on the clock of the external players."""
        now, dt, self._ticked = self._now(), self.game.dt, monotonic()
        if now < self._noticed:
            self._begin_anew("the clock was set back")
            return
        self._noticed = now
        due = int((now - self._started) / dt + 0.1)  # a timer may be a little early
        left_out = self.world.left_out + due - self.world.told - 1
        if left_out > MOST_LEFT_OUT:
            self._begin_anew(f"{left_out} states are missing, and at most {MOST_LEFT_OUT} may be")
            return
        if due > self.world.step + _MADE_UP:
            self.get_logger().warn(
                f"the clock jumped ahead: steps {self.world.step + 1} to {due - 1} are left out"
            )
            self.world.skip_to(due - 1)
        while not self.done and self.world.step < due:
            self._advance()

    def _begin_anew(self, why: str) -> None:
        self.get_logger().warn(f"{why}: the run begins anew")
        for player in self._external.values():
            player.forget()
        self.begin()

    def _tell_why_idle(self) -> None:
        """Say why no step is made, so that nobody takes it for a standstill."""
        idle = ""
        if self._published is None:
            waits = self._absences()
            idle = self._whom_it_lacks()
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
        elif self._external and monotonic() - self._ticked > max(_TELL, 2 * self.game.dt):
            message = f"the clock stands still at {self._now():.1f} s"
            idle = "no /clock"
        elif not self._runs and perf_counter() - self._published > _TELL:
            message = f"waits for the input of {', '.join(self._silent())}"
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
        self._report()
        if not world.missing:
            self._publish_state()
        if self.done:
            self.get_logger().info(f"done: {world.step} steps, {world.late_steps} of them late")
            self._drop_timer()

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if self._external:
            response.message = "external players do not pause: nothing has changed"
            return response
        changes = request.data != self._paused
        self._paused = request.data
        if changes and self._runs and not self.done and self._timer is not None:
            if self._paused:
                self._timer.cancel()
            else:
                self._timer.reset()
        response.success = True
        response.message = f"{'pauses' if self._paused else 'goes on'} at step {self.world.step}"
        self.get_logger().info(response.message)
        self._proceed()
        return response

    def _on_restart(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = f"begins anew, after {self.world.step} steps"
        self.get_logger().info(f"reset: {response.message}")
        self.begin()
        response.success = True
        return response

    # --- Players --------------------------------------------------------------------------------

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

    def _whom_it_lacks(self) -> str:
        names = [self.players.names[i] for i in self.world.missing]
        return f"no odometry of {', '.join(names)}" if names else ""

    def _silent(self) -> list[str]:
        """Players whose input for the present step has not come."""
        players = self.world.simulated.items()
        return [self.players.names[i] for i, p in players if not p.is_ready(self.world.step)]

    def _absences(self) -> list[str]:
        return [f"{self.players.names[i]} ({why})" for i, why in self.world.missing.items()]

    # --- Messages -------------------------------------------------------------------------------

    def _publish_state(self) -> None:
        vehicles, names, s, w = self.vehicles, self.vehicles.joint_names, self.world.s, self.world.w
        self.world.tell()
        time = self._last_stamp = self.clock.stamp(self.world.step)
        state = joint_state.JointState(
            time, vehicles.poses(s), vehicles.twists(s, w), vehicles.accelerations(w)
        )
        if self._clock_publisher is not None:
            self._clock_publisher.publish(clock.encode(time))
        for i, publisher in self._odom.items():
            publisher.publish(odometry.encode(time, state.poses[i], state.twists[i], names[i]))
        # It comes last: who reacts to the last state of a run may end it, and us with it.
        self._published = perf_counter()
        self._joint_state.publish(joint_state.encode(state, names))

    def _report(self) -> None:
        names, world = self.players.names, self.world
        figures: dict[str, object] = {"step": world.step - 1, "late_steps": world.late_steps}
        if world.missing:
            figures["idle"] = self._whom_it_lacks()
        for i, player in world.simulated.items():
            figures[f"{names[i]}/late_steps"] = player.late_steps
            if player.latency_ms is not None:
                figures[f"{names[i]}/latency_ms"] = f"{player.latency_ms:.2f}"
        for i, external in self._external.items():
            age = external.age(self._now())
            figures[f"{names[i]}/odom_age_s"] = "none" if age is None else f"{age:.3f}"
        troubles = []
        if world.missing:
            troubles.append(f"missing: {'; '.join(self._absences())}")
        if world.late:
            troubles.append(f"late: {', '.join(names[i] for i in world.late)}")
        self.report(
            "; ".join(troubles) or "all controls in time",
            figures,
            diagnostics.WARN if troubles else diagnostics.OK,
        )


def main(args: list[str] | None = None) -> int:
    """Run the node until it is shut down."""
    return spin(Simulator, args)


if __name__ == "__main__":
    sys.exit(main())
