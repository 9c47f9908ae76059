"""Watches a run until it is over."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

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
from gameinfer_ros.view import port as view_port

#: A run that makes no progress for so long, in s, has failed.
PATIENCE = 60.0

#: Longest time, in s, that reports and beliefs may take after the last state.
LAST_BELIEF = 10.0

#: So long, in s, it may take to find those who are there.
DISCOVERY = 1.0

#: So long, in s, may the nodes of a run before still be there.
LAST_ONES = 10.0


class Watch:
    """Watches a run until it is over.

    Args:
        options: the options of `gameinfer run`.
        recorder: records the run; it is spun here.
        nodes: the processes of the run.
        bag: the recorder of the bag, if there is one.
        console: where progress is reported.
    """

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
        self._record, self._heard = recorder.record, (0, 0)
        self._discovered, self._begun, self._viewed = False, False, not options.view

    def until_over(self) -> None:
        """Return when the run is over and its record complete, or its bag cannot be written.

        Raises:
            RunError: a node ended, nothing happened for a long time, or others take part.
        """
        with RunProgress(self._console, self._steps) as progress:
            while not self._over():
                self._executor.spin_once(timeout_sec=0.1)
                self._check_nodes()
                if self._bag is not None and self._bag.failure is not None:
                    return
                # Nodes that were killed and started anew count twice for a while.
                most = 1 + self._respawn.ghosts
                _check_alone(self._recorder, self._options.external, most)
                self._tell_milestones(progress)
                self._check_progress()
                solve_ms = self._figures("inference").get("solve_ms")
                progress.show(self._recorder.record, solve_ms)
        self._complete_record()

    def _over(self) -> bool:
        record, lockstep = self._recorder.record, self._options.time == LOCKSTEP
        if record.steps < self._steps:
            return False
        # Reports and beliefs arrive on topics of their own, in any order, and may be lost. With
        # external players, there may be further states.
        if self._idle_for > LAST_BELIEF:
            return True
        if record.steps != int(self._figures("simulator").get("step", "-1")) + 1:
            return False
        counted = not lockstep or self._steps - 1 in self._safety
        return record.steps in record.beliefs and counted

    def _check_nodes(self) -> None:
        """Start nodes anew that have died, where that is allowed.

        Raises:
            RunError: it is not.
        """
        for node in self._nodes:
            if node.exit_code is None:
                continue
            if node.exit_code != BAD_INPUT and self._respawn.allows(node.name):
                words = f"The node {node.name} ended with {node.ending}: it is started anew."
                self._console.print(words)
                node.restart()
                continue
            raise RunError(
                f"the node {node.name} ended with {node.ending}; its last words:\n"
                f"{node.last_words()}",
                BAD_INPUT if node.exit_code == BAD_INPUT else FAILED,
            )

    def _tell_milestones(self, progress: RunProgress) -> None:
        """Say how far the run has come, each thing once."""
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
                self._console.print("The run begins anew.")
            self._record = self._recorder.record
            progress.begin()
        if not self._begun and self._record.steps > 0:
            self._begun = True
            self._console.print(f"First controls of all players after {seconds:.1f} s.")

    def _check_progress(self) -> None:
        """Take note of new states and beliefs, and of reasons why there are none.

        Raises:
            RunError: there has been neither for a long time.
        """
        record = self._recorder.record
        heard = len(record.states), len(record.beliefs)
        idleness = Idleness.of(self._figures("simulator"))
        idleness.tell(self._idleness, self._console)
        if heard != self._heard or idleness.reason:  # with a reason, it is meant to wait
            self._last_progress = time.monotonic()
        self._heard, self._idleness = heard, idleness
        if self._idle_for > PATIENCE:
            words = "\n".join(f"--- {n.name}:\n{n.last_words(5)}" for n in self._nodes)
            raise RunError(f"no new state or belief for {PATIENCE:.0f} s; last words:\n{words}")

    def _complete_record(self) -> None:
        """Put into the record what the nodes said of themselves."""
        record = self._recorder.record
        if record.steps not in record.beliefs:
            newest = max(record.beliefs, default=None)
            words = (
                "there is no belief" if newest is None else f"the last belief is of step {newest}"
            )
            self._console.print(f"The inference does not answer: {words}.")
        record.late_steps = int(self._figures("simulator").get("late_steps", "0"))
        if not self._options.no_safety:
            known = [step for step in self._safety if step < self._steps]
            counts = self._safety[max(known)] if known else (0, 0)
            record.safety_braked, record.safety_limited = counts
        record.step_ms = list(self._recorder.solve_ms[f"{self._namespace}/inference"].values())

    def _figures(self, node: str) -> dict[str, str]:
        """What a node said of itself last."""
        return self._recorder.figures.get(f"{self._namespace}/{node}", {})

    @property
    def _safety(self) -> dict[int, tuple[int, int]]:
        """How often the safety layer of the robot has braked and limited until each step."""
        return self._recorder.safety[f"{self._namespace}/robot_planner"]

    @property
    def _idle_for(self) -> float:
        """Time since there was something new, in s."""
        return time.monotonic() - self._last_progress


def wait_until_alone(
    recorder: Recorder, external: Sequence[str], joined: float, console: Console
) -> None:
    """Wait until nobody publishes what the nodes of this run will, before these are started.

    Nodes of a run that was killed are there for some seconds. The states of another run, perhaps
    of another user, would be taken for ours.

    Args:
        recorder: hears who is there.
        external: players that are not simulated.
        joined: when the recorder joined the others, by `time.monotonic`.
        console: told if it takes longer.

    Raises:
        RunError: somebody goes on to publish it.
    """
    time.sleep(max(0.0, joined + DISCOVERY - time.monotonic()))
    topic = _crowded(recorder, external, 0)
    if topic is not None:
        console.print(f"Somebody else publishes {topic}: waiting for the end of a run before ...")
    deadline = time.monotonic() + LAST_ONES
    while time.monotonic() < deadline and _crowded(recorder, external, 0) is not None:
        time.sleep(0.05)
    _check_alone(recorder, external, 0)


def _check_alone(recorder: Recorder, external: Sequence[str], most: int) -> None:
    """Check that nobody else, perhaps on another machine, plays in this run.

    Raises:
        RunError: more than `most` publish the same.
    """
    topic = _crowded(recorder, external, most)
    if topic is not None:
        raise RunError(f"somebody else publishes {topic}, so this run is not what it should be")


def _crowded(recorder: Recorder, external: Sequence[str], most: int) -> str | None:
    """A topic that more than `most` publish; None if there is none.

    One more may publish the odometry of a player that is external.
    """
    topics = {"joint_state": most}
    for name in recorder.players.names:
        topics |= {f"{name}/odom": max(1, most)} if name in external else {f"{name}/control": most}
    return next((t for t, count in topics.items() if recorder.count_publishers(t) > count), None)
