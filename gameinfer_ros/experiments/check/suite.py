"""The suite of standard games, and the table of their checks."""

from collections.abc import Mapping
from typing import Any

from gameinfer_ros import scenario as scenarios
from gameinfer_ros.experiments.study import Table, command
from gameinfer_ros.scenario import Scenario

#: Scenario that the suite also contains with all costs multiplied by each of these factors. That
#: does not change the equilibria.
SCALED, FACTORS = "three_player", (0.01, 1, 100)


def games() -> dict[str, Scenario]:
    """Load all games of the suite, by name; raises `ScenarioError` if one is missing or invalid."""
    loaded = {name: command.load(str(path)) for name, path in scenarios.suite().items()}
    base = command.load(SCALED)
    return loaded | {
        SCALED if factor == 1 else f"{SCALED}_x{factor:g}": scaled(base, factor)
        for factor in FACTORS
    }


def scaled(scenario: Scenario, factor: float) -> Scenario:
    """Return the scenario with all weights multiplied by a factor."""
    content = scenario.model_dump()
    for cost in content["costs"]:
        if "weight" in cost:
            cost["weight"] *= factor
        else:
            cost["weights"] = [factor * weight for weight in cost["weights"]]
    return Scenario.model_validate(content)


def table(figures: Mapping[str, Mapping[str, Any]]) -> Table:
    """Format the figures of `CheckStudy`, by game, with one line for each game."""
    rows = []
    for name, of_game in figures.items():
        gaps = of_game["relative_gap"].values()
        line = [name, str(len(gaps)), f"{100 * of_game['converged_share']:.0f} %"]
        converged = round(of_game["samples"] * of_game["converged_share"])
        if not converged:
            rows.append([*line, *("unknown",) * 4, "0"])
            continue
        rows.append(
            [
                *line,
                f"{of_game['median_iterations']:.0f}",
                *(
                    f"{100 * max(gap[key] for gap in gaps):.2f} %"
                    for key in ("median", "percentile_95")
                ),
                f"{100 * of_game['collided'] / converged:.0f} %",
                str(of_game["above_tolerance"]),
            ]
        )
    title = (
        "N players; share of seeds that converged; of these: median iterations, median and 95 % "
        "of the gap of the player with the largest one, collisions, and equilibria with a gap "
        "above the tolerance"
    )
    # Short, so that the table fits into a terminal of 80 columns.
    header = ["game", "N", "conv.", "iter.", "gap", "95 %", "coll.", "above"]
    return Table(title, header, rows)
