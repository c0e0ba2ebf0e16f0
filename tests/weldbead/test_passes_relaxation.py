"""The quadratic program of a pass: against its statement in cvxpy, against its closed form, against the
planner.
"""

import numpy as np
import pytest
from scipy.optimize import brentq
from weldbead_inside import statement

from sdpgrind import units, weldbead
from sdpgrind.weldbead import passes

PROCESS = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
DISC = passes.TiltedDisc(PROCESS, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
X = np.linspace(0, 150, 1501)
WAVY = passes.Contour(X, 1.0 + 0.15 * np.sin(2 * np.pi * X / 60) + 0.05 * np.sin(2 * np.pi * X / 9))


def problem(cut=0.25, feed=20.0, **more):
    return passes.PassProblem(DISC, WAVY, mean_cut=cut, feed_rate=feed, **more)


def mean(found):
    return np.trapezoid(found.cut_depth, found.x) / found.problem.bead.length


@pytest.mark.parametrize(
    ("cut", "feed", "slope"), [(0.25, 20.0, 0.36), (0.25, 27.0, 0.005), (0.1, 20.0, 0.01), (0.3, 40.0, 0.36)]
)
def test_it_is_what_cvxpy_states(cut, feed, slope):
    (found,) = passes.relax(problem(cut, feed), slope_max=slope)
    stated, depth = statement(problem(cut, feed), slope)
    stated.solve(solver="CLARABEL")
    np.testing.assert_allclose(found.cut_depth, depth.value, atol=2e-4)
    assert found.deviation**2 == pytest.approx(stated.value, rel=1e-3, abs=1e-8)


@pytest.mark.parametrize("feed", [20.0, 27.0, 33.0])
def test_without_a_limit_on_the_slope_the_depth_is_clipped(feed):
    """Optimality: d = clip(wanted + nu, 0, most), with nu from the mean."""
    (found,) = passes.relax(problem(0.25, feed), slope_max=10.0)
    wanted = WAVY.at(found.x) - found.problem.target.at(found.x)
    most = float(PROCESS.mean_cut(90.0, feed))

    def clipped(nu):
        return np.clip(wanted + nu, 0.0, most)

    nu = brentq(
        lambda nu: np.trapezoid(clipped(nu), found.x) / 150.0 - min(0.25, most), -1.0, 1.0, xtol=1e-12
    )
    np.testing.assert_allclose(found.cut_depth, clipped(nu), atol=1e-5)
    assert found.depth_max == pytest.approx(most)
    assert found.limited == pytest.approx(np.mean(clipped(nu) >= most * (1 - 1e-6)), abs=0.02)


def test_many_candidates_are_what_each_is_alone():
    pairs = [(0.1, 10.0), (0.25, 20.0), (0.25, 40.0), (0.0, 20.0)]
    for found, (cut, feed) in zip(
        passes.relax(problem(), candidates=pairs, slope_max=0.02), pairs, strict=True
    ):
        (alone,) = passes.relax(problem(cut, feed), slope_max=0.02)
        np.testing.assert_allclose(found.cut_depth, alone.cut_depth, atol=1e-5)
        assert mean(found) == pytest.approx(min(cut, found.depth_max), abs=1e-6)
        assert np.all(np.abs(np.diff(found.cut_depth)) <= 0.02 * np.diff(found.x) + 1e-6)


def test_what_the_limits_do_not_leave_is_said():
    (found,) = passes.relax(problem(0.25, 60.0))
    most = float(PROCESS.mean_cut(90.0, 60.0))
    assert found.shortfall == pytest.approx((0.25 - most) * 12.7 * 150.0, rel=1e-9)
    assert found.limited == 1.0
    np.testing.assert_allclose(found.contour.at(found.x), WAVY.at(found.x) - found.cut_depth)


def test_within_the_limits_it_is_where_the_planner_ends():
    easy = problem(0.1, 10.0)
    (found,) = passes.relax(easy)
    planned = passes.plan(easy).contour
    inner = (found.x > 5) & (found.x < 145)
    off = (found.contour.at(found.x) - planned.at(found.x))[inner]
    assert np.sqrt(np.mean(off**2)) < 2e-3  # mm; the program has nodes every 0.5 mm, and no disc
    assert found.shortfall == 0.0


def test_bad_input():
    with pytest.raises(ValueError, match=r"slope_max must be > 0 \(mm/mm\); got -1"):
        passes.relax(problem(), slope_max=-1)
    with pytest.raises(ValueError, match=r"mean_cut must be >= 0 \(mm\)"):
        passes.relax(problem(), candidates=[(-0.1, 20.0)])
