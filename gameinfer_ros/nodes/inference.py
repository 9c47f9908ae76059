"""The node that infers which equilibrium the humans play, and plans for the robot."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import Any

import numpy as np
from typing_extensions import override
from visualization_msgs.msg import MarkerArray

from gameinfer_ros.inference import MOST_PARTICLES, NO_PARTICLE, Belief, check_particles
from gameinfer_ros.names.choices import MAP
from gameinfer_ros.nodes.base.follower_node import FollowerNode, Observation
from gameinfer_ros.nodes.base.spin import spin
from gameinfer_ros.nodes.belief.belief_publisher import BeliefPublisher
from gameinfer_ros.nodes.belief.catch_up import CatchUp
from gameinfer_ros.nodes.viewing.scene import Scene
from gameinfer_ros.planning import Deliberation, Planner, make_planner
from gameinfer_ros.solver import GameSolver
from msg_adapters import diagnostics, markers, qos


class Inference(FollowerNode):
    """Maintains a belief over equilibria, and plans the robot's strategy from it.

    For each state, the node first updates the weights of the particles, and publishes the belief
    and the strategy that the planner derives from it. It then re-solves the particles from the new
    state, the heaviest first. In realtime, this ends at a deadline; the other particles keep their
    strategies until the next state. The first solve has no deadline.

    A node that starts during a run builds its belief from all states so far, up to 200. In
    lockstep, the belief is the same as without the late start. In realtime, the node solves
    earlier states for at most five time steps, and weighs the particles by the remaining ones
    without solving. It publishes nothing until it has caught up.

    Subscribers:
        joint_state (sensor_msgs/MultiDOFJointState, `STREAM`)

    Publishers:
        robot_strategy (std_msgs/Float64MultiArray, `RECENT`)
        map_strategy (std_msgs/Float64MultiArray, `RECENT`)
        map_equilibrium (trajectory_msgs/MultiDOFJointTrajectory, `RECENT`): if there is a
            subscriber.
        belief (std_msgs/Float64MultiArray, `STREAM`)
        markers (visualization_msgs/MarkerArray, `RECENT`): if there is a subscriber, and
            in realtime only if the state was handled without delay.

    Services:
        ~/reset (std_srvs/srv/Trigger): restarts the belief with new particles.
    """

    def __init__(self, name: str = "inference", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        later = "; a change takes effect with the next run"
        self._particles = self.declare_live(
            "particles",
            0,
            f"number of particles; 0 for that of the scenario{later}",
            (0, MOST_PARTICLES),
            check=lambda count: check_particles(count, self.game),
        )
        self._generator = self.declare_seed("seed of the random generator for the particles")
        self._robot_plays = self.declare_live(
            "robot_plays",
            True,
            "if true, the robot acts, and only the states of the humans are weighed; if false, it "
            f"watches, and all states are weighed{later}",
        )
        self._planner_kind = self.declare_live(
            "planner",
            MAP,
            "planner that derives the robot's strategy from the belief; a change takes effect with "
            "the next state",
            choices=tuple(Planner.family),
            on_set=self._replace_planner,
        )
        self._planner_generator = self.declare_seed(
            "seed of the planner's random generator, which for example draws the equilibrium of "
            "the baseline",
            "planner_seed",
        )
        settings = self.scenario.solver
        threads = self.declare(
            "threads", 0, "number of threads of the solver; 0 for that of the scenario", (0, 64)
        )
        if threads:
            settings = settings.model_copy(update={"threads": threads})
        self._deadline = self.declare_live(
            "deadline",
            0.0,
            "in realtime, re-solving ends this long after the arrival of a state, in s; 0 for nine "
            "tenths of a time step",
            (0.0, 60.0),
        )
        self._solver = GameSolver(self.game, settings)
        self._solver.warm_up()
        self.on_run()
        self._missed = 0
        self._publisher = BeliefPublisher(self)
        self._markers = self.advertise(MarkerArray, "markers", qos.RECENT, self._on_viewer)
        self.subscribe_state(self._on_state, qos.STREAM)
        self._catch_up = CatchUp(self, self._on_quiet)
        self.get_logger().info(f"ready: {len(self._belief)} particles wait for states")

    @override
    def on_run(self) -> None:
        self._scene = Scene(self.game)
        self._drawn: Observation | None = None  # the last state with published markers
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

    def _replace_planner(self) -> None:
        self._planner = self._mind.planner = self._make_planner()

    def _on_state(self, observation: Observation) -> None:
        now = perf_counter()
        self._solve_s = 0.0
        if self._catch_up.covers(now):
            self._take_in(observation)
            return
        seconds = np.inf if self.lockstep else self._deadline() or 0.9 * self.game.dt
        self._observe(observation)
        self._publish(observation)
        updated = self._update(now - observation.waited + seconds)
        self._missed += updated < len(self._belief)
        self._report(observation.step, updated)
        # Markers can take longer than the update, so a node that is late publishes none.
        if self.lockstep or observation.waited < 0.1 * self.game.dt:
            self._show(observation)

    def _take_in(self, observation: Observation) -> None:
        """Weigh one of the earlier states without publishing; more may follow at once."""
        first = self._last is None
        self._observe(observation)
        self._update(self._catch_up.deadline)
        if first:
            self._catch_up.restart()

    def _on_quiet(self) -> None:
        """Publish what follows from the newest of the earlier states."""
        last = self._last
        if last is None:
            return
        self._catch_up.end()
        if self._belief.strategy.first_step < last.step:
            self._solve_s = 0.0
            self._update(perf_counter() + 0.9 * self.game.dt)
        self._publish(last)
        self._report(last.step, int(self._belief.updated.sum()))
        self._show(last)
        if last.step > 0:
            self.get_logger().info(f"has caught up with step {last.step}")

    def _observe(self, observation: Observation) -> None:
        """Weigh the particles by a state."""
        self._last = observation
        with self._timed():
            self._mind.observe(observation.step, observation.s, observation.w)
        if self._mind.missing:
            steps = f"{observation.step - self._mind.missing} to {observation.step - 1}"
            self.get_logger().warn(f"states of steps {steps} are missing")
        self._scene.follow(observation.step, self.vehicles.poses(observation.s))

    def _publish(self, observation: Observation) -> None:
        """Plan, and publish the result and the belief."""
        with self._timed():
            chosen = self._mind.choose()
        self._publisher.publish(observation, self._belief, self._planner.particle, chosen)

    def _update(self, deadline: float) -> int:
        """Re-solve particles until a deadline, by `time.perf_counter`; returns their number."""
        with self._timed():
            return self._mind.update(deadline)

    @contextmanager
    def _timed(self) -> Iterator[None]:
        """Add the time that a block takes to the solve time of the state."""
        start = perf_counter()
        yield
        self._solve_s += perf_counter() - start

    def _show(self, observation: Observation) -> None:
        if self._markers.get_subscription_count():
            shapes = self._scene.shapes(self._belief)
            self._markers.publish(markers.encode(shapes, self.now))
            self._drawn = observation

    def _on_viewer(self, event: Any) -> None:
        """Publish markers of the last state for a new subscriber, before the next state arrives."""
        last = self._last
        if self._catch_up.active:  # newer markers follow
            return
        if event.current_count_change > 0 and last is not None and last is not self._drawn:
            self._show(last)

    def _report(self, step: int, updated: int) -> None:
        belief, likely = self._belief, self._belief.equilibrium
        settled = int(belief.settled.sum())
        message, level = "follows the belief", diagnostics.OK
        if likely.particle == NO_PARTICLE:
            message, level = "no equilibrium is known: the robot brakes", diagnostics.WARN
        elif belief.map_index is None:
            message, level = "no particle is settled: the last MAP is kept", diagnostics.WARN
        elif updated < len(belief):
            message, level = "some particles were not reached in time", diagnostics.WARN
        elif settled < len(belief):
            message, level = "some particles are not settled", diagnostics.WARN
        self.report(
            message,
            {
                "step": step,
                "solve_ms": f"{1e3 * self._solve_s:.2f}",
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


if __name__ == "__main__":
    sys.exit(spin(Inference, sys.argv[1:]))
