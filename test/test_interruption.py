"""Ctrl-C where exceptions do not get through."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from gameinfer_ros.interruption import one_interruption

#: Swallows whatever is raised, as libraries do while they are imported.
SWALLOWS = """
import os, signal, sys
try:
    os.kill(os.getpid(), signal.SIGINT)
    sum(range(10**6))
except BaseException:
    pass
print("went on")
"""


@ctypes.CFUNCTYPE(None)
def interrupted_callback() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def test_what_a_callback_swallows_comes_again(capfd: pytest.CaptureFixture[str]) -> None:
    before = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)]
    hook = sys.unraisablehook
    with pytest.raises(KeyboardInterrupt), one_interruption():
        interrupted_callback()
        time.sleep(60)
    assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)] == before
    assert sys.unraisablehook is hook
    assert capfd.readouterr().err == ""


def test_what_is_swallowed_at_the_very_end_counts(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt), one_interruption():
        interrupted_callback()
    assert capfd.readouterr().err == ""


def test_what_comes_of_an_interruption_is_one() -> None:
    with pytest.raises(KeyboardInterrupt), one_interruption():
        interrupted_callback()
        raise RuntimeError("what was called back did not answer")


def test_other_exceptions_stay() -> None:
    with pytest.raises(RuntimeError), one_interruption():
        raise RuntimeError


def test_a_library_cannot_swallow_an_interrupt_while_it_is_imported(tmp_path: Path) -> None:
    (tmp_path / "swallows.py").write_text(SWALLOWS)
    code = "from gameinfer_ros.load import load; load('swallows')"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
