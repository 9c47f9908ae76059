"""Solving games: local feedback Nash equilibria by iterative LQ approximations."""

from gameinfer_ros.solver.best_response import BestResponse, best_response
from gameinfer_ros.solver.brake import brake
from gameinfer_ros.solver.iterative_lq import IterativeLQ
from gameinfer_ros.solver.receding_horizon import Equilibria, RecedingHorizon
from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.solution import Solution, Status
from gameinfer_ros.solver.strategy import Strategy

__all__ = [
    "BestResponse",
    "Equilibria",
    "IterativeLQ",
    "RecedingHorizon",
    "Solution",
    "SolverSettings",
    "Status",
    "Strategy",
    "best_response",
    "brake",
]
