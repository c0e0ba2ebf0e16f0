"""Robust fits: spikes of dust do not move the centre, the covariance stays true, results repeat."""

import numpy as np
import pytest
from circle_inside import fit_kernels as fit
from circle_inside import robust_kernels as robust
from circle_inside import triples
from scipy.optimize import least_squares

from centering.circle import circle_derivatives, circle_reading, fit_circle
from sdpgrind.base.compiling.compiled import opened

RADIUS, OFFSET, PHI, SIGMA = 61.94, 3.6, 0.7, 0.01
LOSSES = ("huber", "soft_l1")


def arc_of(degrees, start=40.0):
    return np.radians(start + np.arange(degrees + 1 if degrees < 360 else 360))


def truth(offset):
    return np.array([RADIUS, offset * np.cos(PHI), offset * np.sin(PHI)])


def bound(angle, offset):
    """Cramer-Rao covariance of radius and centre without spikes."""
    back = np.eye(3)
    back[1:, 1:] = [[np.cos(PHI), -offset * np.sin(PHI)], [np.sin(PHI), offset * np.cos(PHI)]]
    slopes = circle_derivatives(angle, RADIUS, offset, PHI)
    return SIGMA**2 * back @ np.linalg.inv(slopes.T @ slopes) @ back.T


def spiked(angle, offset, share, rng, burst=False):
    """Readings with noise, a share of them 50 to 150 standard deviations too high."""
    reading = circle_reading(angle, RADIUS, offset, PHI) + rng.normal(0, SIGMA, angle.size)
    count = round(share * angle.size)
    hit = (
        (rng.integers(angle.size) + np.arange(count)) % angle.size
        if burst
        else rng.choice(angle.size, count, replace=False)
    )
    reading[hit] += rng.uniform(50, 150, count) * SIGMA
    return reading


def trials(angle, offset, share, loss, seeds, burst=False):
    """Errors (seeds, 3), mean of e' C^-1 e/2 of the centre, readings found to count for less than half."""
    rng, errors, chi, away = np.random.default_rng(11), np.empty((seeds, 3)), 0.0, 0
    for k in range(seeds):
        found = fit_circle(angle, spiked(angle, offset, share, rng, burst), loss=loss)
        errors[k] = found.value - truth(offset)
        chi += errors[k, 1:] @ np.linalg.solve(found.covariance[1:, 1:], errors[k, 1:]) / 2 / seeds
        away += found.down_weighted / seeds
    return errors, chi, away


def over_bound(errors, angle, offset):
    """Root mean square error of the centre over the bound."""
    return np.sqrt(np.mean(np.sum(errors[:, 1:] ** 2, axis=1)) / np.trace(bound(angle, offset)[1:, 1:]))


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("share", [0.05, 0.1])
@pytest.mark.parametrize(
    ("degrees", "offset"),
    [(90, OFFSET), (120, OFFSET), (180, OFFSET), (270, OFFSET), (360, OFFSET), (360, 0.9 * RADIUS)],
)
def test_spikes(loss, share, degrees, offset):
    """At most three times the bound is wanted; 1.3 times is had. The covariance is true, the spikes are
    counted.
    """
    angle = arc_of(degrees)
    errors, chi, away = trials(angle, offset, share, loss, 150)
    assert over_bound(errors, angle, offset) < 1.3
    assert chi == pytest.approx(1.0, abs=0.3)  # the mean of 150 scatters by 0.085
    spikes = round(share * angle.size)
    # the normal ones beyond 2.3 or 2.7 scales join them
    assert spikes <= away < spikes + 0.025 * angle.size + 0.5
    plain = [
        fit_circle(angle, spiked(angle, offset, share, np.random.default_rng(k))).value - truth(offset)
        for k in range(40)
    ]
    assert over_bound(np.array(plain), angle, offset) > 5


@pytest.mark.parametrize("burst", [False, True])
@pytest.mark.parametrize("degrees", [90, 360])
def test_survives_thirty_percent(degrees, burst):
    """In one place or anywhere; a fit without them would have 1.2 times the bound where they lie anywhere."""
    angle = arc_of(degrees)
    errors, chi, _ = trials(angle, OFFSET, 0.3, "huber", 150, burst)
    assert over_bound(errors, angle, OFFSET) < (3.0 if burst else 1.5)
    assert chi == pytest.approx(1.0, abs=0.35)


def test_dust_does_not_push_the_radius():
    """It only adds: a loss that merely bounds its influence would leave 0.18 sigma at 10 %, 3.5 times the sd
    of the radius.
    """
    angle = arc_of(360)
    errors, _, _ = trials(angle, OFFSET, 0.1, "huber", 150)
    assert abs(errors[:, 0].mean()) < 4 * np.sqrt(bound(angle, OFFSET)[0, 0] / 150) + 0.01 * SIGMA


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("degrees", [90, 360])
def test_without_spikes_little_is_lost(loss, degrees):
    angle = arc_of(degrees)
    errors, chi, _ = trials(angle, OFFSET, 0.0, loss, 400)
    # 1.026 in the long run; the estimate of it scatters by 3.5 %
    assert over_bound(errors, angle, OFFSET) < 1.12
    assert chi == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("degrees", [60, 360])
def test_against_scipy(loss, degrees):
    """The least loss at the scale found, which is that of the median absolute residual."""
    angle, rng = arc_of(degrees), np.random.default_rng(3)
    reading = circle_reading(angle, RADIUS, OFFSET, PHI, 3.75) + SIGMA * rng.standard_t(8, angle.size)
    found = fit_circle(angle, reading, tip_radius=3.75, loss=loss)
    left = reading - found.reading(angle)
    assert np.abs(left).max() < robust.FAR * found.noise_sd  # or the two would differ
    scale = (
        1.4826022185056018 * np.sort(np.abs(left))[angle.size // 2] * np.sqrt(angle.size / (angle.size - 3))
    )
    assert found.noise_sd == pytest.approx(scale, rel=1e-3)

    def rows(q):
        return circle_reading(angle, q[0], q[1], q[2], 3.75) - reading

    twin = least_squares(
        rows,
        [RADIUS, OFFSET, PHI],
        loss=loss,
        f_scale=1.345 * found.noise_sd,
        x_scale=[1, 1, 0.3],
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    within = 0.01 * found.center_sd
    assert [found.radius, found.offset, OFFSET * found.offset_angle] == pytest.approx(
        [*twin.x[:2], OFFSET * twin.x[2]], abs=within
    )


def test_huber_covariance_by_hand():
    angle, rng = arc_of(120), np.random.default_rng(8)
    reading = spiked(angle, OFFSET, 0.08, rng)
    found = fit_circle(angle, reading, loss="huber")
    z = (reading - found.reading(angle)) / found.noise_sd
    z = z[np.abs(z) <= 6]
    score, slope = np.clip(z, -1.345, 1.345), np.mean(np.abs(z) <= 1.345)
    factor = (1 + 3 / z.size * (1 - slope) / slope) ** 2 * np.sum(score**2) / (z.size - 3) / slope**2
    kept = angle[np.abs(reading - found.reading(angle)) <= 6 * found.noise_sd]
    wanted = bound(kept, OFFSET) * (found.noise_sd / SIGMA) ** 2 * factor
    assert found.covariance == pytest.approx(wanted, rel=0.02)
    assert found.freedom == pytest.approx(slope * z.size - 3)


def test_results_repeat_and_order_does_not_matter():
    angle, rng = arc_of(180), np.random.default_rng(2)
    reading = spiked(angle, OFFSET, 0.2, rng)
    first, order = fit_circle(angle, reading, loss="huber"), rng.permutation(angle.size)
    assert fit_circle(angle, reading, loss="huber") == first
    mixed = fit_circle(angle[order], reading[order], loss="huber")
    assert mixed.value == pytest.approx(first.value, abs=1e-3 * first.center_sd)


@pytest.mark.parametrize("loss", LOSSES)
def test_exact_without_noise(loss):
    """A share of spikes on noiseless readings leaves nothing of them."""
    angle = arc_of(120)
    reading = circle_reading(angle, RADIUS, OFFSET, PHI)
    assert fit_circle(angle, reading, loss=loss).value == pytest.approx(truth(OFFSET), abs=1e-9)
    reading[::4] += 0.5
    assert fit_circle(angle, reading, loss=loss).value == pytest.approx(truth(OFFSET), abs=1e-9)


def test_prior_and_known_noise():
    """The prior joins as another reading: errors are those that the covariance says."""
    angle, rng, chi = arc_of(30), np.random.default_rng(6), 0.0
    for _ in range(300):
        true = rng.normal(RADIUS, 0.05)
        reading = circle_reading(angle, true, OFFSET, PHI) + rng.normal(0, SIGMA, angle.size)
        reading[rng.choice(angle.size, 2, replace=False)] += 1.0
        found = fit_circle(angle, reading, loss="huber", radius_prior=(RADIUS, 0.05), noise_sd=SIGMA)
        away = found.value - [true, *truth(OFFSET)[1:]]
        chi += away @ np.linalg.solve(found.covariance, away) / 3 / 300
    assert found.noise_sd >= SIGMA
    assert chi == pytest.approx(1.0, abs=0.25)
    assert found.center_sd < 0.3 * fit_circle(angle, reading, loss="huber", noise_sd=SIGMA).center_sd


def test_what_is_far_off_is_judged_by_the_readings():
    """Form above a known noise is no dust: nothing is left out."""
    angle = arc_of(360)
    reading = circle_reading(angle, RADIUS, OFFSET, PHI) + 0.02 * np.cos(7 * angle)
    found = fit_circle(angle, reading, loss="huber", noise_sd=0.001)
    assert found.down_weighted == 0
    assert found.value == pytest.approx(truth(OFFSET), abs=1e-9)  # form of 7 upr over a turn pulls to no side
    spread = fit_circle(angle, reading, loss="huber").noise_sd
    # half of a wave lies above the sine of 45 degrees
    assert spread == pytest.approx(0.02 * np.sqrt(0.5) * 1.4826, rel=0.02)


@pytest.mark.parametrize("loss", LOSSES)
def test_the_axis_outside_of_the_part(loss):
    """No three readings have a circle about the axis: the plain start is taken, and stays at the edge."""
    angle = np.linspace(-0.1, 0.1, 21)
    reading = 20 * np.cos(angle) + np.sqrt(5.8**2 - (20 * np.sin(angle)) ** 2)
    found = fit_circle(angle, reading, loss=loss, throw=False)
    assert not found.ok and np.all(np.isfinite(found.value)) and np.all(np.isinf(found.sd))
    with pytest.raises(ValueError, match="the spindle's axis"):
        fit_circle(angle, reading, loss=loss)


def test_least_median():
    angle, rng = arc_of(90), np.random.default_rng(4)
    reading = spiked(angle, OFFSET, 0.3, rng)
    data, circle, chosen = opened(fit._prepared)(angle, reading, np.zeros(91)), np.zeros(3), triples(angle)
    found = opened(robust._least_median)(data, chosen, circle)
    points, best = reading * np.exp(1j * angle), np.inf
    for a, b, c in chosen:
        w = (points[c] - points[a]) / (points[b] - points[a])
        centre = points[a] + (points[b] - points[a]) * (w - abs(w) ** 2) / (2j * w.imag)
        radius = abs(centre - points[a])
        if radius <= abs(centre):
            continue
        left = reading - circle_reading(angle, radius, abs(centre), np.angle(centre))
        best = min(best, np.sort(np.abs(left))[91 // 2 + 1])
    assert found == pytest.approx(best, rel=1e-6)


@pytest.mark.parametrize("loss", [robust.HUBER, robust.SOFT_L1])
def test_weigh_and_sift(loss):
    rng = np.random.default_rng(5)
    left = np.append(rng.normal(0, 0.01, 80), [0.5, -0.7, 0.06])
    kept, weight, result = np.zeros(83, dtype=bool), np.zeros(83), np.zeros(fit.RESULT)
    scale = opened(robust._sifted)(left, 0.02, kept)
    inner = np.abs(left[np.abs(left) <= 0.12])
    assert kept.sum() == inner.size == 81
    assert scale == pytest.approx(1.4826 * np.sort(inner)[40] * np.sqrt(81 / 78), rel=1e-4)
    mean = opened(robust._weigh)(left, scale, loss, kept, weight, result)
    z = np.where(kept, left, 0.0) / scale
    bend = robust.BEND
    score = np.clip(z, -bend, bend) if loss == robust.HUBER else z / np.sqrt(1 + (z / bend) ** 2)
    step = 1e-6
    further = (
        np.clip(z + step, -bend, bend)
        if loss == robust.HUBER
        else (z + step) / np.sqrt(1 + ((z + step) / bend) ** 2)
    )
    assert mean == pytest.approx(np.mean((further - score)[kept]) / step, abs=1e-5)
    assert weight[kept] ** 2 * z[kept] == pytest.approx(score[kept])
    assert np.all(weight[~kept] == 0)
    assert result[fit.AWAY] == np.sum(weight**2 < 0.5)


@pytest.mark.parametrize("count", [7, 8, 10, 15, 20])
@pytest.mark.parametrize("loss", LOSSES)
def test_few_readings(loss, count):
    """A circle through three of them must not have the others taken for dust: of 7, 36 in 2000 had no
    scatter, 10 % missed.
    """
    angle, rng = np.arange(count) * 2 * np.pi / count, np.random.default_rng(count)
    clean, out = circle_reading(angle, RADIUS, OFFSET, PHI), 0
    for _ in range(600):
        found = fit_circle(angle, clean + rng.normal(0, SIGMA, count), loss=loss)
        assert found.center_sd > 0.02 * SIGMA
        out += np.hypot(*(found.value - truth(OFFSET))[1:]) > found.uncertainty(0.99, joint=True)
    assert out <= 15  # 6 are expected; 1.35 % at worst over 2000


def test_triples_are_spread_and_fixed():
    angle = np.random.default_rng(0).permutation(arc_of(90))
    chosen = triples(angle)
    half = len(chosen) // 2
    assert np.array_equal(chosen, triples(angle))
    assert np.all(np.ptp(angle[chosen[:half]], axis=1) > np.radians(29))
    assert all(len(set(row)) == 3 for row in chosen.tolist())
