"""The exact curve fitted to a batch: exact without noise, as good as any estimate can be with it, and what it
refuses.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from circle_inside import fit_kernels as at
from circle_inside import formed
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from centering.circle import circle_derivatives, circle_reading, fit_circle
from sdpgrind.base.compiling.compiled import opened
from sdpgrind.identify import Status

RADIUS, OFFSET, PHI, SIGMA = 61.94, 3.6, 0.7, 0.01
FAR = 0.95 * RADIUS
ARCS = (60, 90, 120, 180, 270, 360)


def arc_of(degrees, start=0.0):
    """One reading a degree; both ends of an arc, a turn without its end."""
    return np.radians(start + np.arange(degrees + 1 if degrees < 360 else 360))


def centre(offset, direction=PHI):
    return np.array([offset * np.cos(direction), offset * np.sin(direction)])


def bound(angle, offset, sigma=SIGMA, direction=PHI):
    """Cramer-Rao covariance of radius, offset and offset angle."""
    slopes = circle_derivatives(angle, RADIUS, offset, direction)
    return sigma**2 * np.linalg.inv(slopes.T @ slopes)


def centre_sd(angle, offset, sigma=SIGMA, direction=PHI):
    """Worst-direction sd of the centre, from the covariance of offset and angle."""
    back = np.array(
        [[np.cos(direction), -offset * np.sin(direction)], [np.sin(direction), offset * np.cos(direction)]]
    )
    return np.sqrt(np.linalg.eigvalsh(back @ bound(angle, offset, sigma, direction)[1:, 1:] @ back.T)[-1])


@pytest.mark.parametrize("degrees", [45, 60, 90, 180, 360])
@pytest.mark.parametrize("share", [0.0, 0.05, 0.5, 0.9, 0.95])
@pytest.mark.parametrize("tip", [0.0, 3.75])
def test_exact_without_noise(degrees, share, tip):
    """To 1e-9 mm from every start angle."""
    wanted, worst = np.array([RADIUS, *centre(share * RADIUS)]), 0.0
    for start in range(0, 360, 10):
        angle = arc_of(degrees, start)
        found = fit_circle(angle, circle_reading(angle, RADIUS, share * RADIUS, PHI, tip), tip_radius=tip)
        worst = max(worst, np.abs(found.value - wanted).max())
    assert worst < 1e-9


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 0.95), direction=st.floats(-3.0, 3.0))
def test_order_repeats_gaps_and_turns_do_not_matter(seed, share, direction):
    rng = np.random.default_rng(seed)
    angle = np.concatenate([rng.uniform(0, 2, 30), rng.uniform(3.5, 5, 30)])
    angle = rng.permutation(
        np.concatenate([angle, angle[:20], angle[:20] + 2 * np.pi * rng.integers(-3, 4, 20)])
    )
    found = fit_circle(angle, circle_reading(angle, RADIUS, share * RADIUS, direction))
    assert found.value == pytest.approx(np.array([RADIUS, *centre(share * RADIUS, direction)]), abs=1e-9)


@given(shift=st.floats(-3.0, 3.0), seed=st.integers(0, 1000))
@settings(max_examples=40, deadline=None)
def test_turning_the_zero_turns_the_centre(shift, seed):
    rng = np.random.default_rng(seed)
    angle = arc_of(120)
    reading = circle_reading(angle, RADIUS, OFFSET, PHI) + rng.normal(0, SIGMA, angle.size)
    one, other = fit_circle(angle, reading), fit_circle(angle + shift, reading)
    assert other.offset == pytest.approx(one.offset, abs=1e-7) and other.radius == pytest.approx(
        one.radius, abs=1e-7
    )
    assert np.angle(np.exp(1j * (other.offset_angle - one.offset_angle - shift))) == pytest.approx(
        0.0, abs=1e-7
    )
    assert other.center_sd == pytest.approx(one.center_sd, rel=1e-5)


def rmse_over_bound(angle, offset, seeds=2000):
    """Root mean square errors of radius, offset and angle over the Cramer-Rao bound; mean of e' C^-1 e/3."""
    clean, rng = circle_reading(angle, RADIUS, offset, PHI), np.random.default_rng(7)
    form, result, wanted = np.zeros(angle.size), np.zeros(at.RESULT), np.array([RADIUS, *centre(offset)])
    left = np.zeros(angle.size + 1)
    errors, chi = np.empty((seeds, 3)), 0.0
    for k in range(seeds):
        ended = at.fit_exact(
            angle, clean + rng.normal(0, SIGMA, angle.size), form, 0.0, np.inf, 0.0, left, result
        )
        assert ended == at.FITTED
        radius, x, y = result[:3]
        errors[k] = radius - RADIUS, np.hypot(x, y) - offset, np.angle(np.exp(1j * (np.arctan2(y, x) - PHI)))
        away = result[:3] - wanted
        chi += (
            away
            @ np.linalg.solve(result[at.UNIT] ** 2 * result[at.INVERSE :].reshape(3, 3), away)
            / 3
            / seeds
        )
    return np.sqrt(np.mean(errors**2, axis=0) / np.diag(bound(angle, offset))), chi


@pytest.mark.parametrize(
    ("degrees", "start", "offset"),
    [
        *((degrees, 0, OFFSET) for degrees in ARCS),
        (60, 200, OFFSET),
        (60, 0, FAR),
        (120, 300, FAR),
        (360, 0, FAR),
    ],
)
def test_efficient(degrees, start, offset):
    """Within 5 % of the bound; the root mean square of 2000 errors scatters by 1.6 %. The covariance is true
    too.
    """
    angle = arc_of(degrees, start)
    ratio, chi = rmse_over_bound(angle, offset)
    assert np.abs(ratio - 1).max() < 0.05
    freedom = angle.size - 3
    assert chi == pytest.approx(freedom / (freedom - 2), abs=0.045)  # the mean of F with 3 and so many


LIMITS = {30: 187, 45: 70, 60: 35, 90: 13, 120: 6.5, 180: 2.6, 270: 1.1, 360: 0.745}


@pytest.mark.parametrize("degrees", LIMITS)
def test_information_limit(degrees):
    """Published sd of the centre (um) in the worst direction; the estimate's own covariance says the same."""
    angle = arc_of(degrees)
    directions = np.radians(np.arange(0, 360, 2))
    sds = [centre_sd(angle, OFFSET, direction=direction) for direction in directions]
    worst = directions[int(np.argmax(sds))]
    last = 0.5 if LIMITS[degrees] > 30 else 0.05 if LIMITS[degrees] > 1 else 5e-4
    last = 0.5 if degrees == 90 else last
    assert 1e3 * max(sds) == pytest.approx(LIMITS[degrees], abs=1.02 * last)
    found = fit_circle(angle, circle_reading(angle, RADIUS, OFFSET, worst), noise_sd=SIGMA)
    assert found.center_sd == pytest.approx(max(sds), rel=1e-6)
    assert found.freedom == np.inf


def test_the_far_side_carries_the_information():
    """At 0.95 R an arc of 120 deg has 0.7 mm on the wrong side, 1.5 um on a lucky one."""
    sds = [centre_sd(arc_of(120, start), FAR) for start in range(0, 360, 2)]
    assert max(sds) == pytest.approx(0.7, abs=0.05) and min(sds) < 0.0015


PRIORS = {
    30: (664, 555, 100, 46.4),
    60: (124, 123, 80, 17.1),
    90: (46.7, 46.6, 43.1, 9.74),
    180: (9.57, 9.57, 9.56, 4.93),
    360: (2.98, 2.98, 2.98, 2.98),
}


@pytest.mark.parametrize("degrees", PRIORS)
def test_a_radius_prior(degrees):
    """Published sd of the centre (um) at 40 um noise: no prior, radius known to 1 mm, to 0.1 mm, from a turn
    before.
    """
    angle, turn = arc_of(degrees), arc_of(360)
    reading = circle_reading(angle, RADIUS, 0.01, PHI)
    before = fit_circle(turn, circle_reading(turn, RADIUS, 3.0, 2.0), noise_sd=0.04)
    priors = None, (RADIUS, 1.0), (RADIUS, 0.1), (before.radius, before.radius_sd)
    found = [fit_circle(angle, reading, noise_sd=0.04, radius_prior=prior) for prior in priors]
    assert [1e3 * one.center_sd for one in found] == pytest.approx(PRIORS[degrees], rel=0.006)


def test_a_prior_is_one_more_reading():
    """Twin: least squares with the prior as a row, its weight from the noise."""
    angle, rng = arc_of(60), np.random.default_rng(3)
    reading = circle_reading(angle, RADIUS, OFFSET, PHI) + rng.normal(0, SIGMA, angle.size)

    def rows(q):
        curve = circle_reading(angle, q[0], np.hypot(q[1], q[2]), np.arctan2(q[2], q[1]))
        return np.append((curve - reading) / (2 * SIGMA), (q[0] - 62.0) / 0.02)

    twin = least_squares(rows, [RADIUS, *centre(OFFSET)], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    found = fit_circle(angle, reading, radius_prior=(62.0, 0.02), noise_sd=2 * SIGMA)
    assert found.value == pytest.approx(twin.x, abs=1e-6)
    assert found.covariance == pytest.approx(np.linalg.inv(twin.jac.T @ twin.jac), rel=1e-4)


def test_a_prior_with_noise_unknown():
    """The weight of the prior rests on the noise that is left; degrees of freedom are between m - 3 and m -
    2.
    """
    angle, rng = arc_of(30), np.random.default_rng(5)
    errors = []
    for _ in range(600):
        true = rng.normal(RADIUS, 0.05)
        reading = circle_reading(angle, true, OFFSET, PHI) + rng.normal(0, SIGMA, angle.size)
        found = fit_circle(angle, reading, radius_prior=(RADIUS, 0.05))
        assert angle.size - 3 < found.freedom < angle.size - 2 or found.inflation > 1
        away = found.value - [true, *centre(OFFSET)]
        errors.append(away @ np.linalg.solve(found.covariance, away) / 3)
    free = angle.size - 2
    assert np.mean(errors) == pytest.approx(free / (free - 2), abs=0.12)  # F with 3 and about m - 2


def test_against_scipy():
    angle, rng = arc_of(90), np.random.default_rng(1)
    reading = circle_reading(angle, RADIUS, FAR, PHI, 3.75) + rng.normal(0, SIGMA, angle.size)

    def rows(q):
        return circle_reading(angle, q[0], q[1], q[2], 3.75) - reading

    twin = least_squares(rows, [RADIUS, FAR, PHI], x_scale=[1, 1, 0.01], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    found = fit_circle(angle, reading, tip_radius=3.75)
    assert [found.radius, found.offset, found.offset_angle] == pytest.approx(twin.x, abs=1e-6)
    noise = np.sqrt(2 * twin.cost / (angle.size - 3))
    assert found.noise_sd == pytest.approx(noise, rel=1e-9)
    assert found.freedom == angle.size - 3
    sds = noise * np.sqrt(np.diag(np.linalg.inv(twin.jac.T @ twin.jac)))
    assert [found.radius_sd, found.offset_sd, found.offset_angle_sd] == pytest.approx(sds, rel=1e-4)


def test_standard_errors_over_a_turn():
    """Section 6: se(d) = s sqrt(2/m), se(phi) = se(d)/d, se(R) = s/sqrt(m), for a small offset."""
    angle, rng = arc_of(360), np.random.default_rng(2)
    found = fit_circle(angle, circle_reading(angle, RADIUS, 0.05, PHI) + rng.normal(0, SIGMA, 360))
    s = found.noise_sd
    assert found.offset_sd == pytest.approx(s * np.sqrt(2 / 360), rel=1e-3)
    assert found.offset_angle_sd == pytest.approx(found.offset_sd / found.offset, rel=1e-3)
    assert found.radius_sd == pytest.approx(s / np.sqrt(360), rel=1e-3)


LOBES = {2: (0.02, 0.4), 3: (0.05, 2.0), 17: (0.004, 1.0)}


def lobed(part_angle, tip=0.0):
    """Angle and reading of points of a lobed part, exactly."""
    height = RADIUS + tip + sum(a * np.cos(n * part_angle - phase) for n, (a, phase) in LOBES.items())
    point = OFFSET * np.exp(1j * PHI) + height * np.exp(1j * part_angle)
    return np.angle(point), np.abs(point) - tip


@pytest.mark.parametrize("degrees", [90, 360])
@pytest.mark.parametrize("loss", ["linear", "huber"])
def test_known_form_is_subtracted(degrees, loss):
    angle, reading = lobed(arc_of(degrees), 3.75)
    rough = fit_circle(angle, reading, tip_radius=3.75, loss=loss)
    assert np.abs(rough.value - [RADIUS, *centre(OFFSET)]).max() > (1e-3 if degrees == 90 else 1e-6)
    upr, pairs = np.array(list(LOBES)), np.array(list(LOBES.values()))
    spectrum = SimpleNamespace(upr=upr, amplitude=pairs[:, 0], phase=pairs[:, 1])
    for known in (LOBES, spectrum):
        found = fit_circle(angle, reading, tip_radius=3.75, harmonics=known, loss=loss)
        assert found.value == pytest.approx(np.array([RADIUS, *centre(OFFSET)]), abs=1e-9)
    empty = fit_circle(angle, reading, tip_radius=3.75, harmonics={}, loss=loss)
    assert empty == rough


def test_form_is_laid_about_the_part():
    """At its own centre the angle of the part counts, wherever the spindle is."""
    part_angle = np.linspace(-3, 3, 7)
    angle, reading = lobed(part_angle)
    parts = np.array([[3.0, 0.05 * np.cos(2.0), 0.05 * np.sin(2.0)]])
    found = formed(angle, reading, np.array([RADIUS, *centre(OFFSET)]), parts)
    assert found == pytest.approx(0.05 * np.cos(3 * part_angle - 2.0), abs=1e-12)


@pytest.mark.parametrize(
    ("angle", "covered"),
    [
        (arc_of(90), np.pi / 2),
        (arc_of(360), 2 * np.pi * 359 / 360),
        (np.concatenate([arc_of(60), arc_of(60, 180)]), 2 * np.pi / 3),
        (np.concatenate([arc_of(360), arc_of(360, 360), arc_of(180, 720)]), 5 * np.pi),
        (np.repeat(arc_of(90), 3)[::-1], np.pi / 2),
        (np.zeros(4), 0.0),
    ],
)
def test_swept(angle, covered):
    assert at.swept(np.sort(angle)) == pytest.approx(covered, abs=1e-12)
    shown = np.random.default_rng(0).permutation(angle)
    if len(set(shown)) > 3:
        assert fit_circle(shown, circle_reading(shown, RADIUS, OFFSET, PHI)).swept == pytest.approx(
            covered, abs=1e-12
        )


def test_what_an_estimate_rests_on():
    angle = arc_of(90)
    found = fit_circle(angle, circle_reading(angle, RADIUS, OFFSET, PHI, 2.0), tip_radius=2.0)
    assert (found.samples, found.tip_radius, found.model, found.down_weighted) == (91, 2.0, "exact", 0)
    assert found.swept == pytest.approx(np.pi / 2)
    assert found.status is Status.OK and found.reading(angle) == pytest.approx(
        circle_reading(angle, RADIUS, OFFSET, PHI, 2.0)
    )


def test_readings_that_do_not_tell():
    angle = np.array([0.0, 1e-9, 2e-9, 3e-9, 0.5]) * 3
    found = fit_circle(angle, circle_reading(angle, RADIUS, OFFSET, PHI), throw=False)
    assert (
        found.status is Status.UNDETERMINED
        and np.all(np.isinf(found.sd))
        and np.all(np.isfinite(found.value))
    )
    assert "the readings do not tell" in found.message and "from the others" in found.message
    with pytest.raises(ValueError, match="turn the part further"):
        fit_circle(angle, circle_reading(angle, RADIUS, OFFSET, PHI))


def test_the_axis_outside_of_the_part():
    """Readings of a curve that no circle about the axis has (d >= R: there is no part)."""
    angle = np.linspace(-0.1, 0.1, 21)
    reading = 20 * np.cos(angle) + np.sqrt(5.8**2 - (20 * np.sin(angle)) ** 2)
    found = fit_circle(angle, reading, throw=False)
    assert (
        found.status is Status.IMPOSSIBLE and np.all(np.isinf(found.sd)) and np.all(np.isfinite(found.value))
    )
    with pytest.raises(ValueError, match=r"offset must be < radius \(mm\).*lead to .*bad readings"):
        fit_circle(angle, reading)


GOOD = arc_of(90)
READ = circle_reading(GOOD, RADIUS, OFFSET, PHI)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: fit_circle(GOOD, READ[:-1]),
            r"angle and reading must be one-dimensional of one length; got shapes \(91,\) and",
        ),
        (
            lambda: fit_circle(GOOD, np.where(GOOD > 1, np.nan, READ)),
            r"reading\[58\] must be finite \(mm\); got nan",
        ),
        (
            lambda: fit_circle(np.append(GOOD[:-1], np.inf), READ),
            r"angle\[90\] must be finite \(rad\); got inf",
        ),
        (lambda: fit_circle(GOOD, READ - 65.5), r"reading\[90\] must be > 0 \(mm\); got -"),
        (lambda: fit_circle(GOOD[:2], READ[:2]), r"angle must be at least 3 angles; got 2"),
        (
            lambda: fit_circle(GOOD[:3], READ[:3]),
            r"angle must be at least 4 different angles, with their readings; got 3",
        ),
        (
            lambda: fit_circle(np.tile(GOOD[:2], 5), np.tile(READ[:2], 5), noise_sd=0.01),
            r"at least 3 different angles.*got 2",
        ),
        (
            lambda: fit_circle([0.0, 0.0, 2 * np.pi, 0.0], READ[:4], noise_sd=0.01),
            r"at least 3 different angles.*got 1",
        ),
        (
            lambda: fit_circle(np.arange(0.0, 360.0), np.tile(READ, 4)[:360]),
            r"a span of 359, with 360 readings, smells of degrees",
        ),
        (
            lambda: fit_circle(90 * GOOD, READ, turns=1),
            r"angle must span at most 1 turns, 6\.28319 rad; got 141.*in degrees\?",
        ),
        (lambda: fit_circle(GOOD, READ, turns=0), r"turns must be > 0"),
        (lambda: fit_circle(GOOD, READ, tip_radius=-1.0), r"tip_radius must be >= 0 \(mm\); got -1\.0"),
        (lambda: fit_circle(GOOD, READ, noise_sd=-0.1), r"noise_sd must be > 0 \(mm\); got -0\.1"),
        (
            lambda: fit_circle(GOOD, READ, radius_prior=(-1.0, 0.1)),
            r"radius_prior\[0\] must be > 0 \(mm\); got -1\.0",
        ),
        (
            lambda: fit_circle(GOOD, READ, radius_prior=(61.9, -0.1)),
            r"radius_prior\[1\] must be > 0 \(mm\); got -0\.1",
        ),
        (
            lambda: fit_circle(GOOD, READ, loss="cauchy"),
            r"loss must be one of linear, huber, soft_l1; got 'cauchy'",
        ),
        (
            lambda: fit_circle(GOOD, READ, harmonics={2: 0.1}),
            r"harmonics must be upr -> \(amplitude, phase\)",
        ),
        (
            lambda: fit_circle(GOOD[:5], READ[:5], loss="huber"),
            r"reading must be at least 6 readings for loss 'huber'; got 5",
        ),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: fit_circle(GOOD, READ, radius_prior=61.9),
            r"radius_prior must be a pair: .*\(mm\); got 61\.9",
        ),
        (
            lambda: fit_circle(GOOD, READ, harmonics=3),
            r"harmonics must be a spectrum with .*, or upr -> \(ampl.*; got 3",
        ),
        (lambda: fit_circle("a", READ), r"angle must be numbers \(rad\); got 'a'"),
    ],
)
def test_bad_kinds(call, message):
    with pytest.raises(TypeError, match=message):
        call()


def test_many_turns_of_one_reading_a_radian_are_legal_when_said():
    angle = np.arange(60.0)
    found = fit_circle(angle, circle_reading(angle, RADIUS, OFFSET, PHI), turns=10)
    assert found.radius == pytest.approx(RADIUS, abs=1e-9)


def test_triangle_is_a_qr():
    rng = np.random.default_rng(0)
    rows, upper, out, result = rng.normal(size=(4, 30)), np.zeros((3, 4)), np.zeros(3), np.zeros(at.RESULT)
    matrix, goal = rows[:3].T.copy(), rows[3].copy()
    opened(at._orthonormalize)(rows, upper)
    assert opened(at._solved)(upper, out)
    assert out == pytest.approx(np.linalg.lstsq(matrix, goal, rcond=None)[0])
    assert rows[3] == pytest.approx(goal - matrix @ out)
    opened(at._spread)(upper, result)
    inverse = np.linalg.inv(matrix.T @ matrix)
    assert result[at.INVERSE :].reshape(3, 3) == pytest.approx(inverse)
    widened = np.sqrt(np.diag(matrix.T @ matrix) * np.diag(inverse))
    assert (result[at.CONDITION], result[at.WORST]) == (pytest.approx(widened.max()), widened.argmax())


def test_a_triangle_without_rank_is_not_solved():
    rows, upper = np.zeros((4, 5)), np.zeros((3, 4))
    rows[0] = 1.0
    opened(at._orthonormalize)(rows, upper)
    assert not opened(at._solved)(upper, np.zeros(3))


def test_slopes_and_residuals():
    angle, reading = arc_of(90), circle_reading(arc_of(90), RADIUS, OFFSET, PHI) + 0.01
    data, rows, left = (
        opened(at._prepared)(angle, reading, np.full(91, 0.01)),
        np.zeros((4, 92)),
        np.zeros(91),
    )
    circle = np.array([RADIUS, *centre(OFFSET)])
    opened(at._slopes)(data, circle - [0.01, 0, 0], np.full(91, 2.0), rows)
    to_polar = np.array(
        [[1, 0, 0], [0, np.cos(PHI), -OFFSET * np.sin(PHI)], [0, np.sin(PHI), OFFSET * np.cos(PHI)]]
    )
    assert rows[:3, :91].T @ to_polar == pytest.approx(
        2 * circle_derivatives(angle, RADIUS, OFFSET, PHI), abs=1e-12
    )
    assert opened(at._residuals)(data, circle - [0.01, 0, 0], left)
    assert left == pytest.approx(np.full(91, 0.01), abs=1e-12)
    assert not opened(at._residuals)(data, np.array([5.0, 5.0, 1.0]), left)


@pytest.mark.parametrize("size", [1, 2, 7, 360])
def test_ranked(size):
    rng = np.random.default_rng(size)
    for values in (rng.normal(size=size), rng.integers(0, 3, size).astype(float), np.zeros(size)):
        for place in (0, size // 2, size - 1):
            assert opened(at._ranked)(values.copy(), place) == np.sort(values)[place]


def test_distinct():
    assert at.distinct(np.array([0.0, 2 * np.pi, 1.0, 1.0 - 4 * np.pi, -1e-12]), 4) == 2
    assert at.distinct(np.arange(10.0), 4) == 4
