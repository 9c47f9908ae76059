"""Runs that are played to their end, with real processes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import yaml_text
from run_command import Command
from small_scenario import ScenarioFile

from gameinfer_ros.runs.record import RunRecord
from gameinfer_ros.runs.seeds import RunSeeds
from gameinfer_ros.scenario import Scenario

SEEDS = (0, 2)
STEPS = 20

#: Results of lockstep runs of three players by seed and number.
Runs = Mapping[tuple[int, int], Path]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    folder = tmp_path_factory.mktemp("runs")

    def play(key: tuple[int, int]) -> Path:
        seed, number = key
        out = folder / f"{seed}_{number}"
        command = Command(
            out,
            *("--scenario", "three_player", "--planner", "map", "--seed", seed, "--steps", STEPS),
            *("--particles", 10, "--time", "lockstep", "--json", "--out", out),
        )
        try:
            assert command.exit_code() == 0, command.stdout + command.stderr
        finally:
            command.end()
        return out

    wanted = [(SEEDS[0], 0), (SEEDS[0], 1), (SEEDS[1], 0)]
    with ThreadPoolExecutor(2) as pool:
        return dict(zip(wanted, pool.map(play, wanted), strict=True))


def test_the_same_seed_gives_the_same_states_to_the_bit(runs: Runs) -> None:
    one, again, other = (np.load(out / "run.npz") for out in runs.values())
    for name in ("states", "inputs", "beliefs"):
        assert one[name].tobytes() == again[name].tobytes()
    assert not np.array_equal(one["states"], other["states"])
    assert one["states"].shape == (STEPS + 1, 12)
    assert one["inputs"].shape == (STEPS, 6)


def test_the_last_line_is_the_result_in_json(runs: Runs) -> None:
    for out in runs.values():
        summary = json.loads((out / "stdout").read_text())  # there is nothing else
        record = RunRecord.load(out, Scenario.load("three_player").vehicles)
        assert summary == record.summary() == json.loads((out / "run.json").read_text())
        assert len(summary["cost"]) == 3
        assert (summary["steps"], summary["late_steps"]) == (STEPS, 0)
        told = (out / "stderr").read_text()
        assert "three_player, planner map" in told
        # The scenario has more steps.
        assert "the goal begins at 9.85 s, but the run ends at 2 s, after 20 steps" in told


def test_the_results_folder_holds_all_that_belongs_to_a_run(runs: Runs) -> None:
    out = runs[SEEDS[1], 0]
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
    # The humans share a seed that no other node has.
    seeds = RunSeeds.of_run(SEEDS[1])
    for name, own in parameters.items():
        is_human = name.startswith("human")
        assert (seeds.humans in own.values()) == is_human
        assert own["time"] == "lockstep"
    assert parameters["inference"]["seed"] == seeds.inference
    assert parameters["inference"]["planner_seed"] == seeds.planner
    assert parameters["inference"]["particles"] == 10


def test_one_player_in_a_namespace_and_a_results_folder_by_default(
    start: Callable[..., Command], scenario_file: ScenarioFile, tmp_path: Path
) -> None:
    scenario = scenario_file("u", steps=20).rename(tmp_path / 'ü: "u" 🚶.yaml')
    command = start(
        *("--scenario", scenario, "--time", "lockstep", "--seed", 7, "--json"),
        *("--ros-args", "-r", "__ns:=/x"),
    )
    assert command.exit_code() == 0, command.stdout + command.stderr
    assert len(command.summary["cost"]) == 1
    assert command.summary["smallest_distance"] is None
    assert command.summary["steps"] == 20
    assert "the goal begins" not in command.stderr
    (out,) = (tmp_path / "command_0" / "results").iterdir()
    assert '-ü: "u" 🚶-map-7-' in out.name
    assert "[x.simulator]" in (out / "logs/simulator.log").read_text()
    assert (out / "picture.png").exists()
