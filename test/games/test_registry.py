"""Kinds, and what is registered under their names."""

from __future__ import annotations

from typing import Literal

import pytest

from gameinfer_ros.games import CostTerm, Goal


def test_a_class_that_inherits_its_kind_replaces_no_other() -> None:
    class Nearer(Goal):
        """A goal of a user."""

    assert CostTerm.family["goal"] is Goal
    assert Nearer(weights=(1.0,), goals={"robot": (0.0,)}, active_from=0.0).kind == "goal"


def test_a_class_with_a_kind_of_its_own_is_registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(CostTerm, "family", dict(CostTerm.family))

    class Farther(Goal):
        kind: Literal["farther"] = "farther"  # type: ignore[assignment]

    assert CostTerm.family["farther"] is Farther
