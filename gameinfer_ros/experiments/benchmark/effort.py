"""How much a benchmark measures."""

from __future__ import annotations

from typing import NamedTuple


class Effort(NamedTuple):
    """How much is measured, and how often.

    Attributes:
        repetitions: how often each time is taken; the median counts.
        calls: calls of a compiled pass in each repetition; likewise.
        particles: seeds that are solved from scratch, and then from a warm start.
        iterations: at most so many for each of them.
        reference_iterations: iterations in which the compiled solver and the reference compete.
        update_particles: particles of an update where their number is not what varies.
        counts: numbers of particles of an update where it is.
        horizons: numbers of steps T.
        belief_particles: particles of each belief; as the scenario says if `None`.
        belief_steps: steps of each closed loop; likewise.
        empty_cache: whether to measure how long compiling everything takes.
    """

    repetitions: int
    calls: int
    particles: int
    iterations: int
    reference_iterations: int
    update_particles: int
    counts: tuple[int, ...]
    horizons: tuple[int, ...]
    belief_particles: int | None
    belief_steps: int | None
    empty_cache: bool


FULL = Effort(
    repetitions=9,
    calls=5,
    particles=64,
    iterations=200,
    reference_iterations=10,
    update_particles=64,
    counts=(10, 20, 50, 100, 200, 500, 1000),
    horizons=(25, 50, 100, 200),
    belief_particles=None,
    belief_steps=None,
    empty_cache=True,
)

#: Enough to see that everything works.
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
