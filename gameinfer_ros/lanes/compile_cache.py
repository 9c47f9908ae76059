"""The folder of Numba's disk cache."""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import stat
import tempfile
import warnings
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import FunctionCache

PACKAGE = Path(__file__).parents[1]

#: Rooms with compiled functions. They import no other room of the package.
COMPILED = ("games", "inference", "lanes", "solver")

#: Environment variable with the folder of the user's choice.
VARIABLE = "NUMBA_CACHE_DIR"

#: Environment variable that is set when there is no folder, so that child processes do not warn.
_WARNED = "GAMEINFER_ROS_UNCACHED"


def njit(function: Any = None, **options: Any) -> Any:
    """Compile a function like `numba.njit`, and keep the result in the disk cache if there is one.

    A cache that cannot be read or written, for example on a full disk, does not stop the compiler.
    """
    if function is None:
        return partial(njit, **options)
    dispatcher = numba.njit(function, **options)
    if config.CACHE_DIR:
        try:
            dispatcher._cache = _Cache(function)
        except RuntimeError:  # the folder has become unwritable
            _warn_uncached(f"{config.CACHE_DIR} is not writable")
    return dispatcher


class _Cache(FunctionCache):
    """A disk cache whose read and write errors count as misses."""

    def load_overload(self, *args: Any) -> Any:
        try:
            return super().load_overload(*args)
        except OSError:
            return None

    def save_overload(self, *args: Any) -> None:
        try:
            super().save_overload(*args)
        except OSError as error:
            _warn_uncached(str(error))


def keep_apart() -> None:
    """Make Numba use one cache folder for each version of the sources.

    Numba recompiles a function if its own file has changed, but not if the file of a function that
    it calls has. In this package, compiled functions call those of other files.

    The folder is in the package, or in the user's cache folder if the package cannot be written or
    belongs to another user. If that is impossible too, this causes a warning, and a temporary
    folder serves this process and its children. `NUMBA_CACHE_DIR` overrides the folder. Numba
    executes what it finds in the cache, so `NUMBA_CACHE_DIR` causes a warning if other users can
    write to it.
    """
    chosen = config.CACHE_DIR
    if chosen and _is_writable(Path(chosen)):
        _warn_of_others(Path(chosen))
        return
    config.CACHE_DIR = ""
    for caches in _places():
        own = caches / f"numba-{fingerprint()}"
        if _is_writable(own) and not _others_can_write(own):
            config.CACHE_DIR = str(own)
            for other in caches.glob("numba-*"):
                if other != own:
                    shutil.rmtree(other, ignore_errors=True)
            break
    if chosen:
        instead = f"{config.CACHE_DIR} is used instead" if config.CACHE_DIR else "there is no other"
        _warn_uncached(f"{VARIABLE}: {chosen} is not writable; {instead}")
    elif not config.CACHE_DIR:
        _warn_uncached(f"{' and '.join(map(str, _places()))} are not writable")
    if not config.CACHE_DIR:
        _use_temporary_folder()


def _places() -> Iterator[Path]:
    """Yield the folders that may contain the cache, the best one first."""
    yield PACKAGE / "__pycache__"
    try:
        user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:  # the user has no home
        return
    # Installations of different versions do not remove the caches of each other.
    yield user / "gameinfer_ros" / _digest(str(PACKAGE).encode())


def _use_temporary_folder() -> None:
    """Use a folder that this process and its children share, and that it removes at its end."""
    try:
        folder = tempfile.mkdtemp(prefix="gameinfer_ros-numba-")
    except OSError:
        return
    config.CACHE_DIR = os.environ[VARIABLE] = folder
    owner = os.getpid()

    def remove() -> None:
        if os.getpid() == owner:  # not in a fork
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)


def _is_writable(folder: Path) -> bool:
    """Create a folder if it does not exist, and return whether files can be created in it."""
    try:
        folder.mkdir(mode=0o755, parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _others_can_write(folder: Path, trusted: tuple[int, ...] = ()) -> bool:
    found = folder.stat()
    return bool(found.st_mode & stat.S_IWOTH) or found.st_uid not in (os.getuid(), *trusted)


def _warn_of_others(folder: Path) -> None:
    if _others_can_write(folder, trusted=(0,)):
        warnings.warn(
            f"{VARIABLE}: {folder} is unsafe: other users can write to it, and its contents "
            "are executed. Use a folder that only you can write to",
            RuntimeWarning,
            stacklevel=3,
        )


def _warn_uncached(why: str) -> None:
    """Warn once, in this process and its children, that compiled code is not kept."""
    if os.environ.get(_WARNED):
        return
    os.environ[_WARNED] = "1"
    warnings.warn(
        f"compiled code cannot be kept for later commands: {why}. Each command compiles the solver "
        f"again, which takes half a minute. Set {VARIABLE} to a folder that you can write to",
        RuntimeWarning,
        stacklevel=3,
    )


def fingerprint() -> str:
    """A number that changes with any of the sources of compiled functions."""
    content = []
    for room in COMPILED:
        for path in sorted((PACKAGE / room).rglob("*.py")):
            content += [str(path.relative_to(PACKAGE)).encode(), path.read_bytes()]
    return _digest(b"".join(content))


def _digest(content: bytes) -> str:
    return hashlib.sha1(content, usedforsecurity=False).hexdigest()[:16]


keep_apart()  # before anything is compiled
