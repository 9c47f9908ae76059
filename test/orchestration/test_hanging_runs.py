"""Runs and nodes that hang end all the same, and say where they hang."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from run_command import Command
from small_scenario import ScenarioFile

from gameinfer_ros.runs.folder import RUN, results_folder

#: Hangs as two locks of a library do, which signals do not interrupt.
HANG = """
import ctypes, sys

def hang(*args, library=ctypes.CDLL):
    print("locks twice", flush=True)
    mutex = ctypes.create_string_buffer(64)
    for _ in range(2):
        library(None).pthread_mutex_lock(mutex)
"""

#: `gameinfer run`, in which a call of the middleware never returns. It may hold Python's lock.
HANGING_RUN = (
    HANG
    + """
from gameinfer_ros.orchestration import run, watch
from gameinfer_ros.nodes.recorder import Recorder

def hang_here(*args):
    hang(library=ctypes.PyDLL if {lock} else ctypes.CDLL)

run.LEAVING = run.AFTER_SIGNAL = run.STUCK = run.CLOSING = 2.0
{place} = hang_here
from gameinfer_ros.commands import gameinfer
sys.exit(gameinfer.command(sys.argv[1:]))
"""
)

#: A node in which a callback never returns after its first state, and SIGINT does not help.
HANGING_NODE = (
    HANG
    + """
from gameinfer_ros.nodes.base import spin
from gameinfer_ros.nodes.{name} import {kind}

spin.END = 2.0
{kind}.{method} = hang
sys.exit(spin.spin({kind}))
"""
)


def write(folder: Path, name: str, code: str) -> Path:
    file = folder / f"{name}.py"
    file.write_text(code)
    return file


@pytest.mark.parametrize("lock", [False, True])
def test_results_are_saved_before_the_middleware_can_hang(
    lock: bool, start: Callable[..., Command], scenario_file: ScenarioFile, tmp_path: Path
) -> None:
    code = HANGING_RUN.format(place="Recorder.destroy_node", lock=lock)
    out = tmp_path / "out"
    command = start(
        *("--scenario", scenario_file("u", steps=5), "--time", "lockstep", "--out", out),
        first=code,
    )
    assert command.exit_code() == 1, command.messages
    assert (out / "run.json").exists(), command.messages
    assert (out / "picture.png").exists()
    assert "in hang" in (command.stderr if lock else (out / "logs/orchestrator.log").read_text())
    if not lock:
        words = "the run hangs and is ended by force: leaving the ROS domain has not ended within"
        assert words in command.stderr
    assert command.leftovers() == {}
    with results_folder(out, RUN, overwrite=True):
        pass


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("run.BagRecorder.close", "closing the bag has not ended within 2"),
        ("watch._crowded", "receiving messages has not ended within 2"),
    ],
)
def test_a_run_that_hangs_ends_with_its_nodes(
    place: str, words: str, endless: Callable[..., Command], tmp_path: Path
) -> None:
    later = f"""
real, count = {place}, 0
def hang_here(*args):
    global count
    count += 1
    return real(*args) if "crowded" in "{place}" and count < 50 else hang()
"""
    code = HANGING_RUN.format(place=place, lock=False)
    code = code.replace("\nrun.LEAVING", later + "\nrun.LEAVING")
    out = tmp_path / "out"
    command = endless(
        *("--out", out, "--record", tmp_path / "bag"),
        first=code,
    )
    if "crowded" not in place:
        command.until_it_moves()
        command.process.send_signal(signal.SIGINT)
    else:
        command.until(lambda: command.nodes())
    assert command.exit_code() == 1, command.messages
    assert words in command.stderr
    assert "in hang" in (out / "logs/orchestrator.log").read_text()
    assert command.leftovers() == {}


def test_a_signal_ends_a_run_whose_main_thread_hangs(
    endless: Callable[..., Command], tmp_path: Path
) -> None:
    code = HANGING_RUN.format(place="run.Watch.until_over", lock=False)
    code = code.replace("run.STUCK = ", "run.SAVING = ")
    command = endless(first=code)
    command.until(lambda: "locks twice" in command.messages)
    command.process.send_signal(signal.SIGTERM)
    assert command.exit_code() == 1, command.messages
    assert "what SIGTERM interrupted has not ended within 2 s" in command.stderr
    assert command.leftovers() == {}


def test_a_node_that_hangs_says_where_and_ends(
    endless: Callable[..., Command], tmp_path: Path
) -> None:
    replaced = {
        "human_agent": HANGING_NODE.format(
            name="human_agent", kind="HumanAgent", method="on_state"
        ),
        "inference": HANGING_NODE.format(name="inference", kind="Inference", method="close"),
    }
    for name, code in replaced.items():
        write(tmp_path, f"hanging_{name}", code)
    code = """
from gameinfer_ros.orchestration import node_process
popen = node_process.subprocess.Popen
def replaced(command, **options):
    module = command[2].rpartition(".")[2]
    if module in ("human_agent", "inference"):
        command[2] = f"hanging_{module}"
        options["env"].pop("PYTHONSAFEPATH")
    return popen(command, **options)
node_process.subprocess.Popen = replaced
"""
    out = tmp_path / "out"
    command = endless("--out", out, first=code, PYTHONPATH=str(tmp_path))
    command.until(lambda: "All 4 nodes" in command.stdout)
    logs = {name: out / f"logs/{name}.log" for name in ("human_1_agent", "inference")}
    command.until(lambda: "locks twice" in logs["human_1_agent"].read_text())
    command.until(lambda: "ready" in logs["inference"].read_text())
    command.process.send_signal(signal.SIGINT)
    assert command.exit_code() == 130, command.messages
    for name, log in logs.items():
        assert "the node hangs and is ended by force" in log.read_text()
        assert "in hang" in log.read_text()
        assert (
            f"the node {name} did not end well when it was stopped: exit code 1" in command.stderr
        )
    assert command.leftovers() == {}
