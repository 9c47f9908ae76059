"""Defaults of the middleware, for what the user has not set."""

from __future__ import annotations

import os

from rclpy.utilities import get_rmw_implementation_identifier

from gameinfer_ros.scenario import files as scenario_files

#: How far nodes look for others.
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"

#: Not beyond this machine. To what a profile of Fast DDS says, ROS adds shared memory then.
LOCALHOST = "LOCALHOST"

#: As a profile of Fast DDS says, and nothing else.
SYSTEM_DEFAULT = "SYSTEM_DEFAULT"

#: The file with the profile of Fast DDS.
FAST_DDS = "FASTRTPS_DEFAULT_PROFILES_FILE"

#: Ranges beyond this machine. ROS takes unknown ones for `LOCALHOST`.
_FAR = ("SUBNET", SYSTEM_DEFAULT)

#: Variables by which the user names others, perhaps on other machines.
_OTHERS = ("ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER")


def set_defaults() -> None:
    """Keep nodes of this process, and of those it starts, to this machine and out of shared memory.

    With the range `LOCALHOST` alone, Fast DDS still answers other machines, and killed processes
    leave shared memory behind. So unless the user opens the nodes to others or has a profile, its
    profile is `config/fast_dds_loopback.xml`, or `config/fast_dds.xml` if the nodes are open. By
    these, killed processes are also noticed after 3 s instead of 20 s. Empty variables count as
    unset.

    Raises:
        ScenarioError: the package is not installed completely.
    """
    alone = _opened_by() is None
    if not os.environ.get(FAST_DDS) and "fastrtps" in get_rmw_implementation_identifier():
        os.environ[FAST_DDS] = _profile("fast_dds_loopback" if alone else "fast_dds")
        if alone and os.environ.get(RANGE) != "OFF":
            os.environ[RANGE] = SYSTEM_DEFAULT
            os.environ.pop("ROS_LOCALHOST_ONLY", None)  # it would count instead of the range
    elif alone and not os.environ.get(RANGE):
        os.environ[RANGE] = LOCALHOST


def reachable_by() -> str | None:
    """The setting by which other machines may reach our nodes, None if they cannot.

    Call it after `set_defaults`.
    """
    profile = os.environ.get(FAST_DDS)
    if profile == _profile("fast_dds_loopback"):
        return None
    name = _opened_by() or (FAST_DDS if profile else None)
    return None if name is None else f"{name}={os.environ[name]}"


def enclave(process: str) -> list[str]:
    """Arguments behind --ros-args for a process that SROS2 gives rights of its own.

    Without security they do nothing. An enclave that comes later in the arguments counts instead.
    """
    return ["--enclave", f"/gameinfer_ros/{process}"]


def _opened_by() -> str | None:
    """The variable by which the user opens the nodes to other machines, if there is one."""
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":
        return None  # ROS itself looks at no other then
    if os.environ.get(RANGE) in _FAR:
        return RANGE
    return next((name for name in _OTHERS if os.environ.get(name)), None)


def _profile(name: str) -> str:
    return str(scenario_files.folder() / f"{name}.xml")
