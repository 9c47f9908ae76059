"""What the recorder makes of what others say."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import rclpy
from builtin_interfaces.msg import Time
from ros_domain import free_domain

from gameinfer_ros.nodes.recorder import Recorder
from msg_adapters import diagnostics


@pytest.fixture
def recorder() -> Iterator[Recorder]:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=free_domain())
    node = Recorder(context=context, namespace="/demo")
    yield node
    node.destroy_node()
    context.try_shutdown()


def tell(recorder: Recorder, name: str, **figures: str) -> None:
    status = diagnostics.Status(name, "goes on", figures, diagnostics.OK)
    recorder._on_diagnostics(diagnostics.encode(status, Time()), 0.0)


def test_figures_and_solve_times_are_kept_by_node(recorder: Recorder) -> None:
    tell(recorder, "/demo/inference", step="3", solve_ms="1.5")
    tell(recorder, "/demo/inference", step="4", solve_ms="2.5")
    tell(recorder, "/demo/simulator", step="4")
    assert recorder.figures["/demo/inference"]["solve_ms"] == "2.5"
    assert recorder.solve_ms == {"/demo/inference": {"3": "1.5", "4": "2.5"}}


def test_what_others_say_of_themselves_is_left_aside(recorder: Recorder) -> None:
    tell(recorder, "/other/planner", step="none", solve_ms="unknown")
    tell(recorder, "battery", voltage="12")
    assert not recorder.figures and not recorder.solve_ms
    tell(recorder, "/demo/planner", solve_ms="unknown")
    assert recorder.figures["/demo/planner"] == {"solve_ms": "unknown"}
    assert not recorder.solve_ms
