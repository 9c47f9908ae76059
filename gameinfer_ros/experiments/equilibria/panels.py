"""The picture of the study of equilibria: a panel for each cluster."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from gameinfer_ros.names import colours

#: Clusters drawn at most: those that are cheapest for the robot.
MOST = 12

#: Panels side by side.
COLUMNS = 4

#: How much colour is left to the cheapest trajectory, from 0 (white) to 1.
PALEST = 0.35


class Panel(NamedTuple):
    """One cluster of K equilibria among N players.

    Attributes:
        trajectories: positions (K, S, N, 2) of the equilibria, in m.
        initial: positions (K, S', N, 2) of the initial strategies played out, in m.
        costs: cost (K, N) of each equilibrium to each player.
        median_cost: median cost (N,) of the cluster.
    """

    trajectories: np.ndarray
    initial: np.ndarray
    costs: np.ndarray
    median_cost: Sequence[float]


def draw(players: Sequence[str], panels: Sequence[Panel], clusters: int) -> Figure:
    """Draw all trajectories of each cluster, and below them the initial strategies that led there.

    The higher the cost of a trajectory to a player, the deeper its colour.

    Args:
        players: names of the players (N).
        panels: the clusters to draw.
        clusters: number of clusters found.
    """
    columns = max(2, min(COLUMNS, len(panels)))
    groups = max(1, -(-len(panels) // columns))
    figure = Figure(figsize=(3 * columns, 5.2 * groups + 0.6), layout="constrained")
    mark = "closest moment" if len(players) == 2 else "half the horizon"
    which = "" if len(panels) == clusters else f", the {len(panels)} cheapest for the robot"
    figure.suptitle(
        f"{clusters} clusters of equilibria{which}\n"
        f"trajectories from the start (dot), {mark} (diamond); deeper colours cost more",
        fontsize="medium",
    )
    grid = figure.subplots(
        2 * groups, columns, squeeze=False, sharex="row", sharey="row",
        height_ratios=[1.0, 0.72] * groups,
    )  # fmt: skip
    for axes in grid.flat:
        axes.set_aspect("equal")
    low, high = _cost_range(panels)
    for number, panel in enumerate(panels):
        group, column = divmod(number, columns)
        above, below = grid[2 * group, column], grid[2 * group + 1, column]
        scaled = np.clip((panel.costs - low) / np.maximum(high - low, 1e-9), 0.0, 1.0)
        depths = PALEST + (1 - PALEST) * scaled
        _draw_trajectories(above, panel.trajectories, depths)
        _mark(above, panel.trajectories)
        costs = ", ".join(f"{cost:.0f}" for cost in panel.median_cost)
        size = len(panel.costs)
        seeds = f"{size} seed{'' if size == 1 else 's'}"
        above.set_title(f"{number + 1}: {seeds}\ncosts {costs}", fontsize="small")
        _draw_trajectories(below, panel.initial, depths)
        below.set_title("initial strategies, played out", fontsize="small")
    for number in range(len(panels), groups * columns):
        group, column = divmod(number, columns)
        grid[2 * group, column].set_visible(False)
        grid[2 * group + 1, column].set_visible(False)
    handles = [
        grid[0, 0].plot([], [], color=colours.of_player(i), label=name)[0]
        for i, name in enumerate(players)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    for axes in grid[:, 0]:
        axes.set_ylabel("y in m", fontsize="small")
    for axes in grid[-1]:
        axes.set_xlabel("x in m", fontsize="small")
    return figure


def _cost_range(panels: Sequence[Panel]) -> tuple[float, float]:
    """Costs of the palest and the deepest colour; outliers do not set the scale."""
    if not panels:
        return 0.0, 1.0
    low, high = np.percentile(np.concatenate([panel.costs for panel in panels]), [2, 98])
    return float(low), float(high)


def _draw_trajectories(axes, trajectories: np.ndarray, depths: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    """Draw trajectories (K, S, N, 2) with depths of colour (K, N), the palest first."""
    for i in range(trajectories.shape[2]):
        colour = np.array(to_rgb(colours.of_player(i)))
        for k in np.argsort(depths[:, i]).tolist():
            x, y = trajectories[k, :, i].T
            axes.plot(x, y, color=tuple(1 - depths[k, i] * (1 - colour)), linewidth=0.8)
        axes.plot(*trajectories[0, 0, i], "o", color=colours.of_player(i), markersize=5)


def _mark(axes, trajectories: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    """Mark where two players are closest, or where several are after half the horizon."""
    for trajectory in trajectories:
        marked = len(trajectory) // 2
        if trajectory.shape[1] == 2:
            marked = int(np.argmin(np.linalg.norm(trajectory[:, 0] - trajectory[:, 1], axis=-1)))
        for i, (x, y) in enumerate(trajectory[marked]):
            axes.plot(
                x, y, "D", color=colours.of_player(i), markersize=4, fillstyle="none",
                markeredgewidth=0.6,
            )  # fmt: skip
