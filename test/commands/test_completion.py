"""Completion, as shells ask for it; nothing that takes long to import is within reach."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from gameinfer_ros.commands import cli
from gameinfer_ros.names.planners import planners
from gameinfer_ros.scenario.files import available, suite

#: Asks as bash does: candidates come on file descriptor 8.
ASK = "exec 8>&1 9>&2 >/dev/null 2>&1; exec gameinfer"

#: Lets bash itself call the function that is registered for `gameinfer`.
COMPLETE = """
eval "$(register-python-argcomplete gameinfer)"
[[ $(complete -p gameinfer) =~ -F\\ ([^ ]+) ]] || exit 1
COMP_LINE=$1 COMP_POINT=${#1} COMP_TYPE=9
read -ra COMP_WORDS <<<"$1"
[[ $1 != *' ' ]] || COMP_WORDS+=('')
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
"${BASH_REMATCH[1]}" gameinfer "${COMP_WORDS[-1]}" "${COMP_WORDS[-2]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a bag, a scenario and something else."""
    (tmp_path / "bags/first").mkdir(parents=True)
    (tmp_path / "bags/first/metadata.yaml").touch()
    (tmp_path / "bags/first/inner").mkdir()
    (tmp_path / "swap.yaml").touch()
    (tmp_path / "notes.txt").touch()
    return tmp_path


def ask(line: str, shell: dict[str, str], folder: Path) -> set[str]:
    """What the line can be completed by."""
    asked = {"_ARGCOMPLETE": "1", "COMP_LINE": line, "COMP_POINT": str(len(line)),
             "_ARGCOMPLETE_IFS": "\n"}  # fmt: skip
    done = subprocess.run(
        ["bash", "-c", ASK], env={**shell, **asked}, cwd=folder, capture_output=True, text=True,
        timeout=60,
    )  # fmt: skip
    return {word.strip() for word in done.stdout.splitlines()}


def test_subcommands(shell: dict[str, str], folder: Path) -> None:
    assert ask("gameinfer ", shell, folder) == set(cli.COMMANDS)
    assert ask("gameinfer p", shell, folder) == {name for name in cli.COMMANDS if name[0] == "p"}


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        ("run --pl", {"--planner"}),
        ("run --planner ", set(planners())),
        ("run --time re", {"realtime"}),
        ("run --ro", {"--ros-args"}),
        ("planning --backend ", {"dask", "processes"}),
        ("equilibria --k", {"--k-means"}),
        ("run --scenario ", {*available(), *suite(), "swap.yaml", "bags/"}),
        ("report --seed ", set()),
        ("bench --out ", {"bags/"}),
        ("run --record b", {"bags/"}),
        ("inspect ba", {"bags/"}),
        ("replay bags/", {"bags/first"}),
    ],
)
def test_options_and_their_values(
    line: str, wanted: set[str], shell: dict[str, str], folder: Path
) -> None:
    assert ask(f"gameinfer {line}", shell, folder) == wanted


@pytest.mark.parametrize("name", list(cli.COMMANDS))
def test_every_command_completes_its_options(
    name: str, shell: dict[str, str], folder: Path
) -> None:
    assert "--json" in ask(f"gameinfer {name} --", shell, folder)


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        ("gameinfer insp", {"inspect"}),
        ("gameinfer run --scenario five_player_", {"five_player_unicycle"}),
    ],
)
def test_in_a_real_shell(line: str, wanted: set[str], shell: dict[str, str], folder: Path) -> None:
    done = subprocess.run(
        ["bash", "--norc", "-c", COMPLETE, "bash", line], env=shell, cwd=folder,
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert {word.strip() for word in done.stdout.split()} == wanted


def test_shells_that_complete_for_all_commands_find_the_mark(shell: dict[str, str]) -> None:
    check = [sys.executable, "-m", "argcomplete._check_module"]  # what those shells do
    assert subprocess.run([*check, "gameinfer_ros"], env=shell).returncode == 0
    assert subprocess.run([*check, "gameinfer_ros.commands.executables"], env=shell).returncode != 0
