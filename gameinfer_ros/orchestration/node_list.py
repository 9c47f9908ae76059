"""The nodes of a run."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario

#: Node that shows the run on a web page.
VIEWER = "viewer"


def node_list(
    scenario: Scenario, scenario_file: Path, options: argparse.Namespace
) -> list[tuple[str, str, dict[str, Any]]]:
    """Name, module and parameters of each node."""
    seeds = RunSeeds.of_run(options.seed)
    common = {"scenario": str(scenario_file), "time": options.time}
    external = options.external
    humans = [name for name in scenario.game.players.names[1:] if name not in external]
    nodes: list[tuple[str, str, dict[str, Any]]] = [
        (
            "simulator",
            "simulator",
            # Every player, the inference, our recorder, that of a bag, and the viewer.
            {
                **common,
                "steps": options.steps or 0,
                "subscribers": len(humans) + 3 + (options.record is not None) + options.view,
                "external": ",".join(external),
            },
        ),
        (
            "inference",
            "inference",
            {
                **common,
                "seed": seeds.inference,
                "particles": options.particles or 0,
                "planner": options.planner,
                "planner_seed": seeds.planner,
            },
        ),
        (
            "robot_planner",
            "robot_planner",
            {
                **common,
                "safety": not options.no_safety,
            },
        ),
    ]
    for human in humans:
        parameters = {**common, "player": human, "seed": seeds.humans}
        nodes.append((f"{human}_agent", "human_agent", parameters))
    if options.view:
        parameters = {
            **common,
            "steps": options.steps or 0,
            "port": options.view_port,
            "control": options.control,
        }
        nodes.append((VIEWER, "viewer", parameters))
    return nodes
