"""The safety layer, against a simple simulation of the seconds ahead."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from examples import examples
from gameinfer_ros.games import (
    Car,
    DoubleIntegrator,
    Dynamics,
    FlatUnicycle,
    Game,
    Unicycle,
    Vehicles,
)  # fmt: skip
from gameinfer_ros.games.motion import Motion
from gameinfer_ros.planning import (
    BRAKES,
    GOES_ON,
    LIMITED,
    PASSES,
    SafePlan,
    SafetyFilter,
    SafetySettings,
)
from gameinfer_ros.runs import closed_loop
from gameinfer_ros.scenario import Scenario

DT, CLEARANCE, LOOK_AHEAD = 0.1, 0.5, 1.0
#: By so much must a plan be better than braking for the robot not to brake, in m.
MARGIN = 0.1
ROBOTS: dict[str, tuple[Dynamics, dict[str, tuple[float, float]]]] = {
    "unicycle": (Unicycle(), {"omega": (-2.0, 2.0), "a": (-3.0, 2.0)}),
    "flat": (FlatUnicycle(), {"omega": (-2.0, 2.0), "a": (-3.0, 2.0)}),
    "car": (Car(wheelbase=0.5), {"steering_rate": (-1.0, 1.0), "a": (-3.0, 2.0)}),
    "double integrator": (DoubleIntegrator(), {"ax": (-3.0, 3.0), "ay": (-3.0, 3.0)}),
    "unicycle without limits": (Unicycle(), {}),
}
#: A robot that drives along x with a speed: its state, and the input that speeds it up.
ALONG = {
    "unicycle": lambda x, v: [x, 0.0, 0.0, v],
    "flat": lambda x, v: [x, 0.0, 0.0, v],
    "unicycle without limits": lambda x, v: [x, 0.0, 0.0, v],
    "car": lambda x, v: [x, 0.0, 0.0, v, 0.0],
    "double integrator": lambda x, v: [x, v, 0.0, 0.0],
}


def push(kind: str, a: float) -> list[float]:
    return [a, 0.0] if kind == "double integrator" else [0.0, a]


def speed_of(kind: str, s: np.ndarray) -> float:
    return float(s[1] if kind == "double integrator" else s[3])


def make(kind: str, people: int = 1) -> tuple[Vehicles, SafetyFilter]:
    """A robot among people who are unicycles."""
    dynamics, limits = ROBOTS[kind]
    others = {f"human_{j}": Unicycle() for j in range(people)}
    vehicles = Vehicles(Game({"robot": dynamics, **others}, [], DT, 5), {"robot": limits})
    return vehicles, SafetyFilter(vehicles, SafetySettings())


def rooms(
    vehicles: Vehicles,
    walks: Sequence[tuple[np.ndarray, np.ndarray]],
    after: float = 0.0,
    until: float = np.inf,
) -> np.ndarray:
    """Smallest distances between two times if the robot does some inputs, and then brakes.

    A walk is the joint state (ns,) where it starts, and the inputs (S, 2). By default it ends one
    look-ahead after the last input began. Everything is stepped fifty times as often.
    """
    fine = 50
    players = dict(zip(vehicles.names, vehicles.dynamics, strict=True))
    small = Game(players, [], DT / fine, 5)
    robot, found = vehicles.states(0), np.full(len(walks), np.inf)
    s = np.stack([start for start, _ in walks], axis=-1)
    ends = [min((len(inputs) - 1) * DT + LOOK_AHEAD, until) for _, inputs in walks]
    steps = np.round(np.array(ends) / DT).astype(int)
    for k in range(steps.max()):
        w = np.zeros((vehicles.n_inputs, len(walks)))  # people keep their speed and heading
        for walk, (_, inputs) in enumerate(walks):
            brake = vehicles.dynamics[0].braking_input(s[robot, walk], DT)
            doing = inputs[k] if k < len(inputs) else brake
            w[vehicles.inputs(0), walk] = np.clip(doing, vehicles.low[:2], vehicles.high[:2])
        for part in range(fine):
            s = small.step(s, w)
            if (k + (part + 1) / fine) * DT > after + 1e-9:
                nearest = vehicles.distances(s.T)[:, : len(vehicles) - 1].min(axis=1)
                found = np.where(k < steps, np.minimum(found, nearest), found)
    return found


def room(
    vehicles: Vehicles, s: np.ndarray, inputs: np.ndarray, after: float = 0.0, until: float = np.inf
) -> float:
    """The smallest distance of a single walk."""
    return float(rooms(vehicles, [(s, inputs)], after, until)[0])


def test_what_the_shipped_robots_do_among_three_is_left_alone(three_player: Scenario) -> None:
    free = closed_loop.run(three_player, "map", 5)
    safe = closed_loop.run(three_player, "map", 5, safety=True)
    np.testing.assert_array_equal(np.array(safe.states), np.array(free.states))
    np.testing.assert_array_equal(np.array(safe.inputs), np.array(free.inputs))
    assert (safe.safety_braked, safe.safety_limited) == (0, 0)
    assert (free.safety_braked, free.safety_limited) == (None, None)


@pytest.mark.parametrize("kind", ROBOTS)
def test_a_plan_in_an_open_space_passes_to_the_last_bit(kind: str) -> None:
    vehicles, guard = make(kind, people=2)
    rng = np.random.default_rng(0)
    for _ in range(20):
        s = np.concatenate([ALONG[kind](0.0, 1.0), [8.0, 8.0, 0.0, 1.0], [-8.0, 8.0, 0.0, 1.0]])
        inputs = rng.uniform(-1.0, 1.0, (10, 2))
        found = guard.check(s, inputs)
        np.testing.assert_array_equal(found.inputs, inputs)
        assert (found.action, found.reason, len(found.states)) == (PASSES, "", 11)
        for k in range(10):
            w = np.concatenate([inputs[k], np.zeros(4)])
            s = vehicles.step(s, w)
            np.testing.assert_array_equal(found.states[k + 1], s[vehicles.states(0)])


def test_a_robot_that_is_alone_has_limits_only() -> None:
    _, guard = make("unicycle", people=0)
    found = guard.check(np.zeros(4), np.array([[0.0, 5.0], [0.0, 1.0]]))
    assert found.action == LIMITED
    np.testing.assert_array_equal(found.inputs, [[0.0, 2.0], [0.0, 1.0]])


anything = st.floats(allow_nan=True, allow_infinity=True)


@settings(max_examples=examples(150), derandomize=True)
@given(kind=st.sampled_from(list(ROBOTS)), data=st.data())
def test_whatever_comes_in_a_vehicle_can_do_what_comes_out(kind: str, data: st.DataObject) -> None:
    vehicles, guard = make(kind)
    s = data.draw(arrays(float, vehicles.n_states, elements=anything))
    inputs = data.draw(arrays(float, (data.draw(st.integers(1, 4)), 2), elements=anything))
    found = guard.check(s, inputs)
    assert 1 <= len(found.inputs) <= len(inputs)
    assert np.isfinite(found.inputs).all()
    assert (found.inputs >= vehicles.low[:2]).all() and (found.inputs <= vehicles.high[:2]).all()
    assert len(found.states) == len(found.inputs) + 1
    assert (found.action == PASSES) == (found.reason == "")


@pytest.mark.parametrize("kind", ROBOTS)
def test_known_states_of_a_plan_change_nothing(kind: str) -> None:
    vehicles, guard = make(kind, people=2)
    rng, actions = np.random.default_rng(3), set()
    for _ in range(200):
        s = rng.normal(scale=1.5, size=vehicles.n_states)
        inputs = rng.normal(scale=rng.choice([0.3, 3.0]), size=(rng.integers(1, 20), 2))
        if rng.random() < 0.3:
            inputs[rng.integers(len(inputs)), 0] = np.nan
        states = vehicles.motions[0].states(s[vehicles.states(0)], inputs, len(inputs))
        found, expected = guard.check(s, inputs, states), guard.check(s, inputs)
        for one, other in zip(found[:2], expected[:2], strict=True):
            np.testing.assert_array_equal(one, other)
        assert found[2:] == expected[2:]
        actions.add(found.action)
    assert actions >= {PASSES, BRAKES}


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The number of particles of each motion that is simulated."""
    found: list[int] = []
    simulate = Motion._simulated

    def count(self: Motion, s: np.ndarray, w: np.ndarray, steps: int) -> np.ndarray:
        found.append(s.shape[-1])
        return simulate(self, s, w, steps)

    monkeypatch.setattr(Motion, "_simulated", count)
    return found


def test_all_inputs_of_a_plan_are_simulated_at_once(
    simulated: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A check with a simulation for each input, or of all vehicles, takes ten times as long."""
    vehicles, guard = make("unicycle", people=2)
    monkeypatch.setattr(Vehicles, "step", None)
    s = np.array([0.0, 0.0, 0.0, 1.0, 8.0, 8.0, 0.0, 1.0, -8.0, 8.0, 0.0, 1.0])
    states, w = vehicles.follow(0, s, np.zeros((8, 2)))
    assert len(guard.check(s, w, states).inputs) == 8
    assert simulated == [1, 8], "once for the plan, and once for braking after each input"


@pytest.mark.parametrize("clearance", [0.0, 0.5])
def test_a_warm_up_loads_the_code_for_one_and_for_several_inputs(
    clearance: float, simulated: list[int]
) -> None:
    vehicles, _ = make("unicycle")
    SafetyFilter(vehicles, SafetySettings(clearance=clearance)).warm_up()
    assert simulated == [1, 2, 1, 1, 1, 1]


@pytest.mark.parametrize("speed", [0.0, 0.5])
@pytest.mark.parametrize("kind", ROBOTS)
def test_a_plan_ends_before_the_first_input_that_fails_wherever_it_is(
    kind: str, speed: float
) -> None:
    vehicles, guard = make(kind)
    inputs = np.tile(push(kind, 0.0), (30, 1))
    ends, sent_walks, longer_walks = set(), [], []
    for ahead in np.linspace(0.6, 4.0, 40):
        s = np.concatenate([ALONG[kind](0.0, 1.0), [(1 + speed) * ahead, 0.0, np.pi, speed]])
        found = guard.check(s, inputs)
        sent = len(found.inputs)
        ends.add(sent)
        if found.action == PASSES:
            sent_walks.append((s, inputs[:sent]))
            if sent < 30:
                longer_walks.append((s, inputs[: sent + 1]))
    assert (rooms(vehicles, sent_walks) > CLEARANCE - 1e-9).all()
    assert (rooms(vehicles, longer_walks) < CLEARANCE + 1e-9).all()
    assert len(ends) > 20 and max(ends) == 30


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("kind", ROBOTS)
def test_a_plan_that_is_no_plan_becomes_a_brake_or_ends_before(kind: str, bad: float) -> None:
    vehicles, guard = make(kind)
    s = np.concatenate([ALONG[kind](0.0, 1.0), [9.0, 9.0, 0.0, 0.0]])
    inputs = np.full((5, 2), 0.1)
    inputs[3, 1] = bad
    found = guard.check(s, inputs)
    np.testing.assert_array_equal(found.inputs, inputs[:3])
    assert found.action == PASSES
    inputs[0, 0] = bad
    found = guard.check(s, inputs)
    np.testing.assert_array_equal(found.inputs, [vehicles.braking_input(0, s[:-4])])
    assert (found.action, found.reason) == (BRAKES, "the plan is not finite")


@pytest.mark.parametrize("kind", ROBOTS)
def test_to_brake_at_rest_is_to_do_nothing(kind: str) -> None:
    _, guard = make(kind)
    s = np.concatenate([ALONG[kind](1.0, 0.0), [9.0, 9.0, 0.0, 0.0]])
    found = guard.check(s, np.full((1, 2), np.nan))
    np.testing.assert_array_equal(found.inputs, [[0.0, 0.0]])
    np.testing.assert_array_equal(found.states[1], found.states[0])


def test_inputs_beyond_the_limits_are_clipped_and_reported() -> None:
    _, guard = make("unicycle")
    found = guard.check(
        np.array([0.0, 0.0, 0.0, 1.0, 9.0, 9.0, 0.0, 0.0]), np.array([[-7.0, 0.5], [1.0, 9.0]])
    )
    assert found.action == LIMITED and found.reason == "omega -7.00 is clipped to -2"
    np.testing.assert_array_equal(found.inputs, [[-2.0, 0.5], [1.0, 2.0]])


@settings(max_examples=examples(40), derandomize=True)
@given(
    kind=st.sampled_from(list(ROBOTS)),
    speed=st.floats(0.0, 2.6),  # 3 m/s^2 bring it to rest in the look-ahead without its first step
    more=st.floats(0.0, 1.0),
    wanted=st.floats(-1.0, 50.0),
)
def test_who_drives_at_a_standing_person_stops_before_the_clearance(
    kind: str, speed: float, more: float, wanted: float
) -> None:
    _, guard = make(kind)
    stopping = speed * DT + speed * (speed + 3.0 * DT) / 6.0
    person = CLEARANCE + stopping + more
    s = np.concatenate([ALONG[kind](0.0, speed), [person, 0.0, 1.0, 0.0]])
    for _ in range(60):
        found = guard.check(s, np.array([push(kind, wanted)] * 3))
        s = np.concatenate([found.states[1], s[-4:]])
        assert person - s[0] >= CLEARANCE - 1e-9
    if wanted > 0.5 and kind != "unicycle without limits":
        assert abs(speed_of(kind, s)) < 0.3
        assert person - s[0] < CLEARANCE + 0.35, "stops long before it has to"


@settings(max_examples=examples(100), derandomize=True)
@given(
    bearing=st.floats(-np.pi, np.pi),
    distance=st.floats(0.01, 0.49),
    a=st.floats(0.01, 3.0),
    speed=st.floats(0.0, 2.0),
)
def test_who_stands_too_close_may_always_move_away(
    bearing: float, distance: float, a: float, speed: float
) -> None:
    _, guard = make("double integrator")
    away = np.array([np.cos(bearing), np.sin(bearing)])
    person = [-distance * away[0], -distance * away[1], 0.3, 0.0]
    s = np.array([0.0, speed * away[0], 0.0, speed * away[1], *person])
    inputs = np.array([a * away])
    found = guard.check(s, inputs)
    assert found.action == PASSES
    np.testing.assert_array_equal(found.inputs, inputs)


@pytest.mark.parametrize("turn", [-1.5, 0.0, 1.5])
def test_who_stands_too_close_may_turn_and_back_off_but_not_come_closer(turn: float) -> None:
    _, guard = make("unicycle")
    s = np.array([0.0, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    assert guard.check(s, np.array([[turn, 0.0]])).action == PASSES
    assert guard.check(s, np.array([[turn, -1.0]])).action == PASSES
    found = guard.check(s, np.array([[turn, 1.0]]))
    assert found.action == BRAKES
    assert found.reason.endswith("m to human_0 within 0.2 s, and the clearance is 0.5 m")
    np.testing.assert_array_equal(found.inputs, [[0.0, 0.0]])


def test_a_robot_that_would_be_hit_when_it_stops_does_not_brake() -> None:
    """A person approaches from behind, faster: a robot that brakes would be hit."""
    vehicles, guard = make("unicycle")
    s = np.array([0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.1])
    inputs = np.array([[0.0, 1.0]])
    assert room(vehicles, s, inputs) < CLEARANCE
    found = guard.check(s, inputs)
    assert found.action == PASSES
    np.testing.assert_array_equal(found.inputs, inputs)


def test_where_braking_changes_nothing_a_plan_passes() -> None:
    """A person passes too close in any case; rounding decides between two equal distances."""
    _, guard = make("unicycle")
    for a in np.linspace(-2.0, 2.0, 41):
        s = np.array([0.0, 0.0, 0.0, 0.5, -1.0, 0.3, 0.0, 3.0])
        assert guard.check(s, np.array([[0.0, a]])).action == PASSES


def assert_goes_on_rightly(
    found: SafePlan, inputs: np.ndarray, braking: float, whole: float, off: float = 0.01
) -> None:
    assert braking < CLEARANCE + off
    assert whole > braking + MARGIN - 2 * off
    np.testing.assert_array_equal(found.inputs, inputs[:1])
    assert "the plan leaves" in found.reason


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


def with_radii(
    vehicles: Vehicles, radii: dict[str, float], clearance: float
) -> tuple[Vehicles, SafetyFilter]:
    """The same vehicles with radii, and a layer that keeps this clearance."""
    players = dict(zip(vehicles.names, vehicles.dynamics, strict=True))
    _, limits = ROBOTS["unicycle"]
    same = Vehicles(Game(players, [], DT, 5, radii), {"robot": limits})
    return same, SafetyFilter(same, SafetySettings(clearance=clearance))


def test_the_clearance_is_kept_between_edges() -> None:
    """Players with radii of together 0.5 m keep 0.25 m as points keep 0.75 m, to the last bit."""
    vehicles, _ = make("unicycle", people=2)
    radii = {"robot": 0.25, "human_0": 0.25, "human_1": 0.25}
    _, guard = with_radii(vehicles, radii, 0.25)
    _, of_points = with_radii(vehicles, {}, 0.75)
    rng, actions = np.random.default_rng(1), set()
    for _ in range(500):
        s = rng.normal(scale=1.2, size=vehicles.n_states)
        inputs = rng.normal(scale=1.0, size=(10, 2))
        found, expected = guard.check(s, inputs), of_points.check(s, inputs)
        assert found.action == expected.action
        np.testing.assert_array_equal(found.inputs, expected.inputs)
        np.testing.assert_array_equal(found.states, expected.states)
        actions.add(found.action)
    assert actions == {PASSES, BRAKES, LIMITED, GOES_ON}


def test_the_nearest_player_is_the_one_with_the_nearest_edge() -> None:
    vehicles, _ = make("unicycle", people=2)
    _, guard = with_radii(vehicles, {"robot": 0.2, "human_1": 0.6}, 0.3)
    # Behind the robot, which drives on, a person stands 0.6 m away, and before it one 1.4 m away.
    s = np.array([0.0, 0.0, 0.0, 1.0, -0.6, 0.0, 0.0, 0.0, 1.4, 0.0, 0.0, 0.0])
    found = guard.check(s, np.array([[0.0, 1.0]]))
    assert found.action == BRAKES
    assert "m to human_1 within" in found.reason and "the clearance is 0.3 m" in found.reason


@pytest.mark.parametrize("radius", [0.0, 0.3])
def test_a_robot_that_overlaps_a_person_may_always_move_away(radius: float) -> None:
    vehicles, _ = make("unicycle")
    _, guard = with_radii(vehicles, {"robot": radius, "human_0": radius}, 0.2)
    s = np.array([0.0, 0.0, 0.0, 0.0, -0.15, 0.0, 0.0, 0.0])
    assert guard.check(s, np.array([[0.0, 1.0]])).action == PASSES
    found = guard.check(s, np.array([[0.0, -1.0]]))
    assert found.action == BRAKES
    assert f"the input leaves {'-' if radius else ''}0." in found.reason


people = st.lists(
    st.tuples(
        st.floats(-2.5, 2.5), st.floats(-2.5, 2.5), st.floats(-np.pi, np.pi), st.floats(0, 1.5)
    ),
    min_size=2,
    max_size=2,
)


@settings(max_examples=examples(80), derandomize=True)
@example(  # 0.49 m, and braking leaves no more
    kind="unicycle",
    speed=-0.625,
    others=[(0.0, 1.0, 0.0, 0.0), (0.0, -0.609375, 1.03125, 0.28125)],
    inputs=np.array([[0.0, -0.5]] + 5 * [[0.0, 0.0]]),
)
@given(
    kind=st.sampled_from(["unicycle", "car", "double integrator"]),
    speed=st.floats(-1.0, 2.0),
    others=people,
    inputs=arrays(float, (6, 2), elements=st.floats(-1.0, 1.0)),
)
def test_a_plan_is_judged_as_a_walk_through_the_seconds_ahead_says(
    kind: str, speed: float, others: list[tuple[float, ...]], inputs: np.ndarray
) -> None:
    vehicles, guard = make(kind, people=2)
    s = np.concatenate([ALONG[kind](0.0, speed), *others])
    found: SafePlan = guard.check(s, inputs)
    # During a step the layer takes curves for straight lines, which are off by millimetres.
    off = 0.01
    of_parts = rooms(vehicles, [(s, inputs[: k + 1]) for k in range(len(inputs))])
    first = room(vehicles, s, inputs[:1], after=DT)
    brake = vehicles.braking_input(0, s[vehicles.states(0)])[None]
    if found.action in (BRAKES, GOES_ON):
        braking = room(vehicles, s, brake, after=DT)
        whole = room(vehicles, s, inputs, after=DT, until=LOOK_AHEAD)
        assert of_parts[0] < CLEARANCE + off
        assert first < braking + off or room(vehicles, s, brake) > CLEARANCE - off
        if found.action == GOES_ON:
            assert_goes_on_rightly(found, inputs, braking, whole)
            return
        assert braking > CLEARANCE - off or whole < braking + MARGIN + 2 * off
        np.testing.assert_array_equal(found.inputs, brake)
        return
    assert found.action == PASSES
    sent = len(found.inputs)
    np.testing.assert_array_equal(found.inputs, inputs[:sent])
    # It may be alone where the room is too small, which the walk does not know to the millimetre.
    allowed = sent == 1 and first > room(vehicles, s, brake, after=DT) - off
    if of_parts[0] < CLEARANCE - off:
        assert allowed
    elif of_parts[0] > CLEARANCE + off or not allowed:
        assert all(found > CLEARANCE - off for found in of_parts[1:sent])
        assert sent == len(inputs) or of_parts[sent] < CLEARANCE + off


def test_several_threads_may_use_one_filter() -> None:
    vehicles, layer = make("unicycle", people=2)
    rng = np.random.default_rng(0)
    tasks = [
        (rng.normal(size=vehicles.n_states), rng.normal(size=(length, 2)))
        for length in (1, 3, 9, 25)
    ]
    expected = [layer.check(*task) for task in tasks]
    together = threading.Barrier(len(tasks))

    def work(number: int) -> None:
        together.wait()
        for _ in range(50):
            found = layer.check(*tasks[number])
            assert found[2:] == expected[number][2:]
            np.testing.assert_array_equal(found.states, expected[number].states)

    with ThreadPoolExecutor(len(tasks)) as threads:
        list(threads.map(work, range(len(tasks))))
