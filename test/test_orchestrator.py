"""The orchestrator and the command `gameinfer run`, with real processes."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ros_domain import free_domain

from gameinfer_ros import cli
from gameinfer_ros.run_bag import RunBag
from gameinfer_ros.run_record import RunRecord
from gameinfer_ros.run_seeds import RunSeeds
from gameinfer_ros.scenario import Scenario

pytestmark = pytest.mark.alone

#: How long anything may take, in s, on however busy a machine.
DEADLINE = 120.0
KEYS = [
    "cost",
    "smallest_distance",
    "steps",
    "late_steps",
    "missing_steps",
    "map_probability",
    "safety_braked",
    "safety_limited",
]
SEEDS = (0, 2, 3)
SHORT = 40


class Command:
    """`gameinfer run` with some arguments, in a process of its own."""

    def __init__(
        self,
        folder: Path,
        *arguments: object,
        module: tuple[str, ...] = ("gameinfer_ros.cli", "run"),
        ignore_sigint: bool = False,
        domain: int | None = None,
        terminal: Terminal | None = None,
        **settings: str,
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._stdout, self._stderr = folder / "stdout", folder / "stderr"
        with self._stdout.open("wb") as stdout, self._stderr.open("wb") as stderr:
            self.process = subprocess.Popen(
                [sys.executable, "-m", *module, *map(str, arguments)],
                cwd=folder,
                env={
                    **os.environ,
                    "PYTHONUNBUFFERED": "1",
                    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
                    "ROS_DOMAIN_ID": str(free_domain() if domain is None else domain),
                    **settings,
                },
                stdin=terminal.its_end if terminal else subprocess.DEVNULL,
                stdout=terminal.its_end if terminal else stdout,
                stderr=terminal.its_end if terminal else stderr,
                start_new_session=True,
                preexec_fn=terminal.take if terminal else _ignore_sigint if ignore_sigint else None,
            )
        if terminal:
            os.close(terminal.its_end)
        self._seen: set[int] = set()

    @property
    def stdout(self) -> str:
        return self._stdout.read_text()

    @property
    def stderr(self) -> str:
        return self._stderr.read_text()

    @property
    def summary(self) -> dict[str, Any]:
        """The JSON object in the last line of what was printed."""
        found = json.loads(self.stdout.splitlines()[-1])
        assert isinstance(found, dict)
        return found

    def nodes(self) -> dict[int, str]:
        """Process ids of the nodes that run, with their command lines."""
        found = _children(self.process.pid)
        self._seen |= set(found)
        return found

    def until(self, condition: Callable[[], object]) -> None:
        deadline = time.monotonic() + DEADLINE
        while not condition():
            assert self.process.poll() is None, self.stdout + self.stderr
            assert time.monotonic() < deadline, self.stdout + self.stderr
            time.sleep(0.02)

    def exit_code(self) -> int:
        return self.process.wait(DEADLINE)

    def leftovers(self) -> dict[int, str]:
        """Nodes that still run though the orchestrator has ended."""
        found = {pid: _command_line(pid) for pid in self._seen}
        return {pid: line for pid, line in found.items() if "gameinfer_ros.nodes" in line}

    def end(self) -> None:
        """End whatever is left of it."""
        if self.process.poll() is None:
            self.nodes()
            self.process.kill()
            self.process.wait(DEADLINE)
        for pid in self.leftovers():
            os.kill(pid, signal.SIGKILL)


class Terminal:
    """A terminal for a command, which can be closed.

    Args:
        controls: whether the command hears, by SIGHUP, that it is closed.
    """

    def __init__(self, controls: bool) -> None:
        self._controls = controls
        self._ours, self.its_end = pty.openpty()
        self._read = b""

    def take(self) -> None:
        """Become the terminal of this process, which has been started for it."""
        if self._controls:
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)

    @property
    def words(self) -> str:
        """All that was written so far."""
        while select.select([self._ours], [], [], 0)[0]:
            self._read += os.read(self._ours, 65536)
        return self._read.decode(errors="replace")

    def close(self) -> None:
        os.close(self._ours)


def _ignore_sigint() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _children(parent: int) -> dict[int, str]:
    found = {}
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            # The name, in parentheses, may hold blanks; state and parent follow it.
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        if int(fields[1]) == parent and fields[0] != "Z":
            found[int(folder.name)] = _command_line(int(folder.name))
    return found


def _command_line(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Command]]:
    """Starts `gameinfer run` with some arguments."""
    commands: list[Command] = []

    def make(*arguments: object, **options: Any) -> Command:
        commands.append(Command(tmp_path / f"command_{len(commands)}", *arguments, **options))
        return commands[-1]

    yield make
    for command in commands:
        command.end()


@pytest.fixture
def side_by_side(tmp_path: Path) -> Callable[[int], Path]:
    """Writes a scenario of some players who walk side by side."""

    def write(players: int) -> Path:
        names = ["robot", *(f"human_{i}" for i in range(1, players))]
        content = {
            "dt": 0.1,
            "horizon": 10,
            "steps": 20,
            "players": {
                name: {"dynamics": {"kind": "unicycle"}, "initial": [0.0, 1.0 * i, 0.0, 0.5]}
                for i, name in enumerate(names)
            },
            "costs": [
                {"kind": "quadratic_input", "weights": [10, 10]},
                {"kind": "proximity", "radius": 0.8, "weight": 50},
            ],
            "seeds": {"kind": "cosine", "low": [-0.1, 0.0], "high": [0.1, 0.1]},
            "inference": {"particles": 3},
        }
        path = tmp_path / f"{players}_side_by_side.yaml"
        path.write_text(yaml.safe_dump(content, sort_keys=False))
        return path

    return write


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Mapping[tuple[str, int, int], Path]:
    """Results of lockstep runs of three players by planner, seed and number."""
    wanted = [
        *(("map", seed, 0) for seed in SEEDS),
        ("map", SEEDS[0], 1),
        *(("baseline", seed, 0) for seed in SEEDS),
    ]
    folder = tmp_path_factory.mktemp("runs")

    def play(key: tuple[str, int, int]) -> Path:
        planner, seed, number = key
        out = folder / f"{planner}_{seed}_{number}"
        # The baseline does not need the inference; a repeated run need not be whole.
        options = ["--particles", 1] if planner == "baseline" else []
        options += ["--steps", SHORT] if number else []
        command = Command(
            out,
            *("--scenario", "three_player", "--planner", planner, "--seed", seed),
            *("--time", "lockstep", "--json", "--out", out, *options),
        )
        try:
            assert command.exit_code() == 0, command.stdout + command.stderr
        finally:
            command.end()
        return out

    with ThreadPoolExecutor(2) as pool:
        return dict(zip(wanted, pool.map(play, wanted), strict=True))


def summary_of(out: Path) -> dict[str, Any]:
    found = json.loads((out / "run.json").read_text())
    assert isinstance(found, dict)
    return found


@pytest.mark.parametrize("seed", SEEDS)
def test_an_aligned_robot_is_good_for_everybody(
    seed: int, runs: Mapping[tuple[str, int, int], Path]
) -> None:
    summary = summary_of(runs["map", seed, 0])
    assert len(summary["cost"]) == 3
    assert max(summary["cost"]) < 760
    assert min(summary["cost"]) > 600
    assert summary["smallest_distance"] > 1.1
    assert summary["steps"] == 101
    assert summary["late_steps"] == 0
    assert 0.9 < summary["map_probability"] <= 1.0


def test_the_baseline_is_clearly_worse_on_average(
    runs: Mapping[tuple[str, int, int], Path],
) -> None:
    aligned, baseline = (
        np.mean([summary_of(runs[planner, seed, 0])["cost"] for seed in SEEDS], axis=0)
        for planner in ("map", "baseline")
    )
    assert baseline[0] > 1.2 * aligned[0]


def test_the_same_seed_gives_the_same_states_to_the_bit(
    runs: Mapping[tuple[str, int, int], Path],
) -> None:
    saved = [np.load(runs["map", seed, number] / "run.npz") for seed, number in
             ((SEEDS[0], 0), (SEEDS[0], 1), (SEEDS[1], 0))]  # fmt: skip
    for name, count in (("states", SHORT + 1), ("inputs", SHORT)):
        assert saved[0][name][:count].tobytes() == saved[1][name].tobytes()
    beliefs = saved[0]["beliefs"]
    assert beliefs[beliefs[:, 0] <= SHORT].tobytes() == saved[1]["beliefs"].tobytes()
    assert not np.array_equal(saved[0]["states"], saved[2]["states"])
    assert saved[0]["states"].shape == (102, 12)
    assert saved[0]["inputs"].shape == (101, 6)


def test_the_last_line_is_the_result_in_json(
    runs: Mapping[tuple[str, int, int], Path],
) -> None:
    for out in runs.values():
        lines = (out / "stdout").read_text().splitlines()
        summary = json.loads(lines[-1])
        assert list(summary) == KEYS
        assert summary == summary_of(out)
        assert not any(line.startswith("{") for line in lines[:-1])
        assert (out / "stderr").read_text() == ""


def test_the_results_folder_holds_all_that_belongs_to_a_run(
    runs: Mapping[tuple[str, int, int], Path],
) -> None:
    out = runs["map", SEEDS[1], 0]
    nodes = {"simulator", "inference", "robot_planner", "human_1_agent", "human_2_agent"}
    assert {path.name for path in out.iterdir()} == {
        *("run.json", "run.npz", "picture.png", "logs", "parameters"),
        *("stdout", "stderr"),  # of this test
    }
    assert (out / "picture.png").read_bytes().startswith(b"\x89PNG")
    record = RunRecord.load(out, Scenario.load("three_player").vehicles)
    assert len(record.step_ms) >= record.steps and min(record.step_ms) > 0
    assert {path.stem for path in (out / "logs").glob("*.log")} == nodes
    for path in (out / "logs").iterdir():
        assert "ready" in path.read_text()
    parameters = {
        path.stem: yaml.safe_load(path.read_text())["/**"]["ros__parameters"]
        for path in (out / "parameters").glob("*.yaml")
    }
    assert set(parameters) == nodes
    # The humans agree, and nobody else is told on what.
    seeds = RunSeeds.of_run(SEEDS[1])
    for name, own in parameters.items():
        is_human = name.startswith("human")
        assert (seeds.humans in own.values()) == is_human
        assert own["time"] == "lockstep"
    assert parameters["inference"]["seed"] == seeds.inference
    assert parameters["robot_planner"]["seed"] == seeds.baseline


def test_one_player_in_a_namespace_and_a_results_folder_by_default(
    start: Callable[..., Command], side_by_side: Callable[[int], Path], tmp_path: Path
) -> None:
    command = start(
        *("--scenario", side_by_side(1), "--time", "lockstep", "--seed", 7, "--json"),
        *("--ros-args", "-r", "__ns:=/x"),
    )
    assert command.exit_code() == 0, command.stdout + command.stderr
    assert list(command.summary) == KEYS
    assert len(command.summary["cost"]) == 1
    assert command.summary["smallest_distance"] is None
    assert command.summary["steps"] == 20
    (out,) = (tmp_path / "command_0" / "results").iterdir()
    assert "-1_side_by_side-map-7-" in out.name
    assert "[x.simulator]" in (out / "logs/simulator.log").read_text()
    assert (out / "picture.png").exists()


def test_a_short_run_in_realtime(
    start: Callable[..., Command], side_by_side: Callable[[int], Path], tmp_path: Path
) -> None:
    command = start(
        *("--scenario", side_by_side(2), "--time", "realtime", "--steps", 15, "--particles", 2),
        *("--json", "--out", tmp_path / "out"),
        module=("gameinfer_ros.orchestrator",),
    )
    assert command.exit_code() == 0, command.stdout + command.stderr
    summary = command.summary
    assert summary["steps"] == 15
    assert 0 <= summary["late_steps"] <= 15
    assert 0.5 <= summary["map_probability"] <= 1.0
    assert summary["smallest_distance"] > 0.5
    with np.load(tmp_path / "out" / "run.npz") as saved:
        assert saved["states"].shape == (16, 8)
        numbers = saved["beliefs"][:, 1]
        assert set(numbers) <= {0, 1}


@pytest.fixture
def endless(
    start: Callable[..., Command], side_by_side: Callable[[int], Path], tmp_path: Path
) -> Callable[..., Command]:
    """A run in realtime that does not end by itself."""

    def make(*arguments: object, **options: Any) -> Command:
        return start(
            *("--scenario", side_by_side(2), "--time", "realtime", "--steps", 10**6),
            *("--out", tmp_path / "out", *arguments),
            **options,
        )

    return make


def running(command: Command) -> bool:
    return "First controls" in command.stdout and len(command.nodes()) == 4


@pytest.mark.parametrize(
    ("signal_number", "ignore_sigint"),
    [
        (signal.SIGINT, False),
        (signal.SIGINT, True),
        (signal.SIGTERM, False),
        (signal.SIGHUP, False),
    ],
)
def test_an_interrupted_run_leaves_no_node_behind(
    signal_number: signal.Signals, ignore_sigint: bool, endless: Callable[..., Command]
) -> None:
    # A shell starts what runs in the background with SIGINT ignored.
    command = endless(ignore_sigint=ignore_sigint)
    command.until(lambda: running(command))
    command.process.send_signal(signal_number)
    assert command.exit_code() == 130, command.stdout + command.stderr
    assert command.leftovers() == {}
    assert "Interrupted" in command.stdout
    assert "Traceback" not in command.stdout + command.stderr


def test_a_second_run_in_the_same_domain_is_refused(
    endless: Callable[..., Command], start: Callable[..., Command]
) -> None:
    domain = free_domain()
    first = endless(domain=domain)
    first.until(lambda: running(first))
    second = start("--scenario", "two_player", domain=domain)
    assert second.exit_code() == 2, second.stdout + second.stderr
    assert "another run is in the ROS domain" in second.stderr
    assert second.leftovers() == {}
    assert first.process.poll() is None, "the first run goes on"


def test_a_run_that_is_interrupted_while_its_nodes_start_leaves_none_behind(
    endless: Callable[..., Command],
) -> None:
    command = endless()
    command.until(lambda: len(command.nodes()) >= 2)
    # Each has rights of its own under SROS2.
    assert any("--enclave /gameinfer_ros/simulator" in line for line in command.nodes().values())
    command.process.send_signal(signal.SIGINT)
    deadline = time.monotonic() + DEADLINE
    while command.process.poll() is None:  # also those that start meanwhile
        command.nodes()
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert command.exit_code() == 130, command.stdout + command.stderr
    assert command.leftovers() == {}


@pytest.mark.parametrize("module", ["human_agent", "simulator"])
def test_when_a_node_dies_the_run_fails_says_why_and_leaves_a_bag_that_can_be_read(
    module: str, endless: Callable[..., Command], tmp_path: Path
) -> None:
    command = endless("--record", tmp_path / "bag")
    command.until(lambda: running(command))
    (victim,) = (pid for pid, line in command.nodes().items() if f"nodes.{module} " in line)
    assert _children(command.process.pid).get(victim)  # it is still ours
    os.kill(victim, signal.SIGKILL)
    assert command.exit_code() == 1, command.stdout + command.stderr
    assert command.leftovers() == {}
    name = {"human_agent": "human_1_agent"}.get(module, module)
    for words in (f"node {name} ended", "SIGKILL", f"[{name}]: ready"):
        assert words in command.stderr
    assert RunBag(tmp_path / "bag").record().steps >= 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--scenario", "nope"), ("nope", "three_player")),
        (("--planner", "best"), ("--planner", "best", "map", "baseline")),
        (("--time", "slow"), ("--time", "slow", "lockstep", "realtime")),
        (("--seed", "-1"), ("--seed", "-1", "0 or above")),
        (("--seed", "one"), ("--seed", "one", "whole number")),
        (("--steps", "0"), ("--steps", "0", "1 or above")),
        (("--particles", "1.5"), ("--particles", "1.5", "whole number")),
        (("--nonsense",), ("--nonsense",)),
        (("--control",), ("--control", "without --view")),
        (("--view-port", "8642"), ("--view-port", "without --view")),
        (("--view", "--view-port", "-1"), ("--view-port", "-1", "0 or above")),
        (("--view", "--view-port", "65536"), ("--view-port", "65536", "at most 65535")),
    ],
)
def test_bad_options_are_refused_with_2_and_what_is_allowed(
    arguments: tuple[str, ...], words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        assert cli.main(["run", *arguments]) == 2
    except SystemExit as ended:
        assert ended.code == 2
    told = capsys.readouterr().err
    for word in words:
        assert word in told


def test_a_bad_scenario_file_is_refused_with_its_field(
    tmp_path: Path, side_by_side: Callable[[int], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    file = side_by_side(2)
    file.write_text(file.read_text().replace("horizon: 10", "horizon: -10"))
    assert cli.main(["run", "--scenario", str(file), "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    for word in (str(file), "horizon", "-10"):
        assert word in told
    assert not (tmp_path / "out").exists()


def test_a_results_folder_that_cannot_be_made_is_refused(
    tmp_path: Path, side_by_side: Callable[[int], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    out = tmp_path / "file" / "out"
    assert cli.main(["run", "--scenario", str(side_by_side(2)), "--out", str(out)]) == 2
    assert str(out) in capsys.readouterr().err


@pytest.mark.parametrize("far", [True, False])
def test_a_run_says_if_other_machines_may_reach_it(
    far: bool, start: Callable[..., Command]
) -> None:
    command = start(**({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"} if far else {}))
    command.until(lambda: "Loading" in command.stdout)
    words = "Other machines may reach the nodes of this run: ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET"
    assert (words in command.stdout.splitlines()) == far
    assert far or "Other machines" not in command.stdout


def test_bad_ros_arguments_are_refused_before_any_node_starts(
    start: Callable[..., Command], side_by_side: Callable[[int], Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    command = start(
        *("--scenario", side_by_side(1), "--out", out, "--ros-args", "-r", "__ns:=not-good")
    )
    assert command.exit_code() == 2, command.stdout + command.stderr
    for word in ("--ros-args", "__ns:=not-good"):
        assert word in command.stderr
    assert "Traceback" not in command.stderr
    assert not list((out / "logs").iterdir())
