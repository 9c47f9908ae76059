"""What could make data run as code is refused by the style check, and the sources hold none."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

UNSAFE = [
    "eval(input())",
    "exec(input())",
    "import pickle",
    "import marshal\n\nmarshal.loads(b'')",
    "import shelve",
    "import joblib\n\njoblib.load('x')",
    "import cloudpickle",
    "import yaml\n\nyaml.load('x', yaml.Loader)",
    "import yaml\n\nyaml.unsafe_load('x')",
    "import subprocess\n\nsubprocess.run('ls *', shell=True)",
    "import os\n\nos.system('ls *')",
    "import tempfile\n\ntempfile.mktemp()",
    "open('/tmp/fixed', 'w')",
    "from jinja2 import Environment\n\nEnvironment()",
]


def ruff(*arguments: str, code: str | None = None) -> subprocess.CompletedProcess[str]:
    command = shutil.which("ruff")
    if command is None:
        pytest.skip("there is no ruff")
    return subprocess.run(
        [command, "check", "--no-cache", "--output-format=concise", *arguments],
        input=code,
        capture_output=True,
        text=True,
        cwd=ROOT,
    )


@pytest.mark.parametrize("code", UNSAFE)
def test_unsafe_code_is_refused(code: str) -> None:
    found = ruff("--stdin-filename", "gameinfer_ros/new.py", "-", code=f"{code}\n")
    assert re.search(r": (S\d+|TID251) ", found.stdout), code


def test_there_is_none() -> None:
    found = ruff()
    assert found.returncode == 0, found.stdout


def test_numpy_reads_no_pickles() -> None:
    for folder in ("gameinfer_ros", "msg_adapters"):
        for path in (ROOT / folder).rglob("*.py"):
            assert "allow_pickle" not in path.read_text(encoding="utf-8"), path
