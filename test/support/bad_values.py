"""Values that no user writes on purpose."""

from __future__ import annotations

import datetime
from typing import Any

import numpy as np


def deep(levels: int) -> list[Any]:
    value: list[Any] = []
    for _ in range(levels):
        value = [value]
    return value


VALUES: tuple[Any, ...] = (
    None, True, False,
    0, -1, 1, 3, 10**9, 10**18, 2**63, 10**30, -(10**30), 10**400,
    0.0, -0.0, -1.0, 0.5, 1e9, 1e12, 1e13, 1e154, 1e308, -1e308, 5e-324, 1e-300,
    float("nan"), float("inf"), float("-inf"),
    "", " ", "x", "robot", "goal", "cosine", "1.0", "nan", "a" * 10_000, "a\nb", "\x1b[31m",
    "zoé 💥 \u202e\u0000", b"\xff\xfe", datetime.date(2026, 1, 1),
    [], [[]], [None], [0.0] * 4, [1e308] * 4, [-1.0] * 4, [float("nan")] * 2, ["x"] * 4,
    [0.0] * 1000, deep(30), [[1e308, 0.0], [-1e308, 0.0]], [[0.0, 0.0], [5e-324, 0.0]],
    {}, {"kind": "goal"}, {"kind": "unicycle"}, {"kind": None}, {"kind": ["x"]}, {"x": {}},
    {1: 2}, {None: None}, {"": 0.0}, {"robot": None},
)  # fmt: skip

#: What YAML can be besides a scenario.
TEXTS: tuple[bytes, ...] = (
    b"", b"\x00", b"\xff\xfe\x00\x00", b"- 1", b"just text", b"&a [*a]", b"a: &a {b: *a}",
    b"*nobody", b"!!python/object/apply:os.system ['true']", b"!!python/name:os.system", b"!x y",
    b"dt: !!int ''", b"dt: !!float x", b"dt: !!bool maybe", b"dt: !!timestamp x", b"dt: !!null x",
    b"dt: !!binary '\xc3\xa9'", b"dt: !!set [1]", b"dt: !!omap x", b"dt: !!pairs x", b"? [a]\n: b",
    b"? {a: b}\n: c", b"dt: 2026-99-99", b"dt: " + b"9" * 5000, b"dt: 0x" + b"f" * 5000,
    b"dt: 1:99:99:99", b"%YAML 9.9\n---\ndt: 1", b"dt: 1\n---\ndt: 2", b"dt: \t1", b"{" * 3000,
    b"[" * 100_000, b"a: " * 3000, b"- " * 3000, b"'" + b"x" * 2**18 + b"'", b"x" * (2**18 + 1),
    b"a: &a [" + b"x," * 1000 + b"]\n" + b"".join(b"b%d: *a\n" % i for i in range(2000)),
    b"a0: &a0 [x,x,x,x,x,x,x,x,x]\n" + b"".join(
        b"a%d: &a%d [%s]\n" % (i, i, b",".join([b"*a%d" % (i - 1)] * 9)) for i in range(1, 40)
    ),
    b"a: &a {x: y}\nb:\n  <<: *a\n", b"\n".join(b"k%d: 1" % i for i in range(20_000)),
)  # fmt: skip


def spoiled(data: bytes, rng: np.random.Generator) -> bytes:
    """The bytes with some of them changed, left out, doubled or cut off."""
    spoiled = bytearray(data)
    for _ in range(int(rng.integers(1, 6))):
        if not spoiled:
            break
        at = int(rng.integers(len(spoiled)))
        end = at + int(rng.integers(1, 40))
        how = int(rng.integers(5))
        if how == 0:
            spoiled[at] = int(rng.integers(256))
        elif how == 1:
            del spoiled[at:end]
        elif how == 2:
            spoiled[at:at] = spoiled[at:end]
        elif how == 3:
            spoiled[at:end] = rng.bytes(end - at)
        elif rng.random() < 0.2:
            del spoiled[at:]
    return bytes(spoiled)
