"""The rooms of the package: imports only point down, without circles, and nothing lies loose."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "gameinfer_ros"

#: From the top floor down: a room imports from rooms that stand behind it, and from itself.
ROOMS = (
    "__main__", "commands", "orchestration", "experiments", "nodes", "bags", "runs", "view",
    "scenario", "msg_adapters", "planning", "inference", "solver", "games", "lanes", "system",
    "names",
)  # fmt: skip

#: Rooms that work without ROS.
ROS_FREE = (
    "commands", "experiments", "bags", "runs", "view", "scenario", "planning", "inference",
    "solver", "games", "lanes", "system", "names",
)  # fmt: skip

FILES = sorted([*PACKAGE.rglob("*.py"), *(ROOT / "msg_adapters").glob("*.py")])
MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in FILES
}


def imports(path: Path) -> Iterator[str]:
    """Names of all modules that a file imports, also within functions and for types only."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                submodule = f"{node.module}.{alias.name}"
                yield submodule if submodule in MODULES else node.module


def room(module: str) -> str | None:
    top, _, rest = module.partition(".")
    if top == "gameinfer_ros":
        return rest.partition(".")[0] or None
    return top if top == "msg_adapters" else None


def arrows() -> Iterator[tuple[str, str]]:
    for module, path in MODULES.items():
        yield from ((module, imported) for imported in imports(path) if imported in MODULES)


def test_every_folder_is_a_room_and_no_module_lies_loose() -> None:
    loose = {path.name for path in PACKAGE.glob("*.py")}
    folders = {path.name for path in PACKAGE.iterdir() if any(path.rglob("*.py"))}
    assert loose == {"__init__.py", "__main__.py"}
    assert folders == set(ROOMS) - {"__main__", "msg_adapters"}


def test_contributors_find_all_rooms_from_the_top_floor_down() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = re.findall(r"^\| `(\w+)` \| .* \| (yes)? ?\|$", text, re.MULTILINE)
    assert [name for name, _ in table] == [name for name in ROOMS if name != "__main__"]
    assert {name for name, ros in table if not ros} == set(ROS_FREE)


def test_rooms_import_only_from_rooms_below() -> None:
    found = list(arrows())
    assert len(found) > 500
    upwards = [
        f"{module} imports {imported}"
        for module, imported in found
        if (here := room(module)) and (there := room(imported))
        if ROOMS.index(there) < ROOMS.index(here)
    ]
    assert not upwards, "\n".join(upwards)


def test_no_modules_import_one_another_in_a_circle() -> None:
    graph: dict[str, set[str]] = {module: set() for module in MODULES}
    for module, imported in arrows():
        graph[module].add(imported)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))


@pytest.mark.parametrize("name", ROS_FREE)
def test_a_room_without_ros_imports_neither_rclpy_nor_messages(name: str) -> None:
    ros = [
        f"{module} imports {imported}"
        for module, path in MODULES.items()
        if room(module) == name
        for imported in imports(path)
        if imported.partition(".")[0] in ("rclpy", "rosgraph_msgs", "builtin_interfaces")
        or imported.partition(".")[0].endswith("_msgs")
    ]
    assert not ros
