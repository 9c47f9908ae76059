"""The growth of the time of an update with particles, players and steps."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from gameinfer_ros.experiments.benchmark.circle import circle
from gameinfer_ros.experiments.benchmark.effort import Effort
from gameinfer_ros.experiments.benchmark.stopwatch import medians_ms
from gameinfer_ros.experiments.benchmark.warm_start import WarmStart, seeds_of, solver_of
from gameinfer_ros.names.colours import COLOURS
from gameinfer_ros.scenario import Scenario

#: Largest number of iterations of an update.
ITERATIONS = 2

#: Numbers of threads that are compared.
THREADS = (1, 2)


def measure_growth(
    base: Scenario, warm: dict[int, WarmStart], effort: Effort
) -> dict[str, dict[str, Any]]:
    """Measure updates that start from `warm` (by number of players), with `ITERATIONS` iterations.

    Returns:
        `particles`: ms per update of three players, by threads and then by number of particles.
        `players` and `horizon`: ms per particle and iteration, by number of players, and by number
        of steps of three players.
    """
    three = circle(base, 3)
    horizons = {steps: circle(base, 3, steps) for steps in effort.horizons}
    return {
        "particles": _by_count(three, warm[3], effort),
        "players": _iterations_ms({n: (circle(base, n), warm[n]) for n in warm}, effort),
        "horizon": _iterations_ms(
            {steps: (game, solved(game, effort)) for steps, game in horizons.items()}, effort
        ),
    }


def _by_count(scenario: Scenario, warm: WarmStart, effort: Effort) -> dict[str, dict[str, float]]:
    """Measure ms per update, by threads and then by number of particles."""
    solvers = {threads: solver_of(scenario, threads) for threads in THREADS}
    updates = {
        (threads, count): warm.of_particles(count).update(solver, ITERATIONS)
        for threads, solver in solvers.items()
        for count in effort.counts
    }
    ms = medians_ms(updates, effort.repetitions)
    return {str(n): {str(count): ms[n, count] for count in effort.counts} for n in THREADS}


def _iterations_ms(
    games: Mapping[int, tuple[Scenario, WarmStart]], effort: Effort
) -> dict[str, float]:
    """Measure ms per particle and iteration of an update of each game."""
    updates = {
        n: warm.of_particles(effort.update_particles).update(solver_of(scenario), ITERATIONS)
        for n, (scenario, warm) in games.items()
    }
    iterations = {n: int(update().iterations.sum()) for n, update in updates.items()}
    ms = medians_ms(updates, effort.repetitions)
    return {str(n): ms[n] / iterations[n] for n in updates}


def solved(scenario: Scenario, effort: Effort) -> WarmStart:
    """Solve a scenario from seeds, and return the warm start of its updates."""
    solver, seeds = solver_of(scenario), seeds_of(scenario, effort.update_particles)
    x0 = scenario.initial_state
    return WarmStart.of(solver.solve(x0, seeds, None, effort.iterations))


def draw(growth: Mapping[str, Mapping[str, Any]], path: Path) -> None:
    """Draw what `measure_growth` returned for each kind of game, and write a PNG or PDF file."""
    figure = Figure(figsize=(13, 4.2), layout="constrained")
    particles, players, horizon = figure.subplots(1, 3)
    for i, (kind, times) in enumerate(growth.items()):
        for (threads, by_count), style in zip(times["particles"].items(), "-:", strict=True):
            _plot(particles, by_count, f"{kind}, {threads} thread(s)", COLOURS[i], f"o{style}")
        for axes, name in ((players, "players"), (horizon, "horizon")):
            _plot(axes, times[name], kind, COLOURS[i], "o-")
            axes.set_xticks([int(n) for n in times[name]], labels=list(times[name]))
            axes.tick_params(axis="x", which="minor", labelbottom=False)
    particles.set(xlabel="particles", ylabel="ms per update", title="3 players")
    players.set(xlabel="players", ylabel="ms per particle and iteration", title="100 steps")
    horizon.set(xlabel="steps of the horizon", title="3 players")
    for axes in (particles, players, horizon):
        axes.grid(which="both", alpha=0.3)
        axes.legend(fontsize="small")
    figure.savefig(path, dpi=120)


def _plot(axes: Any, times: Mapping[str, float], label: str, colour: str, style: str) -> None:
    """Draw times against the sizes that are their keys, with the power of their growth."""
    n, ms = np.array([float(name) for name in times]), np.array(list(times.values()))
    power = np.polyfit(np.log(n), np.log(ms), 1)[0]
    axes.loglog(n, ms, style, color=colour, label=f"{label}: power {power:.1f}", markersize=4)
