"""Limit of the table under doubtful friction: against friction along the ring, time stepping, the machine."""

import json

import numpy as np
import pytest

from centering import preset
from centering.cycle._strategy.outcomes import FRICTION_SCALES
from centering.cycle._strategy.table_limit import SURE, TableLimit, least_friction
from hwsim import CenteringMachine, Ring
from sdpgrind.base.stored import decode, encode

PROBLEM = preset("printed").replace(friction_range=(0.6, 1.4))
LIMIT = TableLimit(PROBLEM, least_friction(PROBLEM))


def test_the_least_friction_is_that_of_one_part_in_a_thousand():
    assert least_friction(PROBLEM) == pytest.approx(0.6 * (1.0 - SURE * 0.08))
    drawn = 0.6 * (1.0 + 0.08 * np.random.default_rng(0).standard_normal(200_000))
    assert np.mean(drawn < least_friction(PROBLEM)) == pytest.approx(1e-3, abs=3e-4)  # four standard errors
    assert least_friction(PROBLEM.replace(friction_part_sd=0.5)) == pytest.approx(0.06)


def test_the_share_is_the_nearest_point_of_what_a_ring_bears():
    """Friction of even pressure, summed along the ring for every ratio of sliding and spinning."""
    turn = np.linspace(0.0, 2.0 * np.pi, 20_001)[:-1]
    bears = []
    for ratio in np.linspace(0.01, 0.5 * np.pi - 0.01, 61):
        slide, spin = np.cos(ratio), np.sin(ratio)
        x, y = slide - spin * np.sin(turn), spin * np.cos(turn)
        fast = np.hypot(x, y)
        bears.append(np.hypot(np.mean(x / fast), np.mean((y * np.cos(turn) - x * np.sin(turn)) / fast)))
    share = LIMIT.acceleration(0.0, 0.0) * PROBLEM.model.part.radius / LIMIT.held
    assert min(bears) == pytest.approx(share, rel=1e-3)


def test_the_run_up_against_time_stepping():
    angle = time = speed = 0.0
    goal, offset, step = LIMIT.speed(9.0), 9.0, 1e-4
    while angle < 6.0:
        angle, time = angle + speed * step, time + step
        speed = min(speed + step * LIMIT.acceleration(offset, speed), goal)
    assert LIMIT.turning_time(6.0, offset, goal) == pytest.approx(time, abs=3e-3)
    turned = 3.0 * LIMIT.turning_time(6.0, offset, goal)
    assert LIMIT.turning_time(60.0, offset, goal) > turned  # the rest at the goal: 54/goal more


def run_up(friction, offset):
    """Whether a ring slips while the table runs up along the limit."""
    model = PROBLEM.model
    truth = model.replace(mu_static=friction * model.mu_static, mu_kinetic=friction * model.mu_kinetic)
    still = PROBLEM.scatter.replace(friction_part_sd=0.0)
    ring = Ring(model.part.radius, offset)
    plant = CenteringMachine(PROBLEM, truth=truth, ring=ring, scatter=still, errors=None, scheduler=None)
    part = plant.start(np.random.default_rng(0))
    speed, goal = 0.0, LIMIT.speed(offset)
    while speed < goal - 0.01:
        rate = LIMIT.acceleration(offset, min(speed + 0.1, goal))  # after a sample of 10 ms at 10 rad/s^2
        speed = part.step({"spindle_speed": goal, "spindle_acceleration": rate}, 10)["spindle_speed"]
    return bool(part.outcome()["slipped"])


@pytest.mark.parametrize("offset", [1.0, 6.0, 10.0])
def test_on_the_machine_the_least_friction_holds_and_a_quarter_less_does_not(offset):
    """The share of 0.9 leaves up to a ninth."""
    assert not run_up(LIMIT.friction, offset)
    assert run_up(0.75 * LIMIT.friction, offset)


def test_a_problem_without_a_range_keeps_its_speeds():
    """The default range asks for about the share of 0.6 that was used of the friction told."""
    assert least_friction(preset("printed")) == pytest.approx(0.602, abs=1e-3)


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ((0.0, 1.2), ValueError, r"friction_range\[0\] must be in \(0, 1\]: true friction .*; got 0.0"),
        ((1.1, 1.2), ValueError, r"friction_range\[0\] must be in \(0, 1\].*; got 1.1"),
        ((0.9, 0.95), ValueError, r"friction_range\[1\] must be >= 1: true friction .*; got 0.95"),
        ((0.9, float("nan")), ValueError, r"friction_range\[1\] must be finite; got nan"),
        (
            (1e-6, 1.2),
            ValueError,
            r"friction_range must be in \[0.41, 2.46\], the factors .*; got \(1e-06, 1.2\)",
        ),
        ((0.6, 1e6), ValueError, r"friction_range must be in \[0.41, 2.46\], the factors that the tables"),
        (0.6, TypeError, r"friction_range must be a pair \(lowest, highest factor\); got 0.6"),
    ],
)
def test_ranges_that_are_refused(given, error, message):
    with pytest.raises(error, match=message):
        PROBLEM.replace(friction_range=given)


def test_the_range_that_is_held_is_that_of_the_tables():
    low, high = FRICTION_SCALES[0], FRICTION_SCALES[-1]
    assert PROBLEM.replace(friction_range=(0.41, 2.46)).friction_range == (0.41, 2.46)
    assert 0.4 < low <= 0.41 and 2.46 <= high < 2.47


def test_a_problem_kept_without_a_range_has_the_default():
    plain = json.loads(encode(preset("printed")))
    del plain["friction_range"]
    assert decode(json.dumps(plain)) == preset("printed")
    assert decode(encode(PROBLEM)) == PROBLEM
