"""Figures as JSON."""

from __future__ import annotations

import json
import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from gameinfer_ros.names.text import json_text

FIGURES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


def refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is no JSON")


def same(found: Any, wanted: Any) -> bool:
    if isinstance(wanted, list):
        return len(found) == len(wanted) and all(map(same, found, wanted))
    if isinstance(wanted, dict):
        return list(found) == list(wanted) and all(same(found[k], wanted[k]) for k in wanted)
    return (
        found is None
        if isinstance(wanted, float) and not math.isfinite(wanted)
        else found == wanted
    )


@given(FIGURES)
def test_figures_are_kept_and_what_is_no_number_is_null(figures: Any) -> None:
    text = json_text(figures)
    assert "\n" not in text
    assert same(json.loads(text, parse_constant=refuse), figures)


def test_tuples_are_lists() -> None:
    assert json_text({"a": (1.0, math.nan), "b": (math.inf,)}) == '{"a": [1.0, null], "b": [null]}'
