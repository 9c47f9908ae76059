"""Plays the states of a bag to a live inference node, and compares its beliefs to the recorded."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions
from rich.console import Console
from std_msgs.msg import Float64MultiArray

from gameinfer_ros.bags.run_bag import BagError, RunBag
from gameinfer_ros.names.choices import LOCKSTEP
from gameinfer_ros.names.exit_codes import BAD_INPUT, DONE, FAILED, INTERRUPTED
from gameinfer_ros.names.text import json_text
from gameinfer_ros.nodes.base.middleware import enclave
from gameinfer_ros.nodes.base.parameter_node import ParameterError
from gameinfer_ros.nodes.base.spin import RosArgsError, init
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.replayer import Replayer
from gameinfer_ros.orchestration.node_process import write_parameters
from gameinfer_ros.runs.progress import LOADING
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.system.interruption import one_interruption
from gameinfer_ros.system.only_run import AnotherRunError, only_run
from msg_adapters import MessageError, belief

#: The belief of a step may take so long, in s.
PATIENCE = 60.0


class ReplayError(RuntimeError):
    """The replay came to a standstill, or somebody else takes part in it."""


def run(options: argparse.Namespace) -> int:
    """Replay a run and print what agrees; returns the exit code."""
    console = Console(highlight=False, markup=False)
    try:
        with one_interruption():
            bag = RunBag(options.bag)
            bag.record()  # all states are there, and of the scenario
            if bag.runs > 1:
                console.print(f"The bag holds {bag.runs} runs: the last is replayed.")
            console.print(LOADING)
            found = replay(bag)
    except KeyboardInterrupt:
        console.print("Interrupted.")
        return INTERRUPTED
    except (BagError, RosArgsError, ParameterError, ParameterException, AnotherRunError) as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except ReplayError as failure:
        print(failure, file=sys.stderr)
        return FAILED
    console.print(f"Steps with a belief in the bag: {found['steps']}")
    console.print(f"Of them with the same belief, to the last bit: {found['identical_steps']}")
    if not found["identical"]:
        console.print(f"The first that differs is step {found['first_difference']}.")
        if bag.label.time != LOCKSTEP:
            console.print("In realtime, updates end at deadlines: another belief is no wonder.")
    if options.json:
        print(json_text(found), flush=True)
    return DONE if found["identical"] else FAILED


def replay(bag: RunBag) -> dict[str, Any]:
    """Feed an inference node with the states of a bag, one after the other.

    Returns:
        `identical`; `steps`, those with a belief in the bag; `identical_steps`, those with the
        same belief now; `first_difference`, the first step of the others, None if there is none.

    Raises:
        BagError: the bag has no belief, or one without the state that it follows from.
        RosArgsError: what the run got behind --ros-args cannot be used any more.
        ParameterError: likewise a parameter.
        AnotherRunError: a run is in the same domain and namespace.
        ReplayError: no belief arrives, or somebody else publishes.
    """
    states, beliefs, start = (
        bag.serialized("joint_state"),
        bag.serialized("belief"),
        bag.clock.start,
    )
    if start is None or not beliefs or not beliefs.keys() <= states.keys():
        raise BagError(f"{bag.folder}: has no belief to compare to, or not the states before it")
    context = rclpy.Context()
    try:
        # A Ctrl-C is an exception here, and no shutdown in the midst of a callback.
        init(
            ["--ros-args", *enclave("replay"), *bag.label.ros_args],
            context=context,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        replayer = Replayer(start, context=context)
        with only_run(context.get_domain_id(), replayer.get_namespace()):
            executor = SingleThreadedExecutor(context=context)
            executor.add_node(replayer)
            executor.add_node(_inference(bag, context))
            heard = {}
            for step in sorted(states):
                if step in beliefs:
                    heard[step] = _belief_after(step, states[step], bag, replayer, executor)
                elif step < max(beliefs):
                    replayer.publish(states[step])  # the run did not make anything of it either
    finally:
        context.try_shutdown()
    different = [
        step
        for step, data in beliefs.items()
        if not _same(heard[step], deserialize_message(data, Float64MultiArray))
    ]
    return {
        "identical": not different,
        "steps": len(beliefs),
        "identical_steps": len(beliefs) - len(different),
        "first_difference": different[0] if different else None,
    }


def _inference(bag: RunBag, context: rclpy.Context) -> Inference:
    """The node as the run had it, but in lockstep."""
    parameters = {
        "scenario": str(bag.scenario_file.resolve()),
        "time": LOCKSTEP,
        "seed": RunSeeds.of_run(bag.label.seed).inference,
        "particles": bag.label.particles,
    }
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "inference.yaml"
        write_parameters(file, parameters)
        # As a process of a run gets them: what the user said comes last.
        arguments = ["--ros-args", "--params-file", str(file), *bag.label.ros_args]
        return Inference(context=context, cli_args=arguments)


def _belief_after(
    step: int, state: bytes, bag: RunBag, replayer: Replayer, executor: SingleThreadedExecutor
) -> Float64MultiArray:
    """The belief that the state of a step leads to."""
    replayer.publish(state)
    deadline = time.monotonic() + PATIENCE
    while not replayer.beliefs or not _is_of(step, replayer.beliefs[-1], bag):
        if not replayer.alone:
            raise ReplayError("somebody else publishes joint_state or belief in this ROS domain")
        if time.monotonic() > deadline:
            raise ReplayError(f"no belief of step {step} arrived for {PATIENCE:.0f} s")
        executor.spin_once(timeout_sec=0.1)
    return replayer.beliefs[-1]


def _is_of(step: int, message: Float64MultiArray, bag: RunBag) -> bool:
    """Whether a belief is that of a step."""
    try:
        found = belief.decode(message, len(bag.scenario.game.players))
    except MessageError:
        return False
    return found.stamp == bag.clock.stamp(step)


def _same(one: Float64MultiArray, other: Float64MultiArray) -> bool:
    """Whether two messages agree to the last bit; a NaN does not differ from itself."""
    return one.layout == other.layout and one.data.tobytes() == other.data.tobytes()
