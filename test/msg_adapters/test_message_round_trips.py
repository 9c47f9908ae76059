"""Encoding, sending and decoding change nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from visualization_msgs.msg import Marker

from msg_adapters import (
    belief,
    clock,
    cmd_vel,
    control,
    diagnostics,
    equilibrium,
    joint_state,
    markers,
    multi_array,
    odometry,
    planar,
    stamp,
    strategy,
)
from msg_adapters.error import LARGEST

OverTheWire = Callable[[Any], Any]

finite = st.floats(-LARGEST, LARGEST)
angles = st.floats(-20.0, 20.0)
times = st.integers(0, 2**31 * 10**9 - 1)
dts = st.sampled_from((0.1, 0.05, 0.02, 0.25, 1.0, 1 / 3, 1e-3))
counts = st.integers(1, 4)
names = st.lists(
    st.text("abcdefghijklmnopqrstuvwxyz_0123456789", min_size=1, max_size=12),
    min_size=1,
    max_size=4,
    unique=True,
)
words = st.text(st.characters(exclude_characters="\0", exclude_categories=("Cs",)), max_size=20)


def numbers(*shape: int) -> st.SearchStrategy[np.ndarray]:
    return arrays(np.float64, shape, elements=finite)


@st.composite
def poses(draw: st.DrawFn, *shape: int) -> np.ndarray:
    values = draw(numbers(*shape, 3))
    values[..., 2] = draw(arrays(np.float64, shape, elements=angles))
    return values


def assert_same_bits(found: np.ndarray, meant: np.ndarray) -> None:
    assert found.shape == meant.shape
    assert found.dtype == meant.dtype
    assert found.tobytes() == np.ascontiguousarray(meant).tobytes()


def assert_same_poses(found: np.ndarray, meant: np.ndarray) -> None:
    assert found.shape == meant.shape
    assert_same_bits(found[..., :2].copy(), meant[..., :2].copy())
    turned = found[..., 2] - meant[..., 2]
    np.testing.assert_allclose(turned - 2 * np.pi * np.round(turned / (2 * np.pi)), 0, atol=1e-12)
    assert (np.abs(found[..., 2]) <= np.pi).all()


def assert_points_every(dt: float, message: Any) -> None:
    later = [p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in message.points]
    np.testing.assert_allclose(later, dt * np.arange(len(later)), atol=1e-9)


@given(time=st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1))
def test_stamp(time: int, over_the_wire: OverTheWire) -> None:
    message = over_the_wire(stamp.encode(time))
    assert stamp.decode(message) == time
    assert 0 <= message.nanosec < 10**9


@given(time=times)
def test_a_time_as_text_has_all_its_nanoseconds(time: int) -> None:
    seconds, nanoseconds = stamp.text(time).split(".")
    assert len(nanoseconds) == 9
    assert int(seconds) * 10**9 + int(nanoseconds) == time


@given(time=times)
def test_clock(time: int, over_the_wire: OverTheWire) -> None:
    assert clock.decode(over_the_wire(clock.encode(time))) == time


@given(data=st.data(), time=times, names=names)
def test_joint_state(
    data: st.DataObject, time: int, names: list[str], over_the_wire: OverTheWire
) -> None:
    n = len(names)
    meant = joint_state.JointState(
        time, data.draw(poses(n)), data.draw(numbers(n, 3)), data.draw(numbers(n, 3))
    )
    message = over_the_wire(joint_state.encode(meant, names))
    found = joint_state.decode(message, names)
    assert found.stamp == time
    assert_same_poses(found.poses, meant.poses)
    assert_same_bits(found.twists, meant.twists)
    assert_same_bits(found.accelerations, meant.accelerations)
    assert message.header.frame_id == "map"


@given(data=st.data(), now=times)
def test_cmd_vel(data: st.DataObject, now: int, over_the_wire: OverTheWire) -> None:
    rates = data.draw(numbers(3))
    message = over_the_wire(cmd_vel.encode(now, rates, "ana"))
    assert stamp.decode(message.header.stamp) == now
    assert_same_bits(cmd_vel.decode(message, "ana"), rates)


@given(data=st.data(), time=times)
def test_odometry(data: st.DataObject, time: int, over_the_wire: OverTheWire) -> None:
    pose, rates = data.draw(poses()), data.draw(numbers(3))
    message = over_the_wire(odometry.encode(time, pose, rates, "ana"))
    found_time, found_pose, found_rates = odometry.decode(message)
    assert found_time == time
    assert_same_poses(found_pose, pose)
    assert_same_bits(found_rates, rates)
    assert (message.header.frame_id, message.child_frame_id) == ("map", "ana")


@given(data=st.data(), time=times, dt=dts, names=names, length=counts)
def test_equilibrium_and_control(
    data: Any, time: int, dt: float, names: list[str], length: int, over_the_wire: OverTheWire
) -> None:
    rates = numbers(length, len(names), 3)
    way, twists, accelerations = (data.draw(x) for x in (poses(length, len(names)), rates, rates))
    whole = equilibrium.Equilibrium(time, way, twists, accelerations)
    message = over_the_wire(equilibrium.encode(whole, names, dt))
    found = equilibrium.decode(message, names)
    assert_same_poses(found.poses, way)
    order = over_the_wire(control.encode(control.Control(time, twists, accelerations), names, dt))
    assert order.header.frame_id == names[0]
    for sent, received in ((message, found), (order, control.decode(order, names))):
        assert received.stamp == time
        assert_same_bits(received.twists, twists)
        assert_same_bits(received.accelerations, accelerations)
        assert_points_every(dt, sent)


@given(data=st.data(), time=times, T=counts, m=counts, nx=counts)
def test_strategy(
    data: st.DataObject, time: int, T: int, m: int, nx: int, over_the_wire: OverTheWire
) -> None:
    meant = strategy.AffineStrategy(
        time,
        data.draw(st.integers(-1, 10**6)),
        data.draw(numbers(T, m)),
        data.draw(numbers(T, m, nx)),
        data.draw(numbers(T, nx)),
    )
    found = strategy.decode(over_the_wire(strategy.encode(meant)), m, nx)
    assert (found.stamp, found.particle) == (time, meant.particle)
    assert_same_bits(found.u_ref, meant.u_ref)
    assert_same_bits(found.P, meant.P)
    assert_same_bits(found.x_ref, meant.x_ref)


@given(data=st.data(), time=times, K=counts, N=counts)
def test_belief(data: st.DataObject, time: int, K: int, N: int, over_the_wire: OverTheWire) -> None:
    costs = st.one_of(finite, st.just(np.inf))  # of a particle that is not settled
    meant = belief.BeliefSummary(
        time,
        data.draw(st.integers(-1, 10**6)),
        data.draw(arrays(np.int64, K, elements=st.integers(0, 10**6))),
        data.draw(arrays(np.float64, K, elements=st.floats(0.0, 1.0))),
        data.draw(arrays(np.bool_, K)),
        data.draw(arrays(np.float64, (K, N), elements=costs)),
    )
    found = belief.decode(over_the_wire(belief.encode(meant)), N)
    assert (found.stamp, found.map) == (time, meant.map)
    assert type(found.map) is int
    assert_same_bits(found.ids, meant.ids)
    assert_same_bits(found.weights, meant.weights)
    assert_same_bits(found.settled, meant.settled)
    assert_same_bits(found.costs, meant.costs)


@given(data=st.data(), time=times, rows=counts, columns=counts)
def test_multi_array(
    data: st.DataObject, time: int, rows: int, columns: int, over_the_wire: OverTheWire
) -> None:
    prefix, table = data.draw(numbers(data.draw(counts) - 1)), data.draw(numbers(rows, columns))
    message = over_the_wire(multi_array.encode(time, list(prefix), table, ("row", "column")))
    found_time, found_prefix, found = multi_array.decode(
        message, len(prefix), ("row", "column"), columns
    )
    assert found_time == time
    assert_same_bits(found_prefix, prefix)
    assert_same_bits(found, table)
    # A reader who knows std_msgs/MultiArrayLayout, and no more, finds the table.
    layout, (first, second) = message.layout, message.layout.dim
    assert (first.size, second.size) == table.shape
    assert (first.stride, second.stride) == (rows * columns, columns)
    for i, j in np.ndindex(rows, columns):
        assert message.data[layout.data_offset + second.stride * i + j] == table[i, j]


levels = st.sampled_from((diagnostics.OK, diagnostics.WARN, diagnostics.ERROR, diagnostics.STALE))
statuses = st.builds(
    diagnostics.NodeStatus, words, words, st.dictionaries(words, words, max_size=4), levels
)


@given(status=statuses, now=times)
def test_diagnostics(status: diagnostics.NodeStatus, now: int, over_the_wire: OverTheWire) -> None:
    message = over_the_wire(diagnostics.encode(status, now))
    assert diagnostics.decode(message) == [status]
    assert stamp.decode(message.header.stamp) == now


def test_diagnostics_of_several_nodes_in_one_message() -> None:
    first = diagnostics.NodeStatus("a", "good")
    second = diagnostics.NodeStatus("b", "bad", {"k": "v"})
    message = diagnostics.encode(first, 0)
    message.status = [*message.status, *diagnostics.encode(second, 0).status]
    assert diagnostics.decode(message) == [first, second]


colours = st.tuples(*[st.floats(0.0, 1.0)] * 4)
sizes = st.floats(0.0, 1e6)
numbers_of_shapes = st.integers(-(2**31), 2**31 - 1)


points = st.integers(0, 4).flatmap(lambda count: numbers(count, 2))
common = words, numbers_of_shapes, colours, sizes
shapes = st.one_of(
    st.builds(markers.Path, *common, points),
    st.builds(markers.Dots, *common, points),
    st.builds(markers.Arrow, *common, poses()),
    st.builds(markers.Text, *common, numbers(2), words),
)


@given(drawn=st.lists(shapes, max_size=4), now=times)
def test_markers(drawn: list[markers.Shape], now: int, over_the_wire: OverTheWire) -> None:
    message = over_the_wire(markers.encode(drawn, now))
    found = markers.decode(message)
    assert len(found) == len(drawn)
    for one, meant in zip(found, drawn, strict=True):
        assert type(one) is type(meant)
        for field in fields(meant):
            value, wanted = getattr(one, field.name), getattr(meant, field.name)
            if field.name == "colour":
                # std_msgs/ColorRGBA has single precision.
                assert value == pytest.approx(wanted, rel=1e-6, abs=1e-30)
            elif field.name == "pose":
                assert_same_poses(value, wanted)
            elif isinstance(wanted, np.ndarray):
                assert_same_bits(value, wanted)
            else:
                assert value == wanted
    assert {stamp.decode(marker.header.stamp) for marker in message.markers} == {now}


def test_types_and_actions_of_markers_and_levels_are_those_of_ros() -> None:
    for name in ("ARROW", "LINE_STRIP", "SPHERE_LIST", "TEXT_VIEW_FACING", "ADD", "DELETEALL"):
        assert getattr(markers, name) == getattr(Marker, name)
    for name in ("OK", "WARN", "ERROR", "STALE"):
        assert getattr(diagnostics, name) == getattr(DiagnosticStatus, name)


def test_markers_replace_all_that_was_drawn_before(over_the_wire: OverTheWire) -> None:
    first, second = (
        markers.encode([markers.Path("way", i, (1.0, 0.0, 0.0, 1.0), 0.1, np.zeros((2, 2)))], 0)
        for i in (1, 2)
    )
    first.markers = [*first.markers, *second.markers]
    assert [shape.number for shape in markers.decode(over_the_wire(first))] == [2]


@given(yaw=angles)
def test_a_yaw_becomes_a_unit_quaternion_about_the_vertical_axis(yaw: float) -> None:
    q = planar.quaternion(yaw)
    assert (q.x, q.y) == (0.0, 0.0)
    assert np.hypot(q.z, q.w) == pytest.approx(1.0, abs=1e-15)
    forward = np.array([1 - 2 * q.z**2, 2 * q.w * q.z])  # the x axis, rotated
    np.testing.assert_allclose(forward, [np.cos(yaw), np.sin(yaw)], atol=1e-14)


@given(yaw=angles, roll=st.floats(-0.5, 0.5))
def test_the_opposite_quaternion_is_the_same_yaw(yaw: float, roll: float) -> None:
    q = planar.quaternion(yaw)
    minus = type(q)(x=-q.x, y=-q.y, z=-q.z, w=-q.w)
    turned = planar.yaw("rotation", minus) - planar.yaw("rotation", q)
    assert np.cos(turned) == pytest.approx(1.0, abs=1e-12)
    # A base that rolls about its forward axis still heads where it heads.
    c, s = np.cos(roll / 2), np.sin(roll / 2)
    rolled = type(q)(x=q.w * s, y=q.z * s, z=q.z * c, w=q.w * c)
    turned = planar.yaw("rotation", rolled) - yaw
    assert np.cos(turned) == pytest.approx(1.0, abs=1e-12)


def test_what_is_out_of_the_plane_is_ignored() -> None:
    message = odometry.encode(2, np.array([1.0, 2.0, 0.5]), np.array([0.1, 0.2, 0.3]), "ana")
    message.pose.pose.position.z = 7.0
    message.twist.twist.linear.z = message.twist.twist.angular.x = 7.0
    message.child_frame_id = "base_link"  # as most bases call it
    time, pose, rates = odometry.decode(message)
    assert time == 2
    np.testing.assert_allclose(pose, [1.0, 2.0, 0.5], atol=1e-15)
    np.testing.assert_array_equal(rates, [0.1, 0.2, 0.3])
