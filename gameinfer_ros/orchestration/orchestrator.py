"""Runs a scenario on ROS 2: starts all nodes, watches them, and stops them."""

import argparse
import sys

from rich.console import Console

from gameinfer_ros.names.exit_codes import BAD_INPUT, DONE, FAILED, INTERRUPTED
from gameinfer_ros.nodes.base.ros_names import RosArgsError
from gameinfer_ros.orchestration.run import Run
from gameinfer_ros.orchestration.run_error import RunError
from gameinfer_ros.scenario import ScenarioError
from gameinfer_ros.system import closed_terminal
from gameinfer_ros.system.interruption import ignore_interrupts, raise_on_interrupt
from gameinfer_ros.system.only_run import AnotherRunError
from gameinfer_ros.system.output import make_console


def run(options: argparse.Namespace) -> int:
    """Run a scenario with the options of `gameinfer run`; and return the exit code."""
    console = make_console(options.json)
    try:
        this_run = Run(options, console)
    except (ScenarioError, RunError) as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    try:
        return _play(this_run, console)
    finally:
        this_run.close()


def _play(this_run: Run, console: Console) -> int:
    # A shell may have started this process in the background, with SIGINT ignored.
    raise_on_interrupt()
    try:
        this_run.set_up()
        this_run.play()
    except KeyboardInterrupt:
        console.print("Interrupted: stopping all nodes.")
        if this_run.nodes:
            console.print(f"Logs: {this_run.logs}", soft_wrap=True)
        return INTERRUPTED
    except (AnotherRunError, RosArgsError) as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except RunError as failure:
        print(failure, file=sys.stderr)
        if this_run.nodes:
            print(f"Logs: {this_run.logs}", file=sys.stderr)
        return failure.exit_code
    except OSError as error:
        return _failed(error)
    finally:
        # A call or `with` would leave a moment in which another interrupt ends the clean-up.
        while True:
            try:
                ignore_interrupts()
                break
            except KeyboardInterrupt:
                pass
        this_run.tidy_up()
    if this_run.bag is not None and this_run.bag.failure is not None:
        return FAILED
    try:
        this_run.present()
    except KeyboardInterrupt:
        console.print("Interrupted: the results were written, but not the animation.")
        return INTERRUPTED
    except RunError as failure:
        print(failure, file=sys.stderr)
        return failure.exit_code
    except OSError as error:
        return _failed(error)
    return DONE


def _failed(error: OSError) -> int:
    if closed_terminal.leave():  # writing may fail before the signal arrives
        return INTERRUPTED
    print(f"the run failed: {error}", file=sys.stderr)
    return FAILED
