"""The options with which `./dev test` spreads tests over processes."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]

TESTS = """\
import os, signal
import pytest

@pytest.mark.parametrize("number", range(8))
def test(number):
    if number == {killed}:
        os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_run_of_tests_survives_the_death_of_a_worker(tmp_path: Path) -> None:
    for name, killed in (("test_one.py", None), ("test_two.py", 3), ("test_three.py", None)):
        (tmp_path / name).write_text(TESTS.format(killed=killed))
    (scheduler,) = re.findall(r"--dist\\n(\w+)\\n", (ROOT / "dev").read_text(encoding="utf-8"))
    settings = ("-c", ROOT / "pyproject.toml", "--rootdir", tmp_path, "-p", "no:cacheprovider")
    done = subprocess.run(
        [
            *(sys.executable, "-m", "pytest", *settings),
            *("-n", "2", "--dist", scheduler, tmp_path),
        ],
        env={name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 1, done.stdout + done.stderr
    assert "crashed while running 'test_two.py::test[3]'" in done.stdout
    assert "1 failed, 23 passed" in done.stdout
