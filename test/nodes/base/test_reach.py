"""Where nodes can be reached from: by default, from this machine only."""

from __future__ import annotations

import ipaddress
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from node_of_its_own import NodeOfItsOwn
from rclpy.node import Node
from ros_domain import free_domain
from sensor_msgs.msg import MultiDOFJointState

from gameinfer_ros.nodes.base import middleware
from gameinfer_ros.nodes.table import NODES
from gameinfer_ros.scenario import files as scenario_files
from msg_adapters import qos

#: Variables by which the user says which machines nodes reach.
SETTINGS = (
    middleware.RANGE,
    middleware.FAST_DDS,
    "ROS_LOCALHOST_ONLY",
    "ROS_STATIC_PEERS",
    "ROS_DISCOVERY_SERVER",
)
EVERYWHERE, LOOPBACK = "0.0.0.0", "127.0.0.1"


class Reachable(NodeOfItsOwn):
    """A node in a process of its own, and the ports on which it can be reached."""

    def __init__(self, module: str, log: Path, domain: int, *args: str, **settings: str) -> None:
        self._domain = domain
        environment = {k: v for k, v in os.environ.items() if k not in SETTINGS} | settings
        super().__init__(module, log, domain, "--ros-args", *args, environment=environment)
        self.until_ready()

    def _addresses(self, protocol: str, state: str) -> Iterator[tuple[str, int]]:
        """Local addresses and ports of the sockets of the process in some state."""
        links = Path(f"/proc/{self.process.pid}/fd").iterdir()
        found = (re.match(r"socket:\[(\d+)\]", os.readlink(link)) for link in links)
        own = {match[1] for match in found if match}
        for line in Path(f"/proc/net/{protocol}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[9] in own and fields[3] == state:
                address, port = fields[1].split(":")
                yield str(ipaddress.ip_address(bytes.fromhex(address)[::-1])), int(port, 16)

    @property
    def of_ros(self) -> set[str]:
        """Addresses on which it listens for others in its domain, at the ports of DDS."""
        first = 7400 + 250 * self._domain
        return {a for a, port in self._addresses("udp", "07") if first <= port < first + 250}

    @property
    def shared_memory(self) -> list[str]:
        """Files of Fast DDS in shared memory that it has mapped."""
        return re.findall(
            r"/dev/shm/\S*fast\S*", Path(f"/proc/{self.process.pid}/maps").read_text()
        )

    @property
    def of_tcp(self) -> set[str]:
        """Addresses on which it listens for connections."""
        return {address for address, _ in self._addresses("tcp", "0A")}


Start = Callable[..., Reachable]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    nodes: list[Reachable] = []

    def make(module: str, domain: int, *args: str, **settings: str) -> Reachable:
        nodes.append(Reachable(module, tmp_path / f"{len(nodes)}", domain, *args, **settings))
        return nodes[-1]

    yield make
    for node in nodes:
        node.end()


@pytest.fixture
def said_only(monkeypatch: pytest.MonkeyPatch) -> Callable[[dict[str, str]], None]:
    """Sets these variables of the environment, and none of the other settings."""

    def setting(said: dict[str, str]) -> None:
        for name in SETTINGS:
            monkeypatch.delenv(name, raising=False)
        for name, value in said.items():
            monkeypatch.setenv(name, value)
        monkeypatch.setattr(os, "environ", dict(os.environ))  # changes are not for other tests

    return setting


@pytest.mark.parametrize("module", NODES)
def test_by_default_a_node_listens_on_the_loopback_interface_only(
    module: str, start: Start
) -> None:
    free_port = ("-p", "port:=0") if module == "viewer" else ()
    node = start(module, free_domain(), *free_port)
    assert node.of_ros == {LOOPBACK}
    assert node.of_tcp == ({LOOPBACK} if module == "viewer" else set())
    assert not node.shared_memory


def test_so_does_one_whose_user_asks_for_that_and_nothing_else_counts(start: Start) -> None:
    others = {middleware.RANGE: "SUBNET", "ROS_STATIC_PEERS": "192.0.2.1"}
    assert start("simulator", free_domain(), ROS_LOCALHOST_ONLY="1", **others).of_ros == {LOOPBACK}


@pytest.mark.parametrize(
    "settings",
    [
        {middleware.RANGE: "SUBNET"},
        {"ROS_STATIC_PEERS": "192.0.2.1"},
        {middleware.RANGE: "LOCALHOST", middleware.FAST_DDS: "fast_dds.xml"},
    ],
    ids=["range", "peers", "profile"],
)
def test_the_user_can_say_that_others_may_reach_it(settings: dict[str, str], start: Start) -> None:
    if middleware.FAST_DDS in settings:
        folder = scenario_files.folder()
        settings = {**settings, middleware.FAST_DDS: str(folder / settings[middleware.FAST_DDS])}
    node = start("simulator", free_domain(), **settings)
    assert EVERYWHERE in node.of_ros
    # With a profile of the user, it is ROS that adds shared memory.
    assert bool(node.shared_memory) == (middleware.FAST_DDS in settings)


def test_nodes_without_these_settings_hear_it_on_the_same_machine(world: Any, start: Start) -> None:
    heard: list[MultiDOFJointState] = []
    tester: Node = world.tester
    tester.create_subscription(MultiDOFJointState, "joint_state", heard.append, qos.LATEST)
    start("simulator", tester.context.get_domain_id())
    world.until(lambda: heard)


@pytest.mark.parametrize(
    ("said", "reach", "profile", "by"),
    [
        ({}, "SYSTEM_DEFAULT", "fast_dds_loopback.xml", None),
        ({middleware.RANGE: "LOCALHOST"}, "SYSTEM_DEFAULT", "fast_dds_loopback.xml", None),
        ({middleware.RANGE: "OFF"}, "OFF", "fast_dds_loopback.xml", None),
        ({middleware.RANGE: "SUBNET"}, "SUBNET", "fast_dds.xml", middleware.RANGE),
        ({"ROS_STATIC_PEERS": "192.0.2.1"}, None, "fast_dds.xml", "ROS_STATIC_PEERS"),
        ({"ROS_DISCOVERY_SERVER": "192.0.2.1:1"}, None, "fast_dds.xml", "ROS_DISCOVERY_SERVER"),
        ({"ROS_LOCALHOST_ONLY": "1"}, "SYSTEM_DEFAULT", "fast_dds_loopback.xml", None),
        ({"ROS_LOCALHOST_ONLY": "0"}, "SYSTEM_DEFAULT", "fast_dds_loopback.xml", None),
        (
            {"ROS_LOCALHOST_ONLY": "1", middleware.RANGE: "SUBNET"},
            "SYSTEM_DEFAULT",
            "fast_dds_loopback.xml",
            None,
        ),
        (dict.fromkeys(SETTINGS, ""), "SYSTEM_DEFAULT", "fast_dds_loopback.xml", None),
        ({middleware.FAST_DDS: "/own.xml"}, "LOCALHOST", "/own.xml", middleware.FAST_DDS),
    ],
)
def test_what_the_user_says_counts(
    said: dict[str, str],
    reach: str | None,
    profile: str,
    by: str | None,
    said_only: Callable[[dict[str, str]], None],
) -> None:
    said_only(said)
    for _ in range(2):  # a process that this one starts does so once more
        middleware.set_defaults()
        assert os.environ.get(middleware.RANGE) == reach
        assert os.environ[middleware.FAST_DDS] == str(scenario_files.folder() / profile)
        assert os.environ.get("ROS_LOCALHOST_ONLY") != "1"
        assert middleware.reachable_by() == (by and f"{by}={said[by]}")


@pytest.mark.parametrize(
    ("said", "reach", "by"),
    [
        ({}, "LOCALHOST", None),
        ({middleware.RANGE: "LOCALHOST"}, "LOCALHOST", None),
        ({middleware.RANGE: "SUBNET"}, "SUBNET", middleware.RANGE),
    ],
)
def test_another_middleware_is_kept_to_this_machine_by_the_range(
    said: dict[str, str],
    reach: str,
    by: str | None,
    said_only: Callable[[dict[str, str]], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said_only(said)
    monkeypatch.setattr(middleware, "get_rmw_implementation_identifier", lambda: "rmw_cyclonedds")
    middleware.set_defaults()
    assert os.environ[middleware.RANGE] == reach
    assert middleware.FAST_DDS not in os.environ
    assert middleware.reachable_by() == (by and f"{by}={said[by]}")
