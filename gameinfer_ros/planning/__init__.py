"""Planning: what a player does with a belief or with an equilibrium of its own."""

from gameinfer_ros.planning.equilibrium_player import EquilibriumPlayer
from gameinfer_ros.planning.plan import plan

#: Planners: align with the most likely equilibrium, or stick to one drawn at random.
MAP, BASELINE = "map", "baseline"

__all__ = ["BASELINE", "MAP", "EquilibriumPlayer", "plan"]
