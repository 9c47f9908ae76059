"""The extent of a benchmark."""

from typing import NamedTuple


class Effort(NamedTuple):
    """The extent of a benchmark, by default a full one: sizes and numbers of measurements."""

    repetitions: int = 9  # measurements of each time; figures are their medians
    calls: int = 5  # calls of a compiled pass per repetition; their median counts
    particles: int = 64  # seeds that are solved from scratch, and then from a warm start
    iterations: int = 200  # largest number of iterations of each of these solves
    reference_iterations: int = 10  # iterations when the solver is compared with the reference
    update_particles: int = 64  # particles of an update where another size varies
    counts: tuple[int, ...] = (10, 20, 50, 100, 200, 500, 1000)  # particles where they vary
    horizons: tuple[int, ...] = (25, 50, 100, 200)  # numbers of steps T where they vary
    belief_particles: int | None = None  # particles of each belief; None for the scenario's
    belief_steps: int | None = None  # steps of each closed loop; None for the scenario's
    empty_cache: bool = True  # whether to measure a start with an empty compile cache


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
