"""Where compiled code is kept."""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import warnings
from pathlib import Path

from numba.core import config

PACKAGE = Path(__file__).parents[1]


def keep_apart() -> None:
    """Make Numba keep what it compiles of these sources apart from what it compiled of others.

    Numba compiles a function anew if its own file has changed, but not if that of a function it
    calls has. Here, the files call one another. Where the package cannot be written, or the user
    has set `NUMBA_CACHE_DIR`, everything stays as it is; of a folder there that anybody can write
    to, a warning tells, because what is found there is executed.
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
        return  # Numba makes it, or says why not
    if found.st_mode & stat.S_IWOTH or found.st_uid not in (0, os.getuid()):
        warnings.warn(
            f"NUMBA_CACHE_DIR: others can write to {folder}, and what is there is executed: "
            "name a folder that is yours alone",
            RuntimeWarning,
            stacklevel=2,
        )


def fingerprint() -> str:
    """A number that changes with any of the sources of this package."""
    digest = hashlib.sha1(usedforsecurity=False)
    for path in sorted(PACKAGE.rglob("*.py")):
        digest.update(str(path.relative_to(PACKAGE)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
