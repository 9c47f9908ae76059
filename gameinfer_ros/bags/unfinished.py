"""A bag whose recording was cut off, as by kill -9 or a full disk."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader

#: File beside the messages while they are recorded: what the bag will say of its run.
MARK = "unfinished.json"


class BagMessage(NamedTuple):
    """A recorded message.

    Attributes:
        topic: name of its topic.
        message_type: name of its type.
        time: when it arrived, in ns.
        data: the message as it was on the wire.
    """

    topic: str
    message_type: str
    time: int
    data: bytes


def mark(folder: Path, custom_data: Mapping[str, str]) -> None:
    """Say of a bag that it is being recorded, and what will stand in its `metadata.yaml`."""
    (folder / MARK).write_text(json.dumps(custom_data) + "\n")


def unmark(folder: Path) -> None:
    """Say of a bag that it is whole."""
    (folder / MARK).unlink()


def is_unfinished(folder: Path) -> bool:
    """Whether a bag is being recorded, or was until it was cut off."""
    return (folder / MARK).exists()


def custom_data(folder: Path) -> dict[str, str]:
    """What would stand in the `metadata.yaml` of an unfinished bag.

    Raises:
        OSError: it cannot be read.
        ValueError: it was cut off before it was written.
    """
    found: dict[str, str] = json.loads((folder / MARK).read_text())
    return found


def messages(folder: Path) -> Iterator[BagMessage]:
    """All messages of an unfinished bag up to where it breaks off, as they arrived.

    Raises:
        OSError: it cannot be read.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    for path in folder.glob("*.mcap"):
        with path.open("rb") as file:
            try:
                # No record is longer than the file, so no more than that is made room for.
                reader = StreamReader(file, record_size_limit=path.stat().st_size)
                for record in reader.records:
                    if isinstance(record, Schema):
                        schemas[record.id] = record
                    elif isinstance(record, Channel):
                        channels[record.id] = record
                    elif isinstance(record, Message):
                        channel = channels[record.channel_id]
                        name = schemas[channel.schema_id].name
                        yield BagMessage(channel.topic, name, record.log_time, record.data)
            except OSError:
                raise
            except Exception:  # whatever is made of half a record: here the bag breaks off
                return
