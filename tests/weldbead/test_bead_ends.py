"""Ends of a bead: what a limited pass leaves there, when the face leaves it, and what the loop does then."""

import numpy as np
import pytest
from test_passes_plan import DISC, PROCESS

from sdpgrind import units
from sdpgrind.weldbead import force, passes
from sdpgrind.weldbead._hierarchy.ends import DOUBT, REACH, ends_raised

LEVEL = passes.Contour(np.linspace(0, 100, 401), np.full(401, 1.5))
DEEP = passes.PassProblem(DISC, LEVEL, mean_cut=0.6, feed_rate=7.5, normal_force_max=50.0)
LIGHT = DEEP.replace(mean_cut=0.1)


def ends_below_the_middle(problem):
    after = passes.plan(problem).contour
    x, z = np.array(after.x), np.array(after.z)
    middle = z[(x > 30) & (x < 70)].mean()
    return middle - z[x < 8].min(), middle - z[x > 92].min()


def test_a_limited_pass_does_not_dig_where_the_contact_is_short():
    """50 N reach 0.4 mm of the 0.6 mm asked for."""
    assert min(ends_below_the_middle(DEEP)) > 0.08
    assert max(ends_below_the_middle(ends_raised(DEEP, 0.0))) < 0.012  # the sagitta of the face, and the step


def test_a_pass_within_its_limit_is_left_alone():
    raised = ends_raised(LIGHT, 0.0)
    x = np.linspace(0, 100, 1001)
    np.testing.assert_allclose(raised.tip_path.at(x), LIGHT.tip_path.at(x), atol=1e-12)


def test_doubt_raises_both_ends_and_the_volume_stays():
    raised = ends_raised(LIGHT, 0.1)
    for end in (0.0, 100.0):
        rise = float(raised.tip_path.at(end) - raised.tip_path.at(50.0))
        assert rise == pytest.approx(DOUBT * 0.1, rel=1e-9)
    assert float(raised.tip_path.at(REACH) - raised.tip_path.at(50.0)) == pytest.approx(0.0, abs=1e-12)
    assert LEVEL.mean - raised.target.mean == pytest.approx(0.1, rel=1e-9)


def test_the_face_leaves_where_its_front_passes_the_end():
    """A steady cut of depth d has its front d/tan(angle) ahead of the tip."""
    plan = passes.plan(LIGHT)
    steady = np.searchsorted(plan.tip_x, 50.0)
    front = 0.1 / np.tan(plan.disk_angle[steady])
    assert plan.face_leaves == pytest.approx(np.interp(100.0 - front, plan.tip_x, plan.time), abs=0.02)
    falls = plan.time[plan.normal_force > 0.98 * plan.normal_force[steady]][-1]
    assert falls == pytest.approx(plan.face_leaves, abs=0.05)  # the force falls from there on


def test_the_loop_holds_its_correction_while_the_face_leaves():
    plan, loop = passes.plan(LIGHT), force.PI.design(crossover=units.hz(3.0))
    held, asked = force.ForceController(plan, loop), []
    for k in range(int(plan.time[-1] * 60)):
        reading = float(np.interp(k / 60, plan.time, plan.normal_force)) * 0.8
        held.step(force=reading, pass_time=k / 60)
        asked.append(held.report()["correction"])
    leaves = int(np.ceil((plan.face_leaves - loop.plant.lag) * 60))
    assert np.ptp(asked[leaves:]) == 0.0 < np.ptp(asked[leaves - 20 : leaves])


def test_the_process_of_the_pass_sets_what_is_reached():
    weak = DEEP.replace(disc=DISC.replace(model=PROCESS.replace(specific_energy=20.0)))
    rise = [
        float(np.ptp(ends_raised(each, 0.0).tip_path.at(np.linspace(0, 100, 201)))) for each in (DEEP, weak)
    ]
    assert rise[1] > rise[0]
