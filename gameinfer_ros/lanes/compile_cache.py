"""The folder of Numba's disk cache."""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import warnings
from pathlib import Path

from numba.core import config

PACKAGE = Path(__file__).parents[1]

#: Rooms with compiled functions. They import no other room of the package.
COMPILED = ("games", "inference", "lanes", "solver")


def keep_apart() -> None:
    """Make Numba use one cache folder for each version of the sources.

    Numba recompiles a function if its own file has changed, but not if the file of a function that
    it calls has. In this package, compiled functions call those of other files.

    If the package folder is not writable, or `NUMBA_CACHE_DIR` is set, Numba's default applies.
    Numba executes what it finds in the cache, so `NUMBA_CACHE_DIR` causes a warning if other users
    can write to it.
    """
    if config.CACHE_DIR:
        _warn_of_others(Path(config.CACHE_DIR))
        return
    caches = PACKAGE / "__pycache__"
    if not os.access(caches if caches.exists() else PACKAGE, os.W_OK):
        return
    own = caches / f"numba-{fingerprint()}"
    try:
        own.mkdir(mode=0o755, parents=True, exist_ok=True)
    except OSError:
        return
    config.CACHE_DIR = str(own)
    for other in caches.glob("numba-*"):
        if other != own:
            shutil.rmtree(other, ignore_errors=True)


def _warn_of_others(folder: Path) -> None:
    try:
        found = folder.stat()
    except OSError:
        return  # Numba creates the folder, or reports why it cannot
    if found.st_mode & stat.S_IWOTH or found.st_uid not in (0, os.getuid()):
        warnings.warn(
            f"NUMBA_CACHE_DIR: {folder} is unsafe: other users can write to it, and its contents "
            "are executed. Use a folder that only you can write to",
            RuntimeWarning,
            stacklevel=2,
        )


def fingerprint() -> str:
    """A number that changes with any of the sources of compiled functions."""
    digest = hashlib.sha1(usedforsecurity=False)
    for room in COMPILED:
        for path in sorted((PACKAGE / room).rglob("*.py")):
            digest.update(str(path.relative_to(PACKAGE)).encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
