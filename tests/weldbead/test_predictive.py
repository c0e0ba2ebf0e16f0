"""Depth of a pass of log-normal coefficients: published moments, quadrature, the plan's values."""

import itertools

import numpy as np
import pytest
from scipy import stats
from stand_job import ALONE, BEADS, BOTH, NAMES, PASSES, PROCESS

from sdpgrind import weldbead
from sdpgrind.weldbead import CoefficientScatter, Scatter

RHO = ((1.0, -0.5, 0.2), (-0.5, 1.0, 0.0), (0.2, 0.0, 1.0))
ALIKE = BOTH.replace(bead_scatter=CoefficientScatter(0.15, 0.15, 0.15, correlation=RHO))
K1, MU = (Scatter(name, 0.15, law="lognormal", mean="coefficient") for name in ("K1", "mu"))
PUBLISHED = [
    (ALONE, 50.0, 15.0, 0.259745, 0.061210),
    (BOTH, 50.0, 15.0, 0.265589, 0.089602),
    (BOTH, 20.0, 15.0, 0.076908, 0.033699),
    (BOTH, 12.0, 15.0, 0.026593, 0.020417),
    (ALONE.replace(scatter=K1), 50.0, 15.0, 0.259745, 0.038962),
    (ALONE.replace(scatter=MU), 50.0, 15.0, 0.254029, 0.045117),
    (ALIKE, 30.0, 10.0, 0.207626, 0.071233),
]


@pytest.mark.parametrize(("problem", "force", "feed", "mean", "sd"), PUBLISHED)
def test_published_moments(problem, force, feed, mean, sd):
    found = problem.depths.moments(PROCESS, force, feed)
    assert np.allclose(found, (mean, sd), rtol=0, atol=1e-6)


def by_quadrature(problem, force, feed):
    """Moments by 24 Gauss-Hermite points for each of the three logarithms, exact for these to rounding."""
    covariance = problem.scatter.log_covariance + problem.bead_scatter.log_covariance
    points, weights = np.polynomial.hermite_e.hermegauss(24)
    root = np.linalg.cholesky(covariance)
    total = square = 0.0
    model = problem.model
    for (x, u), (y, v), (z, w) in itertools.product(zip(points, weights, strict=True), repeat=3):
        k1, k2, mu = np.exp(root @ (x, y, z) - 0.5 * np.diag(covariance))
        torque = model.friction_ratio * mu * model.disk_radius * force
        power = 1e-3 * torque * (model.free_speed - model.speed_droop * torque)
        depth = (power - model.idle_power * k2) / (model.specific_energy * k1 * model.bead_width * feed)
        share = u * v * w / (2 * np.pi) ** 1.5
        total, square = total + share * depth, square + share * depth**2
    return total, np.sqrt(square - total**2)


@pytest.mark.parametrize("droop", [0.0, 0.05])
@pytest.mark.parametrize("force", [14.0, 45.0])
def test_moments_with_droop_by_quadrature(droop, force):
    problem = ALIKE.replace(model=PROCESS.replace(speed_droop=droop))
    found = problem.depths.moments(problem.model, force, 15.0)
    assert np.allclose(found, by_quadrature(problem, force, 15.0), rtol=1e-9)


@pytest.mark.parametrize("droop", [0.0, 0.05])
def test_the_expected_process_has_the_mean_cut(droop):
    model = PROCESS.replace(speed_droop=droop)
    expected, force = ALIKE.depths.expected(model), np.linspace(12.0, 50.0, 9)
    mean = ALIKE.depths.moments(model, force, 15.0)[0]
    assert np.allclose(expected.mean_cut(force, 15.0), mean, rtol=1e-12)
    assert ALIKE.depths.moments(model, expected.threshold_force, 15.0)[0] == pytest.approx(0.0, abs=1e-15)
    if droop:
        near = expected.peak_force * np.array([0.999, 1.0, 1.001])
        assert np.argmax(ALIKE.depths.moments(model, near, 15.0)[0]) == 1


@pytest.mark.parametrize(
    ("problem", "values"),
    [
        (BOTH, (0.13473, 0.13584, 0.46799, 0.17991)),
        (ALONE, (0.07753, 0.07793, 0.45323, 0.13175)),
    ],
)
def test_published_values(problem, values):
    """Told to 2e-4 $; the grid of 401 nodes is within 2e-5 of that of 1601."""
    policy = weldbead.plan(problem, tolerance=None, nodes=401)
    states = ((1.0, 60.0), (0.5, 36.0), (1.0, 36.0), (0.2, 12.0))
    found = [policy.value(height=height, time_left=time) for height, time in states]
    assert np.allclose(found, values, rtol=0, atol=2e-4)


@pytest.mark.parametrize("method", ["cautious", "certain"])
def test_beads_that_do_not_differ_change_nothing(method):
    same = BOTH.replace(bead_scatter=CoefficientScatter(0.0, 0.0, 0.0))
    one, other = (
        weldbead.plan(ALONE, tolerance=None, nodes=51),
        weldbead.plan(same, tolerance=None, nodes=51, method=method),
    )
    for name in ("value", "best", "control", "gap"):
        assert np.array_equal(
            getattr(one.table.table, name), getattr(other.table.table, name), equal_nan=True
        )


def test_the_certain_plan_is_that_of_the_coefficients_at_their_means_of_logs():
    certain = weldbead.plan(BOTH, tolerance=None, nodes=51, method="certain")
    factor = np.exp(-0.5 * np.log1p(0.15**2))
    known = PROCESS.replace(
        specific_energy=12.8 * factor, idle_power=114.0 * factor, friction_ratio=0.33 * factor
    )
    direct = weldbead.plan(ALONE.replace(model=known), tolerance=None, nodes=51)
    assert np.allclose(certain.table.table.value, direct.table.table.value, rtol=0, atol=1e-12)
    assert certain.problem == BOTH and certain.method == "certain"


def test_the_mean_of_the_cut_stays_the_default():
    cut = Scatter(NAMES, (0.15, 0.15, 0.15), law="lognormal")
    assert cut.mean == "cut"
    assert cut.moments(PROCESS, 50.0, 15.0)[0] == PROCESS.mean_cut(50.0, 15.0)


@pytest.mark.parametrize(("times", "share"), [(2.0, 1 / 100), (1.5, 1 / 11)])
def test_how_seldom_a_pass_removes_nothing(times, share):
    """Exact: mu F c < K2 is a normal difference of two logarithms; drawn, too."""
    sd = np.sqrt(4 * np.log1p(0.15**2))
    assert stats.norm.cdf(-np.log(times) / sd) == pytest.approx(share, rel=0.05)
    rng, force = np.random.default_rng(0), times * PROCESS.threshold_force
    drawn = [PASSES.coefficients.drawn(BEADS.drawn(PROCESS, rng), rng) for _ in range(4000)]
    none = np.mean([process.removal_rate(force) == 0 for process in drawn])
    assert none == pytest.approx(share, abs=4 * np.sqrt(share / 4000))


def test_the_default_tolerance_is_one_that_is_reached():
    """A log-normal cut near the threshold is narrower than any cell: 1e-5 $ would refine to the end of memory."""
    policy = weldbead.plan(BOTH)
    assert policy.error <= 1e-3
    assert policy.value(height=1.0, time_left=60.0) == pytest.approx(0.13473, abs=1e-3)


def test_leads_raise_the_feed():
    led = BOTH.replace(lead_length=12.0)
    assert led.feed_rate(12.0) == 162.0 / 10.0
    assert led.duration(16.2) == pytest.approx(12.0, rel=1e-15)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scatter": Scatter("C1", 0.15)}, 'attribution must be of "K1", "K2" and "mu"'),
        (
            {"scatter": Scatter("K1", 0.15, law="empirical", sample=(0.8, 1.0, 1.3))},
            "scatter.law must be another than 'empirical' with bead_scatter",
        ),
        ({"bead_scatter": 0.15}, "bead_scatter must be CoefficientScatter; got 0.15"),
        ({"lead_length": -1.0}, "lead_length must be >= 0"),
    ],
)
def test_refused(change, message):
    with pytest.raises((ValueError, TypeError), match=message):
        BOTH.replace(**change)


def test_c1_has_no_mean_of_a_coefficient():
    with pytest.raises(ValueError, match="cannot be told from mu"):
        Scatter("C1", 0.15, mean="coefficient")


def test_a_saved_plan_keeps_its_method_and_both_scatters(tmp_path):
    certain = weldbead.plan(ALIKE, tolerance=None, nodes=51, method="certain")
    certain.save(tmp_path / "plan.nc")
    again = weldbead.SequencePolicy.from_file(tmp_path / "plan.nc")
    assert again.problem == ALIKE and again.method == "certain"
    assert again.value(0.7, 60.0) == certain.value(0.7, 60.0)
    assert again.problem.bead_scatter.correlation == RHO
