"""Bags that are spoiled somewhere."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from bad_values import spoiled
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from gameinfer_ros.bags import unfinished as unfinished_bag
from gameinfer_ros.bags.inspection import inspect
from gameinfer_ros.bags.label import SCENARIO_FILE, BagLabel
from gameinfer_ros.bags.run_bag import BagError, RunBag

#: What became of a recorder: it came to the end, was killed, or was killed at the very end.
FINISHED, CUT_OFF, MARKED = STATES = ("finished", "cut off", "closed, but still marked")


def write(
    folder: Path,
    scenario: Path,
    messages: dict[str, tuple[str, list[bytes]]],
    state: str = FINISHED,
    external: tuple[str, ...] = (),
) -> None:
    """A bag of a run, with the type and the serialized messages of each topic.

    Args:
        folder: where it goes.
        scenario: what was played.
        messages: of each topic, as they arrived at 10 Hz.
        state: one of `STATES`.
        external: external players.
    """
    types = get_typestore(Stores.ROS2_JAZZY)
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    topics = {topic if topic == "/diagnostics" else topic.strip("/"): topic for topic in messages}
    label = BagLabel(
        scenario.stem, "map", "lockstep", seed=1, topics=topics, external=list(external)
    ).encode()
    writer.open()
    for key, value in label.items():
        writer.set_custom_data(key, value)
    connections = {
        topic: writer.add_connection(topic, kind, typestore=types)
        for topic, (kind, _) in messages.items()
    }
    for k in range(max(len(every) for _, every in messages.values())):
        for topic, (_, every) in messages.items():
            if k < len(every):
                writer.write(connections[topic], 10**8 * k, every[k])
        if state != FINISHED:
            writer.storage.close_chunk()  # as if a second had passed
    if state == CUT_OFF:
        writer.abort()
    else:
        writer.close()
    if state != FINISHED:
        unfinished_bag.mark(folder, label)
    shutil.copy(scenario, folder / SCENARIO_FILE)


def spoil(bag: Path, into: Path, rng: np.random.Generator) -> None:
    """A copy of a bag of which one file is not what it was."""
    shutil.copytree(bag, into)
    files = sorted(file for file in into.iterdir())
    file = files[int(rng.integers(len(files)))]
    how = rng.random()
    if how < 0.05:
        file.unlink()
    elif how < 0.1:
        file.write_bytes(b"")
    elif how < 0.3:
        data = file.read_bytes()
        file.write_bytes(data[: int(rng.integers(len(data)))])
    else:
        file.write_bytes(spoiled(file.read_bytes(), rng))


def outcome(bag: Path) -> str:
    """`accepted` or `rejected`: what became of a bag.

    Raises:
        Exception: it was neither.
    """
    try:
        found = RunBag(bag)
        inspect(found)
        for topic in ("joint_state", "belief"):
            found.serialized(topic)
    except BagError as error:
        assert str(error).startswith(f"{bag}: ") and len(str(error)) < 30_000
        return "rejected"
    return "accepted"
