"""A run that is controlled through its page."""

from __future__ import annotations

import json
import re
import signal
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

from run_command import Command


def ask(address: str, action: str) -> dict[str, Any]:
    request = urllib.request.Request(f"{address}control/{action}", method="POST")
    with urllib.request.urlopen(request, timeout=20) as response:
        return json.load(response)


def test_a_page_pauses_and_restarts_a_run(start: Callable[..., Command], tmp_path: Path) -> None:
    command = start(
        *("--scenario", "two_player", "--steps", 1000, "--out", tmp_path / "out"),
        *("--view", "--view-port", 0, "--control"),
    )
    command.until(lambda: "First controls" in command.stdout and "View:" in command.stdout)
    (address,) = re.findall(r"View: (http://\S+)", command.stdout)
    logs = tmp_path / "out" / "logs"
    for action, words, beginnings in (
        ("pause", "paused at step", 1),
        ("resume", "resumed at step", 1),
        ("reset", "the run restarts after", 2),
        ("new_seeds", "the run restarts after", 3),
    ):
        answer = ask(address, action)
        assert answer["success"] is True
        assert words in answer["message"]
        command.until(
            lambda n=beginnings: (logs / "simulator.log").read_text().count("time starts") == n
        )
    command.process.send_signal(signal.SIGINT)
    assert command.exit_code() == 130
    for node in ("inference", "human_1_agent"):
        assert (logs / f"{node}.log").read_text().count("reset: restarts with new seeds") == 1
