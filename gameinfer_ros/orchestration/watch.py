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
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.view import port as view_port

#: A run that makes no progress for so long, in s, has failed.
PATIENCE = 60.0

#: In realtime, so long, in s, the last belief may take after the last state.
LAST_BELIEF = 10.0

#: So long, in s, it may take to find those who are there.
DISCOVERY = 1.0

#: So long, in s, may the nodes of a run before still be there.
LAST_ONES = 10.0


def watch(
    scenario: Scenario,
    options: argparse.Namespace,
    recorder: Recorder,
    executor: SingleThreadedExecutor,
    nodes: Sequence[NodeProcess],
    bag: BagRecorder | None,
    console: Console,
) -> None:
    """Return when the run is over, or its bag cannot be written any more.

    Raises:
        RunError: a node ended, or nothing happened for a long time.
    """
    steps = options.steps or scenario.steps
    start = last_progress = time.monotonic()
    found, begun, viewed = False, False, not options.view
    told, respawn = Idleness(), Respawn(options.respawn)
    namespace = recorder.get_namespace().rstrip("/")
    robot = f"{namespace}/robot_planner"

    def figures(node: str) -> dict[str, str]:
        return recorder.figures.get(f"{namespace}/{node}", {})

    def idle_for() -> float:
        return time.monotonic() - last_progress

    def over() -> bool:
        # These come on topics of their own, in any order. If somebody is missing, there are more.
        record, last = recorder.record, figures("simulator").get("step", "-1")
        simulated = steps <= record.steps == int(last) + 1
        if simulated and options.time != LOCKSTEP and idle_for() > LAST_BELIEF:
            return True
        counted = options.time != LOCKSTEP or steps - 1 in recorder.safety[robot]
        return simulated and record.steps in record.beliefs and counted

    with RunProgress(console, steps) as progress:
        while not over():
            record = recorder.record
            before, beliefs_before = len(record.states), len(record.beliefs)
            executor.spin_once(timeout_sec=0.1)
            _check_nodes(nodes, respawn, console)
            if bag is not None and bag.failure is not None:
                return
            # Nodes that were killed and started anew count twice for a while.
            _check_alone(recorder, options.external, 1 + respawn.ghosts)
            if not found and {n.name for n in nodes} <= set(recorder.get_node_names()):
                found = True
                seconds = time.monotonic() - start
                console.print(f"All {len(nodes)} nodes discovered after {seconds:.1f} s.")
            if not viewed and view_port.answers(options.view_port):
                viewed = True
                console.print(f"View: http://{VIEW_HOST}:{options.view_port}/")
            if record is not recorder.record:
                if record.states:
                    console.print("The run begins anew.")
                record = recorder.record
                progress.begin()
            if not begun and record.steps > 0:
                begun = True
                seconds = time.monotonic() - start
                console.print(f"First controls of all players after {seconds:.1f} s.")
            if len(record.states) != before or len(record.beliefs) != beliefs_before:
                last_progress = time.monotonic()
            idle = Idleness.of(figures("simulator"))
            idle.tell(told, console)
            told = idle
            if idle.reason:  # it is meant to wait
                last_progress = time.monotonic()
            if idle_for() > PATIENCE:
                words = "\n".join(f"--- {n.name}:\n{n.last_words(5)}" for n in nodes)
                raise RunError(f"no new state or belief for {PATIENCE:.0f} s; last words:\n{words}")
            progress.show(record, figures("inference").get("solve_ms"))
    record = recorder.record
    if record.steps not in record.beliefs:
        newest = max(record.beliefs, default=None)
        words = "there is no belief" if newest is None else f"the last belief is of step {newest}"
        console.print(f"The inference does not answer: {words}.")
    record.late_steps = int(figures("simulator").get("late_steps", "0"))
    if not options.no_safety:
        known = [step for step in recorder.safety[robot] if step < steps]
        counts = recorder.safety[robot][max(known)] if known else (0, 0)
        record.safety_braked, record.safety_limited = counts
    record.step_ms = list(recorder.solve_ms[f"{namespace}/inference"].values())


def _check_nodes(nodes: Sequence[NodeProcess], respawn: Respawn, console: Console) -> None:
    """Start nodes anew that have died, where that is allowed.

    Raises:
        RunError: it is not.
    """
    for node in nodes:
        if node.exit_code is None:
            continue
        if node.exit_code != BAD_INPUT and respawn.allows(node.name):
            console.print(f"The node {node.name} ended with {node.ending}: it is started anew.")
            node.restart()
            continue
        raise RunError(
            f"the node {node.name} ended with {node.ending}; its last words:\n{node.last_words()}",
            BAD_INPUT if node.exit_code == BAD_INPUT else FAILED,
        )


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
