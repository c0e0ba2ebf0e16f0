import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from centering import plan_push, preset
from centering.push import stopping_way
from centering.push.turning import (
    closing_distance,
    max_rim_slope,
    rim_advance,
    rim_motion,
    spindle_acceleration_limit,
    spindle_speed_limit,
)
from sdpgrind import units

PROBLEM = preset("printed")
TURN = np.linspace(0, 2 * np.pi, 200001)


def _rim(angle, d, r):
    return d * np.cos(angle) + np.sqrt(r**2 - (d * np.sin(angle)) ** 2)


def test_rim_speed_of_the_source():
    slope = max_rim_slope(offset=25.0, radius=30.0)
    assert math.isclose(slope, 34.86100, rel_tol=1e-6)
    assert math.isclose(slope * units.rpm(20.0), 73.013, rel_tol=1e-5)
    assert math.isclose(slope * units.rpm(42.2916), 154.39, rel_tol=1e-4)
    at = TURN[np.argmax(np.abs(np.gradient(_rim(TURN, 25.0, 30.0), TURN)))]
    assert math.isclose(min(at, 2 * np.pi - at), units.deg(63.58), abs_tol=1e-3)


@given(st.floats(0.1, 29.0), st.floats(-7.0, 7.0))
def test_rim_motion_is_the_derivative_of_the_distance(d, angle):
    here, h = rim_motion(angle, offset=d, radius=30.0), 1e-4
    before, after = (float(_rim(angle + e, d, 30.0)) for e in (-h, h))
    scale = 30.0 * (30.0 / (30.0 - d)) ** 3  # of the further derivatives
    assert math.isclose(here.distance, float(_rim(angle, d, 30.0)), rel_tol=1e-14)
    assert math.isclose(here.slope, (after - before) / (2 * h), abs_tol=h * h * scale)
    assert math.isclose(
        here.curvature, (after - 2 * here.distance + before) / h**2, abs_tol=h * h * scale**2 / 30 + 1e-5
    )


@given(st.floats(0.01, 29.9))
def test_greatest_slope_is_greatest(d):
    tried = np.abs(np.diff(_rim(TURN[:100001], d, 30.0))) / np.diff(TURN[:100001])
    assert math.isclose(max_rim_slope(offset=d, radius=30.0), tried.max(), rel_tol=1e-6)


def test_speed_limit_of_the_source():
    slippery = PROBLEM.replace(mu_static=0.05, mu_kinetic=0.04)
    limit = spindle_speed_limit(slippery, offset=25.0)
    assert math.isclose(limit.all["friction"], units.rpm(42.2916), rel_tol=1e-5)
    assert limit.reason == "friction" and limit.value == limit.all["friction"]


@pytest.mark.parametrize(("offset", "rpm"), [(25.0, 73.0), (1.0, 366.0)])
def test_speed_rises_as_the_offset_falls(offset, rpm):
    limit = spindle_speed_limit(PROBLEM.replace(mu_static=0.15, mu_kinetic=0.14), offset=offset)
    assert math.isclose(limit.all["friction"], units.rpm(rpm), rel_tol=5e-3)


def test_every_reason_can_be_the_smallest():
    limits = PROBLEM.limits
    reasons = {
        spindle_speed_limit(PROBLEM, offset=0.1, samples_per_turn=50).reason,
        spindle_speed_limit(PROBLEM, offset=0.1, samples_per_turn=200).reason,
        spindle_speed_limit(PROBLEM, offset=25.0).reason,
        spindle_speed_limit(
            PROBLEM.replace(limits=limits.replace(acceleration_max=300.0)), offset=10.0
        ).reason,
        spindle_speed_limit(PROBLEM.replace(mu_static=0.05, mu_kinetic=0.04), offset=25.0).reason,
        spindle_speed_limit(PROBLEM, offset=10.0, push_speed=10.0).reason,
    }
    assert reasons == {"table", "samples", "slide_speed", "slide_acceleration", "friction", "push"}


def test_a_centred_part_bears_any_speed():
    limit = spindle_speed_limit(PROBLEM, offset=0.0)
    assert limit.all["friction"] == limit.all["slide_speed"] == math.inf


def test_push_limit_is_where_the_plan_is_refused():
    wanted = {"offset": 10.0, "push_speed": 40.0}
    speed = spindle_speed_limit(PROBLEM, **wanted).all["push"]
    plan_push(PROBLEM, **wanted, spindle_speed=0.999 * speed, direction="end")
    with pytest.raises(ValueError, match="slow the spindle or open the gap"):
        plan_push(PROBLEM, **wanted, spindle_speed=1.001 * speed, direction="end")


def test_closing_is_the_worst_of_all_phases():
    w, v, a, d, r = units.rpm(42.2916), 120.0, 2560.0, 25.0, 30.0
    t = np.linspace(0, 0.3, 1001)
    turned = np.minimum(t, 2 * v / a)
    slide = v * turned - a * turned**2 / 2 - v * (t - turned)
    start = np.linspace(-np.pi, np.pi, 1441)[:, None]
    worst = (_rim(start + w * t, d, r) - _rim(start, d, r) + slide).max()
    found = closing_distance(offset=d, radius=r, spindle_speed=w, slide_speed=v, acceleration=a)
    assert 0.0 <= found - worst < 1e-4 * worst


def test_printed_stop_is_more_where_the_slide_withdraws_fast_enough():
    """The 14.7 mm of (3.6) hold for a slide that withdraws at 154 mm/s; at 120 mm/s the rim comes 0.9 mm
    nearer.
    """
    w, slope = units.rpm(42.2916), 34.861
    printed = stopping_way(120.0 + slope * w, 2560.0).distance
    limited = closing_distance(
        offset=25.0, radius=30.0, spindle_speed=w, slide_speed=120.0, acceleration=2560.0
    )
    assert printed + 0.5 < limited < printed + 1.5
    slower = units.rpm(20.0)
    easy = closing_distance(
        offset=25.0, radius=30.0, spindle_speed=slower, slide_speed=120.0, acceleration=2560.0
    )
    assert easy < stopping_way(120.0 + slope * slower, 2560.0).distance


def _gauge(force, moment):
    """How near a ring is to slipping: the greatest power of the load over that of full friction, over all
    ways to slip.
    """
    tilt = np.linspace(0, np.pi / 2, 2001)[:, None]
    around = 2 * np.pi * (np.arange(400) + 0.5) / 400
    along, turned = np.cos(tilt), np.sin(tilt)
    friction = np.sqrt(along**2 + turned**2 - 2 * along * turned * np.sin(around)).mean(axis=1, keepdims=True)
    return float(((force * along + moment * turned) / friction).max())


@settings(max_examples=25)
@given(st.floats(0.0, 20.0), st.floats(0.0, 9.0))
def test_a_change_of_speed_is_at_the_edge_of_slipping(d, w):
    alpha, most = spindle_acceleration_limit(PROBLEM, offset=d, spindle_speed=w), 0.2 * 9807.0
    assert alpha > 0.0
    assert math.isclose(
        _gauge(math.hypot(w * w * d, alpha * d) / most, alpha * 89.5 / most), 1.0, rel_tol=2e-6
    )


def test_a_limit_is_copied_and_sent():
    limit = spindle_speed_limit(preset("printed"), offset=5.0)
    assert pickle.loads(pickle.dumps(limit)) == copy.deepcopy(limit) == limit


def test_change_of_speed_alone_and_at_the_limit():
    assert math.isclose(
        spindle_acceleration_limit(PROBLEM, offset=0.0, spindle_speed=10.0), 0.2 * 9807 / 89.5, rel_tol=1e-12
    )
    fast = spindle_speed_limit(PROBLEM, offset=20.0).all["friction"]
    assert spindle_acceleration_limit(PROBLEM, offset=20.0, spindle_speed=1.0001 * fast) == 0.0
    falling = [
        spindle_acceleration_limit(PROBLEM, offset=20.0, spindle_speed=s * fast)
        for s in (0.1, 0.5, 0.9, 0.999)
    ]
    assert all(np.diff(falling) < 0)


@given(st.floats(0.0, 7.0), st.floats(1e-6, 29.0))
def test_advance_of_the_rim_is_what_is_left_to_its_farthest_place(angle, d):
    wanted = d + 30.0 - float(_rim(angle, d, 30.0))
    assert math.isclose(rim_advance(angle, offset=d, radius=30.0), wanted, abs_tol=2e-14 * 60)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: max_rim_slope(offset=30.0, radius=30.0),
            r"offset must be < radius = 30, or the probe finds no part \(mm\); got 30.0",
        ),
        (lambda: spindle_speed_limit(PROBLEM, offset=-1.0), r"offset must be >= 0 \(mm\); got -1.0"),
        (
            lambda: spindle_speed_limit(PROBLEM, offset=1.0, samples_per_turn=0),
            "samples_per_turn must be >= 1; got 0",
        ),
        (
            lambda: plan_push(PROBLEM, offset=10.0, spindle_speed=20.0, push_speed=10.0),
            r"spindle_speed must be <= 10.472 at an offset of 10 mm \(table\) \(rad/s; units.rpm\(...\) for rev/min\); got 20.0",
        ),
        (
            lambda: plan_push(
                PROBLEM.replace(mu_static=0.05, mu_kinetic=0.04),
                offset=10.0,
                spindle_speed=8.0,
                push_speed=10.0,
            ),
            r"spindle_speed must be <= 7.0025 at an offset of 10 mm \(friction\) \(rad/s; units.rpm\(...\) for rev/min\); got 8.0",
        ),
    ],
)
def test_bad_values_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
