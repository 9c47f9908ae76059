"""Colours are for terminals."""

from __future__ import annotations

import json
import os
import pty
import re
import subprocess
import sys
from types import SimpleNamespace

import pytest

from gameinfer_ros.commands import cli

COMMAND = ["-m", "gameinfer_ros", "equilibria", "--scenario", "two_player", "--samples", "4"]
#: A control sequence that chooses a colour, of letters or of what is behind them.
COLOUR = re.compile(r"\x1b\[(?:[\d;]*;)?(?:3[0-8]|4[0-8]|9[0-7]|10[0-7])[\d;]*m")


def environment(**more: str) -> dict[str, str]:
    """Ours, without what others may have said of colours."""
    said = {"NO_COLOR", "FORCE_COLOR", "CLICOLOR_FORCE", "TTY_COMPATIBLE", "COLUMNS"}
    ours = {name: value for name, value in os.environ.items() if name not in said}
    return {**ours, "TERM": "xterm-256color", **more}


def in_terminal(folder: str, **more: str) -> str:
    ours, its = pty.openpty()
    with subprocess.Popen(
        [sys.executable, *COMMAND, "--jobs", "1", "--out", folder],
        env=environment(**more), stdin=its, stdout=its, stderr=its, close_fds=True,
    ) as process:  # fmt: skip
        os.close(its)
        written = b""
        while True:
            try:
                part = os.read(ours, 65536)
            except OSError:  # the other end is closed
                break
            if not part:
                break
            written += part
        assert process.wait(60) == 0, written.decode()
    os.close(ours)
    return written.decode()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A folder with the runs of the study, so that they need not be made again."""
    return str(tmp_path_factory.mktemp("study"))


def test_a_pipe_gets_nothing_but_text(folder: str) -> None:
    done = subprocess.run(
        [sys.executable, *COMMAND, "--jobs", "1", "--json", "--out", folder],
        env=environment(), capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "cluster" in done.stderr
    assert json.loads(done.stdout)["samples"] == 4
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f]", done.stdout + done.stderr)


def test_a_terminal_gets_colours_unless_the_user_forbids_them(folder: str) -> None:
    assert COLOUR.search(in_terminal(folder + "/new"))
    assert not COLOUR.search(in_terminal(folder + "/newer", NO_COLOR="1"))


def test_the_logger_of_ros_has_no_colours_either(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli, "load", lambda module: SimpleNamespace(run=lambda options: 0))
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("RCUTILS_COLORIZED_OUTPUT", "1")
    cli.main(["bench"])
    assert os.environ["RCUTILS_COLORIZED_OUTPUT"] == "1", "what the user says stays"
    monkeypatch.delenv("RCUTILS_COLORIZED_OUTPUT")
    cli.main(["bench"])
    assert os.environ["RCUTILS_COLORIZED_OUTPUT"] == "0"
