"""Scenarios, and their validation."""

import math
import re
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from typing_extensions import Self

from gameinfer_ros.games import Car, CostTerm, Dynamics, Game, Vehicles
from gameinfer_ros.games.costs.cost_term import check_length
from gameinfer_ros.games.registry import NonNegative, PositiveInteger, Real
from gameinfer_ros.inference import BeliefSettings, SeedDistribution, check_particles
from gameinfer_ros.names.text import shorten
from gameinfer_ros.planning import SafetySettings
from gameinfer_ros.scenario import reading
from gameinfer_ros.scenario.files import ScenarioError, find
from gameinfer_ros.scenario.warnings import late_goals, warnings_about
from gameinfer_ros.solver import SolverSettings

#: Largest number of steps of a run. Even with the longest time step, stamps fit 32-bit seconds.
MOST_STEPS = 10**8

#: Largest number of mistakes in one message.
_MOST_MISTAKES = 20


class PlayerSpec(BaseModel):
    """A player of a scenario: its dynamics, initial state, radius and limits."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    dynamics: Dynamics = Field(description="how the player moves")
    initial: tuple[Real, ...] = Field(
        description="initial state of the vehicle, one number per state"
    )
    radius: NonNegative = Field(
        default=0.0,
        description="radius of the player, a disc around its position, in m. Distances, the "
        "clearance and the costs `proximity`, `obstacle` and `lane` are measured from its edge",
    )
    limits: dict[str, tuple[Real, Real]] = Field(
        default={},
        description="lowest and highest value of an input, by its name; other inputs are "
        "unlimited. Braking respects the limits, and so does a robot with its "
        "[safety layer](../safety.md)",
    )


class Scenario(BaseModel):
    """Everything that is fixed before a run: the game, its initial state, and all settings."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    dt: Real = Field(ge=1e-3, le=10.0, description="length of a time step, in s")
    horizon: PositiveInteger = Field(le=10_000, description="steps that every player plans ahead")
    steps: PositiveInteger = Field(le=MOST_STEPS, description="steps of a run")
    players: dict[str, PlayerSpec] = Field(
        min_length=1, max_length=32, description="by name; the first is the robot"
    )
    costs: list[CostTerm] = Field(
        description="cost terms; a term without `players` applies to all players"
    )
    seeds: SeedDistribution = Field(description="distribution of the initial strategies")
    inference: BeliefSettings = Field(
        default=BeliefSettings(), description="settings of the belief"
    )
    solver: SolverSettings = Field(default=SolverSettings(), description="settings of the solver")
    safety: SafetySettings = Field(
        default=SafetySettings(), description="settings of the safety layer"
    )

    @model_validator(mode="after")
    def _check_game(self) -> Self:
        for name, player in self.players.items():
            if len(name) > 64 or not re.fullmatch(r"[A-Za-z](_?[A-Za-z0-9])*", name):
                raise ValueError(
                    f"players.{name}: the name is not allowed: it must consist of at most 64 "
                    "ASCII letters, digits and single underscores, start with a letter, and not "
                    "end with an underscore, because nodes and topics are named after players"
                )
            names = player.dynamics.vehicle.state_names
            check_length(f"players.{name}.initial", player.initial, names)
            _check_steering(f"players.{name}.initial", player)
            _check_limits(f"players.{name}.limits", player)
        players = self.game.players
        _check_apart(self.vehicles, self.initial_vehicle_state)
        try:
            self.seeds.check(players)
        except ValueError as error:
            raise ValueError(f"seeds.{error}") from None
        try:
            check_particles(self.inference.particles, self.game)
        except ValueError as error:
            of_belief = not str(error).startswith("horizon")
            raise ValueError(f"{'inference.' * of_belief}{error}") from None
        return self

    def __getstate__(self) -> dict[Any, Any]:
        # The compiled game belongs to this process: a copy in another process compiles its own.
        state = super().__getstate__()
        fields = {name: state["__dict__"][name] for name in type(self).model_fields}
        return {**state, "__dict__": fields}

    @cached_property
    def game(self) -> Game:
        """Game that the players play."""
        dynamics = {name: player.dynamics for name, player in self.players.items()}
        radii = {name: player.radius for name, player in self.players.items()}
        return Game(dynamics, self.costs, self.dt, self.horizon, radii)

    @cached_property
    def vehicles(self) -> Vehicles:
        """Vehicles of the players."""
        limits = {name: player.limits for name, player in self.players.items()}
        return Vehicles(self.game, limits)

    @property
    def initial_vehicle_state(self) -> np.ndarray:
        """Joint state (ns,) of the vehicles at step 0."""
        return np.concatenate([player.initial for player in self.players.values()])

    @property
    def initial_state(self) -> np.ndarray:
        """Joint state (nx,) of the game at step 0."""
        return self.vehicles.game_state(self.initial_vehicle_state)

    @property
    def warnings(self) -> list[str]:
        """What is valid, but probably a mistake, such as a heading of 180 rad, in words.

        See also `late_goals`.
        """
        return warnings_about(self.vehicles, self.initial_vehicle_state, self.costs)

    def late_goals(self, steps: int | None = None) -> list[str]:
        """Goals that begin after a run of `steps`, by default those of the scenario, in words."""
        return late_goals(self.costs, self.steps if steps is None else steps, self.dt)

    @classmethod
    def load(cls, name_or_file: str | Path) -> Self:
        """Read a scenario from a file, or by its name from the package.

        Raises:
            ScenarioError: the file does not exist, is not YAML, or its content is invalid.
        """
        path = find(name_or_file)
        content = reading.load(path)
        if not isinstance(content, dict):
            found = "nothing" if content is None else _shown(content)
            raise ScenarioError(f"{path}: contains {found}, but must contain a mapping of fields")
        # The user may have defined dynamics, terms or seeds since these classes were created.
        PlayerSpec.model_rebuild(force=True)
        cls.model_rebuild(force=True)
        try:
            return cls.model_validate(content)
        except ValidationError as error:
            errors = error.errors()
        lines = [f"{path}: {_one_line(_describe(item))}" for item in errors[:_MOST_MISTAKES]]
        if len(errors) > _MOST_MISTAKES:
            lines.append(f"{path}: and {len(errors) - _MOST_MISTAKES} more")
        raise ScenarioError("\n".join(lines))


def _check_steering(field: str, player: PlayerSpec) -> None:
    vehicle = player.dynamics.vehicle
    if isinstance(vehicle, Car):  # the tangent of the steering angle must be finite
        index = vehicle.state_names.index("steering")
        value, most = player.initial[index], math.pi / 2
        if abs(value) >= most:
            raise ValueError(
                f"{field}[{index}]: {value} is not allowed: the steering must be between "
                f"-{most:.6g} and {most:.6g} rad; {value:g} degrees are {math.radians(value):.6g} "
                "rad"
            )


def _check_limits(field: str, player: PlayerSpec) -> None:
    names = player.dynamics.vehicle.input_names
    for name, (low, high) in player.limits.items():
        if name not in names:
            raise ValueError(
                f"{field}.{name}: is not allowed: the inputs of the vehicle are {', '.join(names)}"
            )
        if not low < 0 < high:
            raise ValueError(
                f"{field}.{name}: [{low}, {high}] is not allowed: the first must be below 0 and "
                "the second above 0, so that the vehicle can brake and stand still"
            )


def _check_apart(vehicles: Vehicles, s: np.ndarray) -> None:
    distances = vehicles.distances(s)
    if distances.min(initial=0.0) < 0:
        nearest = int(np.argmin(distances))
        i, j = (int(index[nearest]) for index in np.triu_indices(len(vehicles), k=1))
        one, other = vehicles.names[i], vehicles.names[j]
        raise ValueError(
            f"players.{other}.radius: {vehicles.radii[j]} is not allowed: {one}, with a radius of "
            f"{vehicles.radii[i]}, and {other} overlap by {-distances[nearest]:.3g} m at the start"
        )


def _describe(error: Any) -> str:
    """Describe one error of pydantic by its field, its value, and what is allowed."""
    field, model = _locate(error["loc"])
    given, message = error["input"], error["msg"].removeprefix("Value error, ")
    message = message[0].lower() + message[1:]
    if error["type"] == "value_error" and not field:
        return message
    if error["type"] == "missing":
        return f"{field}: is missing"
    if error["type"] == "extra_forbidden":
        allowed = ", ".join(model.model_fields)
        return f"{field}: {_shown(given)} is not allowed: the fields are {allowed}"
    if error["type"] == "union_tag_not_found":
        return f"{field}: {_shown(given)} is not allowed: it must be a mapping with a kind"
    if error["type"] == "union_tag_invalid":
        kind, allowed = given["kind"], error["ctx"]["expected_tags"]
        return f"{field}.kind: {_shown(kind)} is not allowed: it must be one of {allowed}"
    if error["type"] in ("int_type", "float_type") and isinstance(given, str):
        meant = reading.meant_number(given)
        if meant is not None and (error["type"] == "float_type" or meant.lstrip("+-").isdigit()):
            message += f"; did you mean {meant}?"
    return f"{field}: {_shown(given)} is not allowed: {message}"


def _locate(loc: tuple[int | str, ...]) -> tuple[str, Any]:
    """Return the field that a location of pydantic means, and the model that contains it."""
    # Pydantic inserts the chosen kind into the location, after the field with the alternatives.
    field = ""
    model: Any = Scenario
    for before, part in zip((None, *loc), loc, strict=False):
        if isinstance(part, int):
            field += f"[{part}]"
        elif part in _kinds() and (isinstance(before, int) or before in ("dynamics", "seeds")):
            model = _kinds()[part]
        else:
            field += f".{part}" if field else part
    if model is Scenario and len(loc) > 1:
        annotation = Scenario.model_fields[str(loc[0])].annotation
        model = PlayerSpec if loc[0] == "players" else annotation
    return field, model


def _kinds() -> dict[str, Any]:
    return {**Dynamics.family, **CostTerm.family, **SeedDistribution.family}


def _shown(value: Any) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return shorten(repr(value), 80)


def _one_line(text: str) -> str:
    """Escape characters that a terminal does not show, and shorten a long text in its middle."""
    printable = "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)
    # The end says what is allowed.
    return printable if len(printable) <= 1000 else f"{printable[:400]}...{printable[-400:]}"
