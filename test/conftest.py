"""Fixtures that several rooms share; nothing here knows of ROS."""

from __future__ import annotations

import gc
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml_text
from hypothesis import settings

import examples
from gameinfer_ros.games import (
    CostTerm,
    DoubleIntegrator,
    Dynamics,
    Game,
    Goal,
    Proximity,
    QuadraticInput,
    QuadraticState,
    SoftBound,
    Unicycle,
)
from gameinfer_ros.scenario import Scenario

#: Names of the players of the scenarios of the package.
NAMES = ("robot", "human_1", "human_2")

GameFactory = Callable[..., Game]

#: Marks the processes that these tests start, and those that these start.
MARK = "GAMEINFER_ROS_TESTS"
os.environ[MARK] = str(os.getpid())

# A job in the background of a script ignores SIGINT, and what nohup starts ignores SIGHUP. What
# these tests start would inherit that, and could not be ended by these signals.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda number, frame: None)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--thorough", action="store_true", help="try properties on all examples, not on a quarter"
    )


def pytest_configure(config: pytest.Config) -> None:
    examples.thorough = config.getoption("thorough")
    # Without a deadline, because the machine may be busy.
    settings.register_profile("tests", deadline=None, max_examples=examples.examples(100))
    settings.load_profile("tests")


def pytest_collection_finish() -> None:
    """Spare the garbage collector what has been imported: it would look through that ever again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def environment_kept() -> Iterator[None]:
    """Undo what a test, or what it calls, has set in the environment."""
    before = dict(os.environ)
    yield
    if os.environ != before:
        os.environ.clear()
        os.environ.update(before)


@pytest.fixture(scope="module", autouse=True)
def nothing_left() -> Iterator[None]:
    """No test leaves a node or a run behind, which might play along with those of another."""
    yield
    deadline = time.monotonic() + 10.0
    while left := [words for words in _started() if "gameinfer_ros" in words]:
        assert time.monotonic() < deadline, left
        time.sleep(0.1)


def _started() -> Iterator[str]:
    """Commands of all processes that have the mark, but for this one."""
    mark = f"{MARK}={os.getpid()}\0".encode()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if int(folder.name) != os.getpid() and mark in (folder / "environ").read_bytes():
                yield (folder / "cmdline").read_text().replace("\0", " ")
        except OSError:  # it has ended, or is somebody else's
            continue


@pytest.fixture(scope="session")
def two_player() -> Scenario:
    return Scenario.load("two_player")


@pytest.fixture(scope="session")
def three_player() -> Scenario:
    return Scenario.load("three_player")


@pytest.fixture(scope="session")
def five_player() -> Scenario:
    return Scenario.load("five_player")


@pytest.fixture(scope="session")
def flat_three_player(five_player: Scenario) -> Scenario:
    """The flat game of five players, with three of them on the circle."""
    content = five_player.model_dump()
    turns = {name: 2 * np.pi / 3 * i for i, name in enumerate(NAMES)}
    content["players"] = {
        name: {
            "dynamics": {"kind": "flat_unicycle"},
            "initial": (-3 * np.cos(turn), -3 * np.sin(turn), turn, 0.0),
        }
        for name, turn in turns.items()
    }
    content["costs"][-1]["goals"] = {
        name: (3 * np.cos(turn), 0.0, 3 * np.sin(turn), 0.0) for name, turn in turns.items()
    }
    return Scenario.model_validate(content)


@pytest.fixture
def load(tmp_path: Path) -> Callable[[dict[str, Any] | str], Scenario]:
    """Loads a scenario from a file with this content, or with this text."""

    def from_file(content: dict[str, Any] | str) -> Scenario:
        path = tmp_path / "some.yaml"
        path.write_text(content if isinstance(content, str) else yaml_text.dump(content))
        return Scenario.load(path)

    return from_file


@pytest.fixture(scope="session")
def make_game() -> GameFactory:
    """Builds games of unicycles ("u") and double integrators ("d") that have many kinds of costs.

    Player i starts at `start(game)` and crosses the origin on its way to the other side.
    """

    def make(kinds: str, horizon: int = 20, dt: float = 0.1, radius: float = 1.0) -> Game:
        dynamics: dict[str, Dynamics] = {
            f"player_{i}": Unicycle() if kind == "u" else DoubleIntegrator()
            for i, kind in enumerate(kinds)
        }
        costs: list[CostTerm] = [
            QuadraticInput(weights=(2.0, 3.0)),
            Proximity(radius=radius, weight=50.0),
        ]
        for kind, weights, bounded in (
            ("u", (0.0, 0.0, 0.0, 5.0), ("v", "omega")),
            ("d", (0.0, 5.0, 0.0, 4.0), ("vy", "ax")),
        ):
            names = tuple(f"player_{i}" for i, own in enumerate(kinds) if own == kind)
            if not names:
                continue
            goals = {name: tuple(-_start(kinds, int(name[7:]))) for name in names}
            if kind == "u":
                goals = {name: (*goal[:2], -goal[2], 0.0) for name, goal in goals.items()}
            costs += [
                QuadraticState(weights=weights, players=names),
                Goal(
                    weights=(100.0, 50.0, 100.0, 50.0),
                    goals=goals,
                    active_from=(horizon - 1.5) * dt,
                    players=names,
                ),
                *(
                    SoftBound(of=of, low=-0.5, high=1.0, weight=20.0, players=names)
                    for of in bounded
                ),
            ]
        return Game(dynamics, costs, dt, horizon)

    return make


@pytest.fixture(scope="session")
def start() -> Callable[[Game], np.ndarray]:
    """The joint state in which the players of a game of `make_game` start."""

    def of(game: Game) -> np.ndarray:
        kinds = "".join("u" if d.angles else "d" for d in game.players.dynamics)
        return np.concatenate([_start(kinds, i) for i in range(len(kinds))])

    return of


def _start(kinds: str, i: int) -> np.ndarray:
    angle = 2.0 * i + 0.3
    x, y = -1.5 * np.cos(angle), -1.5 * np.sin(angle)
    return np.array([x, y, angle, 0.0] if kinds[i] == "u" else [x, 0.0, y, 0.0])
