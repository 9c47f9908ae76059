"""Runs a scenario on ROS 2: starts all nodes, watches them, and stops them."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rich.console import Console
from rich.table import Table

from gameinfer_ros import animation, cli, picture, results, shared_memory, view_port
from gameinfer_ros.bag_label import BagLabel
from gameinfer_ros.choices import LOCKSTEP, MAP
from gameinfer_ros.exit_codes import BAD_INPUT, DONE, FAILED, INTERRUPTED
from gameinfer_ros.idleness import Idleness
from gameinfer_ros.interruption import one_interruption
from gameinfer_ros.json_text import json_text
from gameinfer_ros.node_process import NodeProcess, stop_all
from gameinfer_ros.nodes.bag_recorder import BagRecorder
from gameinfer_ros.nodes.middleware import enclave
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.spin import RosArgsError, init
from gameinfer_ros.only_run import AnotherRunError, only_run
from gameinfer_ros.progress import LOADING, RunProgress
from gameinfer_ros.respawn import Respawn
from gameinfer_ros.run_record import RunRecord
from gameinfer_ros.run_seeds import RunSeeds
from gameinfer_ros.scenario import Scenario, ScenarioError, find
from gameinfer_ros.solver import IterativeLQ

#: Node that shows the run on a web page.
VIEWER = "viewer"

#: A run that makes no progress for so long, in s, has failed.
PATIENCE = 60.0


class NodeError(RuntimeError):
    """A node ended, or the run came to a standstill; the message says which, and its last words.

    Attributes:
        exit_code: what the orchestrator exits with.
    """

    def __init__(self, message: str, exit_code: int = FAILED) -> None:
        super().__init__(message)
        self.exit_code = exit_code


class OptionError(ValueError):
    """Options do not go together or cannot be used; the message says which, and why."""


def run(options: argparse.Namespace) -> int:
    """Run a scenario as the options say; returns the exit code."""
    console = Console(highlight=False, markup=False)
    try:
        _choose_port(options)
        scenario_file = find(options.scenario).resolve()
        scenario = Scenario.load(scenario_file)
        _check_external(options, scenario)
        out = _make_folder(options)
    except (ScenarioError, OptionError, OSError) as error:
        print(error, file=sys.stderr)
        return BAD_INPUT

    # Also where a shell started us in the background, with SIGINT ignored.
    _on_interrupt(_interrupt)
    nodes: list[NodeProcess] = []
    bag: BagRecorder | None = None
    recorder: Recorder | None = None
    context = rclpy.Context()
    lock = ExitStack()
    shared_memory.remove_abandoned()  # an orchestrator that was killed could not
    try:
        init(
            ["--ros-args", *enclave("run"), *options.ros_args],
            context=context,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        recorder = Recorder(
            context=context,
            parameter_overrides=[Parameter("scenario", value=str(scenario_file))],
        )
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(recorder)
        lock.enter_context(only_run(context.get_domain_id(), recorder.get_namespace()))
        console.print(LOADING)
        with one_interruption():
            IterativeLQ(scenario.game, scenario.solver).warm_up()
        with _interrupts_deferred():  # what is being started must not be lost
            if options.record is not None:
                bag = _start_bag(scenario_file, options, context)
            for name, module, parameters in _plan(scenario, scenario_file, options):
                ros_args = [*enclave(name), *options.ros_args]
                nodes.append(NodeProcess(name, module, parameters, out, ros_args))
        with one_interruption():  # also in the midst of taking a message
            _watch(scenario, options, recorder, executor, nodes, bag, console)
    except KeyboardInterrupt:
        console.print("Interrupted: stopping all nodes.")
        console.print(f"Logs: {(out / 'logs').resolve()}", soft_wrap=True)
        return INTERRUPTED
    except (AnotherRunError, RosArgsError) as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except NodeError as failure:
        print(failure, file=sys.stderr)
        return failure.exit_code
    except OSError as error:
        return _unwritable(out, error)
    finally:
        _on_interrupt(signal.SIG_IGN)
        # The page sees what the others still say.
        stop_all([node for node in nodes if node.name != VIEWER])
        stop_all(nodes)
        if bag is not None:
            bag.close()
            bag.destroy_node()
        if recorder is not None:
            recorder.destroy_node()  # or it would hold what killed nodes have left
        context.try_shutdown()
        lock.close()
        if any(node.was_killed for node in nodes):
            shared_memory.let_go()
        shared_memory.remove_abandoned()
    try:
        _check_bag(bag)
        _finish(recorder.record, options, out, bag, console)
    except KeyboardInterrupt:
        console.print("Interrupted: the results are there, but no animation.")
        return INTERRUPTED
    except NodeError as failure:
        print(failure, file=sys.stderr)
        return failure.exit_code
    except OSError as error:
        return _unwritable(out, error)
    return DONE


def _unwritable(out: Path, error: OSError) -> int:
    print(f"--out: {out} cannot be written: {error}", file=sys.stderr)
    return FAILED


def _check_external(options: argparse.Namespace, scenario: Scenario) -> None:
    options.external = options.external or []
    players = scenario.game.players.names
    for name in options.external:
        if name not in players:
            raise OptionError(
                f"--external: '{name}' is not allowed: the players are {', '.join(players)}"
            )
    if options.external and options.time == LOCKSTEP:
        raise OptionError("--external: needs --time realtime, because nobody else waits for steps")


def _plan(
    scenario: Scenario, scenario_file: Path, options: argparse.Namespace
) -> list[tuple[str, str, dict[str, Any]]]:
    """Name, module and parameters of each node."""
    seeds = RunSeeds.of_run(options.seed)
    common = {"scenario": str(scenario_file), "time": options.time}
    external = options.external
    humans = [name for name in scenario.game.players.names[1:] if name not in external]
    nodes: list[tuple[str, str, dict[str, Any]]] = [
        (
            "simulator",
            "simulator",
            # Every player, the inference, our recorder, that of a bag, and the viewer.
            {
                **common,
                "steps": options.steps or 0,
                "subscribers": len(humans) + 3 + (options.record is not None) + options.view,
                "external": ",".join(external),
            },
        ),
        (
            "inference",
            "inference",
            {**common, "seed": seeds.inference, "particles": options.particles or 0},
        ),
        (
            "robot_planner",
            "robot_planner",
            {
                **common,
                "planner": options.planner,
                "seed": seeds.baseline,
                "safety": not options.no_safety,
            },
        ),
    ]
    for human in humans:
        parameters = {**common, "player": human, "seed": seeds.humans}
        nodes.append((f"{human}_agent", "human_agent", parameters))
    if options.view:
        parameters = {
            **common,
            "steps": options.steps or 0,
            "port": options.view_port,
            "control": options.control,
        }
        nodes.append((VIEWER, "viewer", parameters))
    return nodes


def _watch(
    scenario: Scenario,
    options: argparse.Namespace,
    recorder: Recorder,
    executor: SingleThreadedExecutor,
    nodes: Sequence[NodeProcess],
    bag: BagRecorder | None,
    console: Console,
) -> None:
    """Return when the run is over.

    Raises:
        NodeError: a node ended, the bag cannot be written, or nothing happened for a long time.
    """
    steps = options.steps or scenario.steps
    start = last_progress = time.monotonic()
    found, begun, viewed = False, False, not options.view
    told, respawn = Idleness(), Respawn(options.respawn)
    namespace = recorder.get_namespace().rstrip("/")

    def figures(node: str) -> dict[str, str]:
        return recorder.figures.get(f"{namespace}/{node}", {})

    def acted() -> dict[int, tuple[int, int]]:
        every = recorder.safety[f"{namespace}/robot_planner"]
        return {step: counts for step, counts in every.items() if step < steps}

    def over() -> bool:
        # These come on topics of their own, in any order. If somebody is missing, there are more.
        record, last = recorder.record, figures("simulator").get("step", "-1")
        simulated = steps <= record.steps == int(last) + 1
        counted = options.time != LOCKSTEP or steps - 1 in acted()
        return simulated and record.steps in record.beliefs and counted

    with RunProgress(console, steps) as progress:
        while not over():
            record = recorder.record
            before, beliefs_before = len(record.states), len(record.beliefs)
            executor.spin_once(timeout_sec=0.1)
            _check(nodes, respawn, console)
            _check_bag(bag)
            _check_alone(recorder, options.external, respawn.ghosts)
            if not found and {n.name for n in nodes} <= set(recorder.get_node_names()):
                found = True
                seconds = time.monotonic() - start
                console.print(f"All {len(nodes)} nodes discovered after {seconds:.1f} s.")
            if not viewed and view_port.answers(options.view_port):
                viewed = True
                console.print(f"View: http://{view_port.HOST}:{options.view_port}/")
            if record is not recorder.record:
                record = recorder.record
                console.print("The run begins anew.")
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
            if time.monotonic() - last_progress > PATIENCE:
                words = "\n".join(f"--- {n.name}:\n{n.last_words(5)}" for n in nodes)
                raise NodeError(
                    f"no new state or belief for {PATIENCE:.0f} s; last words:\n{words}"
                )
            progress.show(record, figures("inference").get("solve_ms"))
    record = recorder.record
    record.late_steps = int(figures("simulator").get("late_steps", "0"))
    if not options.no_safety:
        counts = max(acted().items(), default=(0, (0, 0)))[1]
        record.safety_braked, record.safety_limited = counts
    planner = "inference" if options.planner == MAP else "robot_planner"
    record.step_ms = [float(ms) for ms in recorder.solve_ms[f"{namespace}/{planner}"].values()]


def _check(nodes: Sequence[NodeProcess], respawn: Respawn, console: Console) -> None:
    """Start nodes anew that have died, where that is allowed.

    Raises:
        NodeError: it is not.
    """
    for node in nodes:
        if node.exit_code is None:
            continue
        if node.exit_code != BAD_INPUT and respawn.allows(node.name):
            console.print(f"The node {node.name} ended with {node.ending}: it is started anew.")
            node.restart()
            continue
        raise NodeError(
            f"the node {node.name} ended with {node.ending}; its last words:\n{node.last_words()}",
            BAD_INPUT if node.exit_code == BAD_INPUT else FAILED,
        )


def _start_bag(
    scenario_file: Path, options: argparse.Namespace, context: rclpy.Context
) -> BagRecorder:
    """Start to record the run.

    Raises:
        NodeError: the bag cannot be made.
    """
    label = BagLabel(
        Path(options.scenario).stem,
        options.planner,
        options.time,
        options.seed,
        options.particles or 0,
        external=options.external,
        ros_args=options.ros_args,
    )
    try:
        bag = BagRecorder(options.record, scenario_file, label, context=context)
    except OSError as error:
        raise NodeError(f"--record: {options.record} cannot be made: {error}", BAD_INPUT) from None
    bag.start()
    return bag


def _check_bag(bag: BagRecorder | None) -> None:
    if bag is not None and bag.failure is not None:
        raise NodeError(f"--record: the bag cannot be written: {bag.failure}")


def _check_alone(recorder: Recorder, external: Sequence[str], ghosts: int) -> None:
    """Check that nobody else, perhaps on another machine, plays in this run.

    Some publishers may be `ghosts`, of nodes that were killed and started anew.
    """
    of_players = [
        f"{name}/odom" if name in external else f"{name}/control" for name in recorder.players.names
    ]
    for topic in ("joint_state", *of_players):
        if recorder.count_publishers(topic) > 1 + ghosts:
            raise NodeError(
                f"somebody else publishes {topic}, so this run is not what it should be"
            )


def _finish(
    record: RunRecord,
    options: argparse.Namespace,
    out: Path,
    bag: BagRecorder | None,
    console: Console,
) -> None:
    """Write the results and show them.

    Raises:
        NodeError: the animation cannot be written.
    """
    record.save(out)
    title = f"{Path(options.scenario).stem}, planner {options.planner}, seed {options.seed}"
    picture.draw(record, out / "picture.png", title)
    summary = record.summary()
    console.print(title)
    table = Table()
    table.add_column("player")
    table.add_column("cost", justify="right")
    for name, cost in zip(record.game.players.names, summary["cost"], strict=True):
        table.add_row(name, f"{cost:.1f}")
    console.print(table)
    if summary["smallest_distance"] is not None:
        console.print(f"Smallest distance: {summary['smallest_distance']:.2f} m")
    console.print(f"Steps: {summary['steps']}, of them late: {summary['late_steps']}")
    if summary["missing_steps"]:
        console.print(f"Steps whose state is missing: {summary['missing_steps']}")
    if record.safety_braked is not None:
        console.print(
            f"Steps in which the safety layer braked: {record.safety_braked}, "
            f"limited: {record.safety_limited}"
        )
    console.print(f"Results: {out.resolve()}", soft_wrap=True)
    if bag is not None:
        console.print(f"Bag: {options.record.resolve()}, {bag.messages} messages", soft_wrap=True)
    if options.animation is not None:
        _animate(record, options.animation, title, console)
    if options.json:
        print(json_text(summary), flush=True)


def _choose_port(options: argparse.Namespace) -> None:
    """Settle where the run can be viewed.

    Raises:
        OptionError: the port cannot be used, or an option lacks --view.
    """
    if options.view:
        try:
            options.view_port = view_port.choose(options.view_port)
        except ValueError as error:
            raise OptionError(f"--view-port: {error}") from None
    elif options.view_port is not None or options.control:
        option = "--control" if options.control else "--view-port"
        raise OptionError(f"{option} is not allowed without --view: it is about the page")


def _animate(record: RunRecord, path: Path, title: str, console: Console) -> None:
    """Draw the run as an animation, which can be interrupted.

    Raises:
        NodeError: the file cannot be written.
    """
    _on_interrupt(_interrupt)
    try:
        animation.draw(record, path, title, console)
    except OSError as error:
        raise NodeError(f"--animation: {path} cannot be written: {error}") from None
    finally:
        _on_interrupt(signal.SIG_IGN)
    console.print(f"Animation: {path.resolve()}", soft_wrap=True)


def _make_folder(options: argparse.Namespace) -> Path:
    scenario = Path(options.scenario).stem
    out = results.make_folder(options.out, f"{scenario}-{options.planner}-{options.seed}")
    for folder in (out / "logs", out / "parameters"):
        folder.mkdir(parents=True, exist_ok=True)
    return out


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _on_interrupt(handler: Any) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handler)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN or handler is signal.SIG_IGN:
        signal.signal(signal.SIGHUP, handler)  # the terminal is closed, and this is no nohup


@contextmanager
def _interrupts_deferred() -> Iterator[None]:
    """Let an interrupt wait until the end of the block."""
    received: list[int] = []
    _on_interrupt(lambda number, _: received.append(number))
    try:
        yield
    finally:
        _on_interrupt(_interrupt)
    if received:
        raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(cli.main(["run", *sys.argv[1:]]))
