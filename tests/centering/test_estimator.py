"""The streaming estimator: exact without noise, as good as can be with it, the same however it is fed."""

import copy

import numpy as np
import pytest
from circle_inside import slots as at
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from centering.circle import GeometryEstimator, circle_derivatives, circle_reading
from sdpgrind import units
from sdpgrind.identify import Status

RADIUS, SIGMA = 61.94, 0.04


def turned(degrees, start=0.0):
    return np.radians(start + np.arange(float(degrees)))


def noisy(angle, offset=3.6, phi=0.7, sigma=SIGMA, seed=0, tip=0.0):
    return circle_reading(angle, RADIUS, offset, phi, tip) + np.random.default_rng(seed).normal(
        0.0, sigma, angle.size
    )


def fitted(angle, reading, **settings_):
    estimator = GeometryEstimator(**settings_)
    estimator.extend(angle, reading)
    return estimator


def slow_fit(angle, reading, tip=0.0):
    """The recursion's definition, by numpy: every row weighed with the centre that all rows before it give;
    all rows at once.
    """
    r, start = reading + tip, reading[0] + tip
    rows, goals, bias = [], [], np.zeros(3)
    center = np.zeros(2)
    biases = []
    for k, (a, x) in enumerate(zip(angle, r, strict=True)):
        u = np.array([np.cos(a), np.sin(a)])
        cosine = (x - center @ u) / np.linalg.norm(x * u - center)
        h = np.array([1.0, *(x * u / start)]) / cosine
        rows.append(h)
        goals.append((x**2 - start**2) / (2 * start * cosine))
        biases.append((h * (2 * cosine**2 - 1.5) / (start * cosine), np.array([0.0, *u]) / (start * cosine)))
        if k >= 7:
            center = np.linalg.lstsq(np.array(rows), np.array(goals), rcond=None)[0][1:]
    rows, goals = np.array(rows), np.array(goals)
    value = np.linalg.lstsq(rows, goals, rcond=None)[0]
    info = np.linalg.inv(rows.T @ rows)
    variance = np.sum((goals - rows @ value) ** 2) / (angle.size - 3)
    ratio = np.sqrt(start**2 + 2 * start * value[0] + value[1:] @ value[1:]) / start
    bias = sum(a / ratio**2 + b / ratio for a, b in biases)
    value = value - variance * info @ bias
    return np.array([np.sqrt(start**2 + 2 * start * value[0] + value[1:] @ value[1:]) - tip, *value[1:]])


@pytest.mark.parametrize("tip", [0.0, 3.75])
def test_equals_slow_twin(tip):
    angle = turned(29, 20.0)  # the first 30 are screened together after that, and weighed anew
    reading = noisy(angle, 8.0, tip=tip, sigma=0.01)
    expected = slow_fit(angle, reading, tip)
    assert_allclose(
        fitted(angle, reading, tip_radius=tip).estimate.value, expected, atol=2e-6
    )  # condition 1e4 of the normal form


@pytest.mark.parametrize("arc", [45, 90, 180, 360, 720])
@pytest.mark.parametrize("tip", [0.0, 3.75])
def test_exact_without_noise(arc, tip):
    for share in (0.0, 1e-6, 0.058, 0.5, 0.95):
        for start in (0.0, 100.0, 200.0, 220.0):
            angle = turned(arc + 1, start)
            offset = share * RADIUS
            estimate = fitted(angle, circle_reading(angle, RADIUS, offset, 0.7, tip), tip_radius=tip).estimate
            truth = [RADIUS, offset * np.cos(0.7), offset * np.sin(0.7)]
            assert_allclose(estimate.value, truth, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("arc", "start"), [(60, 0.0), (60, 200.0), (120, 90.0), (360, 0.0)])
def test_reaches_cramer_rao_bound(arc, start):
    angle, seeds, sigma = turned(arc, start), 2000, 0.01
    jacobian = circle_derivatives(angle, RADIUS, 3.6, 0.7)
    bound = sigma * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    clean, noise = (
        circle_reading(angle, RADIUS, 3.6, 0.7),
        np.random.default_rng(7).normal(0.0, sigma, (seeds, arc)),
    )
    estimator, found = GeometryEstimator(), np.empty((seeds, 4))
    for one, out in zip(noise, found, strict=True):
        estimator.reset()
        estimator.extend(angle, clean + one)
        assert estimator.band > 0  # it is judged then, and what was found stands in its state
        out[:] = estimator._state[[at.RADIUS, at.FIT_X, at.FIT_Y, at.FIT_NOISE]]
    offset, phi = np.hypot(found[:, 1], found[:, 2]), np.arctan2(found[:, 2], found[:, 1])
    error = np.column_stack([found[:, 0] - RADIUS, offset - 3.6, phi - 0.7])
    assert_allclose(np.sqrt(np.mean(error**2, axis=0)) / bound, 1.0, atol=0.05)  # the standard error is 1.6 %
    expected = sigma * (1 - 0.25 / (arc - 3))  # mean of a standard deviation of so many degrees of freedom
    assert_allclose(np.mean(found[:, 3]), expected, rtol=2.8 / np.sqrt(2 * seeds * arc))


def test_unbiased_where_rows_hold_much_noise():
    """0.5 R over 60 degrees of the near side: least squares of the linear form are low by 0.4 standard
    deviations.
    """
    angle, seeds = turned(60, 180.0), 600
    found = [
        fitted(angle, noisy(angle, 0.5 * RADIUS, sigma=0.04, seed=k)).estimate.radius for k in range(seeds)
    ]
    jacobian = circle_derivatives(angle, RADIUS, 0.5 * RADIUS, 0.7)
    sd = 0.04 * np.sqrt(np.linalg.inv(jacobian.T @ jacobian)[0, 0])
    assert abs(np.mean(found) - RADIUS) < 4 * sd / np.sqrt(seeds)


def test_covariance_is_that_of_the_exact_curve():
    angle = turned(90)
    estimate = fitted(angle, noisy(angle, sigma=1e-4)).estimate
    jacobian = circle_derivatives(angle, RADIUS, 3.6, 0.7)
    covariance = np.linalg.inv(jacobian.T @ jacobian) * estimate.noise_sd**2
    sd = np.sqrt(np.diag(covariance))
    assert_allclose([estimate.radius_sd, estimate.offset_sd, estimate.offset_angle_sd], sd, rtol=2e-3)


@pytest.mark.parametrize("model", ["exact", "limacon"])
@pytest.mark.parametrize("forgetting", [1.0, 0.5])
def test_one_by_one_as_all_at_once(model, forgetting):
    angle = turned(500, 5.0)
    reading = noisy(angle)
    reading[[7, 100, 200, 201]] += 1.0
    options = {"model": model, "forgetting": forgetting, "form": {2: 0.001, 5: 0.0005}, "noise_sd": 0.03}
    one, all_, until = (GeometryEstimator(**options) for _ in range(3))
    first = None
    for k, (a, r) in enumerate(zip(angle, reading, strict=True)):
        one.update(angle=a, reading=r)
        first = k if first is None and one.valid else first
        _ = one.estimate  # looking changes nothing
    all_.extend(angle, reading)
    stopped = until.first_valid(angle, reading)
    assert first == stopped
    until.extend(angle[stopped + 1 :], reading[stopped + 1 :])
    assert one.estimate == all_.estimate == until.estimate
    assert_array_equal(one.rejected, all_.rejected)
    assert_array_equal(all_.rejected, until.rejected)


def test_copies_go_their_own_ways():
    angle = turned(200)
    reading = noisy(angle)
    estimator = fitted(angle[:100], reading[:100])
    twin = copy.deepcopy(estimator)
    estimator.extend(angle[100:], reading[100:])
    assert twin.estimate.samples == 100
    twin.extend(angle[100:], reading[100:])
    assert twin.estimate == estimator.estimate


@settings(max_examples=25, deadline=None)
@given(shift=st.floats(-3.0, 3.0), arc=st.integers(70, 400), backward=st.booleans(), wrapped=st.booleans())
def test_turns_with_the_part(shift, arc, backward, wrapped):
    """Another zero of the encoder, the other sense, angles within one turn: the same circle, turned."""
    angle = turned(arc)
    reading = noisy(angle)
    plain = fitted(angle, reading).estimate
    sign = -1.0 if backward else 1.0
    other = sign * angle + shift
    if wrapped:
        other = np.remainder(other, 2 * np.pi)
    turned_ = fitted(other, reading).estimate
    assert_allclose(turned_.radius, plain.radius, rtol=1e-9)
    assert_allclose(turned_.offset, plain.offset, rtol=1e-7)
    assert_allclose(
        np.exp(1j * turned_.offset_angle), np.exp(1j * (sign * plain.offset_angle + shift)), rtol=1e-7
    )
    assert_allclose(turned_.swept, plain.swept, rtol=1e-9)


def test_averages_turns():
    angle = turned(4 * 360)
    one, four = fitted(angle[:360], noisy(angle)[:360]).estimate, fitted(angle, noisy(angle)).estimate
    assert_allclose(four.center_sd / four.noise_sd, one.center_sd / one.noise_sd / 2, rtol=1e-3)
    assert_allclose(four.swept, units.deg(4 * 360 - 1))


def test_limacon_takes_readings_about_zero():
    angle = turned(360)
    estimate = fitted(angle, 0.2 * np.cos(angle - 1.0), model="limacon").estimate
    assert_allclose([estimate.radius, estimate.offset, estimate.offset_angle], [0.0, 0.2, 1.0], atol=1e-9)


def test_forgets_by_angle():
    """Weighted least squares with weights forgetting^(turns since), which numpy solves."""
    angle, forgetting = turned(1000), 0.3
    drifting = 50.0 + 2.0 * np.cos(angle) + 0.3 * angle
    weight = forgetting ** ((angle[-1] - angle) / (4 * np.pi))
    basis = np.column_stack([np.ones_like(angle), np.cos(angle), np.sin(angle)])
    expected = np.linalg.lstsq(basis * weight[:, None], drifting * weight, rcond=None)[0]
    estimate = fitted(angle, drifting, model="limacon", forgetting=forgetting).estimate
    assert_allclose(estimate.value, expected, rtol=1e-8)


def test_knows_nothing_before_the_first_reading():
    estimator = GeometryEstimator(radius_prior=(RADIUS, 0.1))
    estimate = estimator.estimate
    assert (estimate.status, estimate.limited_by, estimate.samples, estimator.valid) == (
        Status.UNDETERMINED,
        "samples",
        0,
        False,
    )
    assert estimate.radius == RADIUS
    estimator.update(angle=0.0, reading=RADIUS)
    assert np.all(np.isfinite(estimator.estimate.value))
    estimator.reset()
    assert estimator.estimate == estimate


@pytest.mark.parametrize(
    "known", [{}, {"noise_sd": 0.001}, {"radius_prior": (RADIUS, 0.1)}, {"form": {2: 0.01}}]
)
def test_a_few_readings_give_no_nonsense(known):
    """Warnings are errors: nothing endless is multiplied by 0."""
    estimator = GeometryEstimator(**known)
    for k in range(3):
        estimator.update(angle=0.01 * k, reading=RADIUS + 0.001 * (k % 2))
        circle = estimator.estimate
        assert not np.any(np.isnan(circle.covariance)) and not estimator.valid
        assert circle.samples == k + 1 and "too few" in circle.message
        assert circle.offset_sd >= 0 and circle.center_sd >= 0 and circle.radius_sd > 0


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"confidence": 1.0}, "confidence must be in \\(0, 1\\)"),
        ({"rel_tol": -0.1}, "rel_tol must be >= 0"),
        ({"abs_tol": 0.0}, "abs_tol must be > 0 \\(mm\\)"),
        ({"forgetting": 0.0}, "forgetting must be in \\(0, 1\\]"),
        ({"forgetting": 1.1}, "forgetting must be in \\(0, 1\\]"),
        ({"noise_sd": -1.0}, "noise_sd must be >= 0 \\(mm\\)"),
        ({"tip_radius": -1.0}, "tip_radius must be >= 0 \\(mm\\)"),
        ({"model": "circle"}, "model must be one of exact, limacon"),
        ({"arc_min": 30.0}, "arc_min must be in \\[0, 6.28319\\] \\(rad\\)"),
        ({"radius_prior": (61.9, 0.0)}, "radius_prior\\[1\\] must be > 0 \\(mm\\)"),
        ({"form": {1: 0.1}}, "upr of form must be >= 2; got 1"),
        ({"form": {2: -0.1}}, "form\\[2\\] must be >= 0 \\(mm\\)"),
    ],
)
def test_refuses_settings(wrong, message):
    with pytest.raises(ValueError, match=message):
        GeometryEstimator(**wrong)


@pytest.mark.parametrize(
    ("angle", "reading", "message"),
    [
        (np.nan, 60.0, "angle and reading must be finite"),
        (1.0, np.inf, "angle and reading must be finite"),
        (1.0, -3.0, "reading must be > 0 with the exact curve.*limacon.*-3.0"),
        (9.0, 60.0, "units.deg"),
    ],
)
def test_refuses_readings_and_stays_as_it_was(angle, reading, message):
    estimator = fitted(turned(50), noisy(turned(50)))
    before = estimator.estimate
    with pytest.raises(ValueError, match=message):
        estimator.update(angle=angle, reading=reading)
    assert estimator.estimate == before


def test_refuses_degrees():
    estimator = GeometryEstimator()
    with pytest.raises(ValueError, match=r"units\.deg"):
        estimator.extend(np.arange(360.0), noisy(turned(360)))


def test_refuses_unequal_lengths():
    with pytest.raises(ValueError, match=r"one length; got \(3,\) and \(2,\)"):
        GeometryEstimator().extend([0.0, 0.1, 0.2], [1.0, 2.0])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda e: e.update(angle="a", reading=60.0), r"angle must be a number \(rad\); got 'a'"),
        (lambda e: e.update(angle=0.0, reading=None), r"reading must be a number \(mm\); got None"),
        (lambda e: e.extend(["a"], [60.0]), r"angle must be numbers \(rad\); got \['a'\]"),
        (lambda e: e.extend([0.0], ["b"]), r"reading must be numbers \(mm\); got \['b'\]"),
        (lambda e: GeometryEstimator(joint="no"), r"joint must be True or False; got 'no'"),
    ],
)
def test_refuses_what_is_no_number(call, message):
    with pytest.raises(TypeError, match=message):
        call(GeometryEstimator())
