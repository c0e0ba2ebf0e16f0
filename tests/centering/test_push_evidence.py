"""Force and travel of a push that was sent: against the machine, and what they say of friction."""

from math import inf

import numpy as np
import pytest
from push_inside import Approach, FeltPush, Size, felt_model, launch, moments, prior
from strategy_twins import quick_strategy

from centering import preset
from centering.cycle import PushKind
from hwsim import CenteringMachine, Ring

PROBLEM = preset("printed").replace(friction_range=(0.6, 1.4))
STILL = PROBLEM.scatter.replace(
    friction_part_sd=0.0, friction_push_sd=0.0, direction_sd=0.0, stop_sd=0.0, measuring_sd=0.0
)
KINDS = {"blow": PushKind("trapezoid", 40.0, True), "gentle": PushKind("gentle", 40.0, True)}


def pushed(kind, friction, offset=4.0, room=1.0, speed=5.0):
    """A push on the machine without scatter: as it was felt, and the travel of the ring, mm."""
    model, radius = PROBLEM.model, PROBLEM.model.part.radius
    start = Approach(offset, room, speed)
    push = launch(KINDS[kind], offset, start, model, PROBLEM.limits)
    plant = CenteringMachine(
        PROBLEM, truth=felt_model(model, friction), ring=Ring(radius, offset), scatter=STILL,
        errors=None, scheduler=None, start_gap=room, tip_radius=0.0,
    )  # fmt: skip
    part, times, forces = plant.start(np.random.default_rng(0)), [], []
    seen = part.step({"spindle_speed": speed}, 0)
    trigger = 4.0 * np.pi - push.lead
    while seen["angle"] < trigger - 0.2:
        seen = part.step({"spindle_speed": speed}, 1)
    # the tip waits where the push begins, as the slide stands there from the start
    place = part.step({}, 0)["slide"] - (radius + offset + room)
    assert abs(place) < 1e-6
    seen = part.step({"profile": push.rows, "profile_angle": trigger}, 10)
    while seen["pushing"] or seen["angle"] < trigger:
        if seen["angle"] >= trigger:
            times.append((seen["angle"] - trigger) / speed)
            forces.append(seen["force"])
        seen = part.step({}, 10)
    for _ in range(20):
        part.step({}, 10)
    places = part.outcome()
    moved = np.hypot(*(np.diff(places[name])[-1] for name in ("center_x", "center_y")))
    return FeltPush(push, start, model, times, forces, 446.0), float(moved)


@pytest.mark.parametrize("friction", [0.7, 1.0, 1.3])
@pytest.mark.parametrize("kind", KINDS)
def test_force_and_travel_are_those_of_the_machine(kind, friction):
    felt, travelled = pushed(kind, friction)
    model = felt_model(PROBLEM.model, friction)
    assert felt._travel(model) == pytest.approx(travelled, rel=2e-3)
    assert felt._force(model) == pytest.approx(sum(felt.forces), rel=0.02)


def test_a_sensor_at_the_end_of_its_range_shows_no_friction():
    """Forces of a heavy part may be beyond the sensor's; the expected ones are cut at the same end."""
    felt, _ = pushed("blow", 1.0)
    most = 0.5 * max(felt.forces)
    cut = felt.replace(forces=np.minimum(felt.forces, most).tolist(), force_max=most)
    assert cut._force(PROBLEM.model) == pytest.approx(sum(cut.forces), rel=0.02)


@pytest.mark.parametrize("friction", [0.65, 1.0, 1.35])
@pytest.mark.parametrize("kind", KINDS)
def test_one_push_tells_the_friction(kind, friction, strategy):
    """Of a long push that the turning table changes; told is a range of 0.6 to 1.4."""
    felt, travelled = pushed(kind, friction)
    shown = felt.evidence(prior(PROBLEM, 1.0, 0.0), travelled, 1e-3)
    belief = strategy.update_belief(1.0, 0.0, strategy.push(offset=4.0), travelled, shown=shown)
    sd = moments(belief.weights)[1]
    assert sd < 0.12  # a push scatters by 4 %, its forces tell 7 %, and the tenth of the range is wide
    assert belief.friction == pytest.approx(friction, abs=1.5 * sd)


def test_without_a_sensor_the_travel_counts_alone(strategy):
    felt, travelled = pushed("blow", 1.0)
    silent = FeltPush(felt.push, felt.start, felt.model, felt.times, [0.0] * len(felt.times), inf)
    shown = silent.evidence(prior(PROBLEM, 1.0, 0.0), travelled, 1e-3)
    assert shown.expected.shape == (1, 62) and shown.seen.tolist() == [travelled]


@pytest.fixture(scope="module")
def strategy():
    return quick_strategy(PROBLEM, kinds=tuple(KINDS.values()), size=Size(24, 3))
