"""A push on a turning table as a push along a line: the rim's own advance, against the push in the plane; friction from it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from centering._friction.estimator import FrictionEstimator
from centering._friction.turning import turning_profile
from centering._push import direction_kernels as at
from centering._push.direction import plan_touch
from centering._push.presets import preset
from centering._push.profile import TipProfile
from centering._push.reaction import simulate_pushes
from centering._push.shooting import ring_state
from sdpgrind import units

PROBLEM = preset("printed")
RADIUS = PROBLEM.model.part.radius
BACK = TipProfile([0.05], [0.0], [-2560.0])
SLOW_TABLE = units.rpm(20.0)
WAY_ERROR = 0.006


def in_the_plane(touch, offset, speed, factor, problem=PROBLEM):
    """Peak force and way over the table of the push of a ring that lies where it is touched, tip drawn back at the end."""
    law, profile = problem.model.parameters, touch.push_profile
    law[3:5] *= factor
    state = ring_state(offset, -touch.angle, RADIUS, speed)
    rows = np.vstack([profile.segments, BACK.segments, [[0.2, -128.0, 0.0]]])
    at.push_on_table(law, RADIUS, speed, rows, 1e-5, state)
    return state[at.PEAK_FORCE], state[at.WAY]


def along_a_line(touch, offset, speed):
    whole = touch.push_profile.then(BACK)
    return turning_profile(whole, offset=offset, touch_angle=touch.angle, spindle_speed=speed, radius=RADIUS)


@given(offset=st.floats(0.0, 20.0), angle=st.floats(-1.0, 1.0), v=st.floats(0.5, 80.0))
def test_a_table_that_stands_adds_nothing_but_the_slant(offset, angle, v):
    push = TipProfile.constant_speed(v, 0.01)
    found = turning_profile(push, offset=offset, touch_angle=angle, spindle_speed=0.0, radius=RADIUS)
    assert found.velocity[0] == pytest.approx(v * np.sqrt(1 - (offset * np.sin(angle) / RADIUS) ** 2), rel=1e-9)
    assert found.total_time == pytest.approx(0.01, abs=2e-9)


@settings(deadline=None)
@given(offset=st.floats(0.01, 20.0), angle=st.floats(0.0, 1.0), v=st.floats(0.5, 80.0), rpm=st.floats(1.0, 100.0))
def test_speed_at_first_touch_is_that_of_slide_and_rim(offset, angle, v, rpm):
    """The rim on the push line, r = d cos + sqrt(R^2 - d^2 sin^2), rises by dr/dt; both along the slanted normal."""
    w = units.rpm(rpm)

    def rim(t):
        turned = w * t - angle
        return offset * np.cos(turned) + np.sqrt(RADIUS**2 - (offset * np.sin(turned)) ** 2)

    advance = (rim(1e-6) - rim(-1e-6)) / 2e-6
    slant = np.sqrt(1 - (offset * np.sin(angle) / RADIUS) ** 2)
    push = TipProfile.constant_speed(v, 0.01)
    found = turning_profile(push, offset=offset, touch_angle=angle, spindle_speed=w, radius=RADIUS)
    assert found.velocity[0] == pytest.approx((v + advance) * slant, rel=1e-6, abs=1e-6)


def test_pieces_are_fine_enough():
    """Against the quasi-static equation in steps of 2e-5 s."""
    w, offset, angle = units.rpm(100.0), 5.0, 0.5
    push = TipProfile.move(4.0, 40.0, 2560.0)
    found = turning_profile(push, offset=offset, touch_angle=angle, spindle_speed=w, radius=RADIUS)
    count = 6000
    step = push.total_time / count
    c = offset * np.array([np.cos(angle), -np.sin(angle)])
    tip, way = c[0] + np.sqrt(RADIUS**2 - c[1] ** 2), 0.0
    for v in push.velocity_at((np.arange(count) + 0.5) * step):
        n = (c - [tip, 0.0]) / np.linalg.norm(c - [tip, 0.0])
        carried = w * np.array([-c[1], c[0]])
        s = -n @ carried - v * n[0]
        c, tip, way = c + step * (carried + max(s, 0.0) * n), tip - step * v, way + step * s
    assert found.end == pytest.approx(way, rel=1e-3)
    assert way > 1.15 * push.end  # the rim's own advance


@pytest.mark.parametrize(("offset", "v"), [(5.0, 40.0), (1.0, 10.0), (0.2, 5.0)])
def test_it_predicts_the_push_in_the_plane(offset, v):
    touch = plan_touch(PROBLEM, offset=offset, spindle_speed=SLOW_TABLE, push_speed=v)
    force, way = in_the_plane(touch, offset, SLOW_TABLE, 1.0)
    line = simulate_pushes(PROBLEM.model, along_a_line(touch, offset, SLOW_TABLE))[0]
    assert line[2] == pytest.approx(force, rel=5e-3)
    assert line[0] == pytest.approx(way, rel=WAY_ERROR)
    plain = simulate_pushes(PROBLEM.model, touch.push_profile.then(BACK))[0]
    assert abs(line[2] - force) < 0.4 * abs(plain[2] - force)


@pytest.mark.parametrize("factor", [0.9, 1.0, 1.1])
def test_friction_is_learned_from_pushes_on_a_turning_table(factor):
    estimator = FrictionEstimator(PROBLEM, way_error=WAY_ERROR)
    for offset, v in ((5.0, 40.0), (1.0, 10.0), (0.2, 5.0)):
        touch = plan_touch(PROBLEM, offset=offset, spindle_speed=SLOW_TABLE, push_speed=v)
        force, way = in_the_plane(touch, offset, SLOW_TABLE, factor)
        estimator.update(profile=along_a_line(touch, offset, SLOW_TABLE), peak_force=force, final_position=way)
    estimate = estimator.estimate
    assert estimator.refused == 0
    assert np.abs(estimate.value / (factor * np.array([0.2, 0.15])) - 1) == pytest.approx([0, 0], abs=0.06)
    assert np.all(np.abs(estimate.value - factor * np.array([0.2, 0.15])) < 2 * estimate.sd)


PUSH = TipProfile.constant_speed(10.0, 0.1)
GIVEN = {"offset": 1.0, "touch_angle": 0.1, "spindle_speed": 2.0, "radius": RADIUS}
REFUSED = [
    (lambda: turning_profile(TipProfile.constant_speed(10.0, 0.1, start=-1.0), **GIVEN), "profile.start must be 0"),
    (lambda: turning_profile(PUSH, **GIVEN | {"offset": 90.0}), "offset must be < the radius of the part = 89.5 (mm); got 90.0"),
    (lambda: turning_profile(PUSH, **GIVEN | {"offset": -1.0}), "offset must be >= 0 (mm); got -1.0"),
    (lambda: turning_profile(PUSH, **GIVEN | {"radius": 0.0}), "radius must be > 0 (mm); got 0.0"),
    (lambda: turning_profile(PUSH, **GIVEN | {"spindle_speed": np.nan}), "spindle_speed must be finite (rad/s); got nan"),
    (lambda: turning_profile(PUSH, **GIVEN | {"touch_angle": np.inf}), "touch_angle must be finite (rad); got inf"),
]


@pytest.mark.parametrize(("call", "message"), REFUSED)
def test_refused(call, message):
    with pytest.raises(ValueError) as caught:
        call()
    assert str(caught.value).startswith(message)
