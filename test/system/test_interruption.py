"""Ctrl-C where exceptions do not get through."""

from __future__ import annotations

import ctypes
import gc
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from gameinfer_ros.orchestration.node_process import NodeProcess, stop_all
from gameinfer_ros.system.interruption import SIGNALS, interrupts_deferred, one_interruption

#: Swallows whatever is raised, as libraries do while they are imported.
SWALLOWS = """
import os, sys
try:
    os.kill(os.getpid(), int(os.environ["SIGNAL"]))
    sum(range(10**6))
except BaseException:
    pass
print("went on")
"""


@ctypes.CFUNCTYPE(None)
def interrupted_callback() -> None:
    os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.parametrize("at_the_very_end", [False, True])
def test_what_a_callback_swallows_comes_again(
    at_the_very_end: bool, capfd: pytest.CaptureFixture[str]
) -> None:
    before = [signal.getsignal(n) for n in (*SIGNALS, signal.SIGALRM)]
    hook = sys.unraisablehook
    with pytest.raises(KeyboardInterrupt), one_interruption():
        interrupted_callback()
        if not at_the_very_end:
            time.sleep(60)
    assert [signal.getsignal(n) for n in (*SIGNALS, signal.SIGALRM)] == before
    assert sys.unraisablehook is hook
    assert capfd.readouterr().err == ""


class HalfMade:
    """Its destructor needs what its constructor has not set yet when the signal comes."""

    def __init__(self) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60)
        self.resource = 1

    def __del__(self) -> None:
        del self.resource


def test_no_destructor_complains_of_what_the_signal_left_half_made(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    complaints: list[Any] = []
    monkeypatch.setattr(sys, "unraisablehook", complaints.append)
    with pytest.raises(KeyboardInterrupt), one_interruption():
        HalfMade()
    with pytest.raises(KeyboardInterrupt), one_interruption():
        try:
            HalfMade()
        except KeyboardInterrupt:
            raise RuntimeError("what was called back did not answer") from None
    gc.collect()
    assert not complaints


def test_other_complaints_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    complaints: list[Any] = []
    monkeypatch.setattr(sys, "unraisablehook", complaints.append)
    with one_interruption():
        HalfMade.__new__(HalfMade)  # without a signal
    assert [complaint.exc_type for complaint in complaints] == [AttributeError]


def test_an_error_after_an_interruption_is_an_interruption() -> None:
    with pytest.raises(KeyboardInterrupt), one_interruption():
        interrupted_callback()
        raise RuntimeError("what was called back did not answer")


def test_other_exceptions_stay() -> None:
    with pytest.raises(RuntimeError), one_interruption():
        raise RuntimeError


def interrupted(*arguments: str, **settings: str) -> tuple[int, str, str]:
    """Exit code, output and errors of Python, which Ctrl-C would reach."""
    done = subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, **settings},
        capture_output=True,
        text=True,
        timeout=60,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("number", SIGNALS)
def test_a_library_cannot_swallow_an_interrupt_while_it_is_imported(
    number: signal.Signals, tmp_path: Path
) -> None:
    (tmp_path / "swallows.py").write_text(SWALLOWS)
    code = "from gameinfer_ros.system.load import load; load('swallows')"
    path = os.pathsep.join([str(tmp_path), *sys.path])
    found = interrupted("-c", code, PYTHONPATH=path, SIGNAL=str(int(number)))
    assert found == (130, "", "")


@pytest.mark.parametrize("number", SIGNALS)
def test_between_imports_any_signal_ends_a_command_too(number: signal.Signals) -> None:
    code = (
        "import os, sys; from gameinfer_ros.commands import cli; "
        "from gameinfer_ros.commands.gameinfer import main; "
        f"cli.load = lambda module: os.kill(os.getpid(), {int(number)}); sys.exit(main(['bench']))"
    )
    assert interrupted("-c", code) == (130, "", "")


#: Is interrupted in code that was made from a string, and says how it ended.
HANDLES = """
import os, signal, sys
from gameinfer_ros.system import interruption
interruption.{prepare}()
try:
    exec("os.kill(os.getpid(), signal.{signal}); sum(range(10**6))")
except KeyboardInterrupt:
    sys.exit(130)
"""


@pytest.mark.parametrize("prepare", ["raise_by_default", "raise_on_interrupt"])
@pytest.mark.parametrize("number", SIGNALS)
def test_the_exit_code_is_ours_wherever_it_is_interrupted(
    number: signal.Signals, prepare: str, tmp_path: Path
) -> None:
    (tmp_path / "handles.py").write_text(HANDLES.format(prepare=prepare, signal=number.name))
    path = os.pathsep.join([str(tmp_path), *sys.path])
    assert interrupted("-m", "handles", PYTHONPATH=path) == (130, "", "")


@pytest.mark.parametrize("number", SIGNALS)
def test_what_is_deferred_comes_at_the_end_for_who_handled_it_before(
    number: signal.Signals,
) -> None:
    went_on = False
    with pytest.raises(KeyboardInterrupt), one_interruption():
        before = [signal.getsignal(n) for n in SIGNALS]
        try:
            with interrupts_deferred():
                os.kill(os.getpid(), number)
                time.sleep(0.01)
                went_on = True
        finally:
            assert [signal.getsignal(n) for n in SIGNALS] == before
    assert went_on


def test_what_is_deferred_is_not_lost_if_something_else_goes_wrong() -> None:
    with pytest.raises(KeyboardInterrupt), one_interruption(), interrupts_deferred():
        os.kill(os.getpid(), signal.SIGTERM)
        raise RuntimeError


def test_a_node_that_is_restarted_during_an_interrupt_is_not_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = NodeProcess("human_1_agent", "human_agent", {"player": "nobody"}, tmp_path)
    node.send(signal.SIGKILL)
    while node.exit_code is None:
        time.sleep(0.02)
    started: list[subprocess.Popen[bytes]] = []

    class InterruptedPopen(subprocess.Popen[bytes]):
        def __init__(self, *args: Any, **kwargs: Any) -> None:
            super().__init__(*args, **kwargs)
            started.append(self)
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)

    monkeypatch.setattr(subprocess, "Popen", InterruptedPopen)
    try:
        with pytest.raises(KeyboardInterrupt), one_interruption():
            node.restart()
        stop_all([node])
        assert [process.returncode is None for process in started] == [False]
    finally:
        for process in started:
            process.kill()
            process.wait()
