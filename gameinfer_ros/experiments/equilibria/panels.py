"""The picture of the study of equilibria: a panel for each cluster."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from gameinfer_ros.names import colours

if TYPE_CHECKING:
    from gameinfer_ros.experiments.equilibria.equilibria_study import EquilibriaStudy

#: At most so many clusters are drawn, the cheapest for player 1.
MOST = 12

#: Panels side by side.
COLUMNS = 4

#: How much colour is left to the cheapest trajectory, from 0 (white) to 1.
PALEST = 0.35


def draw(
    study: EquilibriaStudy,
    rows: Mapping[int, Mapping[str, str]],
    clusters: list[Mapping[str, Any]],
) -> Figure:
    """Draw all trajectories of each cluster, and below them the initial strategies that led there.

    The dearer a trajectory is to a player, the deeper is its colour.

    Args:
        study: the study.
        rows: what came of each run, by its number.
        clusters: the clusters, as in the figures of the study.
    """
    shown = clusters[:MOST]
    columns = max(2, min(COLUMNS, len(shown)))
    groups = max(1, -(-len(shown) // columns))
    figure = Figure(figsize=(3 * columns, 5.2 * groups + 0.6), layout="constrained")
    mark, why = _marked_step(study)
    which = "" if len(shown) == len(clusters) else f", the {len(shown)} cheapest for the robot"
    figure.suptitle(
        f"{len(clusters)} clusters of equilibria{which}\n"
        f"trajectories from the start (dot), {why} (diamond); deeper colours cost more",
        fontsize="medium",
    )
    grid = figure.subplots(
        2 * groups, columns, squeeze=False, sharex="row", sharey="row",
        height_ratios=[1.0, 0.72] * groups,
    )  # fmt: skip
    for axes in grid.flat:
        axes.set_aspect("equal")
    levels = _levels(study, rows, shown)
    for number, cluster in enumerate(shown):
        group, column = divmod(number, columns)
        above, below = grid[2 * group, column], grid[2 * group + 1, column]
        trajectories = study.trajectories([rows[seed] for seed in cluster["seeds"]])
        depths = np.array([levels[seed] for seed in cluster["seeds"]])
        _draw_trajectories(above, trajectories, depths)
        _mark(above, trajectories, mark)
        costs = ", ".join(f"{cost:.0f}" for cost in cluster["median_cost"])
        size = cluster["size"]
        seeds = f"{size} seed{'' if size == 1 else 's'}"
        above.set_title(f"{number + 1}: {seeds}\ncosts {costs}", fontsize="small")
        _draw_trajectories(below, study.initial_trajectories(cluster["seeds"]), depths)
        below.set_title("initial strategies, played out", fontsize="small")
    for number in range(len(shown), groups * columns):
        group, column = divmod(number, columns)
        grid[2 * group, column].set_visible(False)
        grid[2 * group + 1, column].set_visible(False)
    handles = [
        grid[0, 0].plot([], [], color=colours.of_player(i), label=name)[0]
        for i, name in enumerate(study.players)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    for axes in grid[:, 0]:
        axes.set_ylabel("y in m", fontsize="small")
    for axes in grid[-1]:
        axes.set_xlabel("x in m", fontsize="small")
    return figure


def _levels(
    study: EquilibriaStudy,
    rows: Mapping[int, Mapping[str, str]],
    clusters: list[Mapping[str, Any]],
) -> dict[int, np.ndarray]:
    """Depth of colour (N,) of each run, from `PALEST` to 1; outliers do not set the scale."""
    seeds = [seed for cluster in clusters for seed in cluster["seeds"]]
    if not seeds:
        return {}
    costs = np.array([[float(rows[seed][c]) for c in study.cost_columns] for seed in seeds])
    low, high = np.percentile(costs, [2, 98])
    scaled = np.clip((costs - low) / max(high - low, 1e-9), 0.0, 1.0)
    return dict(zip(seeds, PALEST + (1 - PALEST) * scaled, strict=True))


def _draw_trajectories(axes, trajectories: np.ndarray, depths: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    """Draw trajectories (K, S, N, 2) with depths of colour (K, N), the palest first."""
    for i in range(trajectories.shape[2]):
        colour = np.array(to_rgb(colours.of_player(i)))
        for k in np.argsort(depths[:, i]).tolist():
            x, y = trajectories[k, :, i].T
            axes.plot(x, y, color=tuple(1 - depths[k, i] * (1 - colour)), linewidth=0.8)
        axes.plot(*trajectories[0, 0, i], "o", color=colours.of_player(i), markersize=5)


def _marked_step(study: EquilibriaStudy) -> tuple[int | None, str]:
    """Which of the kept steps is marked, `None` for each trajectory's closest moment; and why."""
    if len(study.players) == 2:
        return None, "closest moment"
    return len(study.kept_steps) // 2, "half the horizon"


def _mark(axes, trajectories: np.ndarray, step: int | None) -> None:  # type: ignore[no-untyped-def]
    for trajectory in trajectories:
        marked = step
        if marked is None:
            marked = int(np.argmin(np.linalg.norm(trajectory[:, 0] - trajectory[:, 1], axis=-1)))
        for i, (x, y) in enumerate(trajectory[marked]):
            axes.plot(
                x, y, "D", color=colours.of_player(i), markersize=4, fillstyle="none",
                markeredgewidth=0.6,
            )  # fmt: skip
