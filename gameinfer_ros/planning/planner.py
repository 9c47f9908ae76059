"""What a planner must provide."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from gameinfer_ros.inference import NO_PARTICLE, Belief, SeedDistribution
from gameinfer_ros.solver import IterativeLQ, Strategy


class Planner(ABC):
    """Turns the belief into a strategy for the robot, at every step.

    A planner is one file in `gameinfer_ros.planning.planners`, with a subclass whose `kind` is the
    name of the file. Nodes, commands and studies find it by that name; the first line of the
    file's docstring explains it to users.

    Args:
        solver: solver of the game that all play.
        seeds: distribution that seeds are drawn from.
        rng: generator for what the planner draws at random.

    Attributes:
        particle: number of the particle that the last strategy belongs to; `NO_PARTICLE` if the
            robot only brakes.
    """

    #: Planners by their kind; a subclass joins when it is defined.
    family: ClassVar[dict[str, type[Planner]]] = {}
    kind: ClassVar[str]
    #: Whether the strategy depends on the belief. If not, a run may do without one.
    needs_belief: ClassVar[bool] = True

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        Planner.family[cls.kind] = cls

    def __init__(
        self, solver: IterativeLQ, seeds: SeedDistribution, rng: np.random.Generator
    ) -> None:
        self.particle = NO_PARTICLE

    @abstractmethod
    def strategy(self, belief: Belief | None, step: int, x: np.ndarray) -> Strategy:
        """Strategies (of one particle) of all players, of which the robot plays its own part.

        Called once for each state, after the belief was weighed by it and before it is re-solved
        from it.

        Args:
            belief: the belief, whose strategies contain `step`; may be `None` if the planner does
                not need one.
            step: the step that `x` belongs to.
            x: joint state (nx,).

        Returns:
            Strategies whose horizon contains `step`.
        """


def make_planner(
    kind: str, solver: IterativeLQ, seeds: SeedDistribution, rng: np.random.Generator
) -> Planner:
    """The planner of this kind.

    Raises:
        ValueError: there is no such planner; the message names those that there are.
    """
    if kind not in Planner.family:
        known = ", ".join(Planner.family)
        raise ValueError(f"planner: '{kind}' is not allowed: it must be one of {known}")
    return Planner.family[kind](solver, seeds, rng)
