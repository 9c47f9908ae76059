"""Monitors a run until it ends."""

import argparse
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext

from rclpy.executors import SingleThreadedExecutor
from rich.console import Console

from gameinfer_ros.names.choices import LOCKSTEP
from gameinfer_ros.names.defaults import VIEW_HOST
from gameinfer_ros.names.exit_codes import BAD_INPUT, FAILED
from gameinfer_ros.nodes.bag_recorder import BagRecorder
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.orchestration.idleness import Idleness
from gameinfer_ros.orchestration.node_process import NodeProcess
from gameinfer_ros.orchestration.respawn import Respawn
from gameinfer_ros.orchestration.run_error import RunError
from gameinfer_ros.runs.progress import RunProgress
from gameinfer_ros.system import port as view_port

#: A run fails after this time without progress, in s.
PATIENCE = 60.0

#: Timeout for statuses and beliefs after the last state, in s.
LAST_BELIEF = 10.0

#: Time for the discovery of other nodes, in s.
DISCOVERY = 1.0

#: Timeout for the end of nodes of an earlier run, in s.
LAST_ONES = 10.0


class Watch:
    """Monitors a run until it ends. It spins the recorder of the run."""

    def __init__(
        self,
        options: argparse.Namespace,
        recorder: Recorder,
        nodes: Sequence[NodeProcess],
        bag: BagRecorder | None,
        console: Console,
    ) -> None:
        self._options, self._recorder = options, recorder
        self._nodes, self._bag, self._console = nodes, bag, console
        self._executor = SingleThreadedExecutor(context=recorder.context)
        self._executor.add_node(recorder)
        self._steps = options.steps or recorder.scenario.steps
        self._namespace = recorder.get_namespace().rstrip("/")
        self._respawn, self._idleness = Respawn(options.respawn), Idleness()
        self._start = self._last_progress = time.monotonic()
        self._record, self._received = recorder.record, (0, 0)
        self._discovered, self._begun, self._viewed = False, False, not options.view

    def until_over(self, guard: Callable[[], AbstractContextManager[None]] = nullcontext) -> None:
        """Return when the run is over and its record complete, or its bag cannot be written.

        Calls of the middleware are in blocks of `guard`.

        Raises:
            RunError: a node ended, there was no progress, or another node publishes its topics.
        """
        with RunProgress(self._console, self._steps) as progress:
            while not self._over():
                with guard():
                    self._executor.spin_once(timeout_sec=0.1)
                    # A killed node and its replacement both count for a while.
                    most = 1 + self._respawn.ghosts
                    topic = _crowded(self._recorder, self._options.external, most)
                self._check_nodes()
                if self._bag is not None and self._bag.failure is not None:
                    return
                if topic is not None:
                    raise _not_alone(topic)
                self._report_milestones(progress)
                self._check_progress()
                progress.show(self._recorder.record, self._figures("inference").get("solve_ms"))
        self._complete_record()

    def _over(self) -> bool:
        record, lockstep = self._recorder.record, self._options.time == LOCKSTEP
        if record.steps < self._steps:
            return False
        # Statuses and beliefs arrive on separate topics, in any order, and may be lost. With
        # external players, there may be further states.
        if self._idle_for > LAST_BELIEF:
            return True
        if record.steps != int(self._figures("simulator").get("step", "-1")) + 1:
            return False
        last = self._steps - 1
        # An inference node that has caught up reports a later step only.
        reported = not lockstep or (
            last in self._safety and max(self._solve_ms, default=-1) >= last
        )
        return record.steps in record.beliefs and reported

    def _check_nodes(self) -> None:
        """Restart nodes that have died, or raise `RunError` if this is not allowed."""
        for node in self._nodes:
            if node.exit_code is None:
                continue
            if node.exit_code != BAD_INPUT and self._respawn.allows(node.name):
                self._console.print(
                    f"The node {node.name} ended with {node.ending}: restarting it."
                )
                node.restart()
                continue
            raise RunError(
                f"the node {node.name} ended with {node.ending}; its last output:\n"
                f"{node.last_output()}",
                BAD_INPUT if node.exit_code == BAD_INPUT else FAILED,
            )

    def _report_milestones(self, progress: RunProgress) -> None:
        seconds = time.monotonic() - self._start
        if not self._discovered:
            names = self._recorder.get_node_names()
            self._discovered = {node.name for node in self._nodes} <= set(names)
            if self._discovered:
                words = f"All {len(self._nodes)} nodes discovered after {seconds:.1f} s."
                self._console.print(words)
        if not self._viewed and view_port.answers(self._options.view_port):
            self._viewed = True
            self._console.print(f"View: http://{VIEW_HOST}:{self._options.view_port}/")
        if self._record is not self._recorder.record:
            if self._record.states:
                self._console.print("The run restarts.")
            self._record = self._recorder.record
            progress.begin()
        if not self._begun and self._record.steps > 0:
            self._begun = True
            self._console.print(f"First controls of all players after {seconds:.1f} s.")

    def _check_progress(self) -> None:
        """Report why there are no new states; raise `RunError` after a long time without reason."""
        record = self._recorder.record
        received = len(record.states), len(record.beliefs)
        idleness = Idleness.of(self._figures("simulator"))
        idleness.tell(self._idleness, self._console)
        if received != self._received or idleness.reason:  # with a reason, waiting is intended
            self._last_progress = time.monotonic()
        self._received, self._idleness = received, idleness
        if self._idle_for > PATIENCE:
            output = "\n".join(f"--- {node.name}:\n{node.last_output(5)}" for node in self._nodes)
            raise RunError(f"no new state or belief for {PATIENCE:.0f} s; last output:\n{output}")

    def _complete_record(self) -> None:
        """Add figures that the nodes reported about themselves to the record."""
        record = self._recorder.record
        if record.steps not in record.beliefs:
            newest = max(record.beliefs, default=None)
            words = (
                "there is no belief" if newest is None else f"the last belief is of step {newest}"
            )
            self._console.print(f"The inference does not respond: {words}.")
        record.late_steps = int(self._figures("simulator").get("late_steps", "0"))
        if not self._options.no_safety:
            known = [step for step in self._safety if step < self._steps]
            counts = self._safety[max(known)] if known else (0, 0)
            record.safety_braked, record.safety_limited = counts
        record.step_ms = list(self._solve_ms.values())

    def _figures(self, node: str) -> dict[str, str]:
        """Newest figures that a node reported."""
        return self._recorder.figures.get(f"{self._namespace}/{node}", {})

    @property
    def _safety(self) -> dict[int, tuple[int, int]]:
        return self._recorder.safety[f"{self._namespace}/robot_planner"]

    @property
    def _solve_ms(self) -> dict[int, float]:
        return self._recorder.solve_ms[f"{self._namespace}/inference"]

    @property
    def _idle_for(self) -> float:
        """Time since the last progress, in s."""
        return time.monotonic() - self._last_progress


def wait_until_alone(
    recorder: Recorder, external: Sequence[str], joined: float, console: Console
) -> None:
    """Wait until no node publishes topics of this run, before its nodes are started.

    Nodes of a killed run remain for some seconds. The states of another run, perhaps of another
    user, would be mistaken for those of this one. The recorder `joined` the domain at this time, by
    `time.monotonic`.

    Raises:
        RunError: another node still publishes after `LAST_ONES`.
    """
    time.sleep(max(0.0, joined + DISCOVERY - time.monotonic()))
    deadline, waits = time.monotonic() + LAST_ONES, False
    while (topic := _crowded(recorder, external, 0)) is not None:
        if not waits:
            console.print(f"Another node publishes {topic}: waiting for an earlier run to end ...")
            waits = True
        if time.monotonic() > deadline:
            raise _not_alone(topic)
        time.sleep(0.05)


def _not_alone(topic: str) -> RunError:
    return RunError(f"another node publishes {topic}, and its messages would mix with this run's")


def _crowded(recorder: Recorder, external: Sequence[str], most: int) -> str | None:
    """Return a topic with more than `most` publishers; None if there is none.

    The odometry of an external player may have one publisher in any case.
    """
    topics = {"joint_state": most}
    for name in recorder.players.names:
        topics |= {f"{name}/odom": max(1, most)} if name in external else {f"{name}/control": most}
    return next((t for t, count in topics.items() if recorder.count_publishers(t) > count), None)
