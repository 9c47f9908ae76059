"""Defaults of the middleware, used unless the user sets others."""

import os

from rclpy.utilities import get_rmw_implementation_identifier

from gameinfer_ros.scenario import files as scenario_files

#: The variable for the range of discovery.
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"

#: A range of this machine only. With it, ROS adds shared memory to a profile of Fast DDS.
LOCALHOST = "LOCALHOST"

#: A range that leaves a profile of Fast DDS unchanged.
SYSTEM_DEFAULT = "SYSTEM_DEFAULT"

#: The variable that names the profile file of Fast DDS.
FAST_DDS = "FASTRTPS_DEFAULT_PROFILES_FILE"

#: Ranges beyond this machine. ROS treats unknown values as `LOCALHOST`.
_FAR = ("SUBNET", SYSTEM_DEFAULT)

#: Variables by which the user names peers, perhaps on other machines.
_OTHERS = ("ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER")


def set_defaults() -> None:
    """Restrict the nodes of this process and its children to this machine, without shared memory.

    With the range `LOCALHOST` alone, Fast DDS still answers other machines, and killed processes
    leave shared memory behind. Unless the user sets a profile, the profile is therefore
    `config/fast_dds_loopback.xml`, or `config/fast_dds.xml` if the user opens the nodes to other
    machines. With these profiles, killed processes are detected after 3 s instead of 20 s. Empty
    variables count as unset.

    Raises:
        ScenarioError: the installation of the package is incomplete.
    """
    alone = _opened_by() is None
    if not os.environ.get(FAST_DDS) and "fastrtps" in get_rmw_implementation_identifier():
        os.environ[FAST_DDS] = _profile("fast_dds_loopback" if alone else "fast_dds")
        if alone and os.environ.get(RANGE) != "OFF":
            os.environ[RANGE] = SYSTEM_DEFAULT
            os.environ.pop("ROS_LOCALHOST_ONLY", None)  # it would override the range
    elif alone and not os.environ.get(RANGE):
        os.environ[RANGE] = LOCALHOST


def reachable_by() -> str | None:
    """After `set_defaults`: the setting that lets other machines reach the nodes, if any."""
    profile = os.environ.get(FAST_DDS)
    if profile == _profile("fast_dds_loopback"):
        return None
    name = _opened_by() or (FAST_DDS if profile else None)
    return None if name is None else f"{name}={os.environ[name]}"


def enclave(process: str) -> list[str]:
    """Arguments after --ros-args that put a process into its own SROS2 enclave.

    They have no effect without security. A later `--enclave` in the arguments overrides them.
    """
    return ["--enclave", f"/gameinfer_ros/{process}"]


def _opened_by() -> str | None:
    """The variable by which the user opens the nodes to other machines; None if there is none."""
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":
        return None  # ROS ignores the other variables then
    if os.environ.get(RANGE) in _FAR:
        return RANGE
    return next((name for name in _OTHERS if os.environ.get(name)), None)


def _profile(name: str) -> str:
    return str(scenario_files.folder() / f"{name}.xml")
