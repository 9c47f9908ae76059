"""Planning: what a player does with a belief or with an equilibrium of its own."""

from gameinfer_ros.choices import BASELINE, MAP
from gameinfer_ros.planning.equilibrium_player import EquilibriumPlayer
from gameinfer_ros.planning.plan import plan
from gameinfer_ros.planning.safety_filter import (
    BRAKES,
    LIMITED,
    PASSES,
    SafePlan,
    SafetyFilter,
    SafetySettings,
)

__all__ = [
    "BASELINE",
    "BRAKES",
    "LIMITED",
    "MAP",
    "PASSES",
    "EquilibriumPlayer",
    "SafePlan",
    "SafetyFilter",
    "SafetySettings",
    "plan",
]
