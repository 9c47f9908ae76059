"""The nodes of a run."""

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
    """Return the name, the module and the parameters of each node."""
    seeds, steps = RunSeeds.of_run(options.seed), options.steps or 0
    humans = [n for n in scenario.game.players.names[1:] if n not in options.external]
    # All players, the inference, the recorders of this process, and the viewer.
    subscribers = len(humans) + 3 + (options.record is not None) + options.view
    external = ",".join(options.external)
    nodes: list[tuple[str, str, dict[str, Any]]] = [
        (
            "simulator",
            "simulator",
            {"steps": steps, "subscribers": subscribers, "external": external},
        ),
        (
            "inference",
            "inference",
            {
                "seed": seeds.inference,
                "particles": options.particles or 0,
                "planner": options.planner,
                "planner_seed": seeds.planner,
            },
        ),
        ("robot_planner", "robot_planner", {"safety": not options.no_safety}),
    ]
    for human in humans:
        nodes.append((f"{human}_agent", "human_agent", {"player": human, "seed": seeds.humans}))
    if options.view:
        page = {"steps": steps, "port": options.view_port, "control": options.control}
        nodes.append((VIEWER, "viewer", page))
    common = {"scenario": str(scenario_file), "time": options.time}
    return [(name, module, {**common, **parameters}) for name, module, parameters in nodes]
