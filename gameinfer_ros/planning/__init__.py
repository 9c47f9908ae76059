"""Planning: what a player does with a belief or with an equilibrium of its own."""

from gameinfer_ros.names.choices import BASELINE, MAP
from gameinfer_ros.planning.equilibrium_player import EquilibriumPlayer
from gameinfer_ros.planning.plan import PLAN_LENGTH, plan
from gameinfer_ros.planning.safety_filter import (
    BRAKES,
    GOES_ON,
    LIMITED,
    PASSES,
    SafePlan,
    SafetyFilter,
    SafetySettings,
)

__all__ = [
    "BASELINE",
    "BRAKES",
    "GOES_ON",
    "LIMITED",
    "MAP",
    "PASSES",
    "PLAN_LENGTH",
    "EquilibriumPlayer",
    "SafePlan",
    "SafetyFilter",
    "SafetySettings",
    "plan",
]
