"""What a shell may complete a word to. Called by argcomplete, which is not imported before."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gameinfer_ros.scenario import files as scenario_files

#: Words that the beginning of one may be completed to.
Completer = Callable[..., list[str]]


def complete(action: argparse.Action, completer: Completer) -> None:
    """Complete the values of an option by a completer."""
    action.completer = completer  # type: ignore[attr-defined]  # the name that argcomplete looks for


def scenarios(prefix: str, **context: Any) -> list[str]:
    """Names of scenarios, and YAML files with the folders on the way to them."""
    from argcomplete.completers import FilesCompleter

    names = [name for name in scenario_files.available() if name.startswith(prefix)]
    return [*names, *FilesCompleter(["yaml", "yml"])(prefix, **context)]


def folders(prefix: str, **context: Any) -> list[str]:
    """Folders."""
    from argcomplete.completers import DirectoriesCompleter

    return list(DirectoriesCompleter()(prefix, **context))


def bags(prefix: str, **context: Any) -> list[str]:
    """Bags, and folders on the way to them; a bag is not gone into, as it has no slash."""
    return [
        name.rstrip("/") if (Path(name) / "metadata.yaml").is_file() else name
        for name in folders(prefix, **context)
    ]
