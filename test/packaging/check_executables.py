"""Checks an installed package: the ament index finds it, and every executable starts and stops.

Usage: check_executables.py PREFIX, in the environment in which the executables shall run.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from importlib.metadata import distribution
from importlib.resources import files
from pathlib import Path

from ament_index_python import get_package_prefix, get_package_share_directory

PACKAGE = "gameinfer_ros"
COMMANDS = {"gameinfer", "orchestrator"}  # these end by themselves, the others are nodes
#: On however busy a machine.
UP_WITHIN_S = 120.0
STOPPED_WITHIN_S = 60.0


def main() -> None:
    """Check the package installed under the prefix."""
    prefix = Path(sys.argv[1]).resolve()
    check_index(prefix)
    check_data()
    folder = prefix / "lib" / PACKAGE
    names = sorted(path.name for path in folder.iterdir())
    wanted = sorted(
        entry.name
        for entry in distribution(PACKAGE).entry_points
        if entry.group == "console_scripts"
    )
    expect(names == wanted, f"executables in {folder}: {names}, wanted: {wanted}")
    with tempfile.TemporaryDirectory() as elsewhere:
        for name in names:
            link = Path(elsewhere) / f"link_to_{name}"
            link.symlink_to(folder / name)
            (check_command if name in COMMANDS else check_node)(link, name)


def check_data() -> None:
    """Files that are no modules are installed too."""
    for module, name in (("experiments.report", "page.html.j2"), ("view", "page.html")):
        file = files(f"{PACKAGE}.{module}") / name
        expect(file.is_file(), f"no {file}")


def check_index(prefix: Path) -> None:
    """The ament index finds the package and its configuration below the prefix."""
    found = Path(get_package_prefix(PACKAGE)).resolve()
    expect(found == prefix, f"the ament index finds {found}, wanted: {prefix}")
    share = Path(get_package_share_directory(PACKAGE))
    expect((share / "package.xml").is_file(), f"no package.xml in {share}")
    for suffix in ("yaml", "rviz", "json"):
        expect(any((share / "config").glob(f"*.{suffix}")), f"no .{suffix} file in {share}/config")


def check_command(executable: Path, name: str) -> None:
    """A command answers --help."""
    result = subprocess.run(
        [executable, "--help"],
        env=environment(),
        cwd=executable.parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=60,
        check=False,
    )
    expect(result.returncode == 0, f"{name} --help: exit {result.returncode}\n{result.stdout}")
    print(f"{name}: answers --help")


def check_node(executable: Path, name: str) -> None:
    """A node starts, and ends well on SIGINT."""
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(
            [executable],
            env=environment(),
            cwd=executable.parent,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            started_after_s = wait_until_up(process, log.fileno())
            os.killpg(process.pid, signal.SIGINT)
            status = process.wait(STOPPED_WITHIN_S)
            expect(status == 0, f"{name}: exit {status} on SIGINT\n{text_of(log.fileno())}")
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
    print(f"{name}: up after {started_after_s:.1f} s, ended well on SIGINT")


def wait_until_up(process: subprocess.Popen[bytes], log: int) -> float:
    """Wait until a node has joined ROS; it may compile for long after that."""
    start = time.monotonic()
    while process.poll() is None and not has_udp_socket(process.pid):
        expect(time.monotonic() - start < UP_WITHIN_S, f"it does not start\n{text_of(log)}")
        time.sleep(0.1)
    expect(process.poll() is None, f"it ended by itself\n{text_of(log)}")
    return time.monotonic() - start


def has_udp_socket(pid: int) -> bool:
    """Whether a process listens for UDP datagrams, as every node of DDS does."""
    lines = Path(f"/proc/{pid}/net/udp").read_text().splitlines()[1:]
    of_udp = {f"socket:[{line.split()[9]}]" for line in lines}
    found = set()
    for descriptor in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(OSError):  # it has just been closed
            found.add(os.readlink(descriptor))
    return not of_udp.isdisjoint(found)


def text_of(log: int) -> str:
    """What was written so far; reading does not move the writers' position."""
    return os.pread(log, 1_000_000, 0).decode(errors="replace")


def environment() -> dict[str, str]:
    """The environment of a fresh shell: without what the ROS wheels did at this one's start."""
    variables = os.environ | {
        "PYTHONUNBUFFERED": "1",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(1 + os.getpid() % 100),
    }
    if variables.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None):
        variables.pop("LD_LIBRARY_PATH", None)
    return variables


def expect(condition: bool, otherwise: str) -> None:
    """End with a message unless the condition holds."""
    if not condition:
        sys.exit(f"packaging check failed: {otherwise}")


if __name__ == "__main__":
    main()
