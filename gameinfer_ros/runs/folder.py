"""Folders of results."""

import fcntl
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from functools import partial
from pathlib import Path

#: What a folder can contain.
RUN, STUDY, REPORT, BENCHMARK, BAG = "a run", "a study", "a report", "a benchmark", "a bag"
SUITE = "a suite"

#: The files of each, as patterns.
_FILES = {
    RUN: ("run.json", "run.npz", "parameters/*.yaml", "logs/*.log", "picture.png"),
    STUDY: (
        *("study.json", "runs.csv", "times.csv", "figures.json", "study.json.draft"),
        *(f"{name}.{kind}" for name in ("check", "equilibria", "planning", "prediction")
          for kind in ("png", "pdf")),
        "scenario.yaml",
    ),
    REPORT: ("report.html",),
    SUITE: ("suite.json", "suite.md"),
    BENCHMARK: ("bench.json", "growth.png"),
    BAG: ("metadata.yaml", "unfinished.json", "*.mcap", "scenario.yaml"),
}  # fmt: skip

#: Patterns of files that may be of something else.
_COMMON = ("picture.png", "growth.png", "scenario.yaml", "logs/*.log")


class FolderError(ValueError):
    """A folder cannot be used for results; the message names it and the reason."""


@contextmanager
def results_folder(
    out: Path | None,
    kind: str,
    name: str = "",
    *,
    overwrite: bool = False,
    resume: bool = False,
    option: str = "--out",
) -> Iterator[Path]:
    """Create the folder of a command's results, and lock it against other commands.

    Args:
        out: the folder; None for a new one in `results/` with `name` in its name.
        kind: what is written, such as `RUN`.
        name: see `out`.
        overwrite: whether to delete earlier results of the same kind. Other files are kept.
        resume: whether earlier results of the same kind are allowed.
        option: option that names the folder, for messages.

    Raises:
        FolderError: another command is using the folder, or it contains other results.
        OSError: the folder cannot be created or read.
    """
    if out is None:
        moment = datetime.now().strftime("%Y%m%d-%H%M%S")
        out = Path("results") / f"{moment}-{name}-{os.getpid()}"
    is_new = not out.exists()
    try:
        out.mkdir(parents=True, exist_ok=True)
        unlock = lock(out, option)
    except OSError as error:
        raise OSError(f"{option}: {out} cannot be created: {error}") from None
    try:
        found = contents(out)
        if found is not None and found != kind:
            raise FolderError(
                f"{option}: {out} contains {found}, and {kind} does not replace it; choose "
                "another folder"
            )
        if found == kind and overwrite:
            _delete(out, kind)
        elif found == kind and not resume:
            raise FolderError(
                f"{option}: {out} contains the results of {found}; choose another folder, or "
                "replace them by --overwrite"
            )
        yield out
    finally:
        if is_new:
            with suppress(OSError):
                out.rmdir()  # if nothing was written
        unlock()


def lock(folder: Path, option: str) -> Callable[[], None]:
    """Lock a folder against other commands until the returned function is called.

    The system unlocks the folder if this process dies.

    Raises:
        FolderError: another command has locked it; the message begins with the `option`.
        OSError: the folder does not exist, or cannot be read.
    """
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise FolderError(f"{option}: {folder} is in use by another command") from None
    return partial(os.close, descriptor)


def contents(folder: Path) -> str | None:
    """Return what a folder contains, such as `RUN`; None if it contains no results."""
    for kind, patterns in _FILES.items():
        if any(any(folder.glob(p)) for p in patterns if p not in _COMMON):
            return kind
    return None


def _delete(folder: Path, kind: str) -> None:
    for pattern in _FILES[kind]:
        for file in folder.glob(pattern):
            file.unlink()
