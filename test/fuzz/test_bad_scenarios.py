"""A scenario file, whatever it holds, is either played or refused in words."""

from __future__ import annotations

import os
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import bad_scenarios
import numpy as np
import pytest
import yaml_text
from bad_values import TEXTS, VALUES

from gameinfer_ros.inference.settings import MOST_BYTES
from gameinfer_ros.scenario import Scenario, ScenarioError

GOOD = bad_scenarios.bases()
#: One of all places that differ in more than their numbers.
PLACES = {
    (*("*" if isinstance(key, int) else key for key in place), content["costs"][-1]["kind"]): (
        content,
        place,
    )
    for content in GOOD
    for place in bad_scenarios.places(content)
    if content is GOOD[0] or place[0] in bad_scenarios.WHERE_KINDS_ARE
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "some.yaml"


def test_every_kind_and_every_field_is_tried() -> None:
    tried = {key for place in PLACES for key in place}
    for family in bad_scenarios.FAMILIES.values():
        for kind, model in family.family.items():
            if model.__module__.startswith("gameinfer_ros"):
                assert any(f"'{kind}'" in str(content) for content in GOOD), kind
                assert set(model.model_fields) <= tried
    assert set(Scenario.model_fields) <= tried


@pytest.mark.parametrize("i", range(len(GOOD)))
def test_good_ones_are_accepted(i: int, path: Path) -> None:
    path.write_bytes(bad_scenarios.text(GOOD[i]))
    assert bad_scenarios.outcome(path) == "accepted"


@pytest.mark.parametrize("i", range(len(TEXTS)))
def test_a_file_that_is_no_scenario_is_refused(i: int, path: Path) -> None:
    path.write_bytes(TEXTS[i])
    assert bad_scenarios.outcome(path) == "rejected"


@pytest.mark.parametrize("part", range(4))
def test_a_bad_value_anywhere_is_refused_or_harmless(part: int, path: Path) -> None:
    rng = np.random.default_rng(part)
    for content, place in list(PLACES.values())[part::4]:
        for value in rng.choice(np.array(VALUES, dtype=object), 2, replace=False):
            path.write_bytes(bad_scenarios.text(bad_scenarios.replaced(content, place, value)))
            bad_scenarios.outcome(path)


@pytest.mark.parametrize("seed", range(2))
def test_a_file_that_is_spoiled_at_random_is_refused_or_harmless(seed: int, path: Path) -> None:
    rng = np.random.default_rng(seed)
    outcomes = []
    for _ in range(60):
        path.write_bytes(bad_scenarios.some(rng, GOOD))
        outcomes.append(bad_scenarios.outcome(path))
    assert {"accepted", "rejected"} == set(outcomes)


def test_what_is_no_plain_file_is_refused_and_not_read(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for what in (tmp_path, pipe, Path("/dev/zero"), "", "\x00", "a" * 100_000, "a/" * 10_000):
        with pytest.raises(ScenarioError, match="is neither a file nor one of the scenarios"):
            Scenario.load(what)


def test_a_large_file_is_not_read_to_its_end(tmp_path: Path) -> None:
    endless = tmp_path / "endless.yaml"
    with endless.open("wb") as file:
        file.truncate(2**40)  # takes no room on the disk
    with pytest.raises(ScenarioError, match=r"endless\.yaml: is too large: at most \d+ bytes"):
        Scenario.load(endless)


@pytest.mark.parametrize(("horizon", "particles"), [(100, 10**6), (10_000, 500), (10_000, 10**6)])
def test_what_would_not_fit_into_memory_is_refused(
    horizon: int, particles: int, path: Path
) -> None:
    content = bad_scenarios.replaced(GOOD[0], ("horizon",), horizon)
    content["inference"]["particles"] = particles
    path.write_bytes(bad_scenarios.text(content))
    with pytest.raises(
        ScenarioError, match=f"inference.particles: {particles} is not .*{MOST_BYTES / 2**30:g} GiB"
    ):
        Scenario.load(path)


def test_games_whose_solver_would_not_fit_into_memory_are_refused(path: Path) -> None:
    content = yaml_text.load(Scenario.load("two_player").model_dump_json())
    robot = content["players"]["robot"]
    content |= {
        "players": {f"player_{i}": robot for i in range(32)},
        "costs": [{"kind": "quadratic_input", "weights": [10.0, 10.0]}],
        "inference": {"particles": 1},
        "horizon": 10_000,
    }
    path.write_bytes(bad_scenarios.text(content))
    with pytest.raises(
        ScenarioError, match=r"yaml: horizon: 10000 .* at most (\d+) .* 1 GiB"
    ) as no:
        Scenario.load(path)
    most = int(str(no.value).split("at most ")[1].split()[0])
    for horizon, fits in ((most, True), (most + 1, False)):
        content["horizon"] = horizon
        path.write_bytes(bad_scenarios.text(content))
        with nullcontext() if fits else pytest.raises(ScenarioError, match="horizon"):
            Scenario.load(path)


@pytest.mark.parametrize(
    "settings",
    [
        {"max_iterations": 10**9},
        {"max_halvings": 1000},
        {"threads": 64},
        {"max_iterations": 10**9, "threads": 64, "max_movement": 1e12},
    ],
)
def test_no_setting_of_the_solver_takes_memory(settings: dict[str, Any], path: Path) -> None:
    content = bad_scenarios.pair(5) | {"solver": settings}
    path.write_bytes(bad_scenarios.text(content))
    assert bad_scenarios.outcome(path) == "accepted"  # which measures the memory
