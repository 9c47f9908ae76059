"""The audit fails on a known vulnerability, and says so where it cannot know of any."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

AUDIT = Path(__file__).parents[2] / ".ci/audit"
WEAK = [{"id": "PYSEC-1", "fix_versions": ["9.9"]}]

#: Stands in for pip-audit: answers what a file says, by project.
PIP_AUDIT = """#!{python}
import json, sys
answers = json.load(open({answers!r}))
if answers is None:
    sys.exit("the service does not answer")
lines = open(sys.argv[sys.argv.index("--requirement") + 1]).read().split()
names = [line.partition("==") for line in lines]
assert len({{name for name, _, _ in names}}) == len(names)
print(json.dumps({{"dependencies": [
    {{"name": name, "version": version, **answers.get(name, answers["*"])}}
    for name, _, version in names
]}}))
"""


@pytest.fixture
def audit(tmp_path: Path) -> Any:
    """Runs the audit of a lock with a service that says so; returns exit code and output."""

    def run(answers: dict[str, Any] | None) -> tuple[int, str]:
        (tmp_path / "answers.json").write_text(json.dumps(answers))
        stand_in, lock = tmp_path / "pip-audit", tmp_path / "lock.txt"
        script = PIP_AUDIT.format(python=sys.executable, answers=str(tmp_path / "answers.json"))
        stand_in.write_text(script)
        stand_in.chmod(0o755)
        lock.write_text(
            "good==1.0 \\\n    --hash=sha256:00\nweak==1.0 ; python_version < '3.11' \\\n"
            "    --hash=sha256:00\nweak==2.0 ; python_version >= '3.11' \\\n    --hash=sha256:00\n"
        )
        done = subprocess.run(
            [sys.executable, str(AUDIT), str(stand_in), str(lock)], capture_output=True, text=True
        )
        return done.returncode, done.stdout

    return run


SOUND, SILENT = {"vulns": []}, {"skip_reason": "Dependency not found on PyPI"}


def test_a_known_vulnerability_fails(audit: Any) -> None:
    code, output = audit({"jinja2": {"vulns": WEAK}, "weak": {"vulns": WEAK}, "*": SOUND})
    assert code == 1
    for version in ("1.0", "2.0"):  # for whatever Python it is
        assert f"weak {version}: PYSEC-1, mended in 9.9" in output
    assert "3 of 3 pinned releases were audited." in output and "NOT AUDITED" not in output


def test_none_is_known(audit: Any) -> None:
    code, output = audit({"jinja2": {"vulns": WEAK}, "*": SOUND})
    assert code == 0
    assert "3 of 3 pinned releases were audited." in output and "NOT AUDITED" not in output


@pytest.mark.parametrize("answers", [None, {"*": SILENT}, {"*": SOUND}])
def test_a_service_that_knows_nothing_is_no_all_clear(audit: Any, answers: Any) -> None:
    code, output = audit(answers)
    assert code == 0
    assert "NOT AUDITED: service unreachable" in output and "were audited" not in output


def test_what_the_service_leaves_out_is_told(audit: Any) -> None:
    code, output = audit({"jinja2": {"vulns": WEAK}, "weak": SILENT, "*": SOUND})
    assert code == 0
    assert "1 of 3 pinned releases were audited." in output and "NOT AUDITED: 2" in output
