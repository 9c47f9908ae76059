"""The parameters, topics and services of the nodes, for checks before the nodes exist."""

from collections.abc import Sequence
from dataclasses import dataclass

from gameinfer_ros.names.ros_args import Rule
from gameinfer_ros.nodes.table import NODES

#: Parameters of all nodes. rclpy declares the first two.
_COMMON = ("use_sim_time", "start_type_description_service", "scenario", "time")

#: Further parameters, by node.
_PARAMETERS = {
    "simulator": (
        *("steps", "subscribers", "publish_clock", "external", "odom_timeout", "odom_time"),
    ),
    "inference": (
        *("particles", "seed", "robot_plays", "planner", "planner_seed", "threads", "deadline"),
    ),
    "robot_planner": ("plan_length", "brake_after", "max_strategy_age", "safety"),
    "human_agent": ("plan_length", "player", "seed"),
    "viewer": ("host", "port", "control", "steps"),
}

#: Names of all parameters of all nodes.
ALL_PARAMETERS = frozenset(_COMMON).union(*_PARAMETERS.values())

#: Topics of all nodes.
_COMMON_TOPICS = ("/diagnostics", "/parameter_events", "/rosout", "/clock", "run_start")

#: Further topics, by node. `PLAYER` is each player, `ROBOT` the robot, and `OWN` the node's player.
_TOPICS = {
    "simulator": ("joint_state", "PLAYER/control", "PLAYER/odom"),
    "inference": (
        *("joint_state", "belief", "map_equilibrium", "map_strategy", "robot_strategy", "markers"),
    ),
    "robot_planner": ("joint_state", "robot_strategy", "ROBOT/control", "ROBOT/cmd_vel"),
    "human_agent": ("joint_state", "OWN/control"),
    "viewer": ("joint_state", "belief", "markers"),
}

#: Services of all nodes, which rclpy creates.
_COMMON_SERVICES = tuple(
    f"~/{name}"
    for name in (
        *("describe_parameters", "get_parameter_types", "get_parameters", "list_parameters"),
        *("set_parameters", "set_parameters_atomically", "get_type_description"),
    )
)

#: Further services that a node offers or calls. `HUMAN` is each human.
_SERVICES = {
    "simulator": ("~/pause", "~/reset"),
    "inference": ("~/reset",),
    "robot_planner": (),
    "human_agent": ("~/reset",),
    "viewer": ("simulator/pause", "simulator/reset", "inference/reset", "HUMAN_agent/reset"),
}


@dataclass(frozen=True)
class NodeInterface:
    """The names that arguments of a node can refer to.

    Attributes:
        kind: name of the node in the table of nodes.
        name: name of the node.
        namespace: namespace of the node.
        players: names of the players of the scenario.
        own: the player that a human agent plays.
    """

    kind: str
    name: str
    namespace: str
    players: Sequence[str]
    own: str = ""

    @property
    def full_name(self) -> str:
        """Name with the namespace."""
        return join(self.namespace, self.name)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return (*_COMMON, *_PARAMETERS[self.kind])

    @property
    def topics(self) -> list[str]:
        """Names of the topics before any remapping, relative if possible."""
        return self._filled((*_COMMON_TOPICS, *_TOPICS[self.kind]))

    @property
    def services(self) -> list[str]:
        """Names of the services before any remapping, relative or private."""
        return self._filled((*_COMMON_SERVICES, *_SERVICES[self.kind]))

    def uses(self, rule: Rule) -> bool:
        """Whether a parameter or remapping has an effect on the node."""
        if rule.is_special:
            return rule.node in (None, self.name, self.kind)
        if rule.node not in (None, self.name):
            return False
        if rule.is_parameter:
            return rule.name in self.parameters
        named = {
            "rostopic": self.topics,
            "rosservice": self.services,
            "": self.topics + self.services,
        }[rule.scheme]
        return self.expanded(rule.name) in map(self.expanded, named)

    def expanded(self, name: str) -> str:
        """The absolute form of the name of a topic or service."""
        if name.startswith("~"):
            return self.full_name + name[1:]
        return join(self.namespace, name)

    def _filled(self, names: Sequence[str]) -> list[str]:
        filled = []
        for name in names:
            found = {
                "PLAYER": self.players,
                "HUMAN": self.players[1:],
                "ROBOT": self.players[:1],
                "OWN": [self.own],
            }
            place = next((p for p in found if name.startswith(p)), None)
            filled += [name.replace(place, p) for p in found[place]] if place else [name]
        return filled


def join(namespace: str, name: str) -> str:
    """Prefix a relative name with a namespace; an absolute name stays as it is."""
    return name if name.startswith("/") else f"{namespace.rstrip('/')}/{name}"


def known_nodes(namespace: str, players: Sequence[str]) -> list[str]:
    """Full names that nodes of a run may have, and those of the nodes that record a run."""
    agents = [f"{name}_agent" for name in players]
    return [join(namespace, name) for name in (*NODES, *agents, "recorder", "bag_recorder")]
