"""Every option of every command: what it cannot use ends with the exit code 2, and in words."""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest

from gameinfer_ros.commands import cli
from gameinfer_ros.names.exit_codes import BAD_INPUT

TEXTS = ("", " ", "x", "-1", "1.5", "nan", "inf", "1e9", "9" * 30, "9" * 5000, "y" * 5000, "\x00",
         "a\nb", "zoé 💥", "/dev/zero", "/", "--", "-x", "0x10")  # fmt: skip


def options() -> Iterator[tuple[str, argparse.Action]]:
    """Each option of each command that takes a value."""
    for command in cli.COMMANDS:
        parser = argparse.ArgumentParser()
        importlib.import_module(f"gameinfer_ros.commands.{command}").add_arguments(parser)
        for action in parser._actions:
            if action.option_strings and action.nargs is None:
                yield command, action


EVERY = {
    f"{command} {action.option_strings[-1]}": (command, action) for command, action in options()
}


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What was understood is not done."""

    class Work:
        @staticmethod
        def run(options: argparse.Namespace) -> int:
            return 77

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cli, "load", lambda name: Work)


@pytest.mark.parametrize("which", EVERY)
def test_an_option_is_understood_or_refused_in_words(
    which: str, told: None, capsys: pytest.CaptureFixture[str]
) -> None:
    command, action = EVERY[which]
    option, needed = action.option_strings[-1], ["bag"] if command in ("inspect", "replay") else []
    refused = 0
    for text in TEXTS:
        try:
            code = cli.main([command, *needed, f"{option}={text}"])
        except SystemExit as end:
            code = end.code
            said = capsys.readouterr().err
            assert f"argument {option}: " in said and "is not allowed" in said, said
            assert len(said) < 8000
            refused += 1
        assert code in (77, BAD_INPUT)
    if action.type not in (None, Path) or action.choices is not None:
        assert refused, "nothing is refused"
