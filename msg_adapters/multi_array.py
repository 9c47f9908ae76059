"""Labelled tables with a stamp: std_msgs/Float64MultiArray.

The array has no header. Numbers that precede the table, counted by `layout.data_offset`, begin
with the seconds and the nanoseconds of the stamp.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters.error import MessageError, check_length
from msg_adapters.stamp import SECOND

if TYPE_CHECKING:
    from std_msgs.msg import Float64MultiArray


def largest(rows: int, columns: int) -> int:
    """A message with so large a table, and a stamp before it, has at most so many bytes."""
    return 1024 + 8 * rows * columns


def encode(
    time: int, prefix: Sequence[float], table: np.ndarray, labels: tuple[str, str]
) -> Float64MultiArray:
    """Message with a stamp in ns, the numbers of `prefix`, and a `table` (rows, columns)."""
    from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

    rows, columns = table.shape
    layout = MultiArrayLayout(
        dim=[
            MultiArrayDimension(label=labels[0], size=rows, stride=rows * columns),
            MultiArrayDimension(label=labels[1], size=columns, stride=columns),
        ],
        data_offset=2 + len(prefix),
    )
    numbers = np.concatenate([divmod(time, SECOND), prefix, table.ravel()])
    return Float64MultiArray(layout=layout, data=array("d", numbers.astype(float).tobytes()))


def decode(
    message: Float64MultiArray, prefix_length: int, labels: tuple[str, str], columns: int
) -> tuple[int, np.ndarray, np.ndarray]:
    """Stamp in ns, prefix (prefix_length,) and table (rows, columns) of a message.

    Raises:
        MessageError: labels, sizes or the number of numbers are not as expected, there is no row,
            or the stamp is none.
    """
    layout = message.layout
    check_length("layout.dim", layout.dim, 2)
    found = tuple(dimension.label for dimension in layout.dim)
    if found != labels:
        raise MessageError(f"layout.dim: labels {found} are not allowed: {labels} are expected")
    if not layout.dim[0].size:
        raise MessageError(f"layout.dim[0].size: 0 is not allowed: there must be a {labels[0]}")
    if layout.dim[1].size != columns:
        raise MessageError(
            f"layout.dim[1].size: {layout.dim[1].size} is not allowed: {columns} is expected"
        )
    if layout.data_offset != 2 + prefix_length:
        raise MessageError(
            f"layout.data_offset: {layout.data_offset} is not allowed: "
            f"{2 + prefix_length} is expected"
        )
    check_length("data", message.data, layout.data_offset + layout.dim[0].size * columns)
    numbers = np.array(message.data)
    seconds, nanoseconds = numbers[0], numbers[1]
    for field, number, limit in (("data[0]", seconds, 2**31), ("data[1]", nanoseconds, SECOND)):
        if not (0 <= number < limit and number == int(number)):
            raise MessageError(
                f"{field}: {number} is not allowed: it must be a whole number of the stamp, "
                f"from 0 to {limit - 1}"
            )
    time = int(seconds) * SECOND + int(nanoseconds)
    table = numbers[layout.data_offset :].reshape(layout.dim[0].size, columns)
    return time, numbers[2 : layout.data_offset], table
