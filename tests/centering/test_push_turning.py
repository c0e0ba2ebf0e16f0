"""A push on a turning table as a push along a line, against the push in the plane; friction learned from it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from push_inside import at, landing, ring_state

from centering import FrictionEstimator, TipProfile, plan_push, preset, simulate_push
from centering.push import plan_touch
from centering.push.turning import TableProfile, TablePushTrace, simulate_table_push, turning_profile
from sdpgrind import units
from sdpgrind.base.compiling.compiled import opened

PROBLEM = preset("printed")
MODEL = PROBLEM.model
RADIUS = MODEL.part.radius
SLOW_TABLE = units.rpm(20.0)


def in_the_plane(model, touch, offset, w):
    """State after the push in the plane, its way along the contact normal, and how much of it was contact."""
    state = ring_state(offset, -touch.angle, RADIUS, w)
    rows, along = touch.push_profile.segments, 0.0
    waits = [(5e-4, 0.0, 0.0)] * 800
    for duration, velocity, acceleration in [*rows, *waits]:
        pieces = max(int(np.ceil(duration / 5e-4)), 1)
        length = duration / pieces
        for k in range(pieces):
            row = np.array([[length, velocity + acceleration * length * k, acceleration]])
            before = _slip(state, w)
            opened(at._push_on_table)(model.parameters, RADIUS, w, row, 1e-9, state)
            along += 0.5 * (before + _slip(state, w)) * length
        if state[at.CLOCK] >= rows[:, 0].sum() - 1e-9 and state[at.RESTS] > 0.5:
            break
    return state, along


def _slip(state, w):
    """Speed of the part over the table along the contact normal, mm/s."""
    n = np.array([state[at.X] - state[at.TIP], state[at.Y]])
    u = np.array([state[at.V_X] + w * state[at.Y], state[at.V_Y] - w * state[at.X]])
    return u @ n / np.linalg.norm(n)


@settings(deadline=None)
@given(offset=st.floats(0.0, 20.0), angle=st.floats(-1.0, 1.0), v=st.floats(0.5, 80.0))
def test_a_table_that_stands_adds_nothing_but_the_slant(offset, angle, v):
    push = TipProfile.constant_speed(v, 0.01)
    found = turning_profile(push, MODEL, offset=offset, touch_angle=angle, spindle_speed=0.0)
    assert found.velocity[0] == pytest.approx(
        v * np.sqrt(1 - (offset * np.sin(angle) / RADIUS) ** 2), rel=1e-9
    )
    assert found.held[0] == 0.0 and found.slid[0] == pytest.approx(0.0, abs=1e-6)


@settings(deadline=None)
@given(
    offset=st.floats(0.01, 20.0), angle=st.floats(0.0, 1.0), v=st.floats(0.5, 80.0), rpm=st.floats(1.0, 100.0)
)
def test_speed_at_first_touch_is_that_of_slide_and_rim(offset, angle, v, rpm):
    """The rim on the push line, r = d cos + sqrt(R^2 - d^2 sin^2), rises by dr/dt; both along the slanted
    normal.
    """
    w = units.rpm(rpm)

    def rim(t):
        turned = w * t - angle
        return offset * np.cos(turned) + np.sqrt(RADIUS**2 - (offset * np.sin(turned)) ** 2)

    advance = (rim(1e-6) - rim(-1e-6)) / 2e-6
    slant = np.sqrt(1 - (offset * np.sin(angle) / RADIUS) ** 2)
    push = TipProfile.constant_speed(v, 0.01)
    found = turning_profile(push, MODEL, offset=offset, touch_angle=angle, spindle_speed=w)
    assert found.velocity[0] == pytest.approx((v + advance) * slant, rel=1e-6, abs=1e-6)


CASES = [
    (mass, rpm, shape, offset, speed)
    for mass in (0.8, 5.0, 18.9)
    for rpm in (20.0, 60.0, 100.0)
    for shape, offset, speed in (("trapezoid", 5.0, 40.0), ("trapezoid", 0.2, 5.0), ("gentle", 1.0, 10.0))
]


@pytest.mark.parametrize(("mass", "rpm", "shape", "offset", "speed"), CASES)
def test_it_is_the_push_in_the_plane(mass, rpm, shape, offset, speed):
    """Way along the normal to 0.3 %, whole way to 2.5 %, free slide to 3 %; force to 0.3 %, to 1.5 % where a
    step is long.
    """
    problem, w = PROBLEM.replace(mass=mass), units.rpm(rpm)
    touch = plan_touch(
        problem, offset=offset, spindle_speed=w, push_speed=speed, direction="quasi-static", shape=shape
    )
    state, along = in_the_plane(problem.model, touch, offset, w)
    profile = turning_profile(
        touch.push_profile, problem.model, offset=offset, touch_angle=touch.angle, spindle_speed=w
    )
    trace = simulate_table_push(problem.model, profile)
    assert trace.energy_balance < 1e-9
    # at the first touch
    assert trace.peak_force == pytest.approx(state[at.PEAK_FORCE], rel=1.5e-2 if mass < 1.0 else 3e-3)
    assert trace.final_position == pytest.approx(along, rel=3e-3)
    assert -0.025 * offset < trace.final_position - state[at.WAY] < 1e-3 * offset
    assert trace.free_slide == pytest.approx(state[at.FREE_MAX], rel=0.03, abs=1e-3)


def test_what_the_table_adds():
    """18.9 kg over 5 mm at 40 mm/s: 192 N on a table at rest; the rim's advance and the throw outward add to it."""
    peaks = [
        plan_push(
            PROBLEM,
            offset=5.0,
            follow_gap=30.0,
            spindle_speed=units.rpm(rpm),
            push_speed=40.0,
            direction="quasi-static",
        )
        .simulate()
        .peak_force
        for rpm in (0.1, 20.0, 100.0)
    ]
    plain = simulate_push(MODEL, TipProfile.constant_speed(40.0, 0.05)).peak_force
    assert peaks[0] == pytest.approx(plain, rel=2e-3) and peaks[0] < peaks[1] < peaks[2]
    w = units.rpm(100.0)
    contact = turning_profile(
        TipProfile.move(1.0, 40.0, 2560.0), MODEL, offset=5.0, touch_angle=0.0, spindle_speed=w
    )
    thrown = MODEL.inertia * w * w * 5.0
    assert contact.held[0] == pytest.approx(thrown, rel=0.03) and contact.slid[0] == pytest.approx(
        thrown, rel=0.03
    )


def test_samples_are_those_of_the_pieces():
    """Between two samples the part gains speed by the contact and by the loaded friction of its piece."""
    push = plan_push(PROBLEM, offset=1.0, follow_gap=12.0, spindle_speed=units.rpm(60.0), push_speed=10.0)
    trace = push.simulate()
    time = np.linspace(0.0, trace.duration, 60_001)
    shown = trace.at(time)
    assert (
        shown.contact_force.max() == pytest.approx(trace.peak_force, rel=1e-4)
        and shown.contact_force.min() >= 0.0
    )
    piece = np.minimum(
        np.searchsorted(np.cumsum(trace.profile.duration), time[:-1], side="right"),
        trace.profile.slid.size - 1,
    )
    speed, force = shown.part_velocity.values, shown.contact_force.values
    friction = MODEL.coulomb_force + trace.profile.slid[piece] + MODEL.viscous_coefficient * speed[:-1]
    gained = (force[:-1] - friction) / MODEL.inertia * np.diff(time)
    moving = (speed[:-1] > 0.5) & (speed[1:] > 0.5) & (force[:-1] > 0.0) & (force[1:] > 0.0)
    assert moving.sum() > 2000
    assert np.abs(np.diff(speed) - gained)[moving].max() < 2e-2
    assert shown.part_position.values[-1] == pytest.approx(trace.final_position, abs=1e-9)


def test_trace_comes_back_from_a_file(tmp_path):
    trace = plan_push(PROBLEM, offset=1.0, spindle_speed=2.0, push_speed=10.0).simulate()
    trace.save(tmp_path / "trace.nc")
    again = TablePushTrace.from_file(tmp_path / "trace.nc")
    assert again == trace and isinstance(again.profile, TableProfile)
    assert np.array_equal(again.contact_force, trace.contact_force)
    trace.plot()


def test_profiles_are_joined_with_their_loads():
    profile = TableProfile([0.1, 0.2], [10.0, 5.0], [0.0, 0.0], held=[3.0, 2.0], slid=[2.0, 1.0])
    whole = profile.then(profile)
    assert whole.held.tolist() == [3.0, 2.0, 3.0, 2.0] and whole.slid.tolist() == [2.0, 1.0, 2.0, 1.0]
    assert profile.then(TipProfile.constant_speed(1.0, 0.1)).slid.tolist() == [2.0, 1.0, 0.0]
    assert TableProfile([0.1], [10.0], [0.0]).held.tolist() == [0.0]


@pytest.mark.parametrize(("factor", "rpm"), [(0.9, 20.0), (1.1, 20.0), (0.9, 100.0), (1.1, 100.0)])
def test_friction_is_learned_from_pushes_on_a_turning_table(factor, rpm):
    """The way that is read is the whole one, in the plane."""
    w = units.rpm(rpm)
    true = MODEL.replace(mu_static=factor * MODEL.mu_static, mu_kinetic=factor * MODEL.mu_kinetic)
    estimator = FrictionEstimator(PROBLEM, way_error=0.001 if rpm < 50 else 0.02)
    for offset, v in ((5.0, 40.0), (1.0, 10.0), (0.2, 5.0)):
        touch = plan_touch(PROBLEM, offset=offset, spindle_speed=w, push_speed=v, direction="quasi-static")
        state = ring_state(offset, -touch.angle, RADIUS, w)
        landing(true, w, touch.push_profile.segments, state, 1e-8)
        profile = turning_profile(
            touch.push_profile, MODEL, offset=offset, touch_angle=touch.angle, spindle_speed=w
        )
        estimator.update(profile=profile, peak_force=state[at.PEAK_FORCE], final_position=state[at.WAY])
    estimate = estimator.estimate
    assert estimator.refused == 0
    assert np.abs(estimate.value / (factor * np.array([0.2, 0.15])) - 1) == pytest.approx([0, 0], abs=0.06)
    assert np.all(np.abs(estimate.value - factor * np.array([0.2, 0.15])) < 2 * estimate.sd)


def test_friction_is_learned_from_the_trace_of_a_push():
    push = plan_push(PROBLEM, offset=1.0, spindle_speed=units.rpm(20.0), push_speed=10.0)
    estimator = FrictionEstimator(PROBLEM)
    for _ in range(4):
        estimator.update(push.simulate())
    estimate = estimator.estimate
    assert estimator.refused == 0 and np.all(np.abs(estimate.value - [0.2, 0.15]) < 1.5 * estimate.sd)


PUSH = TipProfile.constant_speed(10.0, 0.1)
GIVEN = {"model": MODEL, "offset": 1.0, "touch_angle": 0.1, "spindle_speed": 2.0}
REFUSED = [
    (
        lambda: turning_profile(TipProfile.constant_speed(10.0, 0.1, start=-1.0), **GIVEN),
        "profile.start must be 0",
    ),
    (
        lambda: turning_profile(PUSH, **GIVEN | {"offset": 90.0}),
        "offset must be < the radius of the part = 89.5 (mm); got 90.0",
    ),
    (lambda: turning_profile(PUSH, **GIVEN | {"offset": -1.0}), "offset must be >= 0 (mm); got -1.0"),
    (
        lambda: turning_profile(PUSH, **GIVEN | {"spindle_speed": np.nan}),
        "spindle_speed must be finite (rad/s); got nan",
    ),
    (
        lambda: turning_profile(PUSH, **GIVEN | {"touch_angle": np.inf}),
        "touch_angle must be finite (rad); got inf",
    ),
    (lambda: TableProfile([0.1], [1.0], [0.0], held=[1.0, 2.0]), "held must be of the 1 segments; got (2,)"),
]


@pytest.mark.parametrize(("call", "message"), REFUSED)
def test_refused(call, message):
    with pytest.raises(ValueError) as caught:
        call()
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(("offset", "speed"), [(0.05, 10.0), (0.02, 5.0), (1.0, 10.0)])
def test_a_push_ends_when_the_part_rests(offset, speed):
    """The rim of a part at rest may recede from the tip by nm in a second: that is no part of the push."""
    trace = plan_push(PROBLEM, offset=offset, spindle_speed=2.0, push_speed=speed).simulate()
    assert trace.duration < 1.0 and trace.final_velocity == 0.0
    if offset == 0.05:
        assert trace.event_mode[-1] == "stick"
        assert trace.at([trace.duration]).part_position[0] == pytest.approx(trace.final_position, abs=1e-12)
