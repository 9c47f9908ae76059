"""Markers for RViz and Foxglove: visualization_msgs/MarkerArray in the frame `map`."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import planar, stamp
from msg_adapters.error import MessageError, check_finite, check_frame
from msg_adapters.joint_state import FRAME

if TYPE_CHECKING:
    from geometry_msgs.msg import Point
    from visualization_msgs.msg import Marker, MarkerArray

Colour = tuple[float, float, float, float]


@dataclass(frozen=True)
class Path:
    """A line.

    Namespace and number identify a shape.

    Attributes:
        namespace: namespace of the marker.
        number: id of the marker in its namespace.
        points: positions (S, 2), in m.
        colour: red, green, blue and opacity, from 0 to 1.
        width: width of the line, in m.
    """

    namespace: str
    number: int
    points: np.ndarray
    colour: Colour
    width: float


@dataclass(frozen=True)
class Dots:
    """A set of dots.

    Attributes:
        namespace: as in `Path`.
        number: as in `Path`.
        points: positions (S, 2), in m.
        colour: as in `Path`.
        diameter: diameter of each dot, in m.
    """

    namespace: str
    number: int
    points: np.ndarray
    colour: Colour
    diameter: float


@dataclass(frozen=True)
class Arrow:
    """An arrow along the heading of a player.

    Attributes:
        namespace: as in `Path`.
        number: as in `Path`.
        pose: x, y, yaw (3,), in m and rad.
        colour: as in `Path`.
        length: length of the arrow, in m.
    """

    namespace: str
    number: int
    pose: np.ndarray
    colour: Colour
    length: float


@dataclass(frozen=True)
class Text:
    """Text that always faces the viewer.

    Attributes:
        namespace: as in `Path`.
        number: as in `Path`.
        position: position of its centre (2,), in m.
        text: the text.
        colour: as in `Path`.
        height: height of a capital letter, in m.
    """

    namespace: str
    number: int
    position: np.ndarray
    text: str
    colour: Colour
    height: float


Shape = Path | Dots | Arrow | Text

#: Types of markers, as in visualization_msgs/Marker.
ARROW, LINE_STRIP, SPHERE_LIST, TEXT_VIEW_FACING = 0, 4, 7, 9
_TYPES = {Path: LINE_STRIP, Dots: SPHERE_LIST, Arrow: ARROW, Text: TEXT_VIEW_FACING}

#: Actions of markers, as in visualization_msgs/Marker.
ADD, DELETEALL = 0, 3


def encode(shapes: Sequence[Shape], now: int) -> MarkerArray:
    """Convert shapes to a message, stamped with `now` in ns, that replaces all earlier markers."""
    from geometry_msgs.msg import Vector3
    from std_msgs.msg import ColorRGBA, Header
    from visualization_msgs.msg import Marker, MarkerArray

    header = Header(stamp=stamp.encode(now), frame_id=FRAME)
    # Copying a marker takes a fifth of the time of creating one, because its parts are shared.
    blank = Marker(header=header, action=ADD, pose=planar.pose(np.zeros(3)))
    markers = [Marker(header=header, action=DELETEALL)]
    for shape in shapes:
        marker = copy(blank)
        marker.ns, marker.id, marker.type = shape.namespace, shape.number, _TYPES[type(shape)]
        red, green, blue, opacity = map(float, shape.colour)
        marker.color = ColorRGBA(r=red, g=green, b=blue, a=opacity)
        if isinstance(shape, Path):
            marker.scale = Vector3(x=shape.width)
            marker.points = _points(shape.points)
        elif isinstance(shape, Dots):
            marker.scale = Vector3(x=shape.diameter, y=shape.diameter, z=shape.diameter)
            marker.points = _points(shape.points)
        elif isinstance(shape, Arrow):
            marker.pose = planar.pose(shape.pose)
            marker.scale = Vector3(x=shape.length, y=shape.length / 4, z=shape.length / 4)
        else:
            marker.pose = planar.pose(np.array([*shape.position, 0.0]))
            marker.scale = Vector3(z=shape.height)
            marker.text = shape.text
        markers.append(marker)
    return MarkerArray(markers=markers)


def _points(positions: np.ndarray) -> list[Point]:
    from geometry_msgs.msg import Point

    return [Point(x=x, y=y) for x, y in positions.tolist()]


def decode(message: MarkerArray) -> list[Shape]:
    """Convert a message to shapes.

    Raises:
        MessageError: the type or action of a marker is not supported, its frame is not `map`, a
            rotation is invalid, or a number is not finite.
    """
    shapes: list[Shape] = []
    for i, marker in enumerate(message.markers):
        check_frame(marker.header.frame_id, FRAME)
        if marker.action == DELETEALL:
            shapes.clear()
        elif marker.action == ADD:
            shapes.append(_shape(f"markers[{i}]", marker))
        else:
            raise MessageError(
                f"markers[{i}].action: {marker.action} is not allowed: it must be {ADD} to "
                f"add or {DELETEALL} to delete all"
            )
    return shapes


def _shape(field: str, marker: Marker) -> Shape:
    scale, c = marker.scale, marker.color
    colour = (c.r, c.g, c.b, c.a)
    check_finite(f"{field}.color", np.array(colour))
    check_finite(f"{field}.scale", np.array([scale.x, scale.y, scale.z]))
    pose = planar.from_pose(f"{field}.pose", marker.pose)
    check_finite(f"{field}.pose", pose)
    points = np.array([[p.x, p.y] for p in marker.points]).reshape(-1, 2)
    check_finite(f"{field}.points", points)
    if marker.type == LINE_STRIP:
        return Path(marker.ns, marker.id, points, colour, scale.x)
    if marker.type == SPHERE_LIST:
        return Dots(marker.ns, marker.id, points, colour, scale.x)
    if marker.type == ARROW:
        return Arrow(marker.ns, marker.id, pose, colour, scale.x)
    if marker.type == TEXT_VIEW_FACING:
        return Text(marker.ns, marker.id, pose[:2], marker.text, colour, scale.z)
    raise MessageError(
        f"{field}.type: {marker.type} is not allowed: it must be {LINE_STRIP} for a line, "
        f"{SPHERE_LIST} for dots, {ARROW} for an arrow or "
        f"{TEXT_VIEW_FACING} for text"
    )
