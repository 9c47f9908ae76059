"""The figure of the study of equilibria: one panel per cluster."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from gameinfer_ros.names import colours

#: Largest number of clusters drawn; those with the lowest cost for the robot come first.
MOST = 12

#: Largest number of panels in a row.
COLUMNS = 4

#: Depth of colour of the cheapest trajectory, from 0 (white) to 1.
PALEST = 0.35


class Panel(NamedTuple):
    """The contents of a panel: one cluster of K equilibria among N players."""

    trajectories: np.ndarray  # positions (K, S, N, 2) of the equilibria, in m
    initial: np.ndarray  # positions (K, S', N, 2) of the rolled-out initial strategies, in m
    costs: np.ndarray  # cost (K, N) of each equilibrium to each player
    median_cost: Sequence[float]  # median (N,) of these costs
    radii: np.ndarray  # radius (N,) of each player, in m


def draw(players: Sequence[str], panels: Sequence[Panel], clusters: int) -> Figure:
    """Draw the trajectories of each cluster, and below them the initial strategies.

    A deeper colour means a higher cost to the player. `clusters` is the number of all clusters,
    including those without a panel.
    """
    columns = max(2, min(COLUMNS, len(panels)))
    groups = max(1, -(-len(panels) // columns))
    figure = Figure(figsize=(3 * columns, 5.2 * groups + 0.6), layout="constrained")
    mark = "closest approach" if len(players) == 2 else "middle of the horizon"
    which = "" if len(panels) == clusters else f", the {len(panels)} cheapest for the robot shown"
    figure.suptitle(
        f"{clusters} clusters of equilibria{which}\n"
        f"start (dot), {mark} (diamond); deeper colours mean higher costs",
        fontsize="medium",
    )
    grid = figure.subplots(
        2 * groups, columns, squeeze=False, sharex="row", sharey="row",
        height_ratios=[1.0, 0.72] * groups,
    )  # fmt: skip
    for axes in grid.flat:
        axes.set_aspect("equal")
    # Above and below of each cell, row by row.
    cells = grid.reshape(groups, 2, columns).swapaxes(1, 2).reshape(-1, 2)
    # The costs of the palest and the deepest colour; outliers do not set the scale.
    costs = np.concatenate([panel.costs for panel in panels] or [np.zeros((1, len(players)))])
    low, high = np.percentile(costs, [2, 98])
    for number, ((above, below), panel) in enumerate(zip(cells, panels, strict=False), 1):
        scaled = np.clip((panel.costs - low) / np.maximum(high - low, 1e-9), 0.0, 1.0)
        _draw_panel(above, below, panel, number, PALEST + (1 - PALEST) * scaled)
    for axes in cells[len(panels) :].flat:
        axes.set_visible(False)
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


def _draw_panel(above, below, panel: Panel, number: int, depths: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    """Draw a cluster and its initial strategies into two axes, with depths of colour (K, N)."""
    _draw_trajectories(above, panel.trajectories, depths)
    _mark(above, panel.trajectories)
    for i in np.flatnonzero(panel.radii).tolist():
        start = panel.trajectories[0, 0, i]
        disc = Circle(start, panel.radii[i], color=colours.of_player(i), alpha=0.25)
        above.add_patch(disc)
    costs = ", ".join(f"{cost:.0f}" for cost in panel.median_cost)
    seeds = f"{len(panel.costs)} seed{'s' * (len(panel.costs) != 1)}"
    above.set_title(f"{number}: {seeds}\ncosts {costs}", fontsize="small")
    _draw_trajectories(below, panel.initial, depths)
    below.set_title("rollout of the initial strategies", fontsize="small")


def _draw_trajectories(axes, trajectories: np.ndarray, depths: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    """Draw trajectories (K, S, N, 2) with depths of colour (K, N), the deepest on top."""
    for i in range(trajectories.shape[2]):
        colour = np.array(to_rgb(colours.of_player(i)))
        for k in np.argsort(depths[:, i]).tolist():
            x, y = trajectories[k, :, i].T
            axes.plot(x, y, color=tuple(1 - depths[k, i] * (1 - colour)), linewidth=0.8)
        axes.plot(*trajectories[0, 0, i], "o", color=colours.of_player(i), markersize=5)


def _mark(axes, trajectories: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    """Mark the closest approach of two players, or the positions of several at half the horizon."""
    for trajectory in trajectories:
        marked = len(trajectory) // 2
        if trajectory.shape[1] == 2:
            marked = int(np.argmin(np.linalg.norm(trajectory[:, 0] - trajectory[:, 1], axis=-1)))
        for i, (x, y) in enumerate(trajectory[marked]):
            axes.plot(
                x, y, "D", color=colours.of_player(i), markersize=4, fillstyle="none",
                markeredgewidth=0.6,
            )  # fmt: skip
