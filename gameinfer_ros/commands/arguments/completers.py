"""Completers of arguments for the shell; argcomplete calls them, and is imported only then."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gameinfer_ros.scenario import files as scenario_files

#: Returns the words that begin with a prefix.
Completer = Callable[..., list[str]]


def complete(action: argparse.Action, completer: Completer) -> None:
    """Set the completer of an option's values."""
    action.completer = completer  # type: ignore[attr-defined]  # the name that argcomplete looks for


def scenarios(prefix: str, **context: Any) -> list[str]:
    """Complete names of scenarios, YAML files, and folders."""
    from argcomplete.completers import FilesCompleter

    known = (*scenario_files.available(), *scenario_files.suite())
    names = [name for name in known if name.startswith(prefix)]
    return [*names, *FilesCompleter(["yaml", "yml"])(prefix, **context)]


def folders(prefix: str, **context: Any) -> list[str]:
    """Complete folders."""
    from argcomplete.completers import DirectoriesCompleter

    return list(DirectoriesCompleter()(prefix, **context))


def bags(prefix: str, **context: Any) -> list[str]:
    """Complete bags and folders; a bag gets no slash, so that its contents are not completed."""
    return [
        name.rstrip("/") if (Path(name) / "metadata.yaml").is_file() else name
        for name in folders(prefix, **context)
    ]
