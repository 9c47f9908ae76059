"""A bag whose recording was cut off, as by kill -9 or a full disk."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from mcap.reader import NonSeekingReader

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
    for path in folder.glob("*.mcap"):
        with path.open("rb") as file:
            # No record is longer than the file, so no more than that is made room for.
            reader = NonSeekingReader(file, record_size_limit=path.stat().st_size)
            try:
                for schema, channel, message in reader.iter_messages(log_time_order=False):
                    assert schema is not None
                    yield BagMessage(channel.topic, schema.name, message.log_time, message.data)
            except OSError:
                raise
            except Exception:  # whatever is made of half a record: here the bag breaks off
                return
