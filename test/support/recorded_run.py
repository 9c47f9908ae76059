"""A run of two players that is recorded, and copies of its bag that are changed."""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from passing import write_scenario
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from run_command import Command

from gameinfer_ros.bags.label import BagLabel

STEPS = 12
TYPES = get_typestore(Stores.ROS2_JAZZY)


def play(folder: Path) -> None:
    """Play it with other options than the defaults: results in a folder, its bag in `bag`."""
    command = Command(
        folder,
        *("--scenario", write_scenario(folder), "--time", "lockstep", "--seed", 5),
        *("--steps", STEPS, "--particles", 5, "--json", "--out", folder),
        *("--record", folder / "bag", "--animation", folder / "run.gif"),
        *("--ros-args", "-p", "publish_clock:=true"),
        from_scratch=True,
    )
    try:
        assert command.exit_code() == 0, command.stdout + command.stderr
        assert "lost" not in command.stderr
        for name in ("bag", "run.gif"):
            assert str(folder / name) in command.stderr
    finally:
        command.end()


def write_copy(
    bag: Path,
    target: Path,
    change: Callable[[str, int, Any], Any] = lambda topic, k, message: message,
    **label: Any,
) -> None:
    """Write a bag again, with some messages changed or left out, and with another label.

    Args:
        bag: the one that is copied.
        target: where to.
        change: gives what is written for the message k, from 0 on, of a topic; None if nothing is.
        label: fields of the label that change.
    """
    seen = Counter[str]()
    with Reader(bag) as reader:
        writer = Writer(target, version=9, storage_plugin=StoragePlugin.MCAP)
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        with writer:
            custom = reader.storage.metadata.custom or {}
            for key, value in replace(BagLabel.decode(custom), **label).encode().items():
                writer.set_custom_data(key, value)
            connections = {
                c.topic: writer.add_connection(c.topic, c.msgtype, typestore=TYPES)
                for c in reader.connections
            }
            for c, time, data in reader.messages():
                message = TYPES.deserialize_cdr(data, c.msgtype)
                message = change(c.topic, seen[c.topic], message)
                seen[c.topic] += 1
                if message is not None:
                    data = TYPES.serialize_cdr(message, c.msgtype)
                    writer.write(connections[c.topic], time, data)
    shutil.copy(bag / "scenario.yaml", target)
