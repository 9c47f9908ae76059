"""The reference of scenario files, in Markdown, generated from the models that validate them."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from pydantic import BaseModel

from gameinfer_docs.markdown import code, table
from gameinfer_ros.games import CostTerm, Dynamics, QuadraticInput, Vehicle
from gameinfer_ros.inference import BeliefSettings, SeedDistribution
from gameinfer_ros.planning import SafetySettings
from gameinfer_ros.scenario import PlayerSpec, Scenario, available, suite
from gameinfer_ros.solver import SolverSettings

#: Fields that are described in other sections, by model.
SECTIONS: dict[type[BaseModel], dict[str, str]] = {
    Scenario: {
        "players": "mapping from name to [player](#players)",
        "costs": "list of [cost terms](#cost-terms)",
        "seeds": "[seeds](#seeds)",
        "inference": "mapping, see [inference](#inference)",
        "solver": "mapping, see [solver](#solver)",
        "safety": "mapping, see [safety](#safety)",
    },
    PlayerSpec: {
        "dynamics": "[dynamics](#dynamics)",
        "limits": "mapping from input to its lowest and highest value",
    },
}

WORDS = {
    "number": "number",
    "integer": "whole number",
    "string": "name",
    "boolean": "true or false",
}

#: Fields of all kinds of a family.
COMMON = {"kind", "players"}


def scenario() -> str:
    """Generate the sections with all fields of a scenario file."""
    return "\n".join(
        [
            "## The file\n",
            fields(Scenario),
            "## Players\n",
            fields(PlayerSpec),
            "## Dynamics\n",
            *_kinds(Dynamics),
            "## Cost terms\n",
            "Every cost term may have the field `players`:\n",
            fields(QuadraticInput, set(QuadraticInput.model_fields) - {"players"}),
            *_kinds(CostTerm),
            "## Seeds\n",
            (inspect.getdoc(SeedDistribution) or "") + "\n",
            *_kinds(SeedDistribution),
            "## inference\n",
            fields(BeliefSettings),
            "## solver\n",
            fields(SolverSettings),
            "## safety\n",
            "Settings of the [safety layer](../safety.md):\n",
            fields(SafetySettings),
            "## Scenarios of the package\n",
            _scenarios(available()),
            "## Games of the suite\n",
            "`gameinfer check --suite` checks all of them; see "
            "[Standard games](../robustness.md#standard-games).\n",
            _scenarios(suite()),
        ]
    )


def fields(model: type[BaseModel], without: set[str] | None = None) -> str:
    """Generate a table of the fields of a model.

    Args:
        model: the model.
        without: names of fields to leave out.

    Raises:
        ValueError: a field has no description.
    """
    schema, sections = model.model_json_schema(), SECTIONS.get(model, {})
    rows = []
    for name, field in schema["properties"].items():
        if name in (without or ()):
            continue
        description = field.get("description")
        if not description:
            raise ValueError(f"{model.__name__}.{name}: give it a description")
        required = name in schema.get("required", ())
        default = "required" if required else _in_yaml(field.get("default"))
        rows.append([code(name), sections.get(name) or _kind(field), default, description])
    return table(("field", "value", "default", "meaning"), rows) if rows else ""


def _kinds(family: Any) -> Iterator[str]:
    """Generate a section for each kind of a family that the package defines."""
    for kind, cls in sorted(family.family.items()):
        if not cls.__module__.startswith("gameinfer_ros"):
            continue
        yield f"### {kind}\n"
        yield (inspect.getdoc(cls) or "") + "\n"
        if family is Dynamics:
            vehicle = "" if issubclass(cls, Vehicle) else "; in the game, not of the vehicle"
            rows = (("states", cls.state_names), ("inputs", cls.input_names))
            named = [[row, ", ".join(map(code, names))] for row, names in rows]
            yield table(("", f"in order{vehicle}"), named)
        yield fields(cls, COMMON)


def _scenarios(names: Iterable[str]) -> str:
    rows = []
    for name in names:
        loaded = Scenario.load(name)
        dynamics = dict.fromkeys(player.dynamics.kind for player in loaded.players.values())
        rows.append(
            [
                code(name),
                str(len(loaded.players)),
                ", ".join(map(code, dynamics)),
                str(loaded.inference.particles),
                f"{loaded.horizon * loaded.dt:g} s",
            ]
        )
    return table(("name", "players", "dynamics", "particles", "horizon"), rows)


def _kind(field: Mapping[str, Any]) -> str:
    """Describe the values that a JSON schema allows."""
    if "anyOf" in field:
        return " or ".join(_kind(one) for one in field["anyOf"] if one.get("type") != "null")
    if field["type"] == "array":
        return f"list of {_kind_of_items(field)}"
    if field["type"] == "object":
        return f"mapping from player to {_kind(field['additionalProperties'])}"
    if "enum" in field:
        return f"one of {', '.join(map(code, field['enum']))}"
    bounds = [
        f"{word} {field[key]:g}"
        for key, word in (
            ("minimum", "at least"),
            ("exclusiveMinimum", "above"),
            ("maximum", "at most"),
        )
        if key in field
    ]
    return ", ".join([WORDS[field["type"]], *bounds])


def _kind_of_items(field: Mapping[str, Any]) -> str:
    if "prefixItems" in field:
        return f"{len(field['prefixItems'])} numbers"
    return {"array": "points"}.get(field["items"]["type"]) or _kind(field["items"]).replace(
        "number", "numbers", 1
    ).replace("name", "names", 1)


def _in_yaml(value: Any) -> str:
    if value is None:
        return ""
    if value == {}:
        return "none"
    return "its defaults" if isinstance(value, dict) else code(value)
