"""Help of all commands."""

from __future__ import annotations

import argparse
import importlib
import shlex
import subprocess
from collections import defaultdict
from pathlib import Path
from types import SimpleNamespace

import pytest

from gameinfer_ros import __version__
from gameinfer_ros.commands import cli

COMMANDS = list(cli.COMMANDS)


def gameinfer(shell: dict[str, str], *args: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["gameinfer", *args], env=shell, capture_output=True, text=True, timeout=60
    )


def command(name: str) -> tuple[argparse.ArgumentParser, tuple[str, ...]]:
    """A parser with the options of a command, and its examples."""
    module = importlib.import_module(f"gameinfer_ros.commands.{name}")
    parser = argparse.ArgumentParser()
    module.add_arguments(parser)
    return parser, module.EXAMPLES


@pytest.mark.parametrize("name", [None, *COMMANDS])
def test_help_is_light_and_fits_the_terminal(name: str | None, shell: dict[str, str]) -> None:
    done = gameinfer(shell, *([] if name is None else [name]), "--help")
    assert done.returncode == 0, done.stderr
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert "\x1b" not in done.stdout
    if name is not None:
        assert f"usage: gameinfer {name}" in done.stdout
        assert "\nexamples:\n" in done.stdout
        assert "\nresults:\n" in done.stdout


def test_without_a_command_there_is_help(shell: dict[str, str]) -> None:
    done = gameinfer(shell)
    assert done.returncode == 0
    assert done.stdout == gameinfer(shell, "--help").stdout
    for name in COMMANDS:
        assert f"\n    {name} " in done.stdout
    assert "0 done, 1 failed, 2 bad input, 130 interrupted" in done.stdout


@pytest.mark.parametrize("option", ["--version", "-V"])
def test_version(option: str, shell: dict[str, str]) -> None:
    done = gameinfer(shell, option)
    assert (done.returncode, done.stdout) == (0, f"gameinfer {__version__}\n")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_says_what_it_is_and_what_it_is_by_default(name: str) -> None:
    parser, _ = command(name)
    for action in parser._actions:
        words = " ".join(action.option_strings) or action.dest
        assert action.help, words
        has_default = not any(action.default is no for no in (None, False, argparse.SUPPRESS))
        assert has_default == ("%(default)s by default" in action.help), words
        if action.nargs is None and action.option_strings:
            assert action.choices or (action.metavar and action.metavar.isascii()), words


def test_an_option_is_the_same_wherever_it_stands() -> None:
    meanings = defaultdict(set)
    for name in COMMANDS:
        parser, _ = command(name)
        for action in parser._actions:
            for option in action.option_strings:
                meanings[option].add((action.help, action.metavar, action.default, action.dest))
    assert {option for option, found in meanings.items() if len(found) > 1} == set()
    assert {"--scenario", "--seed", "--out", "--json", "--jobs", "--runs"} <= set(meanings)


@pytest.mark.parametrize("example", [e for name in COMMANDS for e in command(name)[1]])
def test_examples_are_understood(
    example: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    called = []
    work = SimpleNamespace(run=lambda options: called.append(options) or 0)
    monkeypatch.setattr(cli, "load", lambda module: work)
    monkeypatch.chdir(tmp_path)
    program, *args = shlex.split(example.partition("|")[0])
    assert program == "gameinfer"
    assert cli.main(args) == 0
    assert [options.command for options in called] == args[:1]
