"""Runs that are played to their end, with real processes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml_text
from run_command import Command

from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario

pytestmark = pytest.mark.alone

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
SEEDS = (0, 2)
SHORT = 40


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
        path.stem: yaml_text.load(path.read_text())["/**"]["ros__parameters"]
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
    assert parameters["inference"]["planner_seed"] == seeds.planner


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
