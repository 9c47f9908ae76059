"""How far a study is, in words and in a bar."""

from __future__ import annotations

import io
import re

import pytest
from rich.console import Console

from gameinfer_ros.experiments.study.study_progress import StudyProgress


def shown(terminal: bool, earlier: int = 0, made: int = 3) -> str:
    output = io.StringIO()
    console = Console(file=output, force_terminal=terminal, width=120, color_system=None)
    with StudyProgress(console, "a study", 10, earlier) as progress:
        for _ in range(made):
            progress.advance()
    return output.getvalue()


def test_without_a_terminal_there_is_a_line_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StudyProgress, "INTERVAL", -1.0)
    lines = shown(terminal=False, earlier=2).splitlines()
    assert lines[0] == "a study: 2 of 10 runs already exist"
    for done, line in enumerate(lines[1:-1], 3):
        assert re.fullmatch(rf"a study: {done} of 10 runs, about \d+ s remaining", line)
    assert re.fullmatch(r"a study: 3 runs played in \d+ s, 5 of 10 exist now", lines[-1])
    assert len(lines) == 5


def test_without_a_terminal_there_are_few_lines() -> None:
    lines = shown(terminal=False, made=8).splitlines()
    assert len(lines) == 1 and lines[0].startswith("a study: 8 runs played in")


def test_in_a_terminal_there_is_a_bar_with_the_time_that_remains() -> None:
    output = shown(terminal=True)
    assert "a study" in output and "3/10" in output and "remaining" in output
    assert "of 10 runs, about" not in output


def test_where_nothing_was_made_nothing_is_said_of_it() -> None:
    assert shown(terminal=False, earlier=10, made=0).splitlines() == [
        "a study: 10 of 10 runs already exist"
    ]
