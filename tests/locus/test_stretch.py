"""Stretches: tables against Koren's closed forms, calibration, refusals."""

import copy
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from koren_stretch import koren, loop_slope_of, u_of, v_of, values

from sdpgrind.locus import Stretch

KOREN = koren()
STATES = st.floats(0.5, 20.0)


@settings(deadline=None)
@given(STATES)
def test_a_stretch_is_the_closed_form(x):
    s = KOREN.coordinate_of(x)
    assert s == pytest.approx(v_of(x), abs=2e-7)
    point = KOREN.at(v_of(x))
    assert point.controls["u"] == pytest.approx(u_of(x), abs=1e-8) and point.controls["v"] == pytest.approx(
        v_of(x), abs=1e-12
    )
    assert point.hidden == pytest.approx(x, rel=1e-6)
    assert point.limit == pytest.approx(17 + u_of(x) - 4 * v_of(x), abs=1e-8)
    assert point.loop_slope == pytest.approx(loop_slope_of(x), rel=1e-5)


@settings(deadline=None)
@given(STATES, st.floats(-0.05, 0.05))
def test_the_loop_slope_is_that_of_the_slack(x, off):
    """Two ways: from the tables, and by differences of the model at fixed hidden state."""
    s, h = float(np.clip(v_of(x) + off, KOREN.low + 1e-3, KOREN.high - 1e-3)), 1e-4
    state = KOREN.at(s).hidden
    slope = (KOREN.slack(s + h, state) - KOREN.slack(s - h, state)) / (2 * h)
    assert slope == pytest.approx(KOREN.at(s).loop_slope, rel=1e-4)
    assert KOREN.slack(s, state) == pytest.approx(0.0, abs=1e-5)


def test_there_and_back():
    s = np.linspace(KOREN.low, KOREN.high, 999)
    np.testing.assert_allclose(KOREN.coordinate_of(KOREN.at(s).hidden), s, atol=1e-13)


def test_tables_converge_with_the_fourth_power():
    x = np.geomspace(0.5, 20, 333)
    errors = [np.abs(koren(points=n).coordinate_of(x) - v_of(x)).max() for n in (51, 101, 201)]
    assert errors[0] / errors[1] > 10 and errors[1] / errors[2] > 10


def test_by_the_hidden_state():
    stretch = koren(along="x")
    np.testing.assert_allclose(
        stretch.at(np.array([1.0, 4.0])).controls["v"], v_of(np.array([1.0, 4.0])), atol=1e-6
    )
    assert stretch.coordinate_of(3.0) == pytest.approx(3.0, abs=1e-12)
    # P_x: the slack of a fixed x grows
    assert stretch.at(2.0).loop_slope == pytest.approx(v_of(2.0), rel=1e-5)


def test_calibration_by_the_response():
    found = KOREN.calibrated()
    assert found.monotone and len(found.usable) == 1
    assert found.usable[0] == pytest.approx((0.5, 6.92738), abs=1e-4)
    k = int(np.argmin(np.abs(found.hidden - 1.0)))
    x, v = found.hidden[k], KOREN.coordinate[k]
    assert found.rho[k] == pytest.approx((x - 4) / ((2 - v) / u_of(x) - 4), rel=1e-9)
    assert koren(low=7.0).calibrated().usable == () and koren(high=6.9).calibrated().usable[0][
        1
    ] == pytest.approx(6.9)


@pytest.mark.parametrize(("x", "settles"), [(1.0, True), (6.8, True), (7.1, False), (9.0, False)])
def test_reading_off_again_and_again(x, settles):
    """Koren's retrieval (errata 8): read the response at a point, take the point with that limit; it
    converges for |rho| < 1.
    """
    order = np.argsort(KOREN.limit)
    s = v_of(x) * 1.001
    for _ in range(2000):
        before = s
        response = KOREN.values(KOREN.rows(s)[:2], np.asarray(x))[0]
        s = float(np.interp(response, KOREN.limit[order], KOREN.coordinate[order]))
    assert (abs(s - v_of(x)) < 2e-3 and abs(s - before) < 1e-6) == settles


def test_a_limit_that_turns_calibrates_nothing():
    flat = koren().limit * 0 + 3.0
    given = {
        name: getattr(KOREN, name)
        for name in ("coordinate", "controls", "hidden", "controls_slope", "hidden_slope")
    }
    stretch = Stretch(
        along="v", names=("u", "v"), hidden_name="x", **given, limit=flat, limit_slope=0 * flat,
        response_slope=KOREN.response_slope, ends=KOREN.ends, values=values,
    )  # fmt: skip
    assert not stretch.calibrated().monotone and np.all(np.isinf(stretch.calibrated().rho))


def test_a_copy_is_itself_and_tables_stay():
    assert copy.deepcopy(KOREN) is KOREN
    with pytest.raises(ValueError, match="read-only"):
        KOREN.hidden[0] = 1.0
    assert repr(KOREN) == "Stretch(v from 0.109726 to 4, x from 0.5 to 20; ends: range, interior)"


def changed(**changes):
    names = [
        "coordinate",
        "controls",
        "hidden",
        "limit",
        "response_slope",
        "controls_slope",
        "hidden_slope",
        "limit_slope",
    ]
    columns = {name: getattr(KOREN, name) for name in names}
    plain = {"along": "v", "names": ("u", "v"), "hidden_name": "x", "ends": KOREN.ends, "values": values}
    return Stretch(**(columns | plain | changes))


bent = KOREN.hidden.copy()
bent[50] = bent[60]
REFUSED = [
    (lambda: koren("u"), "along must be single-valued on the locus; 'u' is not, but v and x are"),
    (lambda: koren("w"), "along must be one of u, v, x; got 'w'"),
    (lambda: KOREN.at(5.0), "v must be in [0.109726, 4], where the stretch ends (interior); got 5"),
    (lambda: KOREN.at(np.nan), "v[0] must be finite; got nan"),
    (lambda: KOREN.coordinate_of(0.3), "x must be in [0.5, 20], where the stretch ends (interior); got 0.3"),
    (
        lambda: changed(hidden=bent),
        "x must change strictly one way along the stretch; it turns, as at a fold",
    ),
    (lambda: changed(coordinate=KOREN.controls[:, 0]), "coordinate 'v' must rise strictly; but v and x are"),
    (lambda: changed(hidden=KOREN.hidden[:-1]), "hidden must be of shape (401,); got (400,)"),
    (
        lambda: changed(hidden_slope=-KOREN.hidden_slope),
        "hidden_slope must have the sign of the change of x everywhere",
    ),
    (lambda: changed(limit=KOREN.limit * np.nan), "limit[0] must be finite; got nan"),
    (
        lambda: changed(ends=("range", "edge")),
        "ends must be one of range, interior, bound, fold, jump; got 'edge'",
    ),
    (lambda: changed(coordinate=np.array([1.0])), "coordinate must be a row of 2 numbers or more; got (1,)"),
]


@pytest.mark.parametrize(("call", "said"), REFUSED)
def test_refused(call, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        call()


def test_a_clamped_state():
    assert KOREN.coordinate_of(0.3, clamp=True) == KOREN.high
    assert KOREN.coordinate_of(np.array([30.0, 0.1]), clamp=True).tolist() == [KOREN.low, KOREN.high]


def test_pieces_that_meet_at_a_kink():
    """A joint of pieces has two points, with the slopes of either side: cos t continues as a straight line."""
    t = np.concatenate([np.linspace(0.0, 1.0, 41), np.linspace(1.0, 2.0, 21)])
    second = np.arange(62) > 40
    x = np.where(second, np.cos(1.0) - 3 * (t - 1), np.cos(t))
    dx = np.where(second, -3.0, -np.sin(t))
    dx[0] = -1e-3
    given = {
        "names": ("s",),
        "hidden_name": "x",
        "limit": 2 * t,
        "ends": ("range", "range"),
        "values": values,
    }
    made = {}
    for sign in (1, -1):  # tangents may point either way
        tangents = sign * np.ones((62, 1)), sign * dx, sign * 2 + 0 * t, sign * np.where(second, 5.0, 3.0)
        made[sign] = Stretch.of_curve("s", controls=t[:, None], hidden=x, tangents=tangents, **given)
    at = np.array([0.3, 0.77, 0.999, 1.001, 1.5])
    point = made[1].at(at)
    np.testing.assert_allclose(
        point.hidden, np.where(at > 1, np.cos(1.0) - 3 * (at - 1), np.cos(at)), atol=1e-6
    )
    np.testing.assert_allclose(point.loop_slope, np.where(at > 1, -3.0, -1.0), atol=1e-9)
    np.testing.assert_allclose(made[-1].at(at).hidden, point.hidden, atol=1e-12)
