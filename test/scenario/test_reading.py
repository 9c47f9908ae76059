"""Files are read by the rules of YAML 1.2, and what is not plain data is refused with its place."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import pytest
import yaml_text

from gameinfer_ros.scenario import Scenario, ScenarioError
from gameinfer_ros.scenario.reading import load

#: Two players who pass each other.
SCENARIO = """
dt: 0.1
horizon: 20
steps: 5
players:
  robot: &walker {dynamics: {kind: unicycle}, initial: [-2, 0, 0, 0.5]}
  ana: {<<: *walker, initial: [0, -2, 1.57, 0.5]}
costs:
  - {kind: quadratic_input, weights: [10, 10]}
  - kind: goal
    players: [robot]
    weights: [300, 300, 0, 0]
    active_from: 0
    goals: {robot: [2, 0, 0, 0]}
seeds: {kind: constant, low: [0, 0], high: [0, 0]}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "some.yaml"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *((word, word) for word in ("no", "No", "on", "off", "yes", "y", "1:30", "12:30:45.5")),
        *((word, word) for word in ("2026-11-30", "1_000", "0b11", "-0x1", "0x", "e3", ".", "=")),
        *((word, None) for word in ("", "~", "null", "Null")),
        *((word, True) for word in ("true", "True", "TRUE")),
        ("040", 40),
        ("-040", -40),
        ("+7", 7),
        ("0o17", 15),
        ("0x1F", 31),
        ("1e-1", 0.1),
        ("1e3", 1000.0),
        ("1e+12", 1e12),
        ("-1E12", -1e12),
        (".5", 0.5),
        (".5e1", 5.0),
        ("5.", 5.0),
        ("-.inf", -float("inf")),
        ("9" * 5000, float("inf")),
        ('"40"', "40"),
        ("'no'", "no"),
    ],
)
@pytest.mark.parametrize("head", ["", "%YAML 1.1\n---\n"])
def test_plain_text_is_read_by_the_core_schema(
    head: str, text: str, value: Any, file: Path
) -> None:
    file.write_text(f"{head}{{value: {text}}}\n")
    found = load(file)["value"]
    assert (found, type(found)) == (value, type(value))


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("a: 1\nb: 2\na: 3", (3, 1), "duplicate key 'a': it is in line 1 too"),
        ("a: &a {b: 1}\nc: {<<: *a, d: 1, d: 2}", (2, 19), "duplicate key 'd'"),
        ("a: &a {b: 1}\nc: {<<: *a, <<: *a}", (2, 13), "duplicate key '<<'"),
        ("a: {<<: 3}", (1, 9), "expected a mapping"),
        ("a: {? [1]: 2}", (1, 7), "a key must be text"),
        ("a: {true: 2}", (1, 5), "the key true is not text: write it in quotes"),
        ("a:\n  : 2", (2, 3), "the key null is not text"),
        (
            "a: !!python/object/apply:os.getcwd []",
            (1, 4),
            "the tag !!python/object/apply:os.getcwd",
        ),
        ("a: !!float 1", (1, 4), "the tag !!float is not allowed: write the value without a tag"),
        ("a: *b", (1, 4), "undefined alias 'b'"),
        ("a: &a [*a]", (1, 8), "the alias *a refers to a value that contains it"),
        ("a: [1", (1, 6), "expected ',' or ']'"),
        ("a: 1\n\tb: 2", (2, 1), "'\\t' that cannot start any token"),
        ("a: 1\n---\nb: 2", (2, 1), "expected a single document"),
        ("a: " + "[" * 100_000, (1, 67), "nested deeper than 64 levels"),
        ("\n".join(" " * k + "a:" for k in range(100)), (64, 64), "nested deeper than 64 levels"),
    ],
)
def test_what_is_not_plain_data_is_refused_with_its_place(
    text: str, place: tuple[int, int], words: str, file: Path
) -> None:
    file.write_text(text)
    with pytest.raises(ScenarioError) as caught:
        load(file)
    line, column = place
    assert f"some.yaml: line {line}, column {column}: cannot be read as YAML: " in str(caught.value)
    assert words in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    "text", [b"\xff\xfe\x00a: 1", b"a: \x00", b'a: "\\UFFFFFFFF"', b"%YAML 1.21\n---"]
)
def test_what_has_no_place_is_refused_too(text: bytes, file: Path) -> None:
    file.write_bytes(text)
    with pytest.raises(ScenarioError, match=r"some\.yaml: cannot be read as YAML: "):
        load(file)


@pytest.mark.parametrize("text", ["[{}]", "{{<<: [{}]}}"], ids=["lists", "merged"])
def test_aliases_cannot_make_a_file_larger_than_one_can_be(text: str, file: Path) -> None:
    lines = ["x0: &x0 {" + ", ".join(f"key{k}: 1" for k in range(100)) + "}"]
    for k in range(10):
        lines.append(f"x{k + 1}: &x{k + 1} " + text.format(", ".join([f"*x{k}"] * 10)))
    file.write_text("\n".join(lines))
    with pytest.raises(
        ScenarioError, match=r"line 4, .* more than 262144 characters with all aliases"
    ):
        load(file)


def test_an_anchor_may_be_used_again_and_aliases_within_bounds(file: Path) -> None:
    file.write_text("a: &x {b: 1}\nc: *x\nd: &x 2\ne: [*x, *x]")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load(file) == {"a": {"b": 1}, "c": {"b": 1}, "d": 2, "e": [2, 2]}


def test_merge_keys_are_understood(file: Path) -> None:
    file.write_text(SCENARIO)
    robot, ana = Scenario.load(file).players.values()
    assert ana.dynamics == robot.dynamics
    assert (robot.initial, ana.initial) == ((-2, 0, 0, 0.5), (0, -2, 1.57, 0.5))
    file.write_text("a: &a {x: 1, y: 1}\nb: {x: 3, <<: [*a, {y: 2, z: 2}]}")
    assert load(file)["b"] == {"x": 3, "y": 1, "z": 2}


@pytest.mark.parametrize("name", ["no", "yes", "on", "n", "off", "e1"])
def test_a_player_may_have_a_name_that_older_yaml_takes_for_something_else(
    name: str, file: Path
) -> None:
    file.write_text(SCENARIO.replace("ana:", f"{name}:"))
    scenario = Scenario.load(file)
    assert list(scenario.players) == ["robot", name]
    file.write_text(yaml_text.dump(scenario.model_dump(mode="json")))
    assert Scenario.load(file) == scenario


def test_numbers_mean_what_they_look_like_or_are_refused(file: Path) -> None:
    file.write_text(SCENARIO.replace("horizon: 20", "horizon: 040"))
    assert Scenario.load(file).horizon == 40
    file.write_text(SCENARIO.replace("active_from: 0", "active_from: 1:30"))
    words = "costs[1].active_from: '1:30' is not allowed: input should be a valid number; did you "
    with pytest.raises(ScenarioError, match=re.escape(f"{words}mean 90?")):
        Scenario.load(file)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("1:30", "90"),
        ("1:00:05", "3605"),
        ("1_000", "1000"),
        ("-1_0.5", "-10.5"),
        ("0b11", "3"),
        ("0,5", "0.5"),
        ('"40"', "40"),
        ("'1e-1'", "1e-1"),
        *(
            (text, None)
            for text in ("soon", "1:99", "1:30:00:00", "1,2,3", "10 s", "no", "_1", "--")
        ),
    ],
)
@pytest.mark.parametrize("field", ["active_from: 0", "horizon: 20"])
def test_a_text_that_looks_like_a_number_is_refused_with_the_number(
    field: str, text: str, meant: str | None, file: Path
) -> None:
    file.write_text(SCENARIO.replace(field, f"{field.split(':')[0]}: {text}"))
    with pytest.raises(ScenarioError) as caught:
        Scenario.load(file)
    fits = meant is not None and (field.startswith("active_from") or meant.isdigit())
    hint = f"; did you mean {meant}?" if fits else ""
    words = rf" is not allowed: input should be a valid \w+{re.escape(hint)}$"
    assert re.search(words, str(caught.value))


def test_a_limit_may_be_written_as_messages_have_it(file: Path) -> None:
    file.write_text(SCENARIO.replace("active_from: 0", "active_from: 1e13"))
    with pytest.raises(ScenarioError, match="it must be from") as caught:
        Scenario.load(file)
    for limit in re.findall(r"-?1e\S+", str(caught.value))[-2:]:
        file.write_text(SCENARIO.replace("active_from: 0", f"active_from: {limit}"))
        assert abs(Scenario.load(file).costs[1].active_from) == 1e12
