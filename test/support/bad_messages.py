"""Messages that are wrong somewhere; places are read off their types."""

from __future__ import annotations

import copy
import re
from array import array
from importlib import import_module
from typing import Any

import numpy as np
from bad_values import spoiled
from rclpy.serialization import serialize_message

NUMBERS = (0.0, -1.0, 1e-308, 1e12, 1e13, 1e308, -1e308, float("nan"), float("inf"), -float("inf"))
WHOLE = (0, 1, -1, 99, 12345, 2**31 - 1, -(2**31), 2**32 - 1, 2**63 - 1)
STRINGS = ("", "map", "odom", "robot", "nobody", "a\nb\x1b[31m", "zoé 💥", "x" * 1000, "y" * 2**20)
BITS = {"int8": 8, "int16": 16, "int32": 32, "int64": 64}
#: Fields that steps come from; a stamp that happens to be a good one would be no bad message.
STAMPS = ("stamp", "sec", "nanosec")


def mutated(message: Any, rng: np.random.Generator, keep_stamp: bool = False) -> bytes:
    """The message, serialized, with something in it that was not there."""
    if rng.random() < 0.2:
        return garbled(message, rng)
    message = copy.deepcopy(message)
    spoil(message, rng, keep_stamp)
    return bytes(serialize_message(message))


def spoil(message: Any, rng: np.random.Generator, keep_stamp: bool = False) -> None:
    """Put something into a message that was not there."""
    for _ in range(int(rng.choice([1, 1, 3]))):
        _mutate(message, rng, keep_stamp)


def garbled(message: Any, rng: np.random.Generator) -> bytes:
    """Bytes that are not, or hardly, those of the message."""
    data = bytes(serialize_message(message))
    if rng.random() < 0.5:
        return data[:4] + rng.bytes(int(rng.integers(0, 200)))
    return data[:4] + spoiled(data[4:], rng)


def cut_off(message: Any) -> bytes:
    """Bytes that cannot be read, whatever the message."""
    return bytes(serialize_message(message))[:4] + b"\xff"


def _mutate(message: Any, rng: np.random.Generator, keep_stamp: bool) -> None:
    fields = message.get_fields_and_field_types()
    names = [name for name in fields if not (keep_stamp and name in STAMPS)]
    if not names:
        return
    name = names[int(rng.integers(len(names)))]
    kind, value = fields[name], getattr(message, name)
    if "/" in kind and not kind.startswith("sequence"):
        _mutate(value, rng, keep_stamp)
    elif kind.startswith("sequence"):
        _mutate_items(message, name, kind[9:-1], rng, keep_stamp)
    elif match := re.fullmatch(r"(\w+)\[(\d+)\]", kind):
        value[int(rng.integers(int(match[2])))] = bad_value(match[1], rng)
    else:
        setattr(message, name, bad_value(kind, rng))


def _mutate_items(
    message: Any, name: str, kind: str, rng: np.random.Generator, keep_stamp: bool
) -> None:
    items = list(getattr(message, name))
    how = int(rng.integers(6))
    if how == 0:
        items.clear()
    elif how == 1 and items:
        items.pop()
    elif how == 2:
        items = items or [_made(kind, rng)]
        heavy = len(str(items)) > 100_000  # with a long string in it
        many = 500 if "/" in kind else 5000
        items *= int(rng.choice([2, 2, 50, 2 if heavy else many]))
    elif items:
        at = int(rng.integers(len(items)))
        if "/" in kind:
            _mutate(items[at], rng, keep_stamp)
        else:
            items[at] = bad_value(kind, rng)
    else:
        items.append(_made(kind, rng))
    setattr(message, name, array("d", items) if kind == "double" else items)


def _made(kind: str, rng: np.random.Generator) -> Any:
    if "/" not in kind:
        return bad_value(kind, rng)
    package, name = kind.split("/")
    return getattr(import_module(f"{package}.msg"), name)()


def bad_value(kind: str, rng: np.random.Generator) -> Any:
    """A value of a type that ROS calls so."""
    if kind in ("double", "float"):
        value = NUMBERS[int(rng.integers(len(NUMBERS)))]
        return float(np.float32(value)) if kind == "float" and abs(value) < 1e38 else value
    if kind.startswith("string"):
        return STRINGS[int(rng.integers(len(STRINGS)))]
    if kind == "boolean":
        return bool(rng.integers(2))
    if kind in ("octet", "byte", "char"):
        return bytes([int(rng.integers(256))]) if kind != "char" else int(rng.integers(256))
    bits, value = BITS[kind.removeprefix("u")], WHOLE[int(rng.integers(len(WHOLE)))]
    if kind.startswith("u"):
        return abs(value) % 2**bits
    return (value + 2 ** (bits - 1)) % 2**bits - 2 ** (bits - 1)
