"""Planned passes: the target is reached, limits hold, the three methods agree, saving, refusals."""

import numpy as np
import pytest

import sdpgrind
from sdpgrind import units, weldbead
from sdpgrind.weldbead import passes

X = np.linspace(0, 150, 1501)
BEAD = passes.Contour(X, 1.0 + 0.15 * np.sin(2 * np.pi * X / 60))
PROCESS = weldbead.GrindingProcess(
    specific_energy=12.8,
    idle_power=114.0,
    friction_ratio=0.33,
    disk_radius=88.9,
    free_speed=500.0,
    speed_droop=0.0,
    bead_width=12.7,
)
DISC = passes.TiltedDisc(PROCESS, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
PROBLEM = passes.PassProblem(DISC, BEAD, mean_cut=0.25, feed_rate=20.0)
FREELY = PROBLEM.replace(normal_force_max=300.0)


@pytest.fixture(scope="module")
def inverse():
    return passes.plan(FREELY)


def test_the_target_has_the_volume():
    assert BEAD.mean - PROBLEM.target.mean == pytest.approx(0.25, rel=1e-12)
    deep = PROBLEM.replace(mean_cut=0.05)  # the tip passes over the dips
    assert deep.target.mean == pytest.approx(BEAD.mean - 0.05, rel=1e-12)
    assert np.all(deep.target.at(X) <= BEAD.at(X) + 1e-15)


def test_inverse_reaches_the_target(inverse):
    # The tip is on its path at every step; between steps the contour is straight: within its sagitta.
    inside = (inverse.tip_x > 0) & (inverse.tip_x < 150)
    np.testing.assert_allclose(inverse.tip_z[inside], FREELY.tip_path.at(inverse.tip_x[inside]), atol=1e-11)
    np.testing.assert_allclose(inverse.contour.z, FREELY.target.at(inverse.contour.x), atol=1e-9)
    assert inverse.volume == pytest.approx(FREELY.volume, rel=1e-9)
    assert inverse.shortfall < 1e-6 * FREELY.volume
    assert inverse.status == "reaches the target"


def test_forward_and_inverse_are_each_other(inverse):
    # The same heights through the forward simulation: another equation, the same pass up to the steps'
    # interpolation.
    record = inverse.simulate()
    inside = (record.tip_x > 1) & (record.tip_x < 149)
    np.testing.assert_allclose(record.normal_force[inside], inverse.normal_force[inside], atol=0.02)
    inner = (X[10:-10], 2e-5)
    np.testing.assert_allclose(record.contour.at(inner[0]), inverse.contour.at(inner[0]), atol=inner[1])


def test_another_truth_cuts_less(inverse):
    dull = inverse.simulate(model=DISC.replace(specific_energy=14.0))
    assert 0.85 * inverse.volume < dull.volume < 0.97 * inverse.volume
    assert dull.removal_rate.shape == dull.time.shape


def test_a_limit_holds_and_is_used():
    plan = passes.plan(PROBLEM)
    assert plan.normal_force.max() == pytest.approx(90.0, rel=1e-9)
    assert plan.shortfall > 1.0
    assert plan.volume + plan.shortfall == pytest.approx(PROBLEM.volume, rel=1e-3)
    assert plan.status.startswith("limited to 90 N: 0.3")
    with pytest.raises(
        ValueError, match=r"mean_cut must be within the limits of force and power where strict \(mm\)"
    ):
        passes.plan(PROBLEM, strict=True)


def test_burning_is_a_limit_on_every_bump():
    limit = weldbead.ForceBurnLimit(14.0)  # N/(mm/s)^(1/2): 62.6 N at 20 mm/s
    plan = passes.plan(FREELY.replace(burn_limit=limit))
    assert plan.normal_force.max() == pytest.approx(14.0 * np.sqrt(20.0), rel=1e-9)
    assert plan.burn_margin == pytest.approx(0.0, abs=1e-6)
    mean = plan.normal_force[plan.normal_force > 0].mean()
    assert mean < 14.0 * np.sqrt(20.0) < passes.plan(FREELY).normal_force.max()
    assert passes.plan(FREELY).burn_margin == np.inf


def test_the_air_motor_is_guarded():
    air = PROCESS.replace(
        free_speed=2 * np.pi * 50,
        speed_droop=0.0821,
        friction_ratio=0.3,
        disk_radius=85.0,
        specific_energy=10.0,
    )
    disc = passes.TiltedDisc(air, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
    problem = passes.PassProblem(disc, BEAD, mean_cut=0.25, feed_rate=10.0)
    plan = passes.plan(problem)
    assert plan.grinding_power.max() == pytest.approx(0.8 * 300.5, rel=1e-3)
    assert plan.disk_speed.min() == pytest.approx(227.3, rel=1e-3)


def test_feedback_becomes_the_inverse_with_growing_gains(inverse):
    errors, forces = [], []
    inside = (inverse.tip_x > 2) & (inverse.tip_x < 148)
    inner = np.abs(np.array(inverse.contour.x) - 75) < 70
    for gains in ((2.0, 50.0), (2.0, 200.0), (5.0, 500.0), (10.0, 2000.0)):
        plan = passes.plan(FREELY, method="pi", gains=gains)
        gap = (np.array(plan.contour.z) - np.array(inverse.contour.z))[inner]
        errors.append(1e3 * np.sqrt(np.mean(gap**2)))
        forces.append(np.sqrt(np.mean((plan.normal_force - inverse.normal_force)[inside] ** 2)))
    assert np.all(np.diff(errors) < 0) and np.all(np.diff(forces) < 0)
    assert errors[-1] <= 0.5 and forces[-1] <= 0.15  # µm and N rms


@pytest.mark.parametrize("problem", [FREELY, PROBLEM])
def test_optimal_control_is_replayed(problem):
    plan, reference = passes.plan(problem, method="collocation"), passes.plan(problem)
    assert plan.collocation.message == "Solve_Succeeded"
    assert plan.collocation.residual < 1e-7  # of the conditions of optimality
    assert plan.collocation.replay_error < 3e-3  # mm
    assert plan.normal_force.max() < problem.force_limit * 1.005
    inside = (plan.tip_x > 5) & (plan.tip_x < 145)
    # Its motion is charged a little: it may leave the path by what saves speed, some micrometres.
    assert np.sqrt(np.mean((plan.normal_force - reference.normal_force)[inside] ** 2)) < 0.5
    assert plan.volume == pytest.approx(reference.volume, rel=5e-3)


def test_optimal_control_that_cannot_be_used_says_so():
    lifted = PROBLEM.replace(mean_cut=0.05)  # over dips the disc cuts nothing
    plan = passes.plan(lifted, method="collocation")
    assert plan.collocation.message == "the pass is no cut of one patch all along"
    np.testing.assert_array_equal(plan.fly_height, passes.plan(lifted).fly_height)


def test_static_forces_are_near(inverse):
    plan = passes.plan(FREELY, method="static")
    inside = (inverse.tip_x > 2) & (inverse.tip_x < 148)
    depth = BEAD.at(plan.tip_x[inside]) - FREELY.tip_path.at(plan.tip_x[inside])
    steady = PROCESS.normal_force(depth, 20.0)
    assert np.sqrt(np.mean((plan.normal_force[inside] - steady) ** 2)) < 2.5
    assert np.sqrt(np.mean((plan.normal_force - inverse.normal_force)[inside] ** 2)) < 2.5


def test_looking_ahead_halves_the_error_of_static_forces():
    """On waves of 60 and 17 mm; the static height of the front is exact for a level cut."""
    x = np.linspace(0, 150, 3001)
    bead = passes.Contour(x, 1.0 + 0.15 * np.sin(2 * np.pi * x / 60) + 0.05 * np.sin(2 * np.pi * x / 17))
    problem = FREELY.replace(bead=bead)
    inverse = passes.plan(problem)
    inside = (inverse.tip_x > 5) & (inverse.tip_x < 145)
    errors = []
    for method in ("static", "quasistatic"):
        plan = passes.plan(problem, method=method)
        force = np.interp(inverse.tip_x[inside], plan.tip_x, plan.normal_force)
        errors.append(np.sqrt(np.mean((force - inverse.normal_force[inside]) ** 2)))
    assert errors[1] < 0.55 * errors[0] and errors[1] < 0.8  # N rms of 63
    flat = FREELY.replace(bead=passes.Contour([0.0, 150.0], [1.0, 1.0]))
    heights = [passes.plan(flat, method=method).fly_height[800:2800] for method in ("static", "quasistatic")]
    np.testing.assert_allclose(*heights, atol=1e-9)


def test_the_error_estimate_is_one(inverse):
    plan, finer = (
        passes.plan(FREELY, method="static"),
        passes.plan(FREELY.replace(spacing=0.0125), method="static"),
    )
    x = np.array(plan.contour.x)
    true = np.sqrt(np.mean((np.array(plan.contour.z) - finer.contour.at(x)) ** 2))
    assert true / 4 < plan.error < 10 * true


def test_nothing_asked_for_touches_nothing():
    plan = passes.plan(PROBLEM.replace(mean_cut=0.0))
    assert (
        plan.volume < 1e-9
        and plan.normal_force.max() * DISC.model.disk_radius < 1.0 / (0.33 * 0.5e-3) * 114.0
    )


def test_a_plan_survives_its_file(tmp_path):
    plan = passes.plan(PROBLEM)
    plan.save(tmp_path / "pass.nc")
    again = sdpgrind.load(tmp_path / "pass.nc")
    assert again.problem == plan.problem and again.method == "inverse" and again.error == plan.error
    for name in ("time", "fly_height", "normal_force", "patches", "removed"):
        np.testing.assert_array_equal(getattr(again, name), getattr(plan, name))
    assert again.contour == plan.contour and again.shortfall == plan.shortfall
    assert repr(again) == repr(plan)


def test_it_is_drawn():
    import matplotlib.pyplot as plt

    before = plt.get_backend()
    plt.switch_backend("Agg")
    try:
        figure = passes.plan(PROBLEM).plot()
        assert len(figure.axes) == 4 and "limited" in figure._suptitle.get_text()
        plt.close(figure)
    finally:
        plt.switch_backend(before)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mean_cut": -0.1}, r"mean_cut must be >= 0 \(mm\); got -0.1"),
        ({"feed_rate": 0.0}, r"feed_rate must be > 0 \(mm/s\); got 0"),
        ({"spacing": 20.0}, r"spacing must be <= 15, a tenth of the bead \(mm\); got 20"),
        ({"normal_force_max": 5.0}, r"normal_force_max must be > 7.77., below which nothing is cut \(N\)"),
        (
            {"target_shape": passes.Contour([10, 150], [0, 0])},
            "the target shape must cover the bead, 0 to 150 mm; got 10 to 150",
        ),
        ({"parent": passes.Contour([0, 150], [0.9, 0.9])}, "mean_cut must leave the parent alone"),
        (
            {"bead": passes.Contour([0, 75, 75.1, 150], [0, 0, 40, 40]), "mean_cut": 22.0},
            r"the bead must rise < 30.41 above the path of the tip, to the disc's center \(mm\); got 42.01",
        ),
    ],
)
def test_problems_that_are_none(change, message):
    with pytest.raises(ValueError, match=message):
        PROBLEM.replace(**change)


def test_a_target_below_the_parent_is_warned_of():
    bump = passes.Contour([0, 60, 70, 80, 150], [0.5, 0.5, 0.85, 0.5, 0.5])
    with pytest.warns(UserWarning, match=r"the target lies below the parent: .* mm\^3 of it would be ground"):
        PROBLEM.replace(parent=bump)
    with pytest.warns(UserWarning, match="the target lies below the parent"):
        PROBLEM.replace(parent=passes.Contour([0, 150], [0.9, 0.9]), allow_overground=True)


def test_an_unknown_method_is_refused():
    with pytest.raises(
        ValueError, match="method must be one of inverse, pi, static, quasistatic, collocation"
    ):
        passes.plan(PROBLEM, method="best")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PROBLEM.replace(bead=None), "bead must be a Contour; got None"),
        (lambda: PROBLEM.replace(disc="disc"), "disc must be a TiltedDisc; got 'disc'"),
        (lambda: PROBLEM.replace(parent=3.0), "parent must be a Contour; got 3.0"),
        (lambda: passes.plan("pass"), "problem must be a PassProblem; got 'pass'"),
        (
            lambda: passes.plan(PROBLEM, method="collocation", freedom=(5, 50)),
            r"freedom must be a Freedom; got \(5, 50\)",
        ),
        (
            lambda: passes.TiltedDisc(None, relaxed_angle=0.3, rotational_stiffness=6e5),
            "model must be a GrindingProcess; got None",
        ),
    ],
)
def test_things_of_another_kind(make, message):
    with pytest.raises(TypeError, match=message):
        make()


@pytest.mark.parametrize(
    ("gains", "message"),
    [((1.0, -5.0), r"gains\[1\] must be > 0 \(1/s\); got -5"), (5.0, "gains must be two")],
)
def test_gains_that_are_none(gains, message):
    with pytest.raises(ValueError, match=message):
        passes.plan(PROBLEM, method="pi", gains=gains)


def test_a_compliance_table_is_not_for_optimal_control(tmp_path):
    """Its torque has corners: the plan is that of "inverse", says why, and keeps that when it is saved."""
    table = DISC.replace(rotational_stiffness=None, compliance=[(0.0, 0.0), (0.004, 1.2e3), (0.03, 16.8e3)])
    plan = passes.plan(FREELY.replace(disc=table), method="collocation")
    assert plan.method == "inverse" and "compliance table" in plan.collocation.message
    plan.save(tmp_path / "pass.nc")
    assert sdpgrind.load(tmp_path / "pass.nc").collocation == plan.collocation


def test_what_is_cut_too_deep_is_said(inverse):
    assert inverse.overcut < 1e-6 * FREELY.volume
    static = passes.plan(FREELY.replace(bead=BEAD, mean_cut=0.25), method="static")
    below = passes.volume_between(static.problem.target, static.contour, PROCESS.bead_width)
    assert static.overcut == pytest.approx(below) and static.overcut > 0


def test_static_forces_beyond_the_limit_are_said():
    deep = PROBLEM.replace(mean_cut=0.8)
    plan = passes.plan(deep, method="static")
    assert plan.normal_force.max() > 1.05 * deep.force_limit
    assert plan.status.startswith("exceeds its limit of 90 N by")
