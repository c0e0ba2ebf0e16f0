"""The source's own estimators: against slow twins, and every distribution that its figures and tables are one
draw of.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from centering.circle import PrintedEstimator
from sdpgrind.identify import Status, random_walk_gain, random_walk_response

RUNS, TURN = 4000, 360
DEGREES = np.deg2rad(np.arange(TURN + 1.0))
WALK = {"walk_variance": 0.0005, "noise_variance": 0.03}  # (4.47)


def simulated(seed, amplitude=1.0, noise_sd=0.5, direction=np.pi / 2, runs=RUNS, angle=DEGREES[:TURN]):
    """Readings of (4.46), shape (runs, m)."""
    rng = np.random.default_rng(seed)
    return amplitude * np.cos(angle - direction) + noise_sd * rng.standard_normal((runs, angle.size))


def slow_rls(angle, reading, radius, inv_info):
    b, p = np.zeros(2), inv_info * np.eye(2)
    for k, (a, r) in enumerate(zip(angle, reading, strict=True)):
        h = np.array([np.cos(a), np.sin(a)])
        b = b + p @ h * (r - radius - h @ b) / (1 + h @ p @ h)
        p = np.linalg.inv(np.linalg.inv(p) + np.outer(h, h))
        fit = radius + b[0] * np.cos(angle[: k + 1]) + b[1] * np.sin(angle[: k + 1])
        yield radius, b, np.sum((reading[: k + 1] - fit) ** 2)


def slow_prls(angle, reading):
    for k in range(angle.size):
        rows = np.column_stack([np.ones(k + 1), np.cos(angle[: k + 1]), np.sin(angle[: k + 1])])
        b = np.linalg.lstsq(rows, reading[: k + 1], rcond=1e-9)[0]
        yield b[0], b[1:], np.sum((reading[: k + 1] - rows @ b) ** 2)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), algorithm=st.sampled_from(["rls", "prls"]), repeats=st.integers(1, 4))
def test_estimates_are_those_of_the_twin(seed, algorithm, repeats):
    rng = np.random.default_rng(seed)
    angle = np.repeat(rng.choice(np.linspace(0, 12, 40), 8), repeats)  # repeated, unsorted, several turns
    reading = 61.94 + simulated(seed, runs=1, angle=angle)[0]
    estimator = PrintedEstimator(algorithm, radius=61.9, inv_info=2.0, confidence=0.99)
    twin = slow_rls(angle, reading, 61.9, 2.0) if algorithm == "rls" else slow_prls(angle, reading)
    z = stats.norm.ppf(0.995)
    for k, (radius, center, squares) in enumerate(twin):
        estimator.update(angle=angle[k], reading=reading[k])
        found = estimator.estimate
        np.testing.assert_allclose(found.value, [radius, *center], rtol=1e-8, atol=1e-8)
        assert found.samples == k + 1
        if k >= 2:
            assert estimator.band == pytest.approx(
                2 * z * np.sqrt(squares / ((k + 1) * (k - 1))), rel=1e-6, abs=1e-6
            )
            assert found.noise_sd == pytest.approx(np.sqrt(squares / (k - 1)), rel=1e-6, abs=1e-6)


def test_shortest_solution_of_one_or_two_directions():
    estimator = PrintedEstimator("prls")
    estimator.update(angle=0.3, reading=2.0)
    np.testing.assert_allclose(estimator.estimate.value, [1.0, np.cos(0.3), np.sin(0.3)])
    assert estimator.estimate.status is Status.UNDETERMINED
    estimator.update(angle=0.3 + 2 * np.pi, reading=4.0)  # the same direction
    np.testing.assert_allclose(estimator.estimate.value, [1.5, 1.5 * np.cos(0.3), 1.5 * np.sin(0.3)])
    estimator.update(angle=-1.0, reading=1.0)
    rows = np.array([[1, np.cos(0.3), np.sin(0.3)], [1, np.cos(1.0), -np.sin(1.0)]])
    np.testing.assert_allclose(estimator.estimate.value, np.linalg.pinv(rows) @ [3.0, 1.0])
    assert estimator.band == pytest.approx(2 * stats.norm.ppf(0.9995) * np.sqrt(2.0 / 3))


def test_kalman_is_the_scalar_filter():
    reading = simulated(3, runs=1)[0]
    history = PrintedEstimator("kalman", **WALK).history(DEGREES[:TURN], reading)
    x, p, out = reading[0], 0.03, [reading[0]]
    for z in reading[1:]:
        p += 0.0005
        k = p / (p + 0.03)
        x, p = x + k * (z - x), (1 - k) * p
        out.append(x)
    most, least = np.maximum.accumulate(out), np.minimum.accumulate(out)
    np.testing.assert_allclose(history.offset, (most - least) / 2, atol=1e-12)
    np.testing.assert_allclose(history.radius, (most + least) / 2, atol=1e-12)
    assert history.offset_angle[-1] == pytest.approx(DEGREES[np.argmax(out)])
    assert not history.valid.any()
    assert np.all(np.isinf(history.band))


@pytest.mark.parametrize("algorithm", ["rls", "prls", "kalman"])
def test_one_by_one_all_at_once_and_many_parts_give_the_same_bits(algorithm):
    readings = 60.0 + simulated(4, runs=3)
    estimator = PrintedEstimator(algorithm, radius=60.0)
    history = estimator.history(DEGREES[:TURN], readings)
    assert history.offset.shape == readings.shape
    assert estimator.estimate.samples == 0
    for run, reading in enumerate(readings):
        estimator.reset()
        for k in range(100):
            estimator.update(angle=DEGREES[k], reading=reading[k])
            assert estimator.estimate.offset == pytest.approx(history.offset[run, k], rel=1e-15)
            assert (estimator.band, estimator.valid) == (history.band[run, k], history.valid[run, k])
            assert estimator.estimate.radius == history.radius[run, k]
        estimator.extend(DEGREES[100:TURN], reading[100:])
        assert estimator.band == history.band[run, -1]
        assert estimator.estimate.offset_angle == history.offset_angle[run, -1]
        assert estimator.estimate.samples == TURN


@pytest.fixture(scope="module")
def convergence():
    """Errors of amplitude (1) and phase (turns) after each reading of (4.46), by algorithm."""
    readings, out = simulated(0), {}
    for algorithm in ("rls", "prls"):
        history = PrintedEstimator(algorithm).history(DEGREES[:TURN], readings)
        phase = np.angle(np.exp(1j * (history.offset_angle - np.pi / 2))) / (2 * np.pi)
        out[algorithm] = history.offset - 1, phase
    return out


def settled(error, limit):
    """Readings from which on every error is below the limit."""
    bad = np.abs(error) >= limit
    return TURN - np.argmax(bad[:, ::-1], axis=1) + np.where(bad.any(axis=1), 1, -TURN)


@pytest.mark.parametrize(
    ("algorithm", "what", "limit", "median", "low", "high", "tolerance"),
    [
        ("rls", 0, 0.10, 92, 59, 263, 3),
        ("prls", 0, 0.10, 205, 149, 274, 3),
        ("prls", 0, 1.00, 60, 44, 90, 2),
        ("rls", 1, 0.05, 34, 13, 70, 3),
        ("prls", 1, 0.05, 100, 76, 134, 3),
    ],
)
def test_when_errors_stay_small(convergence, algorithm, what, limit, median, low, high, tolerance):
    found = settled(convergence[algorithm][what], limit)
    assert np.median(found) == pytest.approx(median, abs=tolerance)
    # Order statistics of 4000: the 5 and 95 % points scatter by a few degrees where the distribution is thin.
    np.testing.assert_allclose(np.quantile(found, [0.05, 0.95]), [low, high], atol=max(3, 0.03 * high))


def test_published_figures_are_one_draw(convergence):
    assert np.mean(settled(convergence["rls"][0], 0.1) <= 106) == pytest.approx(0.69, abs=0.03)
    assert np.mean(settled(convergence["prls"][0], 0.1) <= 190) == pytest.approx(0.35, abs=0.03)


def predicted_rmse(samples, columns, start):
    """Root mean square error of the amplitude, from the normal law of the linear estimate and its shrinkage:
    no filter run.
    """
    rows = np.column_stack([np.ones(samples), np.cos(DEGREES[:samples]), np.sin(DEGREES[:samples])])[
        :, 3 - columns :
    ]
    inverse = np.linalg.inv(rows.T @ rows + start * np.eye(columns))
    true = np.array([0.0, 0.0, 1.0])[3 - columns :]
    mean, covariance = inverse @ rows.T @ rows @ true, 0.25 * inverse @ rows.T @ rows @ inverse
    drawn = np.random.default_rng(0).multivariate_normal(mean, covariance, 200_000)
    return np.sqrt(np.mean((np.hypot(drawn[:, -2], drawn[:, -1]) - 1) ** 2))


@pytest.mark.parametrize(
    ("samples", "rls", "prls"), [(106, 0.073, 0.316), (190, 0.053, 0.108), (360, 0.0370, 0.0370)]
)
def test_amplitude_errors(convergence, samples, rls, prls):
    for algorithm, correct, columns, start in (("rls", rls, 2, 1.0), ("prls", prls, 3, 0.0)):
        found = np.sqrt(np.mean(convergence[algorithm][0][:, samples - 1] ** 2))
        assert found == pytest.approx(correct, rel=0.05)
        # Of a mean square of 4000 normal errors: 1.1 % scatter, and more where the amplitude's law has a
        # tail.
        assert found == pytest.approx(predicted_rmse(samples, columns, start), rel=0.045)


def test_with_one_basis_recursion_and_refit_are_the_same():
    # What the source calls better is the two-parameter basis and the start, not the recursion.
    reading = simulated(1, runs=1)[0]
    angle = DEGREES[:TURN]
    flat = PrintedEstimator("rls", inv_info=1e8).history(angle, reading)
    rows = np.column_stack([np.cos(angle), np.sin(angle)])
    for k in (10, 57, 200, 359):
        b = np.linalg.lstsq(rows[: k + 1], reading[: k + 1])[0]
        assert flat.offset[k] == pytest.approx(np.hypot(*b), rel=1e-5)


def test_kalman_offset_of_the_source():
    history = PrintedEstimator("kalman", **WALK).history(DEGREES[:TURN], np.cos(DEGREES[:TURN] - np.pi / 2))
    response = random_walk_response(random_walk_gain(**WALK), np.deg2rad(1.0))
    # its start has died out by the first crest
    assert 100 * (history.offset[-1] - 1) == pytest.approx(-0.9015, abs=2e-3)
    assert history.offset[-1] == pytest.approx(abs(response), abs=2e-5)
    lag = np.rad2deg(history.offset_angle[-1]) - 90
    assert lag == pytest.approx(-np.rad2deg(np.angle(response)), abs=0.5)  # to the nearest reading


def test_linear_gauge_of_noise():
    # (4.48) on bare readings: half of the range, which grows with the noise.
    readings = simulated(2, runs=400)
    assert np.mean(np.ptp(readings, axis=1) / 2) == pytest.approx(2.17, abs=0.03)


SIGMA = 0.040  # mm
Z = 3.2905267


@pytest.mark.parametrize(
    ("amplitude", "place", "expected", "published", "scatter"),
    [(20.0, 29, 48.1, 52.7, 0.13), (1.0, 76, 30.0, 29.7, 0.08), (0.1, 359, 13.9, 13.4, 0.04)],
)
def test_bands_of_table_4_6(amplitude, place, expected, published, scatter):
    band = (
        1e3 * PrintedEstimator("prls").history(DEGREES[:TURN], simulated(5, amplitude, SIGMA)).band[:, place]
    )
    samples = place + 1
    assert 1e3 * 2 * Z * SIGMA / np.sqrt(samples) == pytest.approx(expected, abs=0.05)
    # The residuals of three values leave m - 3 degrees of freedom, the source divides by m - 2.
    exact = 1e3 * 2 * Z * SIGMA * np.sqrt((samples - 3) / (samples - 2) / samples)
    assert np.sqrt(np.mean(band**2)) == pytest.approx(exact, rel=4 / np.sqrt(2 * RUNS * samples))
    assert np.std(band) / np.mean(band) == pytest.approx(scatter, rel=0.15)
    assert abs(published - exact) <= 2.5 * np.std(band)


def first_valid(amplitude, direction, every=1, seed=6):
    """Place of the first valid reading (the last one when none is), and errors of amplitude and centre over
    half of the band.
    """
    readings = simulated(seed, amplitude, SIGMA, direction, angle=DEGREES)
    history = PrintedEstimator("prls", confidence=0.999, rel_tol=0.03, abs_tol=0.002).history(
        DEGREES, readings
    )
    held = history.valid & (np.arange(TURN + 1) % every == 0)
    place = np.where(held.any(axis=1), np.argmax(held, axis=1), TURN)
    pick = np.arange(RUNS), place
    error = history.offset[pick] * np.exp(1j * history.offset_angle[pick]) - amplitude * np.exp(
        1j * np.ravel(direction)
    )
    half = history.band[pick] / 2
    return place, np.abs(history.offset[pick] - amplitude) / half, np.abs(error) / half, held.any(axis=1)


ANYWHERE = np.random.default_rng(8).uniform(-np.pi, np.pi, (RUNS, 1))


def test_rule_simulated_case_2():
    place, *_ = first_valid(1.0, ANYWHERE, every=3)
    assert np.median(place) == pytest.approx(66, abs=4)
    np.testing.assert_allclose(np.quantile(place, [0.05, 0.95]), [30, 96], atol=3)
    place, *_ = first_valid(1.0, np.pi / 2)  # the direction of (4.46), looked at after every reading
    assert np.median(place) == pytest.approx(73, abs=6)


@pytest.mark.parametrize(
    ("amplitude", "center", "ring", "of_400"),
    [
        (20.0, 0.009, 0.072, (0.01, 0.07)),
        (1.0, 0.079, 0.226, (0.06, 0.21)),
        (0.1, 0.903, 0.949, (0.90, 0.93)),
    ],
)
def test_what_99_9_percent_is_worth(amplitude, center, ring, of_400):
    # Shares of 48000 other draws; 4000 scatter about them by chance alone. What 400 gave is within their own
    # scatter.
    place, of_amplitude, of_center, _ = first_valid(amplitude, ANYWHERE, every=3)
    for held, share, rough in zip((of_center <= 1, of_amplitude <= 1), (center, ring), of_400, strict=True):
        scatter = np.sqrt(share * (1 - share))
        assert np.mean(held) == pytest.approx(share, abs=4 * scatter / np.sqrt(RUNS))
        assert np.mean(held) == pytest.approx(rough, abs=2.5 * scatter / np.sqrt(400))
    if amplitude == 20.0:
        assert np.all(place == 30)
        rows = np.column_stack([np.ones(31), np.cos(DEGREES[:31]), np.sin(DEGREES[:31])])
        cov = np.linalg.inv(rows.T @ rows)[1:, 1:]
        drawn = np.random.default_rng(0).multivariate_normal([0, 0], cov, 200_000)
        half = Z * np.sqrt(28 / 29 / 31)
        assert np.mean(of_center <= 1) == pytest.approx(np.mean(np.hypot(*drawn.T) <= half), abs=0.005)


def test_case_3_never_met_its_rule():
    place, *_, held = first_valid(0.1, np.pi / 2)
    assert np.mean(held) < 0.06
    assert np.median(place) == TURN


def test_rule_has_both_bounds():
    angle = DEGREES[:60]
    reading = 60.0 + 0.5 * np.cos(angle)
    exact = PrintedEstimator("prls", arc_min=np.deg2rad(45))
    assert exact.first_valid(angle, reading) == 45
    assert PrintedEstimator("prls").first_valid(angle[:30], reading[:30]) is None
    exact.extend(angle[:40], reading[:40])
    assert (exact.valid, exact.estimate.limited_by, exact.estimate.status) == (False, "arc", Status.UNSURE)
    assert np.rad2deg(exact.estimate.arc_needed) == pytest.approx(6)
    noisy = PrintedEstimator("prls")
    noisy.extend(angle, reading + 0.05 * np.random.default_rng(0).standard_normal(60))
    assert (noisy.valid, noisy.estimate.limited_by) == (False, "noise")
    width = max(0.03 * noisy.estimate.offset, 0.002)
    assert noisy.estimate.arc_needed == pytest.approx(angle[-1] * ((noisy.band / width) ** 2 - 1))
    assert PrintedEstimator("prls", rel_tol=0.0, abs_tol=1.001 * noisy.band).first_valid(angle, reading) == 30


def test_kalman_has_no_running_estimate():
    estimator = PrintedEstimator("kalman")
    estimator.extend(DEGREES, 61.94 + np.cos(DEGREES))
    assert not estimator.valid
    assert estimator.estimate.status is Status.UNDETERMINED
    assert estimator.estimate.offset == pytest.approx(1.0, abs=0.01)
    assert estimator.estimate.limited_by == "samples"


MESSAGES = [
    (lambda: PrintedEstimator("lsq"), "algorithm must be one of rls, prls, kalman; got 'lsq'"),
    (lambda: PrintedEstimator(confidence=99.9), r"confidence must be in \(0, 1\) \(1\); got 99.9"),
    (lambda: PrintedEstimator(confidence=1.0), r"confidence must be in \(0, 1\) \(1\); got 1.0"),
    (lambda: PrintedEstimator(rel_tol=-0.1), r"rel_tol must be >= 0 \(1\); got -0.1"),
    (lambda: PrintedEstimator(abs_tol=0.0), r"abs_tol must be > 0 \(mm\); got 0.0"),
    (lambda: PrintedEstimator(arc_min=-1.0), r"arc_min must be >= 0 \(rad\); got -1.0"),
    (lambda: PrintedEstimator(inv_info=0.0), r"inv_info must be > 0 \(1\); got 0.0"),
    (
        lambda: PrintedEstimator("kalman", walk_variance=-1.0),
        r"walk_variance must be >= 0 \(mm\^2\); got -1.0",
    ),
    (
        lambda: PrintedEstimator("kalman", noise_variance=-1.0),
        r"noise_variance must be >= 0 \(mm\^2\); got -1.0",
    ),
    (
        lambda: PrintedEstimator("kalman", walk_variance=0.0, noise_variance=0.0),
        r"must not both be 0 \(mm\^2\); got 0 and 0",
    ),
    (lambda: PrintedEstimator().update(angle=np.nan, reading=1.0), r"angle must be finite \(rad\); got nan"),
    (lambda: PrintedEstimator().update(angle=0.0, reading=np.inf), r"reading must be finite \(mm\); got inf"),
    (
        lambda: PrintedEstimator().extend([0.0, 1.0], [1.0]),
        r"angle and reading must be of shape \(m,\) and \(m,\) or \(runs, m\)",
    ),
    (lambda: PrintedEstimator().history([0.0], [np.nan]), r"reading\[0\] must be finite \(mm\); got nan"),
]


@pytest.mark.parametrize(("action", "message"), MESSAGES)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()
