"""The random numbers of one run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class RunSeeds(NamedTuple):
    """Independent seeds of the generators of one run, all from the one number of the run.

    Attributes:
        humans: for the equilibrium that the humans agree on.
        inference: for the particles.
        planner: for what the robot's planner draws, such as the equilibrium of the baseline.
    """

    humans: int
    inference: int
    planner: int

    @classmethod
    def of_run(cls, seed: int) -> RunSeeds:
        """Seeds of the run with this number, 0 or above."""
        return cls(*(int(s) for s in np.random.SeedSequence(seed).generate_state(3)))
