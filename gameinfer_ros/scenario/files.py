"""Where scenario files are."""

from __future__ import annotations

from pathlib import Path

from gameinfer_ros.names.text import shorten

#: The file beside the scenarios that holds parameters of the nodes.
NODE_PARAMETERS = "nodes.yaml"


class ScenarioError(ValueError):
    """A scenario file cannot be used; the message names the file, the field and its value."""


def available() -> dict[str, Path]:
    """Scenarios that come with the package, by name.

    Raises:
        ScenarioError: the package is not installed as a whole.
    """
    files = sorted(folder().glob("*.yaml"))
    return {path.stem: path for path in files if path.name != NODE_PARAMETERS}


def find(name_or_file: str | Path) -> Path:
    """Path of the scenario with this name, or of this file.

    Raises:
        ScenarioError: there is neither.
    """
    path = Path(name_or_file)
    try:
        if path.is_file():
            return path
    except OSError:
        pass  # no file has so long a name
    named = available()
    if str(name_or_file) in named:
        return named[str(name_or_file)]
    raise ScenarioError(
        f"{shorten(str(name_or_file), 200)}: is neither a file nor one of the scenarios "
        f"{', '.join(named)}"
    )


def folder() -> Path:
    """The folder `config` of the package.

    Raises:
        ScenarioError: the package is not installed as a whole.
    """
    # In a source tree the folder stands beside the package; installed, it is in the share folder
    # of the prefix, which is one of the parents of the package.
    for parent in Path(__file__).resolve().parents:
        for config in (parent / "config", parent / "share/gameinfer_ros/config"):
            if (config / "three_player.yaml").is_file():
                return config
    raise ScenarioError("the scenarios of the package gameinfer_ros are not installed")
