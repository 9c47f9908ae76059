"""Replays the states of a bag to an inference node, and compares the beliefs."""

import argparse
import json
import sys
import time
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float64MultiArray

from gameinfer_ros.bags.run_bag import BagError, RunBag
from gameinfer_ros.names.choices import LOCKSTEP
from gameinfer_ros.names.exit_codes import BAD_INPUT, DONE, FAILED, INTERRUPTED
from gameinfer_ros.nodes.base.middleware import enclave
from gameinfer_ros.nodes.base.parameter_node import ParameterError
from gameinfer_ros.nodes.base.ros_names import RosArgsError
from gameinfer_ros.nodes.base.spin import init
from gameinfer_ros.nodes.base.unused_arguments import for_node
from gameinfer_ros.nodes.inference import Inference
from gameinfer_ros.nodes.interface import NodeInterface
from gameinfer_ros.nodes.replayer import Replayer
from gameinfer_ros.runs.progress import LOADING
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.system.interruption import one_interruption
from gameinfer_ros.system.only_run import AnotherRunError, only_run
from gameinfer_ros.system.output import make_console, print_json
from msg_adapters import MessageError, belief

#: Name of the node.
INFERENCE = "inference"

#: Timeout for the belief of a step, in s.
PATIENCE = 60.0


class ReplayError(RuntimeError):
    """The replay does not progress, or another node publishes the same topics."""


def run(options: argparse.Namespace) -> int:
    """Replay a run, print which beliefs are identical, and return the exit code."""
    console = make_console(options.json)
    try:
        with one_interruption():
            bag = RunBag(options.bag)
            bag.record()  # checks that all states are there and match the scenario
            if bag.runs > 1:
                console.print(f"The bag contains {bag.runs} runs; the last one is replayed.")
            console.print(LOADING)
            found = replay(bag)
    except KeyboardInterrupt:
        console.print("Interrupted.")
        return INTERRUPTED
    except (BagError, RosArgsError, ParameterError, AnotherRunError) as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except ReplayError as failure:
        print(failure, file=sys.stderr)
        return FAILED
    console.print(f"Steps with a belief in the bag: {found['steps']}")
    console.print(f"Of these, identical to the last bit: {found['identical_steps']}")
    if not found["identical"]:
        console.print(f"The first difference is at step {found['first_difference']}.")
        if bag.label.time != LOCKSTEP:
            console.print("In realtime, updates end at deadlines, so beliefs may differ.")
    if options.json:
        print_json(found)
    return DONE if found["identical"] else FAILED


def replay(bag: RunBag) -> dict[str, Any]:
    """Publish the states of a bag to an inference node one by one, and compare the beliefs.

    Returns:
        What `gameinfer replay --json` prints.

    Raises:
        BagError: the bag contains no belief, or a belief without its state.
        RosArgsError: an argument of the run after --ros-args is no longer valid.
        ParameterError: a parameter of the run is no longer valid.
        AnotherRunError: a run is active in the same domain and namespace.
        ReplayError: no belief arrives, or another node publishes the same topics.
    """
    states, beliefs = bag.serialized("joint_state"), bag.serialized("belief")
    start = bag.clock.start
    if start is None or not beliefs or not beliefs.keys() <= states.keys():
        raise BagError(
            f"{bag.folder}: contains no belief to compare with, or lacks the state of one"
        )
    context = rclpy.Context()
    try:
        # Ctrl-C raises an exception, and does not shut down in the middle of a callback.
        init(
            ["--ros-args", *enclave("replay"), *bag.label.ros_args],
            context=context,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        replayer = Replayer(start, context=context)
        with only_run(context.get_domain_id(), replayer.get_namespace()):
            executor = SingleThreadedExecutor(context=context)
            executor.add_node(replayer)
            executor.add_node(_inference(bag, context, replayer.get_namespace()))
            replayed = {}
            for step in sorted(states):
                if step in beliefs:
                    replayed[step] = _belief_after(step, states[step], bag, replayer, executor)
                elif step < max(beliefs):
                    replayer.publish(states[step])  # the run did not handle it either
    finally:
        context.try_shutdown()
    different = [
        step
        for step, data in beliefs.items()
        if not _same(replayed[step], deserialize_message(data, Float64MultiArray))
    ]
    return {
        "identical": not different,
        "steps": len(beliefs),
        "identical_steps": len(beliefs) - len(different),
        "first_difference": different[0] if different else None,
    }


def _inference(bag: RunBag, context: rclpy.Context, namespace: str) -> Inference:
    """Create the node with the parameters of the run, but in lockstep."""
    parameters = {
        "scenario": str(bag.scenario_file.resolve()),
        "time": LOCKSTEP,
        "seed": RunSeeds.of_run(bag.label.seed).inference,
        "particles": bag.label.particles,
    }
    own = [
        word
        for name, value in parameters.items()
        for word in ("-p", f"{name}:={json.dumps(value, ensure_ascii=False)}")
    ]  # JSON is YAML
    # The arguments of the user come last, as in a run.
    interface = NodeInterface(INFERENCE, INFERENCE, namespace, bag.scenario.game.players.names)
    ros_args = for_node(bag.label.ros_args, interface)
    return Inference(context=context, cli_args=["--ros-args", *own, *ros_args])


def _belief_after(
    step: int, state: bytes, bag: RunBag, replayer: Replayer, executor: SingleThreadedExecutor
) -> Float64MultiArray:
    """Publish the state of a step, and wait for its belief."""
    replayer.publish(state)
    deadline = time.monotonic() + PATIENCE
    while not replayer.beliefs or not _is_of(step, replayer.beliefs[-1], bag):
        if not replayer.alone:
            raise ReplayError("another node publishes joint_state or belief in this ROS domain")
        if time.monotonic() > deadline:
            raise ReplayError(f"no belief for step {step} arrived within {PATIENCE:.0f} s")
        executor.spin_once(timeout_sec=0.1)
    return replayer.beliefs[-1]


def _is_of(step: int, message: Float64MultiArray, bag: RunBag) -> bool:
    try:
        found = belief.decode(message, len(bag.scenario.game.players))
    except MessageError:
        return False
    return found.stamp == bag.clock.stamp(step)


def _same(one: Float64MultiArray, other: Float64MultiArray) -> bool:
    """Whether two messages are identical to the last bit; a NaN equals itself."""
    return one.layout == other.layout and one.data.tobytes() == other.data.tobytes()
