"""What RViz and Foxglove draw: visualization_msgs/MarkerArray in the frame `map`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters import planar
from msg_adapters.error import MessageError, check_finite, check_frame
from msg_adapters.joint_state import FRAME


@dataclass(frozen=True)
class Path:
    """A line, with a namespace and a number that name it.

    Attributes:
        namespace: what kind of line it is.
        number: which of its kind.
        points: positions (S, 2), in m.
        colour: red, green, blue and opacity, from 0 to 1.
        width: in m.
    """

    namespace: str
    number: int
    points: np.ndarray
    colour: tuple[float, float, float, float]
    width: float


@dataclass(frozen=True)
class Arrow:
    """A player, drawn as an arrow along its heading; attributes as those of `Path`.

    Attributes:
        pose: x, y, yaw (3,), in m and rad.
        length: in m.
    """

    namespace: str
    number: int
    pose: np.ndarray
    colour: tuple[float, float, float, float]
    length: float


def encode(shapes: Sequence[Path | Arrow], now: Time) -> MarkerArray:
    """Message that replaces all that was drawn before by these shapes."""
    header = Header(stamp=now, frame_id=FRAME)
    markers = [Marker(header=header, action=Marker.DELETEALL)]
    for shape in shapes:
        marker = Marker(header=header, ns=shape.namespace, id=shape.number, action=Marker.ADD)
        marker.color = ColorRGBA(**dict(zip("rgba", (float(c) for c in shape.colour), strict=True)))
        if isinstance(shape, Path):
            marker.type = Marker.LINE_STRIP
            marker.pose = planar.pose(np.zeros(3))
            marker.scale = Vector3(x=shape.width, y=0.0, z=0.0)
            marker.points = [Point(x=float(x), y=float(y), z=0.0) for x, y in shape.points]
        else:
            marker.type = Marker.ARROW
            marker.pose = planar.pose(shape.pose)
            marker.scale = Vector3(x=shape.length, y=shape.length / 4, z=shape.length / 4)
        markers.append(marker)
    return MarkerArray(markers=markers)


def decode(message: MarkerArray) -> list[Path | Arrow]:
    """The paths and arrows of a message.

    Raises:
        MessageError: a marker is of another type, action or frame, a rotation is none, or a number
            is not finite.
    """
    shapes: list[Path | Arrow] = []
    for i, marker in enumerate(message.markers):
        check_frame(marker.header.frame_id, FRAME)
        if marker.action == Marker.DELETEALL:
            shapes.clear()
            continue
        if marker.action != Marker.ADD:
            raise MessageError(
                f"markers[{i}].action: {marker.action} is not allowed: it is {Marker.ADD} to add "
                f"or {Marker.DELETEALL} to delete all"
            )
        c = marker.color
        colour = (c.r, c.g, c.b, c.a)
        check_finite(f"markers[{i}].color", np.array(colour))
        check_finite(f"markers[{i}].scale", np.array([marker.scale.x]))
        if marker.type == Marker.LINE_STRIP:
            points = np.array([[p.x, p.y] for p in marker.points]).reshape(-1, 2)
            check_finite(f"markers[{i}].points", points)
            shapes.append(Path(marker.ns, marker.id, points, colour, marker.scale.x))
        elif marker.type == Marker.ARROW:
            pose = planar.from_pose(f"markers[{i}].pose", marker.pose)
            check_finite(f"markers[{i}].pose", pose)
            shapes.append(Arrow(marker.ns, marker.id, pose, colour, marker.scale.x))
        else:
            raise MessageError(
                f"markers[{i}].type: {marker.type} is not allowed: it is {Marker.LINE_STRIP} for "
                f"a line or {Marker.ARROW} for an arrow"
            )
    return shapes
