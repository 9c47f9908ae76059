"""Commands of a user who can write neither to the package nor to a home."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
import unprivileged
from ros_domain import free_domain
from small_scenario import ScenarioFile

UNCACHED = "Set NUMBA_CACHE_DIR to a folder that you can write to"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = unprivileged.install(tmp_path_factory.mktemp("package"))
    yield folder
    unprivileged.uninstall(folder)


class User:
    """Starts commands in a folder of their own, which is the only one that they can write to."""

    def __init__(self, package: Path, folder: Path) -> None:
        self.folder = folder
        self._environment = {
            **{name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"},
            "PYTHONPATH": str(package),
            "PYTHONDONTWRITEBYTECODE": "1",
            "NUMBA_OPT": "1",  # what is compiled here need not be fast
            "HOME": str(package / "home"),
            "TMPDIR": str(folder),
            "MPLCONFIGDIR": str(folder),
            "ROS_LOG_DIR": str(folder / "log"),
            "ROS_DOMAIN_ID": str(free_domain()),
        }
        for name in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "ROS_HOME"):
            self._environment.pop(name, None)

    def run(self, *arguments: str, **settings: str | None) -> subprocess.CompletedProcess[str]:
        return self.python("-m", *arguments, **settings)

    def python(self, *arguments: str, **settings: str | None) -> subprocess.CompletedProcess[str]:
        environment = {**self._environment, **settings}
        return subprocess.run(
            unprivileged.python(*arguments),
            env={name: value for name, value in environment.items() if value is not None},
            cwd=self.folder, capture_output=True, text=True, timeout=300,
        )  # fmt: skip


@pytest.fixture
def user(package: Path, tmp_path: Path) -> User:
    return User(package, tmp_path)


def test_a_study_works_without_a_cache_and_warns_once(
    user: User, scenario_file: ScenarioFile
) -> None:
    scenario = str(scenario_file("dd"))
    study = ("equilibria", "--scenario", scenario, "--samples", "2", "--jobs", "2")
    done = user.run("gameinfer_ros", *study, "--out", "out")
    assert done.returncode == 0, done.stderr
    assert done.stderr.count(UNCACHED) == 1, done.stderr
    assert not list(user.folder.glob("*numba*")), "the temporary cache is removed"


def test_a_folder_of_the_users_choice_is_used_without_a_word(user: User) -> None:
    compiling = (
        "import numpy as np\n"
        "from gameinfer_ros.scenario import Scenario\n"
        "scenario = Scenario.load('two_player')\n"
        "scenario.game.step(scenario.initial_state, np.zeros(4))\n"
    )
    found = []
    for _ in range(2):
        done = user.python("-c", compiling, NUMBA_CACHE_DIR="cache")
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
        files = (user.folder / "cache").rglob("*.nb?")
        found.append({path: path.stat().st_mtime_ns for path in files})
    assert found[0] and found[0] == found[1], "nothing is compiled twice"


def test_a_run_works_without_a_cache_and_warns_once(
    user: User, scenario_file: ScenarioFile
) -> None:
    scenario = str(scenario_file("dd"))
    run = ("run", "--scenario", scenario, "--time", "lockstep", "--steps", "3")
    done = user.run("gameinfer_ros", *run, "--out", "out")
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr.count(UNCACHED) == 1
    logs = "".join(path.read_text() for path in (user.folder / "out/logs").iterdir())
    assert "NUMBA_CACHE_DIR" not in logs


@pytest.mark.parametrize("command", ["inspect", "check", "run", "bench", "report"])
def test_help_needs_no_cache(command: str, user: User) -> None:
    done = user.run("gameinfer_ros", command, "--help")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("home", [None, "unwritable"])
@pytest.mark.parametrize(
    "command",
    [("gameinfer_ros", "run", "--scenario", "two_player"), ("gameinfer_ros.nodes.simulator",)],
)
def test_logs_that_ros_cannot_write_are_named(
    command: tuple[str, ...], home: str | None, user: User, package: Path
) -> None:
    settings = {"HOME": home and str(package / "home"), "ROS_LOG_DIR": None}
    done = user.run(*command, NUMBA_CACHE_DIR="cache", **settings)
    assert done.returncode == 2
    assert "set ROS_LOG_DIR to a folder that you can write to" in done.stderr
    assert "Traceback" not in done.stderr
