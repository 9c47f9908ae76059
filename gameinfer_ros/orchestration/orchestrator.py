"""Runs a scenario on ROS 2: starts all nodes, watches them, and stops them."""

from __future__ import annotations

import argparse
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rich.console import Console

from gameinfer_ros.bags.label import BagLabel
from gameinfer_ros.names.exit_codes import BAD_INPUT, DONE, FAILED, INTERRUPTED
from gameinfer_ros.nodes.bag_recorder import BagRecorder
from gameinfer_ros.nodes.base.middleware import enclave, reachable_by
from gameinfer_ros.nodes.base.spin import RosArgsError, init
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.orchestration import options as run_options
from gameinfer_ros.orchestration import results as run_results
from gameinfer_ros.orchestration.node_list import VIEWER, node_list
from gameinfer_ros.orchestration.node_process import NodeProcess, stop_all
from gameinfer_ros.orchestration.run_error import RunError
from gameinfer_ros.orchestration.watch import wait_until_alone, watch
from gameinfer_ros.runs.progress import LOADING
from gameinfer_ros.scenario import Scenario, ScenarioError, find
from gameinfer_ros.solver import IterativeLQ
from gameinfer_ros.system import closed_terminal
from gameinfer_ros.system.interruption import (
    ignore_interrupts,
    interrupts_deferred,
    one_interruption,
    raise_on_interrupt,
)
from gameinfer_ros.system.only_run import AnotherRunError, only_run


def run(options: argparse.Namespace) -> int:
    """Run a scenario as the options say; returns the exit code."""
    console = Console(highlight=False, markup=False)
    try:
        run_options.choose_port(options)
        scenario_file = find(options.scenario).resolve()
        scenario = Scenario.load(scenario_file)
        run_options.check_external(options, scenario)
    except (ScenarioError, run_options.OptionError) as error:
        print(error, file=sys.stderr)
        return BAD_INPUT

    # Also where a shell started us in the background, with SIGINT ignored.
    raise_on_interrupt()
    nodes: list[NodeProcess] = []
    out: Path | None = None
    bag: BagRecorder | None = None
    recorder: Recorder | None = None
    context = rclpy.Context()
    lock = ExitStack()
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
        joined = time.monotonic()
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(recorder)
        lock.enter_context(only_run(context.get_domain_id(), recorder.get_namespace()))
        out = run_results.make_folder(options)
        setting = reachable_by()
        if setting is not None:
            words = f"Other machines may reach the nodes of this run: {setting}"
            console.print(words, soft_wrap=True)
        console.print(LOADING)
        with one_interruption():
            IterativeLQ(scenario.game, scenario.solver).warm_up()
            wait_until_alone(recorder, options.external, joined, console)
        with interrupts_deferred():  # what is being started must not be lost
            if options.record is not None:
                bag = _start_bag(scenario_file, options, context)
            for name, module, parameters in node_list(scenario, scenario_file, options):
                ros_args = [*enclave(name), *options.ros_args]
                with run_results.writing(out):
                    nodes.append(NodeProcess(name, module, parameters, out, ros_args))
        with one_interruption():  # also in the midst of taking a message
            watch(scenario, options, recorder, executor, nodes, bag, console)
    except KeyboardInterrupt:
        console.print("Interrupted: stopping all nodes.")
        if out is not None:
            console.print(f"Logs: {(out / 'logs').resolve()}", soft_wrap=True)
        return INTERRUPTED
    except (AnotherRunError, RosArgsError) as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except RunError as failure:
        print(failure, file=sys.stderr)
        if nodes and out is not None:
            print(f"Logs: {(out / 'logs').resolve()}", file=sys.stderr)
        return failure.exit_code
    except OSError as error:
        return _failed(error)
    finally:
        while True:
            try:
                ignore_interrupts()
                break
            except KeyboardInterrupt:  # one more, in this very moment
                pass
        # The page sees what the others still say.
        stop_all([node for node in nodes if node.name != VIEWER])
        stop_all(nodes)
        if bag is not None:
            bag.close()
            bag.destroy_node()
            if bag.failure is not None:
                print(f"--record: the bag cannot be written: {bag.failure}", file=sys.stderr)
        if recorder is not None:
            recorder.destroy_node()
        context.try_shutdown()
        lock.close()
    if bag is not None and bag.failure is not None:
        return FAILED
    try:
        run_results.present(recorder.record, options, out, bag, console)
    except KeyboardInterrupt:
        console.print("Interrupted: the results are there, but no animation.")
        return INTERRUPTED
    except RunError as failure:
        print(failure, file=sys.stderr)
        return failure.exit_code
    except OSError as error:
        return _failed(error)
    return DONE


def _failed(error: OSError) -> int:
    if closed_terminal.leave():  # it may be noticed by writing to it, before the signal comes
        return INTERRUPTED
    print(f"the run failed: {error}", file=sys.stderr)
    return FAILED


def _start_bag(
    scenario_file: Path, options: argparse.Namespace, context: rclpy.Context
) -> BagRecorder:
    """Start to record the run.

    Raises:
        RunError: the bag cannot be made.
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
        raise RunError(f"--record: {options.record} cannot be made: {error}", BAD_INPUT) from None
    bag.start()
    return bag
