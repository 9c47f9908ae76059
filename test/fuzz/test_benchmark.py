"""The long one, for a moment."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_benchmark_tells_what_became_of_each_kind(tmp_path: Path) -> None:
    line = ["benchmarks/fuzz.py", "--cases", "8", "--kinds", "bags"]
    done = subprocess.run(
        [sys.executable, *line, "--json", str(tmp_path / "found.json")],
        cwd=ROOT, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads((tmp_path / "found.json").read_text())
    assert "bags" in done.stdout
    assert found["bags"]["tried"] == 8
    assert found["bags"]["rejected"] + found["bags"]["accepted"] == 8
    assert found["bags"]["crashed"] == found["bags"]["hung"] == 0
