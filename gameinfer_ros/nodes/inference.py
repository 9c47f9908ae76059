"""The belief: which equilibrium do the others play?"""

from __future__ import annotations

import sys
from time import perf_counter
from typing import Any

import numpy as np
from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.timer import Timer
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory
from typing_extensions import override
from visualization_msgs.msg import MarkerArray

from gameinfer_ros.games import ROBOT
from gameinfer_ros.inference import MOST_PARTICLES, NO_PARTICLE, Belief, check_particles
from gameinfer_ros.names.choices import MAP
from gameinfer_ros.nodes.base.follower_node import FollowerNode, Observation
from gameinfer_ros.nodes.base.parameter_node import ParameterError
from gameinfer_ros.nodes.base.spin import spin
from gameinfer_ros.nodes.viewing.scene import Scene
from gameinfer_ros.planning import Deliberation, Planner, make_planner
from gameinfer_ros.solver import IterativeLQ, Strategy
from msg_adapters import belief as belief_message
from msg_adapters import diagnostics, equilibrium, markers, qos
from msg_adapters import strategy as strategy_message

#: After its first solve, a node that is started in the midst of a run solves for old states within
#: so many steps, and publishes after so many at the latest.
_CATCH_UP, _CAUGHT_UP = 5, 8


class Inference(FollowerNode):
    """Keeps a belief over equilibria, and plans the robot's part from it.

    When a state arrives, the node weighs the particles by it and publishes the strategy that the
    planner makes from the belief. Then it re-solves the particles from the new state, the heaviest
    first. In realtime this ends at a deadline; particles that were not reached keep their
    strategies until the next state. The first solve has no deadline.

    When it is started in the midst of a run, it makes its belief of all states so far, up to 200.
    In lockstep, that is the belief that it would have had. In realtime, it takes five steps at most
    to solve old states, weighs the particles by the others with the strategies that there are, and
    publishes nothing until it has caught up.

    Parameters, in addition to those of `GameNode`:
        particles (integer): seeds to draw; 0 for as many as the scenario says. A change counts
            from the next run on.
        seed (integer): of the generator that the seeds are drawn with; likewise.
        robot_plays (boolean): whether the robot goes its own way, so that only the humans tell
            about the equilibrium, or only watches; likewise.
        planner (string): what makes the robot's strategy from the belief: `map`, `baseline`, or
            another planner; a change takes effect with the next state.
        planner_seed (integer): of the generator of what the planner draws, such as the equilibrium
            of the baseline; a change takes effect with the next run.
        threads (integer, read-only): threads that share the particles; 0 for as many as the
            scenario says.
        deadline (double): how long after the arrival of a state the solver may work on
            it in realtime, in s; 0 for nine tenths of a time step.

    Subscribers:
        joint_state (sensor_msgs/MultiDOFJointState, `STREAM`)

    Publishers:
        robot_strategy (std_msgs/Float64MultiArray, `RECENT`)
        map_strategy (std_msgs/Float64MultiArray, `RECENT`)
        map_equilibrium (trajectory_msgs/MultiDOFJointTrajectory, `RECENT`): if there is a
            subscriber.
        belief (std_msgs/Float64MultiArray, `STREAM`)
        markers (visualization_msgs/MarkerArray, `RECENT`): if there is a subscriber, and
            in realtime if the state did not wait for the node.

    Services:
        ~/reset (std_srvs/srv/Trigger): begins anew with other particles.
    """

    def __init__(self, name: str = "inference", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        later = "; a change counts from the next run on"
        self._particles = self.declare_live(
            "particles", 0, f"seeds; 0: as the scenario says{later}", (0, MOST_PARTICLES)
        )
        self.add_on_set_parameters_callback(self._check_particles)
        result = self._check_particles([self.get_parameter("particles")])
        if not result.successful:
            raise ParameterError(result.reason)
        self._generator = self.declare_seed("of the generator that the seeds are drawn with")
        self._robot_plays = self.declare_live(
            "robot_plays", True, f"false: the robot only watches{later}"
        )
        self._planner_kind = self.declare_live(
            "planner",
            MAP,
            "what makes the robot's strategy; a change takes effect with the next state",
            choices=tuple(Planner.family),
        )
        self._planner_generator = self.declare_seed("of what the planner draws", "planner_seed")
        self.add_post_set_parameters_callback(self._on_planner_set)
        settings = self.scenario.solver
        threads = self.declare("threads", 0, "of the solver; 0: as the scenario says", (0, 64))
        if threads:
            settings = settings.model_copy(update={"threads": threads})
        self._deadline = self.declare_live(
            "deadline", 0.0, "s for an update in realtime; 0: nine tenths of a step", (0.0, 60.0)
        )
        self._solver = IterativeLQ(self.game, settings)
        self._solver.warm_up()
        self.on_run()
        self._missed = 0
        self._began: float | None = None  # to catch up
        self._news = False  # whether a state has come since the last look
        self._behind: Timer | None = None
        self._robot_strategy = self.advertise(Float64MultiArray, "robot_strategy", qos.RECENT)
        self._map_strategy = self.advertise(Float64MultiArray, "map_strategy", qos.RECENT)
        self._map_equilibrium = self.advertise(
            MultiDOFJointTrajectory, "map_equilibrium", qos.RECENT
        )
        self._belief_publisher = self.advertise(Float64MultiArray, "belief", qos.STREAM)
        self._markers = self.advertise(MarkerArray, "markers", qos.RECENT, self._on_viewer)
        self.subscribe_state(self._on_state, qos.STREAM)
        if not self.lockstep:
            self._behind = self.every(0.25 * self.game.dt, self._look_whether_behind)
        self.get_logger().info(f"ready: {len(self._belief)} particles wait for states")

    def _check_particles(self, parameters: list[Parameter]) -> SetParametersResult:
        try:
            for parameter in parameters:
                if parameter.name == "particles" and isinstance(parameter.value, int):
                    check_particles(parameter.value, self.game)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    @override
    def on_run(self) -> None:
        self._scene = Scene(self.game)
        self._drawn: Observation | None = None  # the newest state that there is a picture of
        self.begin()

    @override
    def begin(self) -> None:
        settings = self.scenario.inference
        if self._particles():
            settings = settings.model_copy(update={"particles": self._particles()})
        self._belief = Belief(
            self._solver, self.scenario.seeds, settings, self._generator(), self._robot_plays()
        )
        self._planner = self._make_planner()
        self._mind = Deliberation(self.vehicles, self._belief, self._planner)
        self._last: Observation | None = None

    def _make_planner(self) -> Planner:
        generator = self._planner_generator()
        return make_planner(self._planner_kind(), self._solver, self.scenario.seeds, generator)

    def _on_planner_set(self, parameters: list[Parameter]) -> None:
        names = [parameter.name for parameter in parameters]
        if "planner" in names:
            self._planner = self._mind.planner = self._make_planner()

    def _on_state(self, observation: Observation) -> None:
        now = perf_counter()
        self._began = self._began or now
        if self._behind is not None and now < self._began + _CAUGHT_UP * self.game.dt:
            self._catch_up(observation)
            return
        self._on_time()
        seconds = np.inf if self.lockstep else self._deadline() or 0.9 * self.game.dt
        solve_s = self._observe(observation)
        solve_s += self._publish(observation)
        update_s, updated = self._update(now - observation.waited + seconds)
        self._missed += updated < len(self._belief)
        self._report(observation.step, solve_s + update_s, updated)
        self._draw(observation)

    def _observe(self, observation: Observation) -> float:
        """Weigh the particles by a state; returns how long it took, in s."""
        start = perf_counter()
        last, self._last = self._last, observation
        self._mind.observe(observation.step, observation.s, observation.w)
        if last is not None and self._mind.missing:
            steps = f"{last.step + 1} to {observation.step - 1}"
            self.get_logger().warn(f"states of steps {steps} are missing")
        return perf_counter() - start

    def _update(self, deadline: float) -> tuple[float, int]:
        """Re-solve the particles until the deadline.

        Returns:
            How long it took, in s, and how many particles it reached.
        """
        start = perf_counter()
        updated = self._mind.update(deadline)
        return perf_counter() - start, updated

    def _catch_up(self, observation: Observation) -> None:
        """Take in one of the first states: others may follow at once, which make it stale."""
        assert self._began is not None
        self._news = True
        begins = self._last is None
        observe_s = self._observe(observation)
        update_s, _ = self._update(self._began + _CATCH_UP * self.game.dt)
        self._solve_s = observe_s + update_s
        self._scene.follow(observation.step, self.vehicles.poses(observation.s))
        if begins:  # the first solve has no deadline, and does not count
            self._began = perf_counter()

    def _look_whether_behind(self) -> None:
        """Publish what follows from the newest of the first states, once no other arrives."""
        self._news, news = False, self._news
        last = self._last
        if news or last is None:
            return
        self._on_time()
        if self._belief.strategy.first_step < last.step:
            self._solve_s, _ = self._update(perf_counter() + 0.9 * self.game.dt)
        choose_s = self._publish(last)
        updated = int(self._belief.updated.sum())
        self._report(last.step, self._solve_s + choose_s, updated)
        self._show(last)
        if last.step > 0:
            self.get_logger().info(f"has caught up with step {last.step}")

    def _on_time(self) -> None:
        if self._behind is not None:
            self._behind.cancel()
            self.destroy_timer(self._behind)
            self._behind = None

    def _publish(self, observation: Observation) -> float:
        """Publish the robot's strategy and the belief; returns how long planning took, in s."""
        belief, step = self._belief, observation.step
        start = perf_counter()
        chosen = self._mind.choose()
        choose_s = perf_counter() - start
        self._publish_strategy(self._robot_strategy, step, self._planner.particle, chosen)
        likely = belief.equilibrium
        own = likely.strategy.of_inputs(self.players.inputs(ROBOT))
        self._publish_strategy(self._map_strategy, step, likely.particle, own)
        self._belief_publisher.publish(
            belief_message.encode(
                belief_message.BeliefSummary(
                    self.clock.stamp(step),
                    likely.particle,
                    belief.ids,
                    belief.weights,
                    belief.settled,
                    belief.costs.T,
                )
            )
        )
        if self._map_equilibrium.get_subscription_count():
            self._publish_equilibrium(observation, likely.strategy)
        return choose_s

    def _publish_strategy(
        self, publisher: Publisher, step: int, particle: int, strategy: Strategy
    ) -> None:
        k = step - strategy.first_step
        x, u, P = (a[k:, ..., 0] for a in (strategy.x_ref, strategy.u_ref, strategy.P))
        stamp = self.clock.stamp(step)
        message = strategy_message.AffineStrategy(stamp, particle, u, P, x[:-1])
        publisher.publish(strategy_message.encode(message))

    def _publish_equilibrium(self, observation: Observation, strategy: Strategy) -> None:
        vehicles, k = self.vehicles, observation.step - strategy.first_step
        x, u = strategy.x_ref[k:, :, 0], strategy.u_ref[k:, :, 0]
        s = vehicles.along(x, observation.s)
        w = vehicles.vehicle_input(s, np.vstack([u, np.zeros(self.players.n_inputs)]))
        message = equilibrium.Equilibrium(
            self.clock.stamp(observation.step),
            vehicles.poses(s),
            vehicles.twists(s, w),
            vehicles.accelerations(w),
        )
        names = vehicles.joint_names
        self._map_equilibrium.publish(equilibrium.encode(message, names, self.game.dt))

    def _draw(self, observation: Observation) -> None:
        """Publish a picture, which can take longer than all else, so not if states wait."""
        self._scene.follow(observation.step, self.vehicles.poses(observation.s))
        if self.lockstep or observation.waited < 0.1 * self.game.dt:
            self._show(observation)

    def _show(self, observation: Observation) -> None:
        if self._markers.get_subscription_count():
            shapes = self._scene.shapes(self._belief)
            self._markers.publish(markers.encode(shapes, self.get_clock().now().nanoseconds))
            self._drawn = observation

    def _on_viewer(self, event: Any) -> None:
        """Show a new viewer the present state: the next one may be long in coming."""
        last = self._last
        if self._behind is not None:  # what it is shown then is newer
            return
        if event.current_count_change > 0 and last is not None and last is not self._drawn:
            self._show(last)

    def _report(self, step: int, solve_s: float, updated: int) -> None:
        belief, likely = self._belief, self._belief.equilibrium
        settled = int(belief.settled.sum())
        message, level = "follows the belief", diagnostics.OK
        if likely.particle == NO_PARTICLE:
            message, level = "no equilibrium is known: the robot brakes", diagnostics.WARN
        elif belief.map_index is None:
            message, level = "no particle is settled: the last MAP stays", diagnostics.WARN
        elif updated < len(belief):
            message, level = "some particles were not reached in time", diagnostics.WARN
        elif settled < len(belief):
            message, level = "some particles are not settled", diagnostics.WARN
        self.report(
            message,
            {
                "step": step,
                "solve_ms": f"{1e3 * solve_s:.2f}",
                "iterations": int(belief.iterations.sum()),
                "particles": len(belief),
                "updated_particles": updated,
                "settled_particles": settled,
                "converged_share": f"{np.mean(belief.converged):.3f}",
                "effective_sample_size": f"{belief.effective_sample_size:.2f}",
                "map": likely.particle,
                "map_probability": f"{likely.probability:.6f}",
                "missed_deadlines": self._missed,
            },
            level,
        )


def main(args: list[str] | None = None) -> int:
    """Run the node until it is shut down."""
    return spin(Inference, args)


if __name__ == "__main__":
    sys.exit(main())
