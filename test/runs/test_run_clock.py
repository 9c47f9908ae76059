"""Which stamp belongs to which step of a run, and which to none."""

from __future__ import annotations

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from gameinfer_ros.runs.run_clock import EarlyError, RunClock
from msg_adapters import MessageError
from msg_adapters.stamp import SECOND

STARTS = st.integers(0, 2**31 * SECOND - 1)
DTS = st.floats(1e-3, 10.0)
STEPS = st.integers(0, 10**8)


def clock_of(start: int | None, dt: float = 0.1) -> RunClock:
    clock = RunClock(dt)
    clock.start = start
    return clock


@given(start=STARTS, dt=DTS, step=STEPS)
def test_the_stamp_of_a_step_tells_the_step(start: int, dt: float, step: int) -> None:
    clock = clock_of(start, dt)
    stamp = clock.stamp(step)
    assert clock.step(stamp) == step
    assert 1e-9 * (stamp - start) == pytest.approx(step * dt, abs=1e-9, rel=1e-12)
    for other in (stamp + 1, max(start, stamp - 1)):  # one that was rounded otherwise
        assert clock.step(other) == step


@given(start=STARTS, step=STEPS, off=st.integers(2, SECOND // 10 - 2))
@example(start=0, step=99_999_997, off=99_999_997)
def test_a_stamp_between_two_steps_may_be_of_a_run_that_is_not_known_yet(
    start: int, step: int, off: int
) -> None:
    clock = clock_of(start)
    with pytest.raises(EarlyError, match=r"stamp: .* is between two steps of 0\.1 s of the run"):
        clock.step(clock.stamp(step) + off)


@given(start=STARTS, before=STARTS)
def test_a_stamp_before_the_start_is_of_an_earlier_run(start: int, before: int) -> None:
    assume(before < start)
    with pytest.raises(MessageError, match="is of an earlier run: the present run began at") as it:
        clock_of(start).step(before)
    assert not isinstance(it.value, EarlyError)


@given(start=STARTS, step=STEPS)
def test_a_step_of_any_size_follows_any_other(start: int, step: int) -> None:
    clock = clock_of(start)
    assert clock.step(clock.stamp(step)) == step
    assert clock.step(clock.stamp(0)) == 0


def test_before_any_start_is_known_every_stamp_may_be_of_a_run() -> None:
    clock = RunClock(0.1)
    assert clock.run == ""
    for stamp in (0, SECOND, 2**31 * SECOND - 1):
        with pytest.raises(EarlyError, match="no run_start has been received"):
            clock.step(stamp)
    with pytest.raises(EarlyError, match="its run_start has not been received"):
        clock.is_present("12.000000001")


def test_a_run_is_named_by_its_start() -> None:
    clock = clock_of(1_764_514_512_123_456_789)
    assert clock.run == "1764514512.123456789"
    assert clock.is_present(clock.run)
    assert not clock.is_present("1764514512.123456788")
    assert not clock.is_present("0.000000000")
    with pytest.raises(EarlyError, match=r"run: 1764514512\.123456790 is unknown"):
        clock.is_present("1764514512.123456790")


@pytest.mark.parametrize("run", ["", "12", "12.5", "-1.000000000", "nan", "1.0000000000", "x" * 99])
def test_a_run_with_a_malformed_name_is_refused(run: str) -> None:
    with pytest.raises(MessageError, match=r"run: '.*' is not allowed: it must be") as it:
        clock_of(5).is_present(run)
    assert not isinstance(it.value, EarlyError)
