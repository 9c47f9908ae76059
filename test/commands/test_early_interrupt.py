"""Ctrl-C while libraries are still being imported."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gameinfer_ros.commands import cli
from gameinfer_ros.nodes.table import NODES

MINIMAL = {"inspect": ["nowhere"], "replay": ["nowhere"]}
COMMAND = "import sys\nfrom gameinfer_ros.commands.gameinfer import main\nsys.exit(main())"


def interrupted_when(
    library: str, code: str, *args: str, number: signal.Signals = signal.SIGINT
) -> tuple[int, str]:
    """Exit code and output of a process that is interrupted as soon as it has loaded a library."""
    process = subprocess.Popen(
        [sys.executable, "-c", code, *args],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    maps = Path(f"/proc/{process.pid}/maps")
    deadline = time.monotonic() + 60
    while library not in maps.read_text() and time.monotonic() < deadline:
        if process.poll() is not None:
            break
        time.sleep(0.002)
    process.send_signal(number)
    output, _ = process.communicate(timeout=60)
    return process.returncode, output


@pytest.mark.parametrize(
    ("name", "library"),
    [
        *((name, "_multiarray_umath") for name in cli.COMMANDS),
        *((name, "libllvmlite") for name in cli.COMMANDS if name != "inspect"),  # needs no compiler
    ],
)
def test_a_command_ends_quietly(name: str, library: str, tmp_path: Path) -> None:
    args = MINIMAL.get(name, ["--out", str(tmp_path / "out")])
    code_of_exit, output = interrupted_when(library, COMMAND, name, *args)
    assert (code_of_exit, output) == (130, "")


@pytest.mark.parametrize("library", ["_multiarray_umath", "libllvmlite", "librcl.so"])
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_run_ends_quietly_by_other_signals_too(
    number: signal.Signals, library: str, tmp_path: Path
) -> None:
    args = ["run", "--out", str(tmp_path / "out")]
    code_of_exit, output = interrupted_when(library, COMMAND, *args, number=number)
    assert (code_of_exit, output) == (130, "")


@pytest.mark.parametrize("library", ["_multiarray_umath", "libllvmlite"])
@pytest.mark.parametrize("name", [*NODES, "orchestrator"])
def test_a_node_ends_quietly(name: str, library: str) -> None:
    code = f"import sys\nfrom gameinfer_ros.commands.executables import {name}\nsys.exit({name}())"
    code_of_exit, output = interrupted_when(library, code)
    assert (code_of_exit, output) == (130, "")
