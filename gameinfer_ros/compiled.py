"""Where compiled code is kept."""

from __future__ import annotations

import hashlib
import os
import shutil
from pathlib import Path

from numba.core import config

PACKAGE = Path(__file__).parent


def keep_apart() -> None:
    """Make Numba keep what it compiles of these sources apart from what it compiled of others.

    Numba compiles a function anew if its own file has changed, but not if that of a function it
    calls has. Here, the files call one another. Where the package cannot be written, or the user
    has set `NUMBA_CACHE_DIR`, everything stays as it is.
    """
    caches = PACKAGE / "__pycache__"
    if config.CACHE_DIR or not os.access(caches if caches.exists() else PACKAGE, os.W_OK):
        return
    own = caches / f"numba-{fingerprint()}"
    try:
        own.mkdir(parents=True, exist_ok=True)
    except OSError:
        return
    config.CACHE_DIR = str(own)
    for other in caches.glob("numba-*"):
        if other != own:
            shutil.rmtree(other, ignore_errors=True)


def fingerprint() -> str:
    """A number that changes with any of the sources of this package."""
    digest = hashlib.sha1(usedforsecurity=False)
    for path in sorted(PACKAGE.rglob("*.py")):
        digest.update(str(path.relative_to(PACKAGE)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
