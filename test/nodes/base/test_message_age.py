"""The age of messages, by clocks that may not agree."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gameinfer_ros.nodes.base.message_age import MANY, MessageAge

DT = 0.1
TRANSITS = st.lists(st.floats(0.001, 0.3), min_size=1, max_size=30)


@given(old=st.lists(st.floats(0.0, 1e4), max_size=20), transits=TRANSITS)
def test_where_clocks_agree_every_age_is_right(old: list[float], transits: list[float]) -> None:
    ages = MessageAge()
    for age in (*old, *transits):
        assert ages.at(1e6 - age, 1e6) == pytest.approx(age, abs=1e-6)


@given(ahead=st.floats(0.5, 1e6), transits=TRANSITS)
def test_a_clock_that_is_ahead_makes_nothing_younger_than_it_is(
    ahead: float, transits: list[float]
) -> None:
    ages = MessageAge()
    for k, transit in enumerate(transits):
        found = ages.at(DT * k + ahead, DT * k + transit)
        assert found == pytest.approx(transit - min(transits[: k + 1]), abs=1e-6)


@given(jump=st.floats(-1e4, 1e4), transit=st.floats(0.001, 0.3))
def test_after_a_jump_of_a_clock_messages_are_believed_again(jump: float, transit: float) -> None:
    ages = MessageAge()
    for k in range(3 * MANY):
        offset = jump if k >= MANY else 0.0
        found = ages.at(DT * k, DT * k + transit + offset)
        if k >= 2 * MANY:
            assert found == pytest.approx(0.0, abs=1e-6)
