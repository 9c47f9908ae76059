"""Bags whose recording is running or was cut off, for example by kill -9 or a full disk."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from mcap.reader import NonSeekingReader

#: Name of the file that marks an unfinished bag. It contains the custom data of the bag.
MARK = "unfinished.json"


class BagMessage(NamedTuple):
    """A recorded, serialized message, with its time of arrival in ns."""

    topic: str
    message_type: str
    time: int
    data: bytes


def mark(folder: Path, custom_data: Mapping[str, str]) -> None:
    """Mark a bag as unfinished, and store the custom data for its `metadata.yaml`."""
    (folder / MARK).write_text(json.dumps(custom_data) + "\n")


def unmark(folder: Path) -> None:
    """Mark a bag as finished."""
    (folder / MARK).unlink()


def is_unfinished(folder: Path) -> bool:
    """Whether the recording of a bag is running or was cut off."""
    return (folder / MARK).exists()


def custom_data(folder: Path) -> dict[str, str]:
    """Custom data of an unfinished bag; raises `OSError` or `ValueError`."""
    found: dict[str, str] = json.loads((folder / MARK).read_text())
    return found


def messages(folder: Path) -> Iterator[BagMessage]:
    """Messages of an unfinished bag up to its first invalid data, in order of arrival."""
    for path in folder.glob("*.mcap"):
        with path.open("rb") as file:
            # No record is longer than the file. The limit bounds the memory.
            reader = NonSeekingReader(file, record_size_limit=path.stat().st_size)
            try:
                for schema, channel, message in reader.iter_messages(log_time_order=False):
                    assert schema is not None
                    yield BagMessage(channel.topic, schema.name, message.log_time, message.data)
            except OSError:
                raise
            except Exception:  # an incomplete record can raise anything
                return
