"""The locations of scenario files."""

from pathlib import Path

from gameinfer_ros.names.text import shorten

#: File in the folder of the scenarios that contains parameters of the nodes.
NODE_PARAMETERS = "nodes.yaml"


class ScenarioError(ValueError):
    """A scenario is missing or invalid; the message names the file, the field and its value."""


def available() -> dict[str, Path]:
    """Return the scenarios of the package, by name; raises `ScenarioError` if there are none."""
    files = sorted(folder().glob("*.yaml"))
    return {path.stem: path for path in files if path.name != NODE_PARAMETERS}


def suite() -> dict[str, Path]:
    """Return the standard games of the package, by name; `available` does not contain them."""
    return {path.stem: path for path in sorted((folder() / "suite").glob("*.yaml"))}


def find(name_or_file: str | Path) -> Path:
    """Find a scenario by the path of its file or by its name in the package or its suite.

    Raises:
        ScenarioError: there is no such file or scenario.
    """
    path = Path(name_or_file)
    try:
        if path.is_file():
            return path
    except OSError:
        pass  # the name is too long for a file
    named, games = available(), suite()
    if str(name_or_file) in (known := {**games, **named}):
        return known[str(name_or_file)]
    raise ScenarioError(
        f"{shorten(str(name_or_file), 200)}: is neither a file nor one of the scenarios "
        f"{', '.join(named)} or of the games of the suite {', '.join(games)}"
    )


def folder() -> Path:
    """Find the folder `config` of the package; raises `ScenarioError` if it is not installed."""
    # In a source tree, the folder is next to the package. Installed, it is in the share folder of
    # the prefix, which is one of the parents of the package.
    for parent in Path(__file__).resolve().parents:
        for config in (parent / "config", parent / "share/gameinfer_ros/config"):
            if (config / "three_player.yaml").is_file():
                return config
    raise ScenarioError("the scenarios of the package gameinfer_ros are not installed")
