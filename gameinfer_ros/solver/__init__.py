"""Solving games: their local feedback Nash equilibria."""

from gameinfer_ros.solver.best_response import BestResponse, best_response
from gameinfer_ros.solver.brake import brake
from gameinfer_ros.solver.game_solver import GameSolver
from gameinfer_ros.solver.receding_horizon import Equilibria, RecedingHorizon
from gameinfer_ros.solver.settings import SolverSettings
from gameinfer_ros.solver.solution import Solution, Status
from gameinfer_ros.solver.strategy import Strategy

__all__ = [
    "BestResponse",
    "Equilibria",
    "GameSolver",
    "RecedingHorizon",
    "Solution",
    "SolverSettings",
    "Status",
    "Strategy",
    "best_response",
    "brake",
]
