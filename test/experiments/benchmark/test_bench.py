"""The command `gameinfer bench`: a small version of it, in a process of its own."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from matplotlib import image

from gameinfer_ros.experiments.benchmark.bench import strategy_bytes
from gameinfer_ros.experiments.benchmark.circle import circle
from gameinfer_ros.experiments.benchmark.warm_start import WarmStart, seeds_of, solver_of
from gameinfer_ros.scenario import Scenario

PLAYERS = [str(n) for n in range(2, 9)]
#: What is known of unicycles, at the top, and of flat games, in `flat`.
OF_GAMES = [
    *("lq_pass_ms", "lq_pass_mflop", "rollout_ms", "iteration_ms"),
    *("cold", "warm", "alone", "reference", "growth"),
]
BELIEFS = [
    *("three_player", "five_player", "five_player_unicycle"),
    *("five_player_threads_1", "five_player_threads_2"),
]


class Bench(NamedTuple):
    out: Path
    stderr: str
    figures: dict[str, Any]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    out = tmp_path_factory.mktemp("bench") / "new"
    done = command("--quick", "--json", "--out", out)
    assert done.returncode == 0, done.stderr
    return Bench(out, done.stderr, json.loads(done.stdout))


def command(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "gameinfer_ros", "bench", *map(str, arguments)],
        env={key: value for key, value in os.environ.items() if not key.endswith("NUM_THREADS")},
        capture_output=True,
        text=True,
        timeout=240,
    )


def numbers(value: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """All numbers of nested dictionaries, and where they stand."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from numbers(item, f"{path}/{key}")
    else:
        yield path, value


def test_all_figures_are_there_and_positive(bench: Bench) -> None:
    figures = dict(bench.figures)
    assert set(figures.pop("machine")) >= {"cpu", "cores", "python", "numpy", "numba"}
    assert figures.pop("quick") is True
    assert set(figures) == {
        *OF_GAMES,
        *("dgemm_gflops", "dgemm_speed_up_of_two_threads"),
        *("flat", "belief_step_ms", "memory_mb", "strategy_bytes", "compile_s"),
    }
    for path, number in numbers(figures):
        assert math.isfinite(number) and number > 0, path


@pytest.mark.parametrize("kind", ["unicycles", "flat"])
def test_figures_of_games(bench: Bench, kind: str) -> None:
    figures = bench.figures["flat"] if kind == "flat" else bench.figures
    assert set(figures) >= set(OF_GAMES)
    for name in OF_GAMES[:4]:
        assert list(figures[name]) == PLAYERS
    for name in ("cold", "warm", "alone", "reference"):
        assert list(figures[name]) == ["3", "5"]
    growth = figures["growth"]
    assert list(growth["particles"]) == ["1", "2"]
    assert list(growth["players"]) == PLAYERS
    assert len(growth["horizon"]) > 1


def test_figures_of_beliefs(bench: Bench) -> None:
    beliefs = bench.figures["belief_step_ms"]
    assert list(beliefs) == BELIEFS
    for belief in beliefs.values():
        assert belief["median"] <= belief["p99"] <= belief["max"]
        assert belief["max_after_ten"] <= belief["max"]
        assert belief["particles_left"] <= belief["particles"]
    one, two = beliefs["five_player_threads_1"], beliefs["five_player_threads_2"]
    assert (one["threads"], two["threads"]) == (1, 2)
    assert one["particles_left"] == two["particles_left"]


def test_files(bench: Bench) -> None:
    assert json.loads((bench.out / "bench.json").read_text()) == bench.figures
    height, width, _ = image.imread(bench.out / "growth.png").shape
    assert min(height, width) > 100
    assert str(bench.out) in bench.stderr


def test_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = command("--quick", "--out", tmp_path / "file")
    assert done.returncode == 2
    assert "file" in done.stderr
    assert "Traceback" not in done.stderr


def test_blas_works_in_one_thread() -> None:
    code = (
        "import os, sys\n"
        "from gameinfer_ros.experiments.benchmark.dgemm import use_one_thread\n"
        "print('begun'); use_one_thread()\n"
        "print(os.environ['OPENBLAS_NUM_THREADS'], sys.argv[1:])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "--some", "argument"],
        env={**os.environ, "OPENBLAS_NUM_THREADS": "2"},
        capture_output=True,
        text=True,
    )
    assert done.stdout.splitlines() == ["begun", "begun", "1 ['--some', 'argument']"]


def test_bytes_are_those_of_the_strategies_that_are_solved(three_player: Scenario) -> None:
    of_players = strategy_bytes(three_player)
    scenario = circle(three_player, 2)
    seeds = seeds_of(scenario, 3)
    solution = solver_of(scenario).solve(scenario.initial_state, seeds, None, 1)
    assert sum(array.nbytes for array in solution.strategy.arrays) == 3 * of_players["2"]
    for n, size in ((n, of_players[str(n)]) for n in range(2, 9)):
        T, nx, nu = 100, 4 * n, 2 * n
        assert size == 8 * ((T + 1) * nx + T * nu + T * nu * nx)


def test_warm_start_has_the_particles_that_converged(three_player: Scenario) -> None:
    solver = solver_of(three_player)
    solution = solver.solve(three_player.initial_state, seeds_of(three_player, 12), None, 25)
    assert 0 < solution.converged.sum() < 12
    kept = np.flatnonzero(solution.converged)
    warm = WarmStart.of(solution)
    np.testing.assert_array_equal(warm.strategy.P, solution.strategy.P[..., kept])
    np.testing.assert_array_equal(warm.x, solution.strategy.x_ref[1, :, kept[0]])
    repeated = warm.of_particles(len(kept) + 1).strategy
    np.testing.assert_array_equal(repeated.P[..., -1], warm.strategy.P[..., 0])


def test_rooms_need_no_ros() -> None:
    code = (
        "import importlib, pkgutil, sys\n"
        "for name in ('experiments', 'solver', 'inference', 'planning', 'games'):\n"
        "    room = importlib.import_module(f'gameinfer_ros.{name}')\n"
        "    for module in pkgutil.walk_packages(room.__path__, room.__name__ + '.'):\n"
        "        if not module.name.endswith('__main__'):\n"
        "            importlib.import_module(module.name)\n"
        "assert not {'rclpy', 'msg_adapters', 'std_msgs'} & set(sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
