"""Scenarios: a game with its initial state, and the settings of solver and belief."""

from typing import TYPE_CHECKING, Any

from gameinfer_ros.scenario.files import ScenarioError, available, find, suite

if TYPE_CHECKING:
    from gameinfer_ros.scenario.scenario import MOST_STEPS, PlayerSpec, Scenario

__all__ = ["MOST_STEPS", "PlayerSpec", "Scenario", "ScenarioError", "available", "find", "suite"]


def __getattr__(name: str) -> Any:
    """Import the scenario, and with it the solver, only when it is used.

    The completion of command lines uses only `files`, and must be fast.
    """
    if name in ("MOST_STEPS", "PlayerSpec", "Scenario"):
        from gameinfer_ros.scenario import scenario

        return getattr(scenario, name)
    raise AttributeError(f"module {__name__} has no attribute {name}")


def __dir__() -> list[str]:
    return __all__
