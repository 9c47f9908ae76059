"""The configurations of RViz and Foxglove name what there really is."""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml_text
from recorded_run import TYPES
from rosbags.rosbag2 import Reader

from gameinfer_ros.scenario import Scenario
from msg_adapters import qos
from msg_adapters.joint_state import FRAME

CONFIG = Path(__file__).parents[2] / "config"
RVIZ = yaml_text.load((CONFIG / "gameinfer.rviz").read_text(encoding="utf-8"))
FOXGLOVE = json.loads((CONFIG / "foxglove.json").read_text(encoding="utf-8"))

#: Players start on a circle of this radius, in m.
RADIUS = 3.0


# --- RViz ----------------------------------------------------------------------------------------


def test_rviz_asks_for_markers_as_they_are_offered() -> None:
    manager = RVIZ["Visualization Manager"]
    (markers,) = [d for d in manager["Displays"] if d["Class"].endswith("/MarkerArray")]
    assert markers["Enabled"] and markers["Value"]
    assert markers["Topic"] == {
        "Value": "/markers",
        "Depth": qos.RECENT.depth,
        "History Policy": qos.RECENT.history.name.replace("_", " ").title(),
        "Reliability Policy": qos.RECENT.reliability.name.replace("_", " ").title(),
        "Durability Policy": qos.RECENT.durability.name.replace("_", " ").title(),
    }
    assert manager["Global Options"]["Fixed Frame"] == FRAME


def test_rviz_shows_all_of_the_circle_from_above() -> None:
    view, window = RVIZ["Visualization Manager"]["Views"]["Current"], RVIZ["Window Geometry"]
    assert view["Class"] == "rviz_default_plugins/TopDownOrtho"
    assert (view["X"], view["Y"], view["Angle"]) == (0, 0, 0)
    pixels = 2 * RADIUS * view["Scale"]
    assert 0.5 * window["Height"] < pixels < 0.8 * window["Height"]
    assert pixels < 0.8 * window["Width"]


def test_rviz_knows_all_classes() -> None:
    """Those that come with RViz2, as its own files name them."""
    found = set(re.findall(r"Class: (\w+/\w+)", (CONFIG / "gameinfer.rviz").read_text()))
    displays = {"Grid", "MarkerArray"}
    tools = {"MoveCamera", "Select", "FocusCamera", "Measure"}
    others = {"TF", "TopDownOrtho"}
    assert found == {
        *(f"rviz_common/{panel}" for panel in ("Displays", "Views", "Time")),
        *(f"rviz_default_plugins/{name}" for name in displays | tools | others),
    }


# --- Foxglove ------------------------------------------------------------------------------------


def leaves(layout: Any) -> Iterator[str]:
    """Panels of a layout, which is a panel or is split into two of its kind."""
    if isinstance(layout, str):
        yield layout
        return
    assert set(layout) == {"first", "second", "direction", "splitPercentage"}
    assert layout["direction"] in ("row", "column")
    assert 0 < layout["splitPercentage"] < 100
    yield from leaves(layout["first"])
    yield from leaves(layout["second"])


def message_paths() -> list[str]:
    return [path["value"] for c in FOXGLOVE["configById"].values() for path in c.get("paths", ())]


def topics() -> set[str]:
    panels = FOXGLOVE["configById"].values()
    return {
        *(re.match(r"[\w/]+", path).group() for path in message_paths()),
        *(topic for panel in panels for topic in panel.get("topics", ())),
        *(panel["topicToRender"] for panel in panels if "topicToRender" in panel),
    }


def values(message: Any, path: str) -> list[Any]:
    """What a message path, without its topic, finds in a message: fields, [:] and filters."""
    found = [message]
    steps = re.findall(r"\.(\w+)|(\[:\])|\{(\w+)==\"([^\"]*)\"\}", path)
    rebuilt = [
        f".{field}" if field else whole or f'{{{key}=="{wanted}"}}'
        for field, whole, key, wanted in steps
    ]
    assert "".join(rebuilt) == path, f"{path} is no message path"
    for field, whole, key, wanted in steps:
        if field:
            found = [getattr(item, field) for item in found]
        elif whole:
            found = [item for items in found for item in items]
        else:
            found = [item for item in found if getattr(item, key) == wanted]
    return found


def test_every_panel_has_a_place_and_every_place_a_panel() -> None:
    assert {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"} == set(
        FOXGLOVE
    )
    panels = list(leaves(FOXGLOVE["layout"]))
    assert sorted(panels) == sorted(FOXGLOVE["configById"])
    kinds = {panel.split("!")[0] for panel in panels}
    assert kinds == {"3D", "Plot", "StateTransitions", "DiagnosticSummary"}


def test_foxglove_shows_all_of_the_circle_from_above() -> None:
    (panel,) = [c for name, c in FOXGLOVE["configById"].items() if name.startswith("3D!")]
    camera = panel["cameraState"]
    assert panel["followTf"] == FRAME
    assert panel["topics"] == {"/markers": {"visible": True}}
    assert not camera["perspective"] and camera["phi"] == camera["thetaOffset"] == 0
    assert 1.2 * 2 * RADIUS < camera["distance"] < 2 * 2 * RADIUS  # the height that is seen


def test_the_robot_is_called_so_in_all_scenarios() -> None:
    """Foxglove plots the weights of the robot's particles."""
    for file in CONFIG.glob("*_player*.yaml"):
        assert Scenario.load(file).game.players.names[0] == "robot"


@pytest.fixture(scope="module")
def messages(run: Path) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = defaultdict(list)
    with Reader(run / "bag") as reader:
        for connection, _, data in reader.messages():
            found[connection.topic].append(TYPES.deserialize_cdr(data, connection.msgtype))
    return found


def test_every_topic_is_in_a_bag(messages: dict[str, list[Any]]) -> None:
    assert topics() == {"/markers", "/diagnostics"}
    assert topics() <= set(messages)


@pytest.mark.parametrize("path", message_paths())
def test_every_message_path_finds_numbers_in_a_bag(
    path: str, messages: dict[str, list[Any]]
) -> None:
    topic, fields = re.fullmatch(r"([\w/]+)(.*)", path).groups()
    found = [float(value) for message in messages[topic] for value in values(message, fields)]
    assert len(found) >= 6


def test_the_weights_that_are_plotted_are_those_of_all_particles(
    messages: dict[str, list[Any]],
) -> None:
    (path,) = [path for path in message_paths() if path.startswith("/markers")]
    for message, belief in zip(messages["/markers"], messages["/belief"], strict=False):
        table = belief.data[belief.layout.data_offset :].reshape(-1, belief.layout.dim[1].size)
        wanted = [max(0.05, weight) for weight in table[:, 1]]
        assert values(message, path.removeprefix("/markers")) == pytest.approx(wanted, rel=1e-6)
