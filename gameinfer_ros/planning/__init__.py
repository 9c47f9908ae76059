"""Planning: what the robot does with a belief, and what keeps it safe."""

from gameinfer_ros.planning import planners as _planners  # registers the planners
from gameinfer_ros.planning.equilibrium_player import EquilibriumPlayer
from gameinfer_ros.planning.planner import Planner, make_planner
from gameinfer_ros.planning.robot import OFF, PLAN_LENGTH, Deliberation, Execution, plan
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
    "BRAKES",
    "GOES_ON",
    "LIMITED",
    "OFF",
    "PASSES",
    "PLAN_LENGTH",
    "Deliberation",
    "EquilibriumPlayer",
    "Execution",
    "Planner",
    "SafePlan",
    "SafetyFilter",
    "SafetySettings",
    "make_planner",
    "plan",
]

del _planners
