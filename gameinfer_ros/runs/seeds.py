"""The random seeds of a run."""

from typing import NamedTuple

import numpy as np
from typing_extensions import Self


class RunSeeds(NamedTuple):
    """Independent seeds of the random generators of a run.

    Attributes:
        humans: seed of the equilibrium that the humans play.
        inference: seed of the particles.
        planner: seed of the robot's planner, such as for the equilibrium of the baseline.
    """

    humans: int
    inference: int
    planner: int

    @classmethod
    def of_run(cls, seed: int) -> Self:
        """Derive the seeds from the number of the run, 0 or above."""
        return cls(*(int(s) for s in np.random.SeedSequence(seed).generate_state(3)))
