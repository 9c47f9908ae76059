"""Labelled tables with a stamp: std_msgs/Float64MultiArray.

The message has no header. `layout.data_offset` numbers precede the table; the first two are the
seconds and nanoseconds of the stamp.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters.error import MessageError, check_equal, check_length
from msg_adapters.stamp import SECOND

if TYPE_CHECKING:
    from std_msgs.msg import Float64MultiArray


def largest(rows: int, columns: int) -> int:
    """Upper limit on the size of a message with a table of this size, in bytes."""
    return 1024 + 8 * rows * columns


def encode(
    time: int, prefix: Sequence[float], table: np.ndarray, labels: tuple[str, str]
) -> Float64MultiArray:
    """Convert a table (rows, columns) with labelled dimensions to a message.

    Args:
        time: stamp, in ns.
        prefix: numbers between the stamp and the table.
        table: the table.
        labels: labels of the two dimensions.
    """
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
    """Convert a message to its stamp in ns, prefix (prefix_length,) and table (rows, columns).

    Raises:
        MessageError: a label, a size or the length of the data does not match, there are no rows,
            or the stamp is invalid.
    """
    layout = message.layout
    check_length("layout.dim", layout.dim, 2)
    found = tuple(dimension.label for dimension in layout.dim)
    if found != labels:
        raise MessageError(f"layout.dim: labels {found} are not allowed: {labels} are expected")
    if not layout.dim[0].size:
        raise MessageError(
            f"layout.dim[0].size: 0 is not allowed: at least one {labels[0]} is expected"
        )
    check_equal("layout.dim[1].size", layout.dim[1].size, columns)
    check_equal("layout.data_offset", layout.data_offset, 2 + prefix_length)
    check_length("data", message.data, layout.data_offset + layout.dim[0].size * columns)
    numbers = np.array(message.data)
    seconds, nanoseconds = numbers[0], numbers[1]
    for field, number, limit in (("data[0]", seconds, 2**31), ("data[1]", nanoseconds, SECOND)):
        if not (0 <= number < limit and number == int(number)):
            raise MessageError(
                f"{field}: {number} is not allowed: the stamp must be a whole number "
                f"from 0 to {limit - 1}"
            )
    time = int(seconds) * SECOND + int(nanoseconds)
    table = numbers[layout.data_offset :].reshape(layout.dim[0].size, columns)
    return time, numbers[2 : layout.data_offset], table
