"""Stamps that jump: one does not mislead a node, several that agree do."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gameinfer_ros.nodes.base.step_order import AHEAD, CONFIRMED, StepOrder
from msg_adapters import MessageError

STEPS = st.integers(0, 2**31)


def admitted(order: StepOrder, step: int) -> bool:
    try:
        order.admit(step)
    except MessageError as error:
        words = (f"stamp: step {step} is", f"step {order.newest}")
        assert all(word in str(error) for word in words), error
        return False
    assert order.newest == step
    return True


def after(*steps: int) -> StepOrder:
    order = StepOrder()
    for step in steps:
        assert admitted(order, step)
    return order


@given(first=STEPS, by=st.integers(1, AHEAD))
def test_the_first_may_be_of_any_step_and_then_come_later_ones(first: int, by: int) -> None:
    after(first, first + by, first + 2 * by)


@given(newest=STEPS, stray=STEPS)
def test_one_stray_stamp_changes_nothing(newest: int, stray: int) -> None:
    order = after(newest)
    if not 0 < stray - newest <= AHEAD:
        assert not admitted(order, stray)
        assert order.newest == newest
    following = [admitted(order, newest + k) for k in range(1, 2 * AHEAD)]
    # One within reach is believed, and makes those before it stale, but not for long.
    assert following.count(False) < CONFIRMED
    assert all(following[CONFIRMED:])


@given(newest=STEPS, strays=st.lists(STEPS, max_size=20))
def test_strays_between_good_ones_never_add_up(newest: int, strays: list[int]) -> None:
    order = after(newest)
    for k, stray in enumerate(strays, 1):
        if not 0 < stray - order.newest <= AHEAD:
            assert not admitted(order, stray)
        assert admitted(order, newest + k)


@given(newest=STEPS, reached=STEPS, ahead=st.integers(-AHEAD, 2 * AHEAD))
def test_what_other_messages_have_reached_is_no_surprise(
    newest: int, reached: int, ahead: int
) -> None:
    order, step = after(newest), reached + ahead
    try:
        order.admit(step, reached)
    except MessageError:
        assert step <= newest or step > max(newest, reached) + AHEAD
    else:
        assert newest < step <= max(newest, reached) + AHEAD


@pytest.mark.parametrize("to", [0, 3, 1000, 2**31])
def test_several_that_agree_are_believed(to: int) -> None:
    order = after(500)
    assert [admitted(order, to + k) for k in range(CONFIRMED)] == [False, False, True]
    assert admitted(order, to + CONFIRMED)


def test_the_same_one_again_and_again_is_never_believed() -> None:
    order = after(500)
    assert not any(admitted(order, 3) for _ in range(10 * CONFIRMED))
    assert not any(admitted(order, 500) for _ in range(10 * CONFIRMED))
    assert not any(admitted(order, 10_000) for _ in range(10 * CONFIRMED))
    assert admitted(order, 501)


def test_after_it_has_forgotten_any_step_may_come() -> None:
    order = after(500)
    order.forget()
    assert order.newest == -1
    assert admitted(order, 3)


@given(newest=st.integers(1, 2**31), by=st.integers(1, AHEAD), again=st.integers(1, 3))
def test_when_step_0_comes_again_both_the_run_before_and_a_new_one_may_go_on(
    newest: int, by: int, again: int
) -> None:
    for following in (newest + by, by):
        order = after(newest)
        for _ in range(again):
            order.restart()
            assert admitted(order, 0)
        assert admitted(order, following)
        # From then on, it is one of the two.
        other = by if following > newest else newest + by
        if not following < other <= following + AHEAD:
            assert not admitted(order, other)
