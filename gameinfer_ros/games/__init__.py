"""Games: players with dynamics and cost terms."""

from gameinfer_ros.games.costs.cost_term import BoundTerm, CostTerm
from gameinfer_ros.games.costs.goal import Goal, goal_positions
from gameinfer_ros.games.costs.obstacle import Obstacle
from gameinfer_ros.games.costs.proximity import Proximity
from gameinfer_ros.games.costs.quadratic_input import QuadraticInput
from gameinfer_ros.games.costs.quadratic_state import QuadraticState
from gameinfer_ros.games.costs.road_lane import RoadLane
from gameinfer_ros.games.costs.soft_bound import SoftBound
from gameinfer_ros.games.dynamics.car import Car
from gameinfer_ros.games.dynamics.double_integrator import DoubleIntegrator
from gameinfer_ros.games.dynamics.dynamics import Dynamics, Vehicle
from gameinfer_ros.games.dynamics.flat_unicycle import FlatUnicycle
from gameinfer_ros.games.dynamics.unicycle import Unicycle
from gameinfer_ros.games.game import Game
from gameinfer_ros.games.players import ROBOT, Players
from gameinfer_ros.games.vehicles import Vehicles

__all__ = [
    "ROBOT",
    "BoundTerm",
    "Car",
    "CostTerm",
    "DoubleIntegrator",
    "Dynamics",
    "FlatUnicycle",
    "Game",
    "Goal",
    "Obstacle",
    "Players",
    "Proximity",
    "QuadraticInput",
    "QuadraticState",
    "RoadLane",
    "SoftBound",
    "Unicycle",
    "Vehicle",
    "Vehicles",
    "goal_positions",
]
