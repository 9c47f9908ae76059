"""Options of `gameinfer run` that are refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_scenario import ScenarioFile

from gameinfer_ros.commands import cli


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--scenario", "nope"), ("nope", "three_player")),
        (("--planner", "best"), ("--planner", "best", "map", "baseline")),
        (("--time", "slow"), ("--time", "slow", "lockstep", "realtime")),
        (("--seed", "-1"), ("--seed", "-1", "a whole number from 0 to")),
        (("--seed", "one"), ("--seed", "one", "whole number")),
        (("--steps", "0"), ("--steps", "0", "from 1 to")),
        (("--particles", "1.5"), ("--particles", "1.5", "whole number")),
        (
            ("--particles", "1000000"),
            ("--particles: 1000000 is not allowed: with 12 states", "at most 14913 (strategies"),
        ),
        (("--nonsense",), ("--nonsense",)),
        (("--out", "a/b", "--record", "a//./b"), ("--record", "it is the folder of --out")),
        (("--control",), ("--control", "without --view")),
        (("--view-port", "8642"), ("--view-port", "without --view")),
        (("--view", "--view-port", "-1"), ("--view-port", "-1", "from 0 to 65535")),
        (("--view", "--view-port", "65536"), ("--view-port", "65536", "from 0 to 65535")),
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
    tmp_path: Path, scenario_file: ScenarioFile, capsys: pytest.CaptureFixture[str]
) -> None:
    file = scenario_file("uu")
    file.write_text(file.read_text().replace("horizon: 10", "horizon: -10"))
    assert cli.main(["run", "--scenario", str(file), "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    for word in (str(file), "horizon", "-10"):
        assert word in told
    assert not (tmp_path / "out").exists()
