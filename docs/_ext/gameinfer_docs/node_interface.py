"""The parameters, topics and services of nodes, read from constructed nodes."""

from __future__ import annotations

import os
import random
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile

from gameinfer_ros.names.defaults import VIEW_PORT
from gameinfer_ros.scenario import Scenario
from msg_adapters import qos

#: Namespace of the constructed nodes, which distinguishes relative names from absolute ones.
NAMESPACE = "/documentation"

#: Parameters, services and topics of every rclpy node.
COMMON_PARAMETERS = {"use_sim_time", "start_type_description_service"}
COMMON_SERVICES = re.compile(
    r"~/(get|set|list|describe)_parameter(s|_types|s_atomically)|~/get_type_description"
)
COMMON_TOPICS = {"/rosout", "/parameter_events"}

#: Values of parameters that add or remove topics although they are not switches.
EXAMPLES = {"external": "human_1"}

#: Parameters that must be set together with another one.
TOGETHER = {"external": {"time": "realtime"}}

#: Port of the constructed nodes: the default port may be in use where the site is built.
FREE_PORT = 0


@dataclass(frozen=True)
class ParameterFacts:
    """A parameter as shown in the reference."""

    name: str
    kind: str
    default: str
    allowed: str
    read_only: bool
    description: str


@dataclass(frozen=True)
class Endpoint:
    """A publisher, subscription or service."""

    role: str  # `publishes`, `subscribes` or `serves`
    name: str  # relative to the namespace or absolute, with `<player>` for any player
    type: str  # such as `std_msgs/Float64MultiArray`
    profile: str  # name of the QoS profile; empty for a service
    condition: str = ""  # value of a parameter that adds or removes the endpoint, if any


@dataclass(frozen=True)
class NodeInterface:
    """Parameters and endpoints of a class of nodes."""

    parameters: list[ParameterFacts]
    endpoints: list[Endpoint]


@contextmanager
def private_context() -> Iterator[rclpy.Context]:
    """Provide a context in a random domain, limited to this machine."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    context = rclpy.Context()
    quiet = ["--ros-args", "--log-level", "warn"]
    rclpy.init(args=quiet, context=context, domain_id=random.SystemRandom().randint(1, 101))
    try:
        yield context
    finally:
        context.try_shutdown()
        # The level belongs to the whole process, so it would affect later nodes.
        set_logger_level("", LoggingSeverity.INFO)


def interface_of(
    node_class: type[Node], context: rclpy.Context, options: Mapping[str, Any] | None = None
) -> NodeInterface:
    """Construct a node of a class for each value of its switches, and read its interface.

    Args:
        node_class: a class that takes the arguments of `rclpy.node.Node`.
        context: context of the nodes.
        options: further arguments of the class.
    """

    def made(**overrides: Any) -> tuple[list[ParameterFacts], list[Endpoint]]:
        values = {"port": FREE_PORT, **overrides}
        chosen = [Parameter(name, value=value) for name, value in values.items()]
        common = {"context": context, "namespace": NAMESPACE, "parameter_overrides": chosen}
        node = node_class(**common, **(options or {}))
        try:
            return _parameters(node), _endpoints(node)
        finally:
            node.destroy_node()

    parameters, endpoints = made()
    found = dict.fromkeys(endpoints)
    for name, value in ((p.name, value) for p in parameters for value in _other_values(p)):
        _, others = made(**{name: value, **TOGETHER.get(name, {})})
        shown = "names the player" if name in EXAMPLES else f"is `{str(value).lower()}`"
        for endpoint in dict.fromkeys(others):
            if endpoint not in endpoints:
                found[replace(endpoint, condition=f"if `{name}` {shown}")] = None
        for endpoint in endpoints:
            if endpoint not in others and endpoint in found:
                del found[endpoint]
                found[replace(endpoint, condition=f"unless `{name}` {shown}")] = None
    return NodeInterface(parameters, sorted(found, key=lambda e: (e.role, e.name)))


def _other_values(parameter: ParameterFacts) -> list[Any]:
    """Return the values of a switch other than its default; empty if it is not a switch."""
    if parameter.name in EXAMPLES:
        return [EXAMPLES[parameter.name]]
    if parameter.kind == "bool":
        return [parameter.default != "true"]
    choices = re.fullmatch(r"one of (.*)", parameter.allowed)
    return [c for c in choices[1].split(", ") if c != parameter.default] if choices else []


def _parameters(node: Node) -> list[ParameterFacts]:
    values = node.get_parameters_by_prefix("")
    names = [
        name
        for name in values
        if name not in COMMON_PARAMETERS and not name.startswith("qos_overrides.")
    ]
    return [
        _in_words(descriptor, values[descriptor.name].value)
        for descriptor in node.describe_parameters(names)
    ]


def _in_words(descriptor: ParameterDescriptor, value: Any) -> ParameterFacts:
    if descriptor.name == "port":
        value = VIEW_PORT
    ranges = [*descriptor.integer_range, *descriptor.floating_point_range]
    allowed = [f"{r.from_value:g} to {_shown(r.to_value)}" for r in ranges]
    if descriptor.additional_constraints:
        allowed.append(descriptor.additional_constraints)
    return ParameterFacts(
        descriptor.name,
        Parameter.Type(descriptor.type).name.lower().replace("_", " "),
        str(value).lower() if isinstance(value, bool) else str(value),
        ", ".join(allowed),
        descriptor.read_only,
        descriptor.description,
    )


def _shown(number: float) -> str:
    return {2**63 - 1: "2^63 - 1"}.get(int(number), f"{number:g}" if number < 1e6 else str(number))


def _endpoints(node: Node) -> list[Endpoint]:
    found = []
    for role, members in (("publishes", node.publishers), ("subscribes", node.subscriptions)):
        for member in members:
            name = _relative(member.topic_name, node)
            if name not in COMMON_TOPICS:
                profile = profile_name(member.qos_profile)
                found.append(Endpoint(role, name, type_name(member.msg_type), profile))
    for service in node.services:
        name = _relative(node.resolve_service_name(service.srv_name), node)
        if not COMMON_SERVICES.fullmatch(name):
            found.append(Endpoint("serves", name, type_name(service.srv_type), ""))
    return list(dict.fromkeys(found))


def _relative(name: str, node: Node) -> str:
    name = re.sub(rf"^{node.get_fully_qualified_name()}/", "~/", name)
    name = name.removeprefix(f"{NAMESPACE}/")
    first, _, rest = name.partition("/")
    return f"<player>/{rest}" if first in Scenario.load("three_player").players else name


def type_name(message_type: Any) -> str:
    """Return the package and name of a type, with `srv` in between for a service."""
    package, kind = message_type.__module__.split(".")[:2]
    return f"{package}/{'srv/' if kind == 'srv' else ''}{message_type.__name__}"


def profile_name(profile: QoSProfile) -> str:
    """Return the name of a QoS profile in `msg_adapters.qos`.

    Raises:
        LookupError: `msg_adapters.qos` does not contain the profile.
    """
    for name, named in vars(qos).items():
        if isinstance(named, QoSProfile) and _same(profile, named):
            return name
    if profile.depth == qos.QUEUE:
        return f"as published, with a queue of {qos.QUEUE}"
    raise LookupError(f"{profile} is not a profile of msg_adapters.qos")


def _same(one: QoSProfile, other: QoSProfile) -> bool:
    return all(
        getattr(one, part) == getattr(other, part)
        for part in ("history", "depth", "reliability", "durability")
    )
