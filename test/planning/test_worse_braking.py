"""The safety layer does not brake where braking is clearly worse."""

from __future__ import annotations

import numpy as np
import pytest
from guarded import (
    ALONG,
    CLEARANCE,
    DT,
    LOOK_AHEAD,
    MARGIN,
    assert_goes_on_rightly,
    make,
    push,
    room,
)

from gameinfer_ros.planning import BRAKES, GOES_ON

#: A person is about to cross close before the robot, which passes first if it does not brake.
CROSSING = [0.5, 1.2, -np.pi / 2, 1.5]


@pytest.mark.parametrize("kind", ["unicycle", "flat", "car", "double integrator"])
def test_where_braking_is_clearly_worse_the_plan_continues_with_a_report(kind: str) -> None:
    _, guard = make(kind)
    s = np.concatenate([ALONG[kind](0.0, 1.5), CROSSING])
    plan = np.zeros((10, 2))
    found = guard.check(s, plan)
    assert found.action == GOES_ON
    np.testing.assert_array_equal(found.inputs, plan[:1])
    assert found.reason.startswith("braking leaves 0.") and "; the plan leaves 0." in found.reason
    # It is the whole plan that is better: what is known of its first steps only is not enough.
    for known in (1, 2):
        assert guard.check(s, plan[:known]).action == BRAKES
        broken = plan.copy()
        broken[known] = np.nan
        assert guard.check(s, broken).action == BRAKES
    plan[0] = np.nan
    assert guard.check(s, plan).reason == "the plan is not finite"


def test_a_plan_that_continues_stays_within_the_limits() -> None:
    vehicles, guard = make("unicycle")
    s = np.concatenate([ALONG["unicycle"](0.0, 1.5), CROSSING])
    inputs = np.zeros((10, 2))
    inputs[0] = -9.0, 0.0
    found = guard.check(s, inputs)
    assert found.action == GOES_ON and found.reason.endswith("m, omega -9.00 is clipped to -2")
    np.testing.assert_array_equal(found.inputs, [[-2.0, 0.0]])
    np.testing.assert_array_equal(found.states[1], vehicles.step_alone(0, s[:4], found.inputs[0]))


@pytest.mark.parametrize("kind", ["unicycle", "car", "double integrator"])
def test_a_plan_continues_only_where_braking_is_clearly_worse(kind: str) -> None:
    """People cross its way from either side; how it would continue is drawn at random."""
    vehicles, guard = make(kind)
    rng = np.random.default_rng(0)
    went_on = braked = 0
    for _ in range(60):
        meets, when = rng.uniform(0.2, 1.0), rng.uniform(0.3, 1.0)
        yaw, speed = rng.uniform(0.5, 2.6) * rng.choice([-1, 1]), rng.uniform(0.5, 2.0)
        way = speed * when
        person = [meets - way * np.cos(yaw), -way * np.sin(yaw), yaw, speed]
        s = np.concatenate([ALONG[kind](0.0, rng.uniform(0.5, 2.0)), person])
        inputs = np.array([push(kind, rng.uniform(-1.0, 1.0))] * 10)
        found = guard.check(s, inputs)
        if found.action not in (BRAKES, GOES_ON):
            continue
        brake = vehicles.braking_input(0, s[vehicles.states(0)])[None]
        braking = room(vehicles, s, brake, after=DT)
        whole = room(vehicles, s, inputs, after=DT, until=LOOK_AHEAD)
        if found.action == GOES_ON:
            went_on += 1
            assert_goes_on_rightly(found, inputs, braking, whole)
        else:
            braked += 1
            assert braking > CLEARANCE - 0.01 or whole < braking + MARGIN + 0.02
    assert went_on >= 3 and braked >= 3


def test_no_person_is_passed_within_a_step_where_braking_keeps_the_clearance() -> None:
    """At the end of the step, the robot would be beyond the person, with more room than now."""
    kind = "unicycle without limits"
    vehicles, guard = make(kind)
    s = np.array([*ALONG[kind](0.0, 0.0), 0.47, 0.25, 0.0, 0.0])
    inputs = np.array([push(kind, 190.0)])
    assert room(vehicles, s, inputs) < 0.3 < CLEARANCE < room(vehicles, s, 0.0 * inputs)
    assert room(vehicles, s, inputs, after=DT) > room(vehicles, s, 0.0 * inputs, after=DT)
    assert guard.check(s, inputs).action == BRAKES
