"""The machine this runs on, and how much memory this process took of it."""

from __future__ import annotations

import os
import platform
from pathlib import Path
from typing import Any

import numba
import numpy as np

from gameinfer_ros import __version__


def describe() -> dict[str, Any]:
    """Processor, cores, how busy they are, and versions."""
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
    """Version of this package."""
    return __version__


def peak_memory_mb() -> float:
    """The most resident memory that this process had so far, in MB."""
    kilobytes = _field("/proc/self/status", "VmHWM") or "nan kB"
    return float(kilobytes.split()[0]) / 1024


def _field(file: str, name: str) -> str | None:
    """The first value that stands behind `name` and a colon; `None` if there is none."""
    path = Path(file)
    for line in path.read_text().splitlines() if path.exists() else ():
        key, _, value = line.partition(":")
        if key.strip() == name:
            return value.strip()
    return None
