"""Times to solve a game: from seeds, from a warm start, and with plain NumPy."""

from collections.abc import Callable, Sequence
from functools import partial
from time import perf_counter

import numpy as np

from gameinfer_ros.experiments.benchmark.effort import Effort
from gameinfer_ros.experiments.benchmark.stopwatch import median_ms
from gameinfer_ros.experiments.benchmark.warm_start import WarmStart, seeds_of, solver_of
from gameinfer_ros.lanes.array import WIDE
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import Solution, reference


def measure_solves(scenario: Scenario, effort: Effort) -> dict[str, dict[str, float]]:
    """Measure solves from seeds (`cold`), one step later from the solutions (`warm`), and `alone`.

    `ms` is the time per particle. `alone` is the first warm particle by itself.
    """
    solver, x0 = solver_of(scenario), scenario.initial_state
    seeds, most = seeds_of(scenario, effort.particles), effort.iterations
    cold = partial(solver.solve, x0, seeds, None, most)
    warm = WarmStart.of(cold())
    alone = warm.of_particles(1)
    return {
        "cold": _per_particle(cold, -(-effort.repetitions // 3)),
        "warm": _per_particle(warm.update(solver, most), effort.repetitions),
        "alone": _per_particle(alone.update(solver, most), 10 * effort.repetitions),
    }


def _per_particle(solve: Callable[[], Solution], repetitions: int) -> dict[str, float]:
    solution = solve()
    return {
        "ms": median_ms(solve, repetitions) / len(solution.strategy),
        "iterations": float(solution.iterations.mean()),
        "most_iterations": int(solution.iterations.max()),
    }


def compare_with_reference(scenario: Scenario, effort: Effort) -> dict[str, float]:
    """Compare the compiled solver with the NumPy reference, in ms per particle and iteration.

    Both start from the same seeds, run the same number of iterations, and use one thread. The
    compiled solver solves all particles together, or one after the other (`alone`).
    """
    solver, x0 = solver_of(scenario), scenario.initial_state
    seeds, most = seeds_of(scenario, WIDE), effort.reference_iterations
    settings = solver.settings.model_copy(update={"max_iterations": most})
    inputs = np.moveaxis(seeds.u_ref, -1, 0)
    reference.solve(scenario.game, x0, inputs[0], settings.model_copy(update={"max_iterations": 1}))
    together, alone, plain = [], [], []
    for _ in range(-(-effort.repetitions // 3)):
        together.append(_iteration_ms(lambda: [solver.solve(x0, seeds, None, most)]))
        alone.append(
            _iteration_ms(
                lambda: [solver.solve(x0, seeds.take([k]), None, most) for k in range(WIDE)]
            )
        )
        plain.append(
            _iteration_ms(lambda: [reference.solve(scenario.game, x0, u, settings) for u in inputs])
        )
    return {
        "compiled_ms": float(np.median(together)),
        "compiled_alone_ms": float(np.median(alone)),
        "numpy_ms": float(np.median(plain)),
        "ratio": float(np.median(np.array(plain) / together)),
        "ratio_alone": float(np.median(np.array(plain) / alone)),
    }


def _iteration_ms(
    solve: Callable[[], Sequence[Solution] | Sequence[reference.ReferenceSolution]],
) -> float:
    """Measure the time of some solves, in ms per iteration."""
    start = perf_counter()
    solutions = solve()
    ms = 1e3 * (perf_counter() - start)
    return ms / float(sum(np.sum(solution.iterations) for solution in solutions))
