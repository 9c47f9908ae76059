"""Markers for RViz and Foxglove: visualization_msgs/MarkerArray in the frame `map`."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msg_adapters import planar, stamp
from msg_adapters.error import MessageError, check_equal, check_finite
from msg_adapters.joint_state import FRAME

if TYPE_CHECKING:
    from geometry_msgs.msg import Point
    from visualization_msgs.msg import Marker, MarkerArray

#: Types of markers, as in visualization_msgs/Marker.
ARROW, LINE_STRIP, SPHERE_LIST, TEXT_VIEW_FACING = 0, 4, 7, 9

#: Actions of markers, as in visualization_msgs/Marker.
ADD, DELETEALL = 0, 3


@dataclass(frozen=True)
class Shape:
    """Base class of the shapes. Namespace and number identify a shape.

    Attributes:
        namespace: namespace of the marker.
        number: id of the marker in its namespace.
        colour: red, green, blue and opacity, from 0 to 1.
        size: width of a path, diameter of each dot, length of an arrow, or height of a capital
            letter, in m.
    """

    namespace: str
    number: int
    colour: tuple[float, float, float, float]
    size: float


@dataclass(frozen=True)
class Path(Shape):
    """A line through `points` (S, 2), in m."""

    points: np.ndarray


@dataclass(frozen=True)
class Dots(Shape):
    """Dots at `points` (S, 2), in m."""

    points: np.ndarray


@dataclass(frozen=True)
class Arrow(Shape):
    """An arrow along the heading of a player with the `pose` x, y, yaw (3,), in m and rad."""

    pose: np.ndarray


@dataclass(frozen=True)
class Text(Shape):
    """A `text` that always faces the viewer, with its centre at `position` (2,), in m."""

    position: np.ndarray
    text: str


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
        marker, size = copy(blank), shape.size
        marker.ns, marker.id = shape.namespace, shape.number
        red, green, blue, opacity = map(float, shape.colour)
        marker.color = ColorRGBA(r=red, g=green, b=blue, a=opacity)
        match shape:
            case Path():
                marker.type, marker.scale = LINE_STRIP, Vector3(x=size)
                marker.points = _points(shape.points)
            case Dots():
                marker.type, marker.scale = SPHERE_LIST, Vector3(x=size, y=size, z=size)
                marker.points = _points(shape.points)
            case Arrow():
                marker.type, marker.scale = ARROW, Vector3(x=size, y=size / 4, z=size / 4)
                marker.pose = planar.pose(shape.pose)
            case Text():
                marker.type, marker.scale = TEXT_VIEW_FACING, Vector3(z=size)
                marker.pose = planar.pose(np.array([*shape.position, 0.0]))
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
        check_equal("header.frame_id", marker.header.frame_id, FRAME)
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
        return Path(marker.ns, marker.id, colour, scale.x, points)
    if marker.type == SPHERE_LIST:
        return Dots(marker.ns, marker.id, colour, scale.x, points)
    if marker.type == ARROW:
        return Arrow(marker.ns, marker.id, colour, scale.x, pose)
    if marker.type == TEXT_VIEW_FACING:
        return Text(marker.ns, marker.id, colour, scale.z, pose[:2], marker.text)
    raise MessageError(
        f"{field}.type: {marker.type} is not allowed: it must be {LINE_STRIP} for a line, "
        f"{SPHERE_LIST} for dots, {ARROW} for an arrow or {TEXT_VIEW_FACING} for text"
    )
