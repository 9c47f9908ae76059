"""Bags that are spoiled somewhere."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from bad_values import spoiled
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from gameinfer_ros.bag_label import SCENARIO_FILE, BagLabel
from gameinfer_ros.inspection import inspect
from gameinfer_ros.run_bag import BagError, RunBag


def write(folder: Path, scenario: Path, messages: dict[str, tuple[str, list[bytes]]]) -> None:
    """A bag of a run, with the type and the serialized messages of each topic."""
    types = get_typestore(Stores.ROS2_JAZZY)
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    topics = {topic.strip("/"): topic for topic in messages}
    label = BagLabel(scenario.stem, "map", "lockstep", seed=1, topics=topics)
    with writer:
        for key, value in label.encode().items():
            writer.set_custom_data(key, value)
        for topic, (kind, every) in messages.items():
            connection = writer.add_connection(topic, kind, typestore=types)
            for k, data in enumerate(every):
                writer.write(connection, 10**8 * k, data)
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
        inspect(RunBag(bag))
    except BagError as error:
        assert str(error).startswith(f"{bag}: ") and len(str(error)) < 30_000
        return "rejected"
    return "accepted"
