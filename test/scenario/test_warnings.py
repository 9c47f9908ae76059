"""Warnings about scenarios that are valid, but probably a mistake."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scenario_content import Content, edited, with_cost

from gameinfer_ros.games import QuadraticState
from gameinfer_ros.scenario import Scenario, available, suite

Load = Callable[..., Scenario]

CAR = {"dynamics": {"kind": "car", "wheelbase": 1.0}, "initial": [0.0, 0.0, 0.5, 0.0, 0.1]}
BOUND: Content = {"kind": "soft_bound", "of": "theta", "weight": 1, "players": ["robot"]}


def initial(theta: float) -> Callable[[Content], None]:
    def edit(content: Content) -> None:
        content["players"]["robot"]["initial"][2] = theta

    return edit


def goal(theta: float) -> Callable[[Content], None]:
    def edit(content: Content) -> None:
        content["costs"][3]["goals"]["robot"][2] = theta

    return edit


def test_no_shipped_scenario_is_warned_about() -> None:
    for name in (*available(), *suite()):
        assert Scenario.load(name).warnings == Scenario.load(name).late_goals() == []


@pytest.mark.parametrize("theta", [0.0, 3.2, -3.2, 2 * np.pi, 6.2832, -6.2832, 6.284])
def test_headings_up_to_a_turn_are_fine(theta: float, load: Load) -> None:
    for edit in (initial, goal):
        assert load(edited(edit(theta))).warnings == []
    assert load(edited(with_cost(BOUND, low=min(theta, 0), high=max(theta, 0)))).warnings == [] or (
        abs(theta) >= 2 * np.pi
    )


@pytest.mark.parametrize(
    ("theta", "number", "radians"),
    [(180.0, "180", "3.14159"), (-90, "-90", "-1.5708"), (6.4, "6.4", "0.111701")],
)
def test_headings_beyond_a_turn_are_probably_degrees(
    theta: float, number: str, radians: str, load: Load
) -> None:
    for edit, field in (
        (initial, "players.robot.initial"),
        (goal, "costs[3].goals.robot"),
    ):
        assert load(edited(edit(theta))).warnings == [
            f"{field}: theta is {number} rad, more than a turn: are these degrees? Write angles in "
            f"rad: {number} degrees are {radians} rad"
        ]


def car(steering: float) -> Callable[[Content], None]:
    """Make the robot a car with a bound and a goal for its steering."""

    def edit(content: Content) -> None:
        content["players"]["robot"] = CAR
        goal = content["costs"][3]
        goal |= {"players": ["ana"], "goals": {"ana": goal["goals"]["ana"]}}
        of_car = {"players": ["robot"], "goals": {"robot": [0.0, 0.0, 1.0, 0.0, steering]}}
        content["costs"] += [
            BOUND | {"of": "steering", "low": -steering, "high": steering},
            goal | of_car | {"weights": [1, 1, 1, 0, 1]},
        ]

    return edit


def test_a_steering_angle_beyond_a_quarter_turn_is_probably_in_degrees(load: Load) -> None:
    assert load(edited(car(1.5708))).warnings == []
    angles = {
        "costs[4].low: steering is -5 rad": "-5 degrees are -0.0872665 rad",
        "costs[4].high: steering is 5 rad": "5 degrees are 0.0872665 rad",
        "costs[5].goals.robot: steering is 5 rad": "5 degrees are 0.0872665 rad",
    }
    assert load(edited(car(5.0))).warnings == [
        f"{start}, more than a quarter turn: are these degrees? Write angles in rad: {end}"
        for start, end in angles.items()
    ]


def test_only_angles_are_warned_about(load: Load) -> None:
    def far(content: Content) -> None:
        content["players"]["robot"]["initial"] = [100.0, -200.0, 1.0, 30.0]
        content["players"]["ana"]["initial"] = [100.0, 20.0, 300.0, 40.0]
        content["costs"][1] |= {"low": -90, "high": 90}

    assert load(edited(far)).warnings == []


def test_the_heading_of_a_flat_unicycle_is_that_of_its_vehicle(load: Load) -> None:
    def flat(content: Content) -> None:
        content["players"]["ana"] = {
            "dynamics": {"kind": "flat_unicycle"},
            "initial": [0.0, 0.0, 90.0, 0.0],
        }
        content["costs"][3]["goals"]["ana"] = [0.0, 90.0, 90.0, 90.0]  # px, vx, py, vy

    (found,) = load(edited(flat)).warnings
    assert found.startswith("players.ana.initial: theta is 90 rad")


def test_bounds_on_a_heading_are_checked(load: Load) -> None:
    found = load(edited(with_cost(BOUND, low=-90, high=45))).warnings
    assert [w.split(" rad")[0] for w in found] == [
        "costs[4].low: theta is -90",
        "costs[4].high: theta is 45",
    ]
    assert load(edited(with_cost(BOUND, low=-4, high=4))).warnings == [
        "costs[4]: the bounds of theta are 8 rad apart: they have no effect, because angles count "
        "modulo a turn"
    ]
    assert load(edited(with_cost(BOUND, low=-3, high=3))).warnings == []


def weights(*of_terms: list[float] | None) -> Callable[[Content], None]:
    """Replace the costs of inputs; there is none for None."""

    def edit(content: Content) -> None:
        content["costs"][:1] = [
            {"kind": "quadratic_input", "weights": w} for w in of_terms if w is not None
        ]

    return edit


@pytest.mark.parametrize(
    ("edit", "robot", "ana"),
    [
        (weights(), "omega and a", "ax and ay"),
        (weights([0.0, 0.0]), "omega and a", "ax and ay"),
        (weights([10, 0]), "a", "ay"),
        (weights([10, 0], [0, 1e-3]), "", ""),
    ],
)
def test_inputs_without_a_cost_are_warned_about(
    edit: Callable[[Content], None], robot: str, ana: str, load: Load
) -> None:
    expected = [
        f"players.{name}: no cost weighs the input {inputs}, so the game has no unique solution; "
        "the method iterative_lq uses input_regularisation as the weight, and newton may not "
        "converge: add a cost of kind quadratic_input"
        for name, inputs in (("robot", robot), ("ana", ana))
        if inputs
    ]
    assert load(edited(edit)).warnings == expected


def test_a_soft_bound_is_no_cost_of_an_input_and_a_term_of_the_user_may_be(load: Load) -> None:
    bound = {"kind": "soft_bound", "of": "a", "low": -1, "high": 1, "weight": 5}

    def edit(content: Content) -> None:
        weights([10, 0])(content)
        content["costs"].append({**bound, "players": ["robot"]})

    assert [w.partition(":")[0] for w in load(edited(edit)).warnings] == [
        "players.robot",
        "players.ana",
    ]

    class MayWeighInputs(QuadraticState):
        """A term of a user."""

    scenario = load(edited(weights()))
    own = MayWeighInputs(kind="quadratic_state", weights=(0.0,) * 4)
    assert not scenario.model_copy(update={"costs": [*scenario.costs, own]}).warnings


def starts_at(active_from: float) -> Callable[[Content], None]:
    return lambda content: content["costs"][3].update(active_from=active_from)


@pytest.mark.parametrize(
    ("active_from", "warns"),
    [(0.0, False), (1.85, False), (2.1, False), (2.2, True), (90, True), (1e9, True)],
)
def test_a_goal_that_begins_after_the_run_is_warned_about(
    active_from: float, warns: bool, load: Load
) -> None:
    found = load(edited(starts_at(active_from))).late_goals()
    assert found == warns * [
        f"costs[3].active_from: the goal begins at {active_from:g} s, but the run ends at 2.1 s, "
        "after 21 steps: let the goal begin earlier, or play more steps"
    ]


def test_a_goal_at_the_last_state_is_not_late_however_the_end_is_rounded(load: Load) -> None:
    for steps in range(1, 200):
        for active_from in {steps * 0.1, steps / 10, float(f"{steps / 10:.1f}")}:
            content = edited(starts_at(active_from)) | {"steps": steps, "dt": 0.1}
            assert load(content).late_goals() == []


def test_a_run_may_have_other_steps_than_the_scenario(load: Load) -> None:
    scenario = load(edited(starts_at(1.05)))
    assert scenario.late_goals() == scenario.late_goals(11) == []
    (found,) = scenario.late_goals(10)
    assert "but the run ends at 1 s, after 10 steps" in found
