"""Games: dynamics, cost terms, and the game they make up."""

from gameinfer_ros import compiled

compiled.keep_apart()  # before anything of this package is compiled: all of that is made of games

from gameinfer_ros.games.car import Car
from gameinfer_ros.games.cost_term import BoundTerm, CostTerm
from gameinfer_ros.games.double_integrator import DoubleIntegrator
from gameinfer_ros.games.dynamics import Dynamics
from gameinfer_ros.games.flat_unicycle import FlatUnicycle
from gameinfer_ros.games.game import Game
from gameinfer_ros.games.goal import Goal, goal_positions
from gameinfer_ros.games.lane import Lane
from gameinfer_ros.games.obstacle import Obstacle
from gameinfer_ros.games.players import ROBOT, Players
from gameinfer_ros.games.proximity import Proximity
from gameinfer_ros.games.quadratic_input import QuadraticInput
from gameinfer_ros.games.quadratic_state import QuadraticState
from gameinfer_ros.games.soft_bound import SoftBound
from gameinfer_ros.games.track import Sample, Track
from gameinfer_ros.games.unicycle import Unicycle
from gameinfer_ros.games.vehicle import Vehicle
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
    "Lane",
    "Obstacle",
    "Players",
    "Proximity",
    "QuadraticInput",
    "QuadraticState",
    "Sample",
    "SoftBound",
    "Track",
    "Unicycle",
    "Vehicle",
    "Vehicles",
    "goal_positions",
]
