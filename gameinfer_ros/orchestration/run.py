"""One run on ROS 2, from joining the ROS domain to leaving it."""

import argparse
import signal
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import rclpy
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rich.console import Console

from gameinfer_ros.bags.label import BagLabel
from gameinfer_ros.names.exit_codes import BAD_INPUT, FAILED
from gameinfer_ros.nodes.bag_recorder import BagRecorder
from gameinfer_ros.nodes.base.middleware import enclave, reachable_by
from gameinfer_ros.nodes.base.spin import init
from gameinfer_ros.nodes.base.unused_arguments import for_node
from gameinfer_ros.nodes.interface import NodeInterface
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.orchestration import options as run_options
from gameinfer_ros.orchestration import results as run_results
from gameinfer_ros.orchestration.node_arguments import check_run_arguments
from gameinfer_ros.orchestration.node_list import VIEWER, node_list
from gameinfer_ros.orchestration.node_process import NodeProcess, stop_all
from gameinfer_ros.orchestration.run_error import RunError
from gameinfer_ros.orchestration.watch import Watch, wait_until_alone
from gameinfer_ros.runs.progress import LOADING
from gameinfer_ros.scenario import Scenario, find
from gameinfer_ros.solver import GameSolver
from gameinfer_ros.system.forced_end import ForcedEnd
from gameinfer_ros.system.interruption import interrupts_deferred, one_interruption
from gameinfer_ros.system.only_run import only_run

#: Longest time that the middleware may take to return from a call, in s.
STUCK = 60.0

#: Timeouts of the end of a run, in s: from a signal to the end of what it interrupts; for stopping
#: all nodes; for closing a small bag; for saving the results; for leaving the ROS domain.
AFTER_SIGNAL, STOPPING, CLOSING, SAVING, LEAVING = 30.0, 40.0, 30.0, 300.0, 20.0

#: Closing a bag is at least this fast, in bytes per second.
SLOWEST = 5e6


class Run:
    """Sets up, plays, tidies up and presents a run; call the methods in this order, then `close`.

    What ends a run has timeouts. A process that hangs longer is ended by force; see `ForcedEnd`.

    Raises:
        ScenarioError: the scenario is invalid.
        RunError: an option is invalid, or options contradict each other.

    Attributes:
        nodes: the processes that have been started.
        bag: the recorder of the bag; None without one.
    """

    _recorder: Recorder
    _out: Path | None = None
    _is_over = False
    _unsaved: RunError | None = None

    def __init__(self, options: argparse.Namespace, console: Console) -> None:
        run_options.choose_port(options)
        self._scenario_file = find(options.scenario).resolve()
        self._scenario = Scenario.load(self._scenario_file)
        run_options.check_external(options, self._scenario)
        run_options.check_count(options, self._scenario)
        run_options.check_record(options)
        self._options, self._console = options, console
        self.nodes: list[NodeProcess] = []
        self.bag: BagRecorder | None = None
        # Every resource registers its clean-up where it is acquired.
        self._resources, self._kept = ExitStack(), ExitStack()
        self._end = ForcedEnd("the run", lambda: stop_all(self.nodes))

    @property
    def logs(self) -> Path | None:
        """Folder of the logs; None before it exists."""
        return self._out and (self._out / "logs").resolve()

    def set_up(self) -> None:
        """Join the domain, wait until no other run is active in it, and start all nodes.

        Raises:
            RosArgsError: an argument for ROS is invalid.
            AnotherRunError: the user has another run in this domain and namespace.
            RunError: another node publishes the same topics, or a node or file cannot be created.
        """
        lock = self._resources.enter_context(ExitStack())  # released after leaving the domain
        self._kept.callback(self._end.after_signals(AFTER_SIGNAL))
        context = self._join()
        joined = time.monotonic()
        self._interfaces = self._check_arguments()
        lock.enter_context(only_run(context.get_domain_id(), self._recorder.get_namespace()))
        self._out = self._kept.enter_context(run_results.folders(self._options))
        setting = reachable_by()
        if setting is not None:
            words = f"Other machines may reach the nodes of this run: {setting}"
            self._console.print(words, soft_wrap=True)
        for warning in self._scenario.late_goals(self._options.steps):
            print(f"{self._options.scenario}: warning: {warning}", file=sys.stderr)
        self._console.print(LOADING)
        with one_interruption():
            GameSolver(self._scenario.game, self._scenario.solver).warm_up()
            wait_until_alone(self._recorder, self._options.external, joined, self._console)
        with interrupts_deferred():  # a process that is being started must not be lost
            self._resources.callback(self._save)
            self._start_bag(context)
            self._start_nodes()

    def play(self) -> None:
        """Wait until the run is over, or its bag cannot be written; may raise `RunError`."""
        watch = Watch(self._options, self._recorder, self.nodes, self.bag, self._console)
        with (
            self._end.watch(STUCK, "receiving messages") as guard,
            one_interruption(),  # also while a message is received
        ):
            watch.until_over(guard)
        self._is_over = self.bag is None or self.bag.failure is None

    def tidy_up(self) -> None:
        """Stop all nodes, save the results, and leave the domain, also after a failure.

        It must not be interrupted.
        """
        self._end.within(LEAVING, "leaving the ROS domain")  # if there is nothing else
        self._resources.close()
        self._end.cancel()

    def present(self) -> None:
        """Print a summary. Raises `RunError` if the results could not be written."""
        if self._unsaved is not None:
            raise self._unsaved
        assert self._out is not None
        record = self._recorder.record
        run_results.present(record, self._options, self._out, self.bag, self._console)

    def close(self) -> None:
        """Release the folder of the results, after everything else."""
        self._kept.close()

    def _join(self) -> rclpy.Context:
        """Join the domain with the recorder of the run."""
        context = rclpy.Context()
        self._resources.callback(context.try_shutdown)
        init(
            ["--ros-args", *enclave("run"), *self._options.ros_args],
            context=context,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        scenario = Parameter("scenario", value=str(self._scenario_file))
        self._recorder = Recorder(context=context, parameter_overrides=[scenario])
        self._resources.callback(self._recorder.destroy_node)
        return context

    def _check_arguments(self) -> list[NodeInterface]:
        """Check the ROS arguments, and return the interfaces of the nodes that get them."""
        players, namespace = self._scenario.game.players.names, self._recorder.get_namespace()
        interfaces = [
            NodeInterface(module, name, namespace, players, parameters.get("player", ""))
            for name, module, parameters in self._node_list()
        ]
        for remark in check_run_arguments(self._options.ros_args, interfaces):
            self._console.print(remark, soft_wrap=True)
        return interfaces

    def _node_list(self) -> list[tuple[str, str, dict[str, Any]]]:
        return node_list(self._scenario, self._scenario_file, self._options)

    def _start_bag(self, context: rclpy.Context) -> None:
        options = self._options
        if options.record is None:
            return
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
            self.bag = BagRecorder(options.record, self._scenario_file, label, context=context)
        except OSError as error:
            words = f"--record: {options.record} cannot be created: {error}"
            raise RunError(words, BAD_INPUT) from None
        self._resources.callback(self._close_bag, self.bag)
        self.bag.start()

    def _start_nodes(self) -> None:
        assert self._out is not None
        self._end.log = self._out.resolve() / "logs" / "orchestrator.log"
        self._resources.callback(self._stop_nodes)
        for interface, node in zip(self._interfaces, self._node_list(), strict=True):
            name, module, parameters = node
            ros_args = [*enclave(name), *for_node(self._options.ros_args, interface)]
            with run_results.writing(self._out):
                self.nodes.append(NodeProcess(name, module, parameters, self._out, ros_args))

    def _stop_nodes(self) -> None:
        self._end.within(STOPPING, "stopping all nodes")
        running = [node for node in self.nodes if node.exit_code is None]
        # The page shows the last messages of the other nodes.
        stop_all([node for node in self.nodes if node.name != VIEWER])
        stop_all(self.nodes)
        for node in running:
            if node.exit_code in (None, FAILED, -signal.SIGKILL):
                words = f"the node {node.name} did not end well when it was stopped: {node.ending}"
                print(f"{words}; see {node.log.resolve()}", file=sys.stderr)

    def _close_bag(self, bag: BagRecorder) -> None:
        self._end.within(CLOSING + bag.size / SLOWEST, "closing the bag")
        bag.close()
        self._end.within(LEAVING, "leaving the ROS domain")
        bag.destroy_node()
        if bag.failure is not None:
            self._is_over = False
            print(f"--record: the bag cannot be written: {bag.failure}", file=sys.stderr)

    def _save(self) -> None:
        """Save the results of a run that is over, before anything of the middleware can hang."""
        if self._is_over and self._out is not None:
            self._end.within(SAVING, "saving the results")
            try:
                run_results.save(self._recorder.record, self._options, self._out)
            except RunError as error:
                self._unsaved = error
        self._end.within(LEAVING, "leaving the ROS domain")
