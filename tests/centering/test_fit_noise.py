"""Noise that a batch fit shows: correlated along the travel or not, form told from it, a floor, steps of the
probe; degrees.
"""

import numpy as np
import pytest
from circle_inside import fit_noise_kernels as kernels
from circle_inside import slots as at
from circle_inside import step_noise, travel_of
from scipy.signal import lfilter
from scipy.special import ndtri, stdtrit

from centering import identify
from centering.circle import (
    GeometryEstimator,
    circle_derivatives,
    circle_reading,
    fit_circle,
    residual_checks,
)
from centering.roundness import Harmonics
from sdpgrind.base.compiling.compiled import opened

RADIUS, OFFSET, PHI, SIGMA = 61.94, 3.6, 0.7, 0.01
TRUE = np.array([RADIUS, OFFSET * np.cos(PHI), OFFSET * np.sin(PHI)])
TURN, TWO_PI = np.radians(np.arange(360.0)), 2 * np.pi
READ = circle_reading(TURN, RADIUS, OFFSET, PHI)


def faded(rho, count, rows, seed=0):
    """AR(1) noise of sd SIGMA, (rows, count)."""
    fresh = np.random.default_rng(seed).normal(0, SIGMA, (rows, count + 400))
    return lfilter([np.sqrt(1 - rho**2)], [1, -rho], fresh, axis=1)[:, 400:]


def misses(angle, noise, fit=fit_circle, **options):
    """Share of centres outside of the joint band for 0.99, of values outside of their intervals, and the
    estimates.
    """
    clean = circle_reading(angle, RADIUS, OFFSET, PHI)
    found = [fit(angle, clean + row, **options) for row in noise]
    away = np.array([one.value - TRUE for one in found])
    band = np.array([one.uncertainty(0.99, joint=True) for one in found])
    low, high = np.array([one.interval(0.99).T for one in found]).transpose(1, 0, 2)
    outside = (low > TRUE) | (high < TRUE)
    return np.mean(np.hypot(away[:, 1], away[:, 2]) > band), outside.mean(), found


@pytest.mark.parametrize("loss", ["linear", "huber"])
@pytest.mark.parametrize("degrees", [121, 360])
def test_correlated_noise_is_covered(loss, degrees):
    """232 of 300 bands missed without inflation, and 46 % of intervals. Of 300, 1 % is 3 +- 1.7."""
    band, interval, found = misses(np.radians(np.arange(degrees)), faded(0.88, degrees, 300), loss=loss)
    assert band <= 0.03 and interval <= 0.025
    if loss == "linear":
        told = np.array([one.inflation for one in found])
        expected = expected_inflation(np.radians(np.arange(degrees)), 0.88)
        # of a median
        assert np.median(told) == pytest.approx(
            expected, rel=4 * 1.2533 * np.log(told).std() / np.sqrt(told.size)
        )


def expected_inflation(angle, rho):
    """Of residuals as they are in the mean: beside form over a turn; over an arc beside the circle, in
    matrices.
    """
    count, lags = angle.size, np.arange(angle.size)
    if count == 360:
        left = opened(kernels._expected)(rho, count, TWO_PI / count)[0]
        return np.sqrt((count - kernels.COLUMNS) / left * opened(kernels._once)(rho, count, TWO_PI / count))
    slopes = circle_derivatives(angle, RADIUS, OFFSET, PHI)
    rest = np.eye(count) - slopes @ np.linalg.pinv(slopes)
    left = rest @ rho ** abs(np.subtract.outer(lags, lags)) @ rest
    plain = 1 - 0.5 * np.trace(np.diff(np.diff(left, axis=0), axis=1)) / np.trace(left)
    plain -= 2 * rho / count  # the mean of a quotient is not the quotient of means (Marriott and Pope)
    return kernels.factor(plain + (2 + 5 * plain) / count)


def test_correlated_noise_is_covered_by_the_limacon():
    turn = np.radians(np.arange(360))
    clean = RADIUS + 0.01 * np.cos(turn - PHI)
    found = [identify((turn, clean + row), method="limacon") for row in faded(0.88, 360, 200)]
    away = [np.hypot(one.center_x - 0.01 * np.cos(PHI), one.center_y - 0.01 * np.sin(PHI)) for one in found]
    assert np.mean(away > np.array([one.uncertainty(0.99, joint=True) for one in found])) <= 0.03


def test_streamed_intervals_cover_too():
    """The covariance of a streamed estimate holds the inflation: once in the band, once in the intervals."""

    def stream(angle, reading):
        estimator = GeometryEstimator()
        estimator.extend(angle, reading)
        return estimator.estimate

    band, interval, _ = misses(TURN, faded(0.88, 360, 200), stream)
    assert band <= 0.03 and interval <= 0.03
    estimator = GeometryEstimator(confidence=0.99)
    estimator.extend(TURN, READ + faded(0.88, 360, 1)[0])
    # t of whole freedom
    assert estimator.estimate.uncertainty(0.99) == pytest.approx(estimator.band, rel=0.05)


def test_a_carried_radius_is_not_inflated_twice():
    estimator = GeometryEstimator()
    estimator.extend(TURN, READ + faded(0.88, 360, 1)[0])
    before = estimator.estimate
    estimator.reset(keep_radius=True)
    assert before.inflation > 1.0
    wider = stdtrit(np.floor(before.freedom), 0.9995) / ndtri(0.9995)  # tables hold whole degrees of freedom
    assert estimator._state[at.PRIOR_SD] == pytest.approx(wider * before.radius_sd + before.form_bound)


@pytest.mark.parametrize("degrees", [60, 121, 360])
def test_white_noise_is_left_alone(degrees):
    """Not more than 1 % is taken for correlated; for the others the covariance is the plain one."""
    angle = np.radians(np.arange(degrees))
    _, _, found = misses(angle, np.random.default_rng(1).normal(0, SIGMA, (400, degrees)))
    plain = [one for one in found if one.inflation == 1 and one.freedom == degrees - 3]
    assert len(plain) >= 0.97 * len(found)
    slopes = circle_derivatives(angle, RADIUS, OFFSET, PHI)
    for one in plain[:20]:
        assert one.radius_sd == pytest.approx(
            one.noise_sd * np.sqrt(np.linalg.inv(slopes.T @ slopes)[0, 0]), rel=0.02
        )


def lobed(degrees, lobes):
    """Angle and reading of a lobed part, at even angles about its own centre."""
    part_angle = np.radians(np.arange(degrees))
    height = RADIUS + sum(a * np.cos(n * part_angle - 1) for n, a in lobes.items())
    point = OFFSET * np.exp(1j * PHI) + height * np.exp(1j * part_angle)
    return np.unwrap(np.angle(point)), np.abs(point)


@pytest.mark.parametrize("degrees", [360, 450, 720])
def test_form_is_not_taken_for_noise(degrees):
    """Lobes of 2 to 5 upr, five times the noise: inflation 1, noise that of the readings; their pull is in
    the band.
    """
    (angle, clean), rng, out = lobed(degrees, {2: 0.02, 3: 0.05}), np.random.default_rng(2), 0
    for _ in range(100):
        found = fit_circle(angle, clean + rng.normal(0, SIGMA, degrees))
        assert found.noise_sd == pytest.approx(SIGMA, rel=0.2) and found.inflation < 2
        out += np.hypot(*(found.value - TRUE)[1:]) > found.uncertainty(0.99, joint=True)
    assert out <= 5
    assert found.form_bound > (0.001 if degrees == 450 else 0.0)


def test_form_above_five_waves_is_not_endless():
    angle, clean = lobed(360, {7: 0.02})
    # as where noise walks at random; AR(1) without a bound: 141
    assert fit_circle(angle, clean).inflation < 50


def test_noise_is_looked_at_along_the_travel():
    """Order, wrapped turns and sense do not matter where the spindle's way can be told."""
    angle = np.radians(np.arange(1080.0))
    reading = circle_reading(angle, RADIUS, OFFSET, PHI) + faded(0.8, 1080, 1)[0]
    mixed = np.random.default_rng(0).permutation(1080)
    first = fit_circle(angle, reading)
    assert first.inflation > 2
    for other in (
        fit_circle(angle[mixed], reading[mixed]),
        fit_circle(angle % TWO_PI, reading),
        fit_circle(-angle[::-1], reading),
    ):
        assert other.inflation == pytest.approx(first.inflation, rel=0.05) and other.swept == pytest.approx(
            first.swept
        )


def test_one_formula_of_the_factor():
    left = faded(0.6, 360, 1)[0]
    found = residual_checks(left)
    assert (
        found.inflation
        == kernels.factor(found.lag_1)
        == pytest.approx(np.sqrt((1 + found.lag_1) / (1 - found.lag_1)))
    )


def test_lobes_are_taken_out_by_least_squares():
    rng, circle = np.random.default_rng(3), TRUE
    left, part = (
        rng.normal(0, SIGMA, 360),
        np.arctan2(READ * np.sin(TURN) - TRUE[2], READ * np.cos(TURN) - TRUE[1]),
    )
    side = np.sqrt(RADIUS**2 - (TRUE[2] * np.cos(TURN) - TRUE[1] * np.sin(TURN)) ** 2)
    columns = np.column_stack([np.ones(360), *(f(n * part) for n in range(1, 6) for f in (np.cos, np.sin))])
    columns *= (RADIUS / side)[:, np.newaxis]
    value = np.linalg.lstsq(columns, left, rcond=None)[0]
    out = left.copy()
    assert opened(kernels._freed)(TURN, READ, np.arange(360), circle, out) == pytest.approx(
        np.hypot(value[1], value[2])
    )
    assert out == pytest.approx(left - columns @ value, abs=1e-12)
    assert opened(kernels._freed)(TURN, READ, np.arange(90), circle, left[:90].copy()) < 0


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_what_noise_leaves_beside_lobes(rho):
    """In matrices, for noise that goes round."""
    lags = np.arange(200)
    row = (rho**lags + rho ** (200 - lags)) / (1 - rho**200) if rho else (lags == 0).astype(float)
    covariance = np.array([np.roll(row, k) for k in range(200)])
    angle = TWO_PI * lags / 200
    basis, _ = np.linalg.qr(
        np.column_stack([np.ones(200), *(f(n * angle) for n in range(1, 6) for f in (np.cos, np.sin))])
    )
    rest = np.eye(200) - basis @ basis.T
    left = rest @ covariance @ rest
    step = np.eye(200) - np.roll(np.eye(200), 1, axis=0)
    wanted = np.trace(left), np.trace(step @ left @ step.T)
    assert opened(kernels._expected)(rho, 200, TWO_PI / 200) == pytest.approx(wanted, rel=1e-9)
    assert opened(kernels._fading)(wanted[1] / wanted[0], 200, TWO_PI / 200) == pytest.approx(rho, abs=1e-4)


@pytest.mark.parametrize("way", [1, -1])
def test_wrapped_turns_are_counted(way):
    three = np.radians(np.arange(1080.0)) * way
    assert travel_of(three % TWO_PI).swept == pytest.approx(np.radians(1079))
    assert travel_of((three + 3.0) % TWO_PI - np.pi).swept == pytest.approx(np.radians(1079))
    mixed = np.random.default_rng(0).permutation(three % TWO_PI)
    assert travel_of(mixed).swept == pytest.approx(np.radians(359), abs=1e-6)
    back = np.concatenate([TURN[:90], TURN[:90][::-1]])
    assert travel_of(back).swept == pytest.approx(np.radians(89))


def test_a_noise_that_is_told_is_the_least():
    """100 times too small it changes nothing; larger than what is seen it counts, with certainty."""
    reading = READ + np.random.default_rng(4).normal(0, 0.04, 360)
    plain, small, large = (fit_circle(TURN, reading, noise_sd=sd) for sd in (None, 4e-4, 0.2))
    assert small.center_sd == plain.center_sd and small.freedom == 357
    assert (
        large.center_sd == pytest.approx(plain.center_sd * 0.2 / plain.noise_sd) and large.freedom == np.inf
    )
    huber = fit_circle(TURN, reading, noise_sd=4e-4, loss="huber")
    assert huber.center_sd == pytest.approx(plain.center_sd, rel=0.15) and huber.freedom < 357
    lima = identify((TURN, RADIUS + reading - READ), method="limacon", noise_sd=4e-4)
    assert lima.center_sd == pytest.approx(plain.center_sd, rel=0.01)


def test_steps_of_the_probe():
    """Readings that the steps make equal have no noise to be seen; they have that of the steps."""
    stepped = np.round(circle_reading(TURN, RADIUS, 0.02, PHI) / 0.01) * 0.01
    found = fit_circle(TURN, stepped)
    assert found.noise_sd >= 0.01 / np.sqrt(12) * (1 - 1e-9)
    assert step_noise(stepped) == pytest.approx(0.01 / np.sqrt(12))
    assert step_noise(READ) == step_noise(np.tile(READ, 5)) == step_noise(np.full(9, 3.0)) == 0.0
    few = fit_circle([0.0, 1.5, 3.0, 4.5] * 3, [60.0, 60.0, 60.01, 60.01] * 3)
    assert few.center_sd > 0.0005


@pytest.mark.parametrize(
    "angle", [np.arange(0, 360, 2.0), np.arange(0, 360, 10.0), np.arange(0, 90, 0.5), np.arange(0, 360, 0.1)]
)
def test_degrees_are_refused(angle):
    reading = circle_reading(np.radians(angle), RADIUS, OFFSET, PHI) + np.random.default_rng(5).normal(
        0, SIGMA, angle.size
    )
    with pytest.raises(
        ValueError, match=r"angle must be in rad; .* smells of degrees: give units\.deg\(angle\)"
    ):
        fit_circle(angle, reading)
    assert fit_circle(np.radians(angle), reading).ok


@pytest.mark.parametrize("points", [360, 20, 9])
@pytest.mark.parametrize("offset", [0.0, OFFSET])
def test_many_turns_are_legal(points, offset):
    """Counted or not, in any order: one fit, but for the order of its sums."""
    angle, rng = TWO_PI * np.arange(4 * points) / points, np.random.default_rng(6)
    reading = circle_reading(angle, RADIUS, offset, PHI) + rng.normal(0, SIGMA, angle.size)
    mixed = rng.permutation(angle.size)
    first = fit_circle(angle, reading)
    assert (
        np.abs(first.value - [RADIUS, offset * np.cos(PHI), offset * np.sin(PHI)]).max() < 5 * first.center_sd
    )
    for turned, read in (
        (angle[mixed], reading[mixed]),
        (angle % TWO_PI, reading),
        (angle[mixed] % TWO_PI, reading[mixed]),
    ):
        found = fit_circle(turned, read)
        assert found.value == pytest.approx(first.value, abs=1e-11)
        assert found.covariance == pytest.approx(first.covariance, rel=1e-9, abs=1e-15)
        assert (found.freedom, found.inflation) == (first.freedom, first.inflation)


def test_known_form_is_told_alike_everywhere():
    angle, reading = lobed(120, {3: 0.05})
    for known in (
        {3: (0.05, 1.0)},
        Harmonics([3.0], [0.05], [1.0]),
        {3: (0.05, 1.0), 7.5: (0.0, 0.0), 1: (0.0, 0.0)},
    ):
        found = identify((angle, reading), harmonics=known)
        assert found.value == pytest.approx(TRUE, abs=1e-9)
        estimator = GeometryEstimator(harmonics=known)
        estimator.extend(angle, reading)
        assert estimator.estimate.value == pytest.approx(TRUE, abs=1e-3)


@pytest.mark.parametrize(
    "call", [lambda known: fit_circle(TURN, READ, harmonics=known), lambda k: GeometryEstimator(harmonics=k)]
)
@pytest.mark.parametrize("upr", [1, 2.5, -3])
def test_form_that_is_none(call, upr):
    with pytest.raises(
        ValueError, match=rf"harmonics upr must be a whole number >= 2 \(1\); got {float(upr)}"
    ):
        call({upr: (0.1, 0.0)})


def test_form_as_large_as_the_part():
    with pytest.raises(
        ValueError, match=r"harmonics amplitude must be < .*, the least reading \(mm\); got 70\.0"
    ):
        fit_circle(TURN, READ, harmonics={3: (70.0, 0.0)})
    with pytest.raises(ValueError, match="harmonics must hold arrays of one length"):
        fit_circle(
            TURN, READ, harmonics=type("Known", (), {"upr": [2, 3], "amplitude": [0.1], "phase": [0.0]})()
        )


def test_prior_is_weighed_with_all_of_the_noise():
    """Where noise is correlated the radius known counts for more; its own sd is not inflated."""
    arc = np.radians(np.arange(121.0))
    reading = circle_reading(arc, RADIUS, OFFSET, PHI) + faded(0.88, 121, 1, 3)[0]
    free, held = fit_circle(arc, reading), fit_circle(arc, reading, radius_prior=(RADIUS, 0.001))
    assert free.inflation > 2 and free.radius_sd > 0.01
    assert held.radius_sd == pytest.approx(0.001, rel=0.02) and held.radius == pytest.approx(
        RADIUS, abs=0.002
    )
