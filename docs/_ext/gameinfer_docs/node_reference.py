"""The reference of all nodes, in Markdown, generated from their docstrings and interfaces."""

from __future__ import annotations

import inspect
import re
import tempfile
from collections.abc import Mapping
from itertools import takewhile
from pathlib import Path
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile

from gameinfer_docs.markdown import code, table
from gameinfer_docs.node_interface import NodeInterface, interface_of, private_context
from gameinfer_ros.bags.label import BagLabel
from gameinfer_ros.nodes.bag_recorder import BagRecorder
from gameinfer_ros.nodes.recorder import Recorder
from gameinfer_ros.nodes.table import NODES, class_of
from gameinfer_ros.scenario import find
from msg_adapters import qos

#: Nodes in the process of the orchestrator.
IN_THE_ORCHESTRATOR: tuple[type[Node], ...] = (Recorder, BagRecorder)

#: The header of a section of a docstring, and an entry such as `name (type, more): note`.
SECTION = re.compile(r"^(Subscribers|Publishers|Services|Clients|Args|Attributes|Raises)\b")
ENTRY = re.compile(r"^(\S+) \(([^)]*)\)(?:: (.*))?$")


def nodes() -> str:
    """Generate a table of the nodes with executables, and a section for each executable."""
    overview = [[f"[`{name}`](#{name})", purpose.rstrip(".")] for name, purpose in NODES.items()]
    parts = [table(("node", "purpose"), overview)]
    with private_context() as context:
        for name in NODES:
            parts += [f"## {name}\n", _node(class_of(name), context)]
        parts.append("## orchestrator\n")
        for cls in IN_THE_ORCHESTRATOR:
            parts += [f"### The node {_default_name(cls)}\n", _node(cls, context)]
    return "\n".join(parts)


def quality_of_service() -> str:
    """Generate a table of all QoS profiles."""
    rows = [
        [
            code(name),
            profile.reliability.name.lower().replace("_", " "),
            profile.durability.name.lower().replace("_", " "),
            str(profile.depth),
        ]
        for name, profile in vars(qos).items()
        if isinstance(profile, QoSProfile)
    ]
    return table(("profile", "reliability", "durability", "depth"), rows)


def interface(node_class: type[Node], context: rclpy.Context) -> NodeInterface:
    """Read the interface of a class of nodes; a bag recorder gets a temporary folder."""
    if node_class is not BagRecorder:
        return interface_of(node_class, context)
    with tempfile.TemporaryDirectory() as folder:
        options: Mapping[str, Any] = {
            "folder": Path(folder) / "bag",
            "scenario_file": find("three_player"),
            "label": BagLabel("three_player", "map", "lockstep", 0, 0),
        }
        return interface_of(node_class, context, options)


def notes(node_class: type[Node]) -> dict[str, str]:
    """Return the notes of a class and its bases on each topic and service, by name."""
    found: dict[str, str] = {}
    for cls in node_class.__mro__:
        section = ""
        for line in re.split(r"\n(?!        )", inspect.getdoc(cls) or ""):
            if not line.startswith(" "):
                section = line
            entry = ENTRY.match(" ".join(line.split()))
            if entry and not section.startswith(("Args", "Attributes", "Raises")):
                found.setdefault(entry[1], entry[3] or "")
    return found


def prose(node_class: type[Node]) -> str:
    """Return the paragraphs of a docstring before its sections."""
    paragraphs = (inspect.getdoc(node_class) or "").split("\n\n")
    return "\n\n".join(takewhile(lambda paragraph: not SECTION.match(paragraph), paragraphs)) + "\n"


def _node(node_class: type[Node], context: rclpy.Context) -> str:
    found, said = interface(node_class, context), notes(node_class)
    parameters = table(
        ("parameter", "type", "default", "allowed", "set", "meaning"),
        [
            [
                code(p.name),
                p.kind,
                code(p.default),
                p.allowed,
                "at start" if p.read_only else "any time",
                p.description,
            ]
            for p in found.parameters
        ],
    )
    endpoints = table(
        ("", "name", "type", "QoS", "notes"),
        [
            [
                e.role,
                code(e.name),
                code(e.type),
                e.profile if " " in e.profile else code(e.profile),
                e.condition or said.get(e.name, "").rstrip("."),
            ]
            for e in found.endpoints
        ],
    )
    return "\n".join(
        [
            prose(node_class),
            parameters if found.parameters else "This node has no parameters of its own.\n",
            endpoints if found.endpoints else "This node has no topics of its own.\n",
        ]
    )


def _default_name(node_class: type[Node]) -> str:
    return code(inspect.signature(node_class).parameters["name"].default)
