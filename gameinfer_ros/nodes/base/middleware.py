"""What the middleware does where the user has not said anything."""

from __future__ import annotations

import os

from gameinfer_ros.scenario import files as scenario_files

#: How far nodes look for others, and how far when the user says nothing: not beyond this machine.
RANGE, LOCALHOST = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"

#: Ranges beyond this machine. What ROS does not know, it takes for `LOCALHOST`.
_FAR = ("SUBNET", "SYSTEM_DEFAULT")

#: By these the user names others, perhaps on other machines.
_OTHERS = ("ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER")

#: What Fast DDS is told by a file.
FAST_DDS = "FASTRTPS_DEFAULT_PROFILES_FILE"


def set_defaults() -> None:
    """Keep nodes of this process, and of those it starts, to this machine.

    By the range alone, Fast DDS does not look for other machines, but answers them. So unless the
    user opens the nodes to others, it is told to listen on the loopback interface only. Those that
    get killed are given up after 3 s, and not after 20 s: see `config/fast_dds.xml`. A variable of
    the environment that is empty says nothing.

    Raises:
        ScenarioError: the package is not installed as a whole.
    """
    alone = _opened_by() is None
    if alone and not os.environ.get(RANGE):
        os.environ[RANGE] = LOCALHOST
    if not os.environ.get(FAST_DDS):
        os.environ[FAST_DDS] = _profile("fast_dds_loopback" if alone else "fast_dds")


def reachable_by() -> str | None:
    """The setting by which other machines may reach our nodes, None if they cannot.

    It is to be asked for after `set_defaults`.
    """
    name = _opened_by()
    if name is None and os.environ[FAST_DDS] != _profile("fast_dds_loopback"):
        name = FAST_DDS
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
