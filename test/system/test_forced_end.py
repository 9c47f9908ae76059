"""A process that hangs ends all the same, and says where it hangs."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

DEADLINE = 60.0

#: Makes a ForcedEnd with a log; `hang` never returns, and `hang_with_lock` keeps Python's lock.
BEGIN = """
import ctypes, os, signal, sys, threading, time
from pathlib import Path
from gameinfer_ros.system.forced_end import ForcedEnd
end = ForcedEnd("the test", lambda: print("before", flush=True))
end.log = Path(sys.argv[1])
def hang():
    ctypes.CDLL(None).pause()
    hang()
def hang_with_lock():
    ctypes.PyDLL(None).pause()
    hang_with_lock()
"""


def start(code: str, log: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", BEGIN + code, str(log)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def test_a_thread_that_hangs_is_shown_and_the_process_ends(tmp_path: Path) -> None:
    log = tmp_path / "log"
    process = start("end.within(0.5, 'the thing')\nhang()", log)
    stdout, stderr = process.communicate(timeout=DEADLINE)
    assert process.returncode == 1
    assert stdout == "before\n"
    assert stderr.startswith("the test hangs and is ended by force: the thing has not ended within")
    assert str(log) in stderr
    assert "in hang" in log.read_text()


def test_no_python_code_needs_to_run(tmp_path: Path) -> None:
    process = start("end.within(0.5, 'the thing')\nhang_with_lock()", tmp_path / "log")
    _, stderr = process.communicate(timeout=DEADLINE)
    assert process.returncode == 1
    assert "in hang_with_lock" in stderr


def test_the_end_of_the_interpreter_is_limited_too(tmp_path: Path) -> None:
    """As the destructors of a library may hang, after all threads of Python have ended."""
    code = """
end.within(0.5, 'the end')
sys.stdout.flush()
libc = ctypes.CDLL(None)
libc.atexit(ctypes.cast(libc.pause, ctypes.c_void_p))
"""
    process = start(code, tmp_path / "log")
    process.communicate(timeout=DEADLINE)
    assert process.returncode in (1, -signal.SIGALRM)


def test_what_ends_in_time_is_left_alone(tmp_path: Path) -> None:
    code = """
end.within(0.5, 'the thing')
end.within(60.0, 'another')
time.sleep(3.0)
end.cancel()
end.within(0.5, 'the thing')
end.cancel()
time.sleep(3.0)
print("fine")
"""
    process = start(code, tmp_path / "log")
    stdout, stderr = process.communicate(timeout=DEADLINE)
    assert (process.returncode, stdout, stderr) == (0, "fine\n", "")


@pytest.mark.parametrize("stops", [False, True])
def test_a_signal_limits_the_time(stops: bool, tmp_path: Path) -> None:
    """Also if the main thread hangs, and does not handle it."""
    code = f"""
signal.signal(signal.SIGINT, lambda *_: None)
stop = end.after_signals(0.5)
if {stops}:
    stop()
print("ready", flush=True)
hang() if not {stops} else time.sleep(4.0)
"""
    process = start(code, tmp_path / "log")
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    os.kill(process.pid, signal.SIGINT)
    _, stderr = process.communicate(timeout=DEADLINE)
    assert process.returncode == (0 if stops else 1)
    assert ("what SIGINT interrupted" in stderr) != stops


def test_a_guarded_call_is_limited_but_not_while_the_process_is_stopped(tmp_path: Path) -> None:
    code = """
with end.watch(2.0, 'the call') as guard:
    for _ in range(40):
        with guard():
            time.sleep(0.1)
    with guard():
        pass
    time.sleep(4.0)  # this is not guarded
    print("ready", flush=True)
    with guard():
        time.sleep(1.0)
    print("hangs", flush=True)
    with guard():
        hang()
"""
    process = start(code, tmp_path / "log")
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    os.kill(process.pid, signal.SIGSTOP)
    time.sleep(4.0)
    os.kill(process.pid, signal.SIGCONT)
    assert process.stdout.readline() == "hangs\n"
    _, stderr = process.communicate(timeout=DEADLINE)
    assert process.returncode == 1
    assert "the call has not ended within 2 s" in stderr
