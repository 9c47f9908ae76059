"""The references name all that there is, as it is: they are read off the code."""

from __future__ import annotations

import argparse
import inspect
import re
from functools import cache
from importlib.metadata import distribution
from pathlib import Path

import pytest
import yaml_text
from gameinfer_docs import command_reference, scenario_reference
from gameinfer_docs.generated import MARK, PARTS, expanded
from gameinfer_docs.node_interface import private_context
from gameinfer_docs.node_reference import IN_THE_ORCHESTRATOR, interface, quality_of_service
from pages import PAGES, ROOT
from pydantic import BaseModel
from rclpy.node import Node
from rclpy.qos import QoSProfile

from gameinfer_ros.commands import cli
from gameinfer_ros.games import CostTerm, Dynamics
from gameinfer_ros.inference import BeliefSettings, SeedDistribution
from gameinfer_ros.nodes.table import NODES, class_of
from gameinfer_ros.scenario import PlayerSpec, Scenario, available, suite
from gameinfer_ros.solver import SolverSettings
from msg_adapters import qos

MESSAGES = (ROOT / "docs/reference/messages.md").read_text(encoding="utf-8")

CLASSES = [*map(class_of, NODES), *IN_THE_ORCHESTRATOR]


@cache
def nodes() -> str:
    return PARTS["nodes"]()


@cache
def scenario() -> str:
    return scenario_reference.scenario()


def section(title: str, text: str) -> str:
    """What stands below a heading, up to the next one of the same level or above."""
    found = re.search(rf"^(#+) {re.escape(title)}$", text, re.M)
    assert found, title
    after = text[found.end() :]
    end = re.search(rf"^#{{1,{len(found[1])}}} ", after, re.M)
    return after[: end.start()] if end else after


def test_every_parameter_and_topic_in_the_sources_is_in_the_reference() -> None:
    found = 0
    for module in (ROOT / "gameinfer_ros/nodes").rglob("*.py"):
        source = module.read_text(encoding="utf-8")
        for parameter in re.findall(r"self\.declare(?:_\w+)?\(\s*\"(\w+)\"", source):
            assert f"| `{parameter}` |" in nodes(), f"{parameter} of {module.name}"
            found += 1
        for topic in re.findall(r"\"(/?[a-z_]+)\", qos\.", source):
            assert f"| `{topic}` |" in nodes(), f"{topic} of {module.name}"
            found += 1
    assert found > 15


def test_what_a_node_has_is_told_with_all_that_there_is_to_tell() -> None:
    inference = section("inference", nodes())
    (threads,) = re.findall(r"^\| `threads` \|.*$", inference, re.M)
    assert [cell.strip() for cell in threads.split("|")[2:6]] == [
        "integer", "`0`", "0 to 64", "at start",
    ]  # fmt: skip
    (belief,) = re.findall(r"^\| publishes \| `belief` .*$", inference, re.M)
    assert "`std_msgs/Float64MultiArray` | `STREAM`" in belief


def test_what_a_switch_makes_is_found() -> None:
    (clock,) = re.findall(r"^\| publishes \| `/clock`.*$", section("simulator", nodes()), re.M)
    assert "if `publish_clock` is `true`" in clock


def test_every_topic_says_what_its_messages_say() -> None:
    topics = set(re.findall(r"^\| (?:publishes|subscribes) \| `([^`]+)`", nodes(), re.M))
    assert {"joint_state", "<player>/control", "/diagnostics"} <= topics
    for topic in topics:
        assert f"| `{topic}` |" in MESSAGES, topic


@pytest.mark.parametrize("node_class", CLASSES, ids=lambda cls: cls.__name__)
def test_parameters_are_described_and_docstrings_name_every_topic_and_service(
    node_class: type[Node],
) -> None:
    text = "\n".join(inspect.getdoc(cls) or "" for cls in node_class.__mro__)
    with private_context() as context:
        found = interface(node_class, context)
    for parameter in found.parameters:
        assert len(parameter.description.split()) > 3, parameter.name
    for endpoint in found.endpoints:
        name = re.escape(endpoint.name).replace("<player>", "<(?:player|robot)>")
        assert re.search(rf"^ *{name} \({endpoint.type}\b", text, re.M), endpoint
        if endpoint.role != "serves" and " " not in endpoint.profile:
            assert re.search(rf"^ *{name} \({endpoint.type}, `{endpoint.profile}`\)", text, re.M), (
                endpoint
            )


def test_every_profile_is_in_the_reference() -> None:
    for name, profile in vars(qos).items():
        if isinstance(profile, QoSProfile):
            row = rf"^\| `{name}` \|.* \| {profile.depth} \|$"
            assert re.search(row, quality_of_service(), re.M), name


def test_the_file_of_node_parameters_has_known_parameters_only() -> None:
    content = yaml_text.load((ROOT / "config/nodes.yaml").read_text(encoding="utf-8"))
    for node, body in content.items():
        for parameter in body["ros__parameters"]:
            assert f"| `{parameter}` |" in nodes(), f"{parameter} of {node}"


@pytest.mark.parametrize("model", [Scenario, PlayerSpec, BeliefSettings, SolverSettings])
def test_every_field_of_a_scenario_is_in_the_reference(model: type[BaseModel]) -> None:
    for name, field in model.model_fields.items():
        (row,) = re.findall(rf"^\| `{name}` \|.*$", scenario_reference.fields(model), re.M)
        assert row in scenario()
        assert field.description and field.description in row


@pytest.mark.parametrize("family", [Dynamics, CostTerm, SeedDistribution])
def test_every_kind_and_its_fields_are_in_the_reference(family: type[BaseModel]) -> None:
    members = {
        kind: cls
        for kind, cls in family.family.items()  # type: ignore[attr-defined]
        if cls.__module__.startswith("gameinfer_ros")  # and not one of some test
    }
    assert members
    for kind, cls in members.items():
        of_kind = section(kind, scenario())
        for name in set(cls.model_fields) - {"kind", "players"}:
            assert f"| `{name}` |" in of_kind, f"{name} of {kind}"
        for name in (*getattr(cls, "state_names", ()), *getattr(cls, "input_names", ())):
            assert f"`{name}`" in of_kind, f"{name} of {kind}"


def test_ranges_and_defaults_are_in_the_reference() -> None:
    (threads,) = re.findall(r"^\| `threads` \|.*$", section("solver", scenario()), re.M)
    assert "whole number, above 0, at most 64 | `1` |" in threads
    (radius,) = re.findall(r"^\| `radius` \|.*$", section("proximity", scenario()), re.M)
    assert "number, above 0 | required |" in radius


def test_every_scenario_of_the_package_is_in_the_reference() -> None:
    for title, names in (
        ("Scenarios of the package", available()),
        ("Games of the suite", suite()),
    ):
        assert names
        for name in names:
            assert f"| `{name}` |" in section(title, scenario())


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_every_option_of_a_command_is_in_the_reference(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="0"):
        cli.main([name, "--help"])
    options = set(re.findall(r"^  (?:-\w, )?(--[a-z-]+)", capsys.readouterr().out, re.M))
    options -= {"--help"}
    assert options
    of_command = section(name, command_reference.commands())
    for option in options:
        assert re.search(rf"^\| `[^|]*{option}\b", of_command, re.M), option


def test_every_executable_is_in_a_reference() -> None:
    for executable in distribution("gameinfer_ros").entry_points:
        assert executable.name == "gameinfer" or f"## {executable.name}\n" in nodes()


def test_pages_ask_for_every_part_and_for_no_other() -> None:
    asked = [mark for page in PAGES for mark in MARK.findall(page.read_text(encoding="utf-8"))]
    assert sorted(asked) == sorted(PARTS)
    with pytest.raises(KeyError):
        expanded("<!-- generated: weather -->")


def test_a_field_without_a_description_is_refused() -> None:
    class Nameless(BaseModel):
        weight: float

    with pytest.raises(ValueError, match=r"Nameless\.weight: give it a description"):
        scenario_reference.fields(Nameless)


def test_an_option_is_told_with_choices_and_default() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument(
        "--colour", choices=("red", "blue"), default="red", help="paint; %(default)s by default"
    )
    told = command_reference._options(parser)
    assert "| `--colour red\\|blue` | paint; red by default |" in told


def test_the_site_is_made_of_pages_that_exist() -> None:
    linked = re.findall(r"\]\(([^):#]+\.md)", (ROOT / "docs/index.md").read_text("utf-8"))
    assert all((ROOT / "docs" / Path(link)).is_file() for link in linked)
