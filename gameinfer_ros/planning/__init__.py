"""Planning: what a player does with a belief or with an equilibrium of its own."""

from gameinfer_ros.choices import BASELINE, MAP
from gameinfer_ros.planning.equilibrium_player import EquilibriumPlayer
from gameinfer_ros.planning.plan import plan

__all__ = ["BASELINE", "MAP", "EquilibriumPlayer", "plan"]
