"""The node of a simulated human, who plays one equilibrium."""

import sys
from time import perf_counter
from typing import Any

from typing_extensions import override

from gameinfer_ros.nodes.base.follower_node import Observation
from gameinfer_ros.nodes.base.player_node import PlayerNode
from gameinfer_ros.nodes.base.spin import spin
from gameinfer_ros.planning import EquilibriumPlayer
from gameinfer_ros.solver import GameSolver
from msg_adapters import diagnostics


class HumanAgent(PlayerNode):
    """Plays one player's part of an equilibrium.

    The node re-solves the game from each state, with the previous solution as initial guess. Humans
    with the same `seed` that were reset equally often agree on an equilibrium. The robot does not
    know the seed.

    Services:
        ~/reset (std_srvs/srv/Trigger): switches to another equilibrium.
    """

    def __init__(self, name: str = "human_agent", **node_options: Any) -> None:
        super().__init__(name, **node_options)
        self._generator = self.declare_seed("determines the equilibrium that all humans agree on")
        self._solver = GameSolver(self.game, self.scenario.solver)
        self._solver.warm_up(alone=True)
        self.begin()
        self.control(self.players.names.index(self.own))
        self.get_logger().info(f"ready: {self.own} waits for states")

    @override
    def declare_own(self) -> str:
        names = self.players.names
        default = names[1] if len(names) > 1 else names[0]
        player: str = self.declare("player", default, "name of the player", choices=names)
        return player

    @override
    def begin(self) -> None:
        self._equilibrium = EquilibriumPlayer(self._solver, self.scenario.seeds, self._generator())

    @override
    def on_state(self, observation: Observation) -> None:
        start = perf_counter()
        strategy = self._equilibrium.solve(observation.step, observation.x)
        solve_ms = 1e3 * (perf_counter() - start)
        own, length = strategy.of_inputs(self.own_inputs), self.plan_length()
        plan = self.execution.act(own, observation.step, observation.s, length)
        self.publish_control(observation.step, plan.inputs)
        converged = self._equilibrium.converged
        self.report(
            "plays its equilibrium" if converged else "the solver did not converge",
            {
                "step": observation.step,
                "solve_ms": f"{solve_ms:.2f}",
                "iterations": self._equilibrium.iterations,
            },
            diagnostics.OK if converged else diagnostics.WARN,
        )


if __name__ == "__main__":
    sys.exit(spin(HumanAgent, sys.argv[1:]))
