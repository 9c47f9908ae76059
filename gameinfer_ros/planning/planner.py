"""The interface of planners."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from gameinfer_ros.inference import NO_PARTICLE, Belief, SeedDistribution
from gameinfer_ros.solver import GameSolver, Strategy


class Planner(ABC):
    """Base class of planners, which turn the belief into a strategy of the robot at every step.

    A planner is one file in `gameinfer_ros.planning.planners` with a subclass whose `kind` is the
    name of the file. Nodes, commands and studies find it by that name. The first line of the
    file's docstring, of at most 80 characters, is its description for users.

    Args:
        solver: solver of the game.
        seeds: distribution of seeds.
        rng: generator for random choices of the planner.

    Attributes:
        particle: number of the particle of the last strategy; `NO_PARTICLE` if the robot brakes.
    """

    #: Planners by their kind. A subclass is registered when it is defined.
    family: ClassVar[dict[str, type[Planner]]] = {}
    kind: ClassVar[str]
    #: Whether the strategy depends on the belief. If not, a run does not need one.
    needs_belief: ClassVar[bool] = True

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        Planner.family[cls.kind] = cls

    def __init__(
        self, solver: GameSolver, seeds: SeedDistribution, rng: np.random.Generator
    ) -> None:
        self.particle = NO_PARTICLE

    @abstractmethod
    def strategy(self, belief: Belief | None, step: int, x: np.ndarray) -> Strategy:
        """Return strategies (of one particle) of all players; the robot plays its own part.

        Called once for each state, after the belief has been weighed with it and before it is
        re-solved from it.

        Args:
            belief: the belief; the horizon of its strategies contains `step`. It may be `None` if
                the planner does not need one.
            step: step of `x`.
            x: joint state (nx,).

        Returns:
            Strategies whose horizon contains `step`.
        """


def make_planner(
    kind: str, solver: GameSolver, seeds: SeedDistribution, rng: np.random.Generator
) -> Planner:
    """Create a planner.

    Args:
        kind: name of the planner, such as `map`.
        solver: solver of the game.
        seeds: distribution of seeds.
        rng: generator for random choices of the planner.

    Raises:
        ValueError: no planner has this name; the message lists the available ones.
    """
    if kind not in Planner.family:
        known = ", ".join(Planner.family)
        raise ValueError(f"planner: '{kind}' is not allowed: it must be one of {known}")
    return Planner.family[kind](solver, seeds, rng)
