"""Figures that the package draws when the site is built, cached until the sources change."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from sphinx.application import Sphinx

from gameinfer_ros.experiments.equilibria import clusters
from gameinfer_ros.games import ROBOT
from gameinfer_ros.inference import Belief
from gameinfer_ros.names.colours import COLOURS
from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.runs import closed_loop
from gameinfer_ros.runs.picture import weights_over_time
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario
from gameinfer_ros.solver import GameSolver, Strategy

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "docs/figures"

#: Number of the run on the page about the method.
RUN = 3


def equilibria() -> Figure:
    """Draw the clusters of equilibria of two players."""
    scenario = Scenario.load("two_player")
    solver, players = GameSolver(scenario.game, scenario.solver), scenario.game.players
    u = scenario.seeds.sample(np.random.default_rng(0), players, scenario.horizon, 64)
    x0 = scenario.initial_state
    solution = solver.solve(x0, Strategy.from_inputs(0, x0, u))
    x = np.moveaxis(solution.strategy.x_ref, -1, 0)[solution.converged]
    x = x[players.distances(x).min(axis=(1, 2)) > 0.75]
    positions = players.positions(x)
    found = clusters.find(positions)
    figure = Figure(figsize=(8, 4), layout="constrained")
    for number, (axes, members) in enumerate(
        zip(figure.subplots(1, len(found), sharey=True, squeeze=False)[0], found, strict=True)
    ):
        for i, name in enumerate(players.names):
            for k in members:
                axes.plot(*positions[k, :, i].T, color=COLOURS[i], linewidth=0.8, alpha=0.5)
            axes.plot(*positions[0, 0, i], "o", color=COLOURS[i], label=name)
        axes.set_title(f"equilibrium {number + 1}: {len(members)} seeds")
        axes.set(xlabel="x in m", aspect="equal")
    figure.axes[0].set_ylabel("y in m")
    figure.axes[0].legend(loc="upper left")
    return figure


def convergence() -> Figure:
    """Draw the iterations from one seed to its equilibrium."""
    scenario = Scenario.load("two_player")
    solver, players = GameSolver(scenario.game, scenario.solver), scenario.game.players
    u = scenario.seeds.sample(np.random.default_rng(RUN), players, scenario.horizon, 1)
    x0 = scenario.initial_state
    seed = Strategy.from_inputs(0, x0, u)
    needed = int(solver.solve(x0, seed).iterations[0])
    figure = Figure(figsize=(9, 4), layout="constrained")
    ways, moves = figure.subplots(1, 2)
    moved = []
    for n in range(needed + 1):
        if n == 0:
            strategy = solver.play_out(x0, seed)
        else:
            solution = solver.solve(x0, seed, max_iterations=n)
            strategy = solution.strategy
            moved.append(float(solution.movement[0]))
        positions = players.positions(strategy.x_ref[..., 0])
        for i in range(len(players)):
            ways.plot(
                *positions[:, i].T, color=COLOURS[i],
                alpha=0.15 + 0.85 * (n / needed) ** 3, linewidth=2.0 if n == needed else 0.8,
                linestyle=":" if n == 0 else "-",
            )  # fmt: skip
    ways.set_title("operating points: seed (dotted) to equilibrium (bold)")
    ways.set(xlabel="x in m", ylabel="y in m", aspect="equal")
    moves.semilogy(range(1, needed + 1), moved, "o-", color=COLOURS[1], markersize=4)
    for movement, words, colour in (
        (scenario.solver.max_movement, "at most", COLOURS[0]),
        (scenario.solver.converged_movement, "converged", COLOURS[2]),
    ):
        moves.axhline(movement, color=colour, linestyle="--")
        moves.text(1, 1.08 * movement, words, color=colour)
    moves.set(title="largest movement of a state component", xlabel="iteration")
    moves.set_ylim(top=3)
    return figure


def belief() -> Figure:
    """Draw the weights and the number of particles over a run."""
    record = closed_loop.run(Scenario.load("three_player"), "map", RUN)
    times, series = weights_over_time(record)
    counts = [len(record.beliefs[step]) for step in sorted(record.beliefs)]
    figure = Figure(figsize=(9, 3.2), layout="constrained")
    weights, count = figure.subplots(1, 2)
    weights.stackplot(times, *series.values(), edgecolor="white", linewidth=0.3)
    weights.set(title="weights: one band for each particle", ylim=(0, 1))
    count.step(times, counts, color=COLOURS[1], where="post")
    count.set_title("number of particles")
    count.set_ylim(bottom=0)
    for axes in (weights, count):
        axes.set_xlabel("time in s")
        axes.margins(x=0)
    return figure


def predictions() -> Figure:
    """Draw the predicted trajectories of all particles at three times of the same run."""
    scenario, moments = Scenario.load("three_player"), (0, 8, 20)
    game, seeds = scenario.game, RunSeeds.of_run(RUN)
    solver, players = GameSolver(game, scenario.solver), scenario.game.players
    humans = EquilibriumPlayer(solver, scenario.seeds, np.random.default_rng(seeds.humans))
    watched = Belief(
        solver, scenario.seeds, scenario.inference, np.random.default_rng(seeds.inference)
    )
    own = players.inputs(ROBOT)
    figure = Figure(figsize=(10, 3.8), layout="constrained")
    panels = iter(figure.subplots(1, len(moments), sharex=True, sharey=True))
    x, u = scenario.initial_state, np.zeros(players.n_inputs)
    for step in range(moments[-1] + 1):
        if step > 0:
            x_before, x = x, game.step(x, u)
            watched.weigh(step - 1, x_before, x, u[own])
            watched.combine_duplicates()
        watched.solve(step, x)
        u = humans.solve(step, x).inputs(step, x)[:, 0]
        u[own] = watched.equilibrium.strategy.of_inputs(own).inputs(step, x)[:, 0]
        if step in moments:
            axes = next(panels)
            ways = players.positions(np.moveaxis(watched.strategy.x_ref, -1, 0))
            for i, name in enumerate(players.names):
                for k in np.argsort(watched.weights):
                    opacity = 0.04 + 0.96 * float(watched.weights[k])
                    axes.plot(
                        *ways[k, :, i].T, color=COLOURS[i], alpha=opacity,
                        linewidth=0.8 + 1.5 * float(watched.weights[k]),
                    )  # fmt: skip
                axes.plot(*players.positions(x)[i], "o", color=COLOURS[i], label=name)
            axes.set_title(f"t = {step * game.dt:.1f} s: {len(watched)} particles")
            axes.set(xlabel="x in m", aspect="equal")
    figure.axes[0].set_ylabel("y in m")
    figure.axes[0].legend(fontsize="small", loc="upper left")
    return figure


FIGURES: dict[str, Callable[[], Figure]] = {
    figure.__name__: figure for figure in (equilibria, convergence, belief, predictions)
}


def draw_all(folder: Path = FOLDER) -> None:
    """Draw all figures, unless they exist and the sources are unchanged."""
    digest = _fingerprint()
    stamp = folder / "made-from"
    if stamp.exists() and stamp.read_text() == digest:
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    # Equal figures give equal files: no date, and no random names.
    with mpl.rc_context({"svg.hashsalt": "gameinfer_ros", "svg.fonttype": "path"}):
        for name, make in FIGURES.items():
            make().savefig(folder / f"{name}.svg", metadata={"Date": None})
    stamp.write_text(digest)


def _fingerprint() -> str:
    """Return a digest of all files that the figures depend on."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for pattern in ("gameinfer_ros/**/*.py", "config/*.yaml"):
        for path in sorted(ROOT.glob(pattern)):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def setup(app: Sphinx) -> dict[str, bool]:
    """Draw the figures before the pages are read."""
    app.connect("builder-inited", lambda _: draw_all())
    return {"parallel_read_safe": True, "parallel_write_safe": True}
