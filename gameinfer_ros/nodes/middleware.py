"""What the middleware does where the user has not said anything."""

from __future__ import annotations

import os

from gameinfer_ros import scenario_files

#: How far nodes look for others, and how far when the user says nothing: not beyond this machine.
RANGE, LOCALHOST = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"

#: By any of these, the user says something about it too.
_OTHER_WORDS = ("ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER")

#: What Fast DDS is told by a file.
FAST_DDS = "FASTRTPS_DEFAULT_PROFILES_FILE"


def set_defaults() -> None:
    """Keep nodes of this process, and of those it starts, to this machine.

    By the range alone, Fast DDS does not look for other machines, but answers them. So where the
    range is `LOCALHOST`, it is told to listen on the loopback interface only. Those that get killed
    are given up after 3 s, and not after 20 s: see `config/fast_dds.xml`. Environment variables by
    which the user says something else count.

    Raises:
        ScenarioError: the package is not installed as a whole.
    """
    alone = not any(name in os.environ for name in _OTHER_WORDS)
    if alone:
        alone = os.environ.setdefault(RANGE, LOCALHOST) == LOCALHOST
    profile = "fast_dds_loopback.xml" if alone else "fast_dds.xml"
    os.environ.setdefault(FAST_DDS, str(scenario_files.folder() / profile))


def enclave(process: str) -> list[str]:
    """Arguments behind --ros-args for a process that SROS2 gives rights of its own.

    Without security they do nothing. An enclave that comes later in the arguments counts instead.
    """
    return ["--enclave", f"/gameinfer_ros/{process}"]
