"""Spikes, parts that move, spindles that stand: what a machine does to the streaming estimator."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import hwsim
from centering.circle import GeometryEstimator, circle_derivatives, circle_reading
from sdpgrind import units
from sdpgrind.identify import Status

RADIUS, SIGMA, OFFSET, PHI = 61.94, 0.01, 3.6, 0.7
CENTER = OFFSET * np.array([np.cos(PHI), np.sin(PHI)])


def turned(degrees, start=0.0):
    return np.radians(start + np.arange(float(degrees)))


def center_bound(angle, offset=OFFSET):
    jacobian = circle_derivatives(angle, RADIUS, offset, PHI)
    covariance = np.linalg.inv(jacobian.T @ jacobian) * SIGMA**2
    return np.sqrt(covariance[1, 1] + offset**2 * covariance[2, 2])


def fitted(angle, reading, **settings):
    estimator = GeometryEstimator(**settings)
    estimator.extend(angle, reading)
    return estimator


@pytest.mark.parametrize("share", [0.05, 0.10])
@pytest.mark.parametrize("noise_sd", [None, SIGMA])
def test_dust_leaves_the_centre(share, noise_sd):
    angle, errors = turned(360), []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        clean = circle_reading(angle, RADIUS, OFFSET, PHI) + rng.normal(0.0, SIGMA, angle.size)
        dust = np.where(rng.random(angle.size) < share, rng.uniform(50, 150, angle.size) * SIGMA, 0.0)
        estimator = fitted(angle, clean + dust, noise_sd=noise_sd)
        estimate = estimator.estimate
        errors.append(np.hypot(*(estimate.value[1:] - CENTER)))
        assert estimator.restarts == 0
        # every refused reading is dust, and all dust is refused
        assert_array_equal(estimator.rejected[0], angle[dust > 0])
        assert estimate.samples + np.count_nonzero(dust) == angle.size
    # 1 is what clean readings would give
    assert np.sqrt(np.mean(np.square(errors))) < 1.1 * center_bound(angle)
    assert np.max(errors) < 3 * 1.1 * center_bound(angle) * 1.3


@pytest.mark.parametrize("spikes", [[0], [1], [2], [0, 1], [3, 4, 5], [0, 14, 29], [27, 28, 29]])
def test_a_spike_at_the_start_is_not_believed(spikes):
    angle = turned(120)
    clean = circle_reading(angle, RADIUS, OFFSET, PHI) + np.random.default_rng(1).normal(
        0.0, SIGMA, angle.size
    )
    dusty = clean.copy()
    dusty[spikes] += 1.0
    estimator = fitted(angle, dusty)
    assert_array_equal(estimator.rejected[0], angle[spikes])
    assert_array_equal(estimator.rejected[1], dusty[spikes])
    assert estimator.restarts == 0
    kept = np.delete(np.arange(120), spikes)
    assert_allclose(
        estimator.estimate.value,
        fitted(angle[kept], clean[kept]).estimate.value,
        atol=0.1 * center_bound(angle),
    )


def test_white_noise_is_not_refused():
    angle, refused = turned(720), 0
    for seed in range(50):
        reading = circle_reading(angle, RADIUS, OFFSET, PHI) + np.random.default_rng(seed).normal(
            0.0, SIGMA, angle.size
        )
        estimator = fitted(angle, reading)
        refused += estimator.rejected[0].size + estimator.restarts
    assert refused <= 1  # 36000 readings, each with 6e-7


@pytest.mark.parametrize("when", [150, 200, 400])
@pytest.mark.parametrize("direction", [0.0, 1.0, 2.5, 4.0, 5.5])
def test_a_part_that_moves_is_noticed(when, direction):
    angle = turned(when + 360)
    after = CENTER + 0.5 * np.array([np.cos(direction), np.sin(direction)])
    moved = circle_reading(angle, RADIUS, np.hypot(*after), np.arctan2(after[1], after[0]))
    still = circle_reading(angle, RADIUS, OFFSET, PHI)
    noise = np.random.default_rng(when).normal(0.0, SIGMA, angle.size)
    reading = np.where(np.arange(angle.size) < when, still, moved) + noise
    estimator = fitted(angle, reading, noise_sd=SIGMA)
    estimate = estimator.estimate
    assert estimator.restarts >= 1
    assert np.hypot(*(estimate.value[1:] - after)) < estimate.uncertainty(0.9999, joint=True)
    assert estimate.uncertainty(0.9999, joint=True) < 0.02
    assert estimator.rejected[0].size <= 10  # what was refused at the move is used after the restart


def moved_early(when, direction):
    angle = turned(when + 360)
    after = CENTER + 0.5 * np.array([np.cos(direction), np.sin(direction)])
    moved = circle_reading(angle, RADIUS, np.hypot(*after), np.arctan2(after[1], after[0]))
    still = circle_reading(angle, RADIUS, OFFSET, PHI)
    reading = np.where(np.arange(angle.size) < when, still, moved)
    return angle, reading + np.random.default_rng(when).normal(0.0, SIGMA, angle.size), after


@pytest.mark.parametrize("when", [20, 31, 50, 60, 80, 100])
def test_a_part_that_moves_is_not_believed_in(when):
    """Early moves may look like a circle of another size for a while; the band must not be trusted then.

    The readings change by 50 sd times the cosine of their angle to the move: at once, but for the 2 of 8
    directions that lie within 0.4 rad of across. There at most half of the latest 30 are taken before the
    rest begin the estimate anew."""
    believed = 0
    for direction in np.arange(0.0, 6.2, 0.8):
        angle, reading, after = moved_early(when, direction)
        estimator = GeometryEstimator(noise_sd=SIGMA)
        for a, r in zip(angle, reading, strict=True):
            estimator.update(angle=a, reading=r)
            if a >= angle[when] and estimator.valid:
                estimate = estimator.estimate
                allowed = max(0.03 * estimate.offset, 0.002)
                believed += np.hypot(*(estimate.value[1:] - after)) > 1.05 * allowed
    assert believed <= 2 * 15


@pytest.mark.parametrize("dusty", [10, 11, 12])
@pytest.mark.parametrize("begin", [0, 5, 10, 20])
def test_a_burst_of_dust_at_the_start_is_refused(dusty, begin):
    """Fewer than half of the first 30, all neighbours: some circles through three readings are of clean ones
    only.
    """
    angle, rng = turned(120), np.random.default_rng(dusty)
    begin = min(begin, 30 - dusty)
    for phi in np.arange(0.0, 6.0, 1.0):
        reading = circle_reading(angle, RADIUS, 3.0, phi) + rng.normal(0.0, 0.005, angle.size)
        reading[begin : begin + dusty] += rng.uniform(0.25, 0.75, dusty)
        assert_array_equal(fitted(angle, reading).rejected[0], angle[begin : begin + dusty])


def test_is_not_valid_while_the_newest_reading_is_refused():
    angle = turned(200)
    reading = circle_reading(angle, RADIUS, OFFSET, PHI) + np.random.default_rng(0).normal(0.0, SIGMA, 200)
    estimator = fitted(angle[:180], reading[:180])
    assert estimator.valid
    estimator.update(angle=angle[180], reading=reading[180] + 1.0)
    assert not estimator.valid
    assert "1 of the latest 30 readings disagree" in estimator.estimate.message
    estimator.update(angle=angle[181], reading=reading[181])
    assert estimator.valid


def flicker(count, seed):
    """One count of an encoder of 4000, to and fro."""
    return np.random.default_rng(seed).integers(-1, 2, count) * 2 * np.pi / 4000


@pytest.mark.parametrize("standing", [40, 100, 500])
def test_a_standing_start_is_no_circle(standing):
    """Noise of readings stands in the rows too: alone it looks like a circle of radius 0 at the surface,
    without any error.
    """
    for seed in range(20):
        angle = np.concatenate([flicker(standing, seed), turned(360)])
        noise = np.random.default_rng(100 + seed).normal(0.0, 0.001, angle.size)
        estimator = GeometryEstimator(joint=True)
        assert estimator.first_valid(angle, circle_reading(angle, 50.0, 2.0, 0.5) + noise) is not None
        estimate = estimator.estimate
        # 1 in 250 of all these tests would be wrong by chance
        assert abs(estimate.radius - 50.0) < 4 * estimate.radius_sd
        assert (
            np.hypot(estimate.center_x - 2.0 * np.cos(0.5), estimate.center_y - 2.0 * np.sin(0.5))
            < 1.2 * estimator.band
        )


def test_a_standing_spindle_tells_no_radius():
    for seed in range(20):
        rng = np.random.default_rng(seed)
        estimator = fitted(np.zeros(200), 52.0 + rng.normal(0.0, SIGMA, 200))
        estimator.reset(keep_radius=True)
        assert estimator.estimate.radius == 0.0  # nothing is known
        estimator.extend(
            turned(200), circle_reading(turned(200), 50.0, 1.0, 0.5) + rng.normal(0.0, SIGMA, 200)
        )
        assert abs(estimator.estimate.radius - 50.0) < 4.5 * estimator.estimate.radius_sd


@pytest.mark.parametrize("noise_sd", [None, SIGMA])
def test_nothing_is_refused_while_nothing_is_turned(noise_sd):
    refused = 0
    for seed in range(10):
        noise = np.random.default_rng(seed).normal(0.0, SIGMA, 2000)
        for angle in (np.zeros(2000), np.cumsum(flicker(2000, seed))[:50].repeat(40)):
            estimator = fitted(angle, circle_reading(angle, 50.0, 2.0, 0.5) + noise, noise_sd=noise_sd)
            refused += estimator.rejected[0].size + estimator.restarts
    assert refused == 0


def test_no_part_is_impossible():
    """Readings of a point far off the axis, spread over an arc: there is no part that holds the axis."""
    angle = np.linspace(-0.6, 0.6, 200)
    reading = 50.0 * np.cos(angle) - np.sqrt(40.0**2 - (50.0 * np.sin(angle)) ** 2)
    estimator = fitted(angle, reading, noise_sd=0.01)
    assert not estimator.valid
    assert estimator.estimate.offset > estimator.estimate.radius
    assert estimator.estimate.status is Status.IMPOSSIBLE
    assert "outside the part" in estimator.estimate.message


def test_a_restart_keeps_the_radius():
    angle = turned(360 + 60)
    after = CENTER + np.array([0.5, 0.0])
    moved = circle_reading(angle, RADIUS, np.hypot(*after), np.arctan2(after[1], after[0]))
    reading = np.where(np.arange(angle.size) < 360, circle_reading(angle, RADIUS, OFFSET, PHI), moved)
    reading = reading + np.random.default_rng(0).normal(0.0, SIGMA, angle.size)
    estimate = fitted(angle, reading, noise_sd=SIGMA).estimate
    alone = fitted(angle[360:], reading[360:], noise_sd=SIGMA).estimate
    assert estimate.center_sd < 0.5 * alone.center_sd


@pytest.mark.parametrize("forgetting", [1.0, 0.5, 1e-6])
def test_a_standing_spindle_forgets_nothing(forgetting):
    angle = turned(200)
    rng = np.random.default_rng(0)
    estimator = fitted(
        angle, circle_reading(angle, RADIUS, OFFSET, PHI) + rng.normal(0.0, SIGMA, 200), forgetting=forgetting
    )
    before = estimator.estimate
    estimator.extend(
        np.full(1_000_000, angle[-1]),
        circle_reading(angle[-1], RADIUS, OFFSET, PHI) + rng.normal(0.0, SIGMA, 1_000_000),
    )
    after = estimator.estimate
    assert np.all(np.isfinite(after.value))
    assert np.all(np.diag(after.covariance) <= 1.2 * np.diag(before.covariance))  # s is new
    assert after.swept == before.swept


def test_a_spindle_that_only_stands_knows_little():
    estimator = fitted(
        np.zeros(1_000_000), RADIUS + np.random.default_rng(0).normal(0.0, SIGMA, 1_000_000), forgetting=0.9
    )
    estimate = estimator.estimate
    assert not estimator.valid
    assert estimate.limited_by == "arc"
    assert np.all(np.isfinite(estimate.value))
    assert np.all(estimate.sd < 200 * RADIUS)


@pytest.mark.parametrize("jitter", [0.0, 1e-3])
def test_a_spindle_creeping_to_and_fro_stays_bounded(jitter):
    rng = np.random.default_rng(0)
    angle = np.concatenate([turned(200), np.radians(195 + 5 * np.cos(np.arange(1_000_000) * 0.02))])
    angle += rng.normal(0.0, jitter, angle.size)
    estimator = fitted(
        angle, circle_reading(angle, RADIUS, OFFSET, PHI) + rng.normal(0.0, SIGMA, angle.size), forgetting=0.3
    )
    estimate = estimator.estimate
    assert np.all(np.isfinite(estimate.value))
    assert np.all(np.isfinite(estimate.covariance))
    assert np.all(estimate.sd < 200 * RADIUS)
    # what is forgotten is not believed any more
    assert np.hypot(*(estimate.value[1:] - CENTER)) < 6 * estimate.center_sd
    assert estimate.center_sd > 3 * center_bound(turned(200))
    assert estimator.restarts == 0


def test_swept_counts_what_is_seen():
    reading = circle_reading(turned(90), RADIUS, OFFSET, PHI)
    there_and_back = np.concatenate([turned(90), turned(90)[::-1]])
    with_gap = np.concatenate([turned(20), turned(20, 200.0)])
    wrapped = np.remainder(turned(30, 340.0), 2 * np.pi)
    assert_allclose(
        fitted(wrapped, circle_reading(wrapped, RADIUS, OFFSET, PHI)).estimate.swept, units.deg(29.0)
    )
    assert_allclose(fitted(turned(90), reading).estimate.swept, units.deg(89.0))
    assert_allclose(
        fitted(there_and_back, np.concatenate([reading, reading[::-1]])).estimate.swept, units.deg(89.0)
    )
    assert_allclose(
        fitted(with_gap, circle_reading(with_gap, RADIUS, OFFSET, PHI)).estimate.swept, units.deg(39.0)
    )


def test_one_reading_that_fits_does_not_settle_a_move():
    """Two circles cross: there a reading of the moved part fits the old one."""
    ring = hwsim.Ring(62.0, offset=2.0, offset_angle=np.pi / 6)
    scan = hwsim.Probe(ring, moved=(0.3, 0.3, -0.2)).scan(turns=3, rng=1)
    estimator = GeometryEstimator(tip_radius=3.75, noise_sd=0.0015)
    told = []
    for angle, reading in zip(scan.angle[:50], scan.reading[:50], strict=True):
        estimator.update(angle=angle, reading=reading)
        told.append(estimator.estimate)
        assert not estimator.valid
    refused = estimator.rejected[0].size > 10 and any(
        "of the latest 30 readings disagree" in one.message for one in told
    )
    assert refused and {one.limited_by for one in told[-4:]} == {"outliers"}
