"""The machine that a study or benchmark runs on, and the memory of this process."""

import os
import platform
from pathlib import Path
from typing import Any

import numba
import numpy as np

from gameinfer_ros import __version__


def describe() -> dict[str, Any]:
    """Return the processor, its cores and load average, and the versions of the software."""
    return {
        "cpu": _field("/proc/cpuinfo", "model name") or platform.machine(),
        "cores": os.cpu_count(),
        "load_average": os.getloadavg()[0],
        "gameinfer_ros": version(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
    }


def version() -> str:
    """Return the version of this package."""
    return __version__


def peak_memory_mb() -> float:
    """Return the peak resident memory of this process, in MB; nan if it is unknown."""
    kilobytes = _field("/proc/self/status", "VmHWM") or "nan kB"
    return float(kilobytes.split()[0]) / 1024


def _field(file: str, name: str) -> str | None:
    """Return the value after the first `name:` in a file, or None if the name is missing."""
    path = Path(file)
    for line in path.read_text().splitlines() if path.exists() else ():
        key, _, value = line.partition(":")
        if key.strip() == name:
            return value.strip()
    return None
