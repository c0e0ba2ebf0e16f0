"""Inversion of a response for the hidden state, against scipy's brentq, at the ends, out of reach; optimum there."""

from functools import partial

import casadi
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from locus_inside import (
    ABOVE,
    BELOW,
    INSIDE,
    NO_KEY,
    Inversion,
    LocusTable,
    find_state,
    run_many,
    tape,
    work_size,
)
from locus_inside import inversion_kernels as kernels
from scipy.optimize import brentq

from sdpgrind.locus.kernels import retrieve

LOW, HIGH = 0.2, 20.0
FORMS = {
    "line": lambda x, u: u * x,
    "square": lambda x, u: u * x**2,
    "root": lambda x, u: (x - LOW) ** 0.5 + u,
    "cube at rest": lambda x, u: (x - 7) ** 3 + u,
    "saturating": lambda x, u: 1 - casadi.exp(-u * x),
    "step": lambda x, u: casadi.tanh(3 * (x - 4 * u)) + 1e-3 * x,
    "waves": lambda x, u: u * x + 0.95 * u * casadi.sin(x),
    "power": lambda x, u: x**1.7 + u * x**0.3,
    "logarithm": lambda x, u: u * casadi.log(x),
    "pole": lambda x, u: -u / (x - LOW),
    "corner": lambda x, u: u * casadi.fmax(x, 5 * x - 20),
    "stairs that rise": lambda x, u: casadi.floor(x) + 1e-3 * u * x,
}


def response(form, sign=1):
    u, x = casadi.SX.sym("u"), casadi.SX.sym("x")
    value = sign * FORMS[form](x, u)
    return tape(casadi.Function("f", [u, x], [value, casadi.gradient(value, x)]))


def off(packed, control, measured, state):
    return value(packed, control, state) - measured


def found(packed, control, measured, guess=2.0, direction=1.0, find=find_state):
    inputs = np.array([control, guess])
    flag = find(
        packed, inputs, (1, 0, 1), LOW, HIGH, direction, measured, np.empty(work_size(packed)), np.empty(2)
    )
    return inputs[1], flag


def both(packed, control, x):
    """Response and slope."""
    out = np.empty((1, 2))
    run_many(packed, np.array([[control, x]]), out)
    return out[0]


def value(packed, control, x):
    return both(packed, control, x)[0]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("sign", [1, -1])
def test_the_root_that_brentq_finds(form, sign):
    packed, rng = response(form, sign), np.random.default_rng(5)
    for _ in range(60):
        control, guess, wanted = rng.uniform(0.5, 1.5), rng.uniform(LOW, HIGH), rng.uniform(LOW, HIGH)
        measured = value(packed, control, wanted)
        x, flag = found(packed, control, measured, guess, sign)
        assert flag == INSIDE
        residual = partial(off, packed, control, measured)
        reference = brentq(residual, LOW + 1e-12, HIGH, xtol=1e-13, rtol=1e-14)
        # where it is flat, the response's rounding counts
        slope = max(abs(both(packed, control, wanted)[1]), 1e-11)
        assert abs(x - reference) < 1e-11 + 1e-15 * (1 + abs(measured)) / slope
        miss = abs(value(packed, control, x) - measured)
        assert miss <= abs(value(packed, control, reference) - measured) + 1e-12 * (1 + abs(measured))


@settings(max_examples=150, deadline=None)
@example("pole", 0.0, 0.20000000000000004, 1.0)
@given(st.sampled_from(list(FORMS)), st.floats(-0.5, 1.5), st.floats(LOW, HIGH), st.floats(0.5, 1.5))
def test_whatever_is_measured_the_answer_is_the_state_or_an_end(form, share, guess, control):
    packed = response(form)
    ends = np.clip([value(packed, control, LOW), value(packed, control, HIGH)], -1e6, 1e6)
    measured = ends[0] + share * (ends[1] - ends[0])
    x, flag = found(packed, control, measured, guess)
    assert LOW <= x <= HIGH
    if flag == INSIDE:  # the response crosses the measurement there; at a stair it jumps
        around = [value(packed, control, np.clip(x * (1 + side * 1e-9), LOW, HIGH)) for side in (-1, 1)]
        room = 1e-9 * (1 + abs(measured))
        assert around[0] - room <= measured <= around[1] + room
    else:
        assert (x, flag) in ((LOW, BELOW), (HIGH, ABOVE))
        assert measured < ends[0] if flag == BELOW else measured > ends[1]


def test_a_line_takes_two_evaluations_and_no_response_many(monkeypatch):
    seen = []
    real = kernels.run
    monkeypatch.setattr(kernels, "run", lambda *given: (seen.append(1), real(*given)))
    monkeypatch.setattr(kernels, "_newton", kernels._newton.py_func)
    counts = {}
    for form in FORMS:
        packed, most = response(form), 0
        for wanted in np.linspace(LOW + 0.01, HIGH, 40):
            seen.clear()
            found(packed, 1.0, value(packed, 1.0, wanted), find=find_state.py_func)
            most = max(most, len(seen))
        counts[form] = most
    assert counts["line"] <= 2
    assert all(counts[form] <= 9 for form in ("square", "power", "logarithm", "corner"))
    assert max(counts.values()) <= 25, counts  # halving alone would take 50


def test_ends_are_inside_and_beyond_them_is_flagged():
    packed = response("line")
    for x in (LOW, HIGH):
        assert found(packed, 0.7, 0.7 * x) == (x, INSIDE)
        # by rounding
        assert found(packed, 0.7, np.nextafter(0.7 * x, x * np.inf if x == HIGH else -np.inf))[1] == INSIDE
    assert found(packed, 0.7, 0.7 * HIGH + 1e-9) == (HIGH, ABOVE)
    assert found(packed, 0.7, 0.7 * LOW - 1e-9) == (LOW, BELOW)
    assert found(packed, 0.7, np.inf) == (HIGH, ABOVE)
    assert found(packed, 0.7, -np.inf) == (LOW, BELOW)
    falling = response("line", -1)
    # of the state, not of the measurement
    assert found(falling, 0.7, -100.0, direction=-1.0) == (HIGH, ABOVE)
    assert found(falling, 0.7, 100.0, direction=-1.0) == (LOW, BELOW)


def test_a_guess_outside_or_at_an_end_does_no_harm():
    packed = response("power")
    measured = value(packed, 1.2, 3.3)
    for guess in (-5.0, LOW, HIGH, 1e9):
        x, flag = found(packed, 1.2, measured, guess)
        assert flag == INSIDE
        assert x == pytest.approx(3.3, rel=1e-12)


def test_no_number_gives_none():
    x, flag = found(response("line"), 0.7, np.nan)
    assert np.isnan(x)
    assert flag == NO_KEY
    assert found(response("power"), np.nan, 3.0)[1] == NO_KEY


def koren_table(count=200):
    """Best controls of Koren's example by x, in closed form."""
    x = np.geomspace(0.5, 20, count)
    u, v = (x**2 + 4 * x - 1) / (1 + x**2), (4 + 2 * x) / (1 + x**2)
    slopes = np.column_stack([(2 * x + 4) - 2 * x * u, 2 - 2 * x * v]) / (1 + x**2)[:, None]
    return LocusTable(x, np.column_stack([u, v]), slopes)


def koren(**changes):
    z, x = casadi.SX.sym("z", 2), casadi.SX.sym("x")
    measured = x * z[1] + 16 - 4 * z[1]
    function = casadi.Function("response", [z, x], [measured, z[1]])
    return Inversion(tape(function), koren_table(), **{"low": 0.2, "high": 20.0, **changes})


def test_the_best_point_in_one_step_from_anywhere():
    inversion = koren()
    for x in np.geomspace(0.51, 19.9, 37):
        for v in (0.2, 1.0, 3.7):
            point, clamped = inversion.at(x * v + 16 - 4 * v, 2.1, v)
            exact = [x, (x**2 + 4 * x - 1) / (1 + x**2), (4 + 2 * x) / (1 + x**2)]
            np.testing.assert_allclose(point, exact, atol=2e-8)
            assert point[0] == pytest.approx(x, rel=1e-12 / min(1, v))
            assert not clamped


def test_out_of_reach_of_the_response_or_of_the_table():
    inversion = koren()
    point, clamped = inversion.at(100.0, 2.0, 3.0)
    assert clamped
    np.testing.assert_array_equal(point, [20.0, *inversion.table.columns[-1]])
    # a state with which the constraint is idle: not in the table
    point, clamped = inversion.at(0.3 * 3.0 + 16 - 12, 2.0, 3.0)
    assert clamped
    np.testing.assert_allclose(point, [0.3, 1.0, 4.0], atol=1e-12)


def test_ways_to_ask_agree():
    inversion = koren()
    outs = np.empty((2, 3))
    flags = [
        retrieve(inversion.packed, np.array([2.1, 2.8]), 7.0, outs[0]),
        retrieve(inversion.packed, (2.1, 2.8), 7.0, outs[1]),
    ]
    point, clamped = inversion.at(7.0, 2.1, 2.8)
    assert flags == [INSIDE, INSIDE]
    assert not clamped
    np.testing.assert_array_equal(outs, [point, point])
    np.testing.assert_array_equal(inversion.at(7, 3, 2)[0], inversion.at(7.0, 3.0, 2.0)[0])


def test_one_response_of_several_that_falls():
    z, x = casadi.SX.sym("z"), casadi.SX.sym("x")
    responses = casadi.vertcat(x + z, 30 - x * z)
    function = casadi.Function("f", [z, x], [responses, casadi.jacobian(responses, x)])
    inversion = Inversion(tape(function), koren_table(), low=0.2, high=20.0, rising=False, count=2, index=1)
    point, clamped = inversion.at(30 - 2.5 * 4.0, 2.5)
    assert point[0] == pytest.approx(4.0, rel=1e-13)
    assert not clamped


def test_errors_at_a_reading():
    with pytest.raises(ValueError, match=r"^response must be a number, no NaN; got nan$"):
        koren().at(np.nan, 2.0, 3.0)
    with pytest.raises(
        ValueError, match=r"^controls must be where the model has a response; it has none at 2.0, nan$"
    ):
        koren().at(7.0, 2.0, np.nan)
