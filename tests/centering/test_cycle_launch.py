"""What is sent for a push: angle, motion, what a late slide and a turning table need."""

from math import pi

import numpy as np
import pytest
from cycle_twins import PlainStrategy
from hypothesis import given, settings
from hypothesis import strategies as st
from push_inside import (
    Approach,
    LearnedBias,
    NextPush,
    RingTravel,
    SentPush,
    TableMotion,
    followed,
    launch,
    preview,
    run_up,
)

from centering import preset, simulate_push
from centering.cycle import PushKind

PROBLEM = preset("printed").replace(mass=0.8, radius=44.45)
GENTLE, TAP = PushKind("gentle", 40.0, True), PushKind("trapezoid", 10.0, True)


def place(rows):
    """Travel at the end of a motion, mm."""
    return float(np.sum((rows[:, 1] + 0.5 * rows[:, 2] * rows[:, 0]) * rows[:, 0]))


@pytest.mark.parametrize(("kind", "offset"), [(GENTLE, 3.0), (GENTLE, 0.5), (TAP, 0.05)])
def test_the_ring_comes_to_where_the_stroke_was_meant_to_bring_it(kind, offset):
    """Followed in the plane: nothing across, and along what a push on a table at rest leaves."""
    start = Approach(offset, 0.3, 8.0)
    sent = launch(kind, offset, start, PROBLEM.model, PROBLEM.limits)
    along, across = followed(sent.rows, start, PROBLEM.model, sent.lead)
    resting = followed(launch(kind, offset, Approach(offset, 0.3, 0.0), PROBLEM.model, PROBLEM.limits).rows,
                       Approach(offset, 0.3, 1e-9), PROBLEM.model, 0.0)[0]  # fmt: skip
    assert abs(across) < 2e-4 * offset
    assert along == pytest.approx(resting, abs=5e-4 + 1e-3 * offset)


def test_a_wrong_lead_shows():
    start = Approach(1.0, 0.3, 8.0)
    sent = launch(GENTLE, 1.0, start, PROBLEM.model, PROBLEM.limits)
    late = followed(sent.rows, start, PROBLEM.model, sent.lead - 0.05)
    assert np.hypot(*late) == pytest.approx(0.05, rel=0.2)  # the offset turned by 0.05 rad and pushed by 1 mm


@pytest.mark.parametrize("offset", [5.2, 5.3592, 5.6])
@pytest.mark.parametrize("lead", ["launch", "preview"])
def test_a_ring_that_the_tip_misses_is_not_taken_for_one_that_is_hit_straight(offset, lead):
    """A tip that comes too late leaves nothing across the offset either; the table turns so fast that it is
    nearly too slow.
    """
    problem = preset("printed").replace(mass=5.0, radius=60.0)
    start = Approach(offset, 0.335, 10.472)
    kind = {"launch": launch, "preview": preview}[lead]
    sent = kind(GENTLE, offset + 0.0017, start, problem.model, problem.limits)
    along, across = followed(sent.rows, start, problem.model, sent.lead)
    assert abs(along) < (0.1 if lead == "launch" else 0.5) * offset and abs(across) < 2e-4 * offset


def test_a_push_that_is_too_weak_is_aligned_at_its_end():
    problem = preset("printed")  # 18.9 kg
    sent = preview(
        PushKind("trapezoid", 2.0, True), 0.01, Approach(0.012, 0.3, 8.0), problem.model, problem.limits
    )
    assert sent.lead == pytest.approx(8.0 * sent.stop_time)


def test_the_motion_is_one_that_the_slide_can_do():
    limits = PROBLEM.limits
    for room in (run_up(10.0, limits), 0.1, 1.0, 7.0):
        rows = launch(TAP, 0.2, Approach(0.2, room, 5.0), PROBLEM.model, limits).rows
        assert np.all(rows[:, 0] > 0) and np.abs(rows[:, 2]).max() <= limits.acceleration_max * (1 + 1e-9)
        ends = rows[:, 1] + rows[:, 2] * rows[:, 0]
        assert max(np.abs(rows[:, 1]).max(), np.abs(ends).max()) <= limits.slide_speed_max
        travel = np.cumsum((rows[:, 1] + 0.5 * rows[:, 2] * rows[:, 0]) * rows[:, 0])
        # mended for the turning of the table by little
        assert travel.max() == pytest.approx(room + 0.2, abs=0.02)


@pytest.mark.parametrize("kind", [GENTLE, TAP])
def test_a_slide_that_follows_late_is_made_up_for(kind):
    """e' = v - e/tau under load: the tip must come as far as that of a slide without lag."""
    tau, start = 2.5e-3, Approach(0.4, 0.3, 6.0)
    prompt = launch(kind, 0.4, start, PROBLEM.model, PROBLEM.limits)
    sent = launch(kind, 0.4, start, PROBLEM.model, PROBLEM.limits, tau)
    step, lag, reference, furthest = 1e-5, 0.0, 0.0, 0.0
    for k, (duration, velocity, rate) in enumerate(sent.rows):
        for n in range(round(duration / step)):
            v = velocity + rate * (n + 0.5) * step
            reference += v * step
            lag += step * (v - lag / tau) if k >= sent.first else 0.0
            furthest = max(furthest, reference - lag)
    plain = np.cumsum(
        (prompt.rows[:, 1] + 0.5 * prompt.rows[:, 2] * prompt.rows[:, 0]) * prompt.rows[:, 0]
    ).max()
    assert furthest == pytest.approx(plain, abs=2e-3)
    assert sent.lead - prompt.lead == pytest.approx(tau * 6.0, rel=1e-9)


@settings(deadline=None, max_examples=30)
@given(st.floats(0.0, 10.0), st.floats(0.1, 10.0), st.floats(0.01, 12.0))
def test_time_and_speed_of_the_table_are_those_of_its_motion(speed, wanted, way):
    """Against steps of a millisecond."""
    table = TableMotion(10.0)
    table.see(3.0, 1.0, speed)
    table.set_point = wanted
    angle, w, time = 1.0, speed, 0.0
    while angle < 1.0 + way:
        before = w
        w += min(max(wanted - w, -1e-2), 1e-2)
        angle, time = angle + 0.5 * (before + w) * 1e-3, time + 1e-3
    assert table.time_to(1.0 + way) == pytest.approx(time, abs=3e-3)
    assert table.speed_at(1.0 + way) == pytest.approx(w, abs=3e-2)


def test_a_table_that_gains_speed_pushes_in_the_turn_in_which_it_can():
    """A rough plan for 10.5 rad/s leads by 2 rad, the alignment is 1.5 rad ahead; at the speed there it leads less."""
    table, coming = TableMotion(10.0), NextPush(PlainStrategy(PROBLEM), 0.0)
    table.see(0.03, 0.005, 0.3)
    table.set_point = 10.47
    coming.launch, coming.start = SentPush(2.03, np.zeros((0, 3)), 0.25, 0.0, 0), Approach(5.0, 0.1, 10.47)
    speed = coming.arriving(1.5, table)
    coming.set_trigger(1.5, table, speed)
    assert speed == pytest.approx(table.speed_at(coming.trigger), rel=1e-6)
    assert coming.trigger + speed * 2.03 / 10.47 == pytest.approx(1.5, rel=1e-9)


def test_a_table_at_rest_never_comes():
    table = TableMotion(10.0)
    table.see(0.0, 0.0, 0.0)
    assert table.time_to(1.0) == float("inf") and table.time_to(-1.0) == 0.0


@settings(deadline=None)
@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-5, 5), st.floats(-5, 5), st.floats(-pi, pi))
def test_travel_is_the_vector_in_the_frame_of_the_push(x, y, u, v, towards):
    travel = RingTravel.between((x, y), (u, v), towards=towards)
    turned = (complex(u, v) - complex(x, y)) * np.exp(-1j * towards)
    assert (travel.along, travel.across) == pytest.approx((turned.real, turned.imag), abs=1e-9)
    assert travel.distance == pytest.approx(abs(turned), abs=1e-9)


def test_a_bias_is_the_weighted_mean_of_what_was_seen():
    rng, bias = np.random.default_rng(0), LearnedBias(0.5)
    seen, sds = rng.normal(1.0, 0.3, 20), rng.uniform(0.1, 1.0, 20)
    for value, sd in zip(seen, sds, strict=True):
        bias.see(value, sd)
    weights = sds**-2.0
    assert bias.value == pytest.approx((weights @ seen) / (weights.sum() + 4.0), rel=1e-12)
    assert bias.sd == pytest.approx((weights.sum() + 4.0) ** -0.5, rel=1e-12)
    bias.reset()
    assert (bias.value, bias.sd) == (0.0, 0.5)


SLIPPERY = preset("printed").model.replace(mu_static=0.04, mu_kinetic=0.03)  # 18.9 kg
BLOW = PushKind("trapezoid", 80.0, True).profile(SLIPPERY, 2.0, PROBLEM.limits.acceleration_max)


def test_a_ring_that_slides_long_is_followed_until_it_rests():
    """A blow after which it slides for half a second. Two ways: the event-exact push along a table at rest."""
    along, across = followed(BLOW.segments, Approach(15.0, 0.0, 1e-9), SLIPPERY, 0.0)
    assert across == pytest.approx(0.0, abs=1e-6)
    assert 15.0 - along == pytest.approx(simulate_push(SLIPPERY, BLOW).final_position, abs=0.01)


def test_where_a_ring_comes_to_rest_does_not_depend_on_how_long_the_motion_lasts():
    start, longer = Approach(15.0, 0.0, 1.0), np.vstack((BLOW.segments, [(1.0, 0.0, 0.0)]))
    here, there = (followed(rows, start, SLIPPERY, 0.2) for rows in (BLOW.segments, longer))
    assert here == pytest.approx(there, abs=0.01)
