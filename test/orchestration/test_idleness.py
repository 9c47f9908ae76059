"""What the terminal shows of a run that waits."""

from __future__ import annotations

import io

from rich.console import Console

from gameinfer_ros.orchestration.idleness import Idleness


def told(*figures: dict[str, str]) -> list[str]:
    """The lines that reports with these figures lead to."""
    text, before = io.StringIO(), Idleness()
    for report in figures:
        now = Idleness.of(report)
        now.tell(before, Console(file=text, width=200))
        before = now
    return text.getvalue().splitlines()


def test_nothing_is_shown_of_a_run_that_continues() -> None:
    assert told({}, {"step": "1", "idle": ""}, {"last_rejection": "stale"}) == []


def test_each_reason_is_shown_once_and_its_end_too() -> None:
    lost = {"idle": "no odometry of human_1"}
    assert told({}, lost, lost, {}, {}, {"idle": "paused at step 3"}) == [
        "No new states: no odometry of human_1",
        "New states arrive again.",
        "No new states: paused at step 3",
    ]


def test_a_rejection_is_shown_once_though_its_numbers_differ() -> None:
    lost = {"idle": "no odometry of human_1"}
    behind = [{**lost, "last_rejection": f"stamp: {t}.5 s is behind"} for t in range(3)]
    frame = {**lost, "last_rejection": "frame_id: 'odom' is not allowed"}
    assert told(lost, *behind, frame, frame) == [
        "No new states: no odometry of human_1",
        "stamp: 0.5 s is behind",
        "frame_id: 'odom' is not allowed",
    ]
