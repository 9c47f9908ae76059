"""Commands that cannot write where file modes forbid it, even if root starts the tests."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]

#: Drops the capabilities by which root ignores file modes, and becomes another program.
DROP = """
import ctypes, os, sys
for capability in (1, 2):  # CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH, from linux/capability.h
    ctypes.CDLL(None).prctl(24, capability, 0, 0, 0)  # PR_CAPBSET_DROP, from sys/prctl.h
os.execv(sys.argv[1], sys.argv[1:])
"""


def python(*arguments: str) -> list[str]:
    """The command line of Python without these capabilities."""
    return [sys.executable, "-IS", "-c", DROP, sys.executable, *arguments]


def install(folder: Path) -> Path:
    """Install the package and a home where nothing can be written; returns the package's folder."""
    for name in ("gameinfer_ros", "msg_adapters", "config"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "home").mkdir()
    for path in (folder, *folder.rglob("*")):
        path.chmod(path.stat().st_mode & ~0o222)
    return folder


def uninstall(folder: Path) -> None:
    """Make the folder writable again, so that it can be removed."""
    for path in (folder, *folder.rglob("*")):
        path.chmod(path.stat().st_mode | 0o700)
