"""The extent of a benchmark."""

from __future__ import annotations

from typing import NamedTuple


class Effort(NamedTuple):
    """The extent of a benchmark, by default a full one: sizes and numbers of measurements.

    Attributes:
        repetitions: measurements of each time; figures are their medians.
        calls: calls of a compiled pass per repetition; their median counts.
        particles: seeds that are solved from scratch, and then from a warm start.
        iterations: largest number of iterations of each of these solves.
        reference_iterations: iterations when the solver is compared with the reference.
        update_particles: particles of an update where another size varies.
        counts: numbers of particles of an update where it varies.
        horizons: numbers of steps T where the horizon varies.
        belief_particles: particles of each belief; None for that of the scenario.
        belief_steps: steps of each closed loop; None for that of the scenario.
        empty_cache: whether to measure a start with an empty compile cache.
    """

    repetitions: int = 9
    calls: int = 5
    particles: int = 64
    iterations: int = 200
    reference_iterations: int = 10
    update_particles: int = 64
    counts: tuple[int, ...] = (10, 20, 50, 100, 200, 500, 1000)
    horizons: tuple[int, ...] = (25, 50, 100, 200)
    belief_particles: int | None = None
    belief_steps: int | None = None
    empty_cache: bool = True


#: Just enough to check that everything works.
QUICK = Effort(
    repetitions=1,
    calls=1,
    particles=8,
    iterations=3,
    reference_iterations=1,
    update_particles=8,
    counts=(10, 100),
    horizons=(25, 200),
    belief_particles=4,
    belief_steps=12,
    empty_cache=False,
)
