"""Burn limits, admissible forces, the problem's checks, presets."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from sdpgrind import physics, sdp, weldbead
from sdpgrind.base import stored

P1 = weldbead.preset("P1")
BASE = P1.model
DROOPY = BASE.replace(free_speed=560.0, speed_droop=0.1)


def test_force_limit():
    limit = weldbead.ForceBurnLimit(16.0)
    low, high = limit.interval(BASE, [4.0, 9.0])
    np.testing.assert_allclose(low, 0.0)
    np.testing.assert_allclose(high, [32.0, 48.0])
    np.testing.assert_allclose(limit.margin(BASE, [30.0, 50.0], [4.0, 9.0]), [2.0, -2.0])


def test_power_limit_is_the_force_limit_of_a_stiff_drive():
    # C_Pi = 1e-3 mu omega R C_B only without droop.
    power, force = weldbead.PowerBurnLimit(1e-3 * 0.3 * 500 * 85 * 16.0), weldbead.ForceBurnLimit(16.0)
    feeds = np.array([2.0, 5.0, 12.5])
    np.testing.assert_allclose(power.interval(BASE, feeds)[1], force.interval(BASE, feeds)[1])
    high = power.interval(DROOPY, feeds)[1]
    np.testing.assert_allclose(power.margin(DROOPY, high, feeds), 0.0, atol=1e-9)
    assert float(weldbead.PowerBurnLimit(1e6).interval(DROOPY, 5.0)[1]) == np.inf


@settings(max_examples=60)
@given(
    idle=st.sampled_from([0.0, 5.0, 20.0, 60.0, 300.0]),
    energy=st.sampled_from([4.0, 6.2, 8.0, 15.0]),
    feed=st.floats(1.0, 30.0),
    droop=st.sampled_from([0.0, 0.05]),
)
def test_malkin_interval_against_its_inequality(idle, energy, feed, droop):
    process = BASE.replace(idle_power=idle, specific_energy=energy, speed_droop=droop)
    limit = weldbead.MalkinBurnLimit.published(diameter=170.0)
    low, high = (float(end) for end in limit.interval(process, feed))
    top = min(process.peak_force, 500.0)
    start = min(process.threshold_force, top)
    forces = start + (top - start) * np.linspace(1e-4, 1 - 1e-4, 1500)
    margin = limit.margin(process, forces, feed)
    scale = process.grinding_power(forces)
    inside = (forces >= low) & (forces <= high)
    assert np.all(margin[inside] >= -1e-9 * scale[inside])
    assert np.all(margin[~inside] <= 1e-9 * scale[~inside])


def test_malkin_limit_refuses_light_cuts():
    process = BASE.replace(idle_power=60.0)
    limit = weldbead.MalkinBurnLimit.published(170.0)
    low, high = (float(end) for end in limit.interval(process, 10.0))
    assert process.threshold_force < low < high < np.inf
    for end in (low, high):
        assert float(limit.margin(process, end, 10.0)) == pytest.approx(0.0, abs=1e-8)
    # So much idle power that it always burns: an empty interval.
    low, high = limit.interval(BASE.replace(idle_power=3000.0), [10.0, 10.0])
    assert np.all(low > high)
    low, high = limit.interval(BASE.replace(idle_power=0.0), 10.0)
    assert float(low) == 0.0


@pytest.mark.parametrize("energy", [4.0, 10.0])
def test_malkin_limit_is_the_burning_of_a_wheel_that_only_ploughs(energy):
    process, feed, speed = BASE.replace(idle_power=60.0, specific_energy=energy), 10.0, 30e3
    plough = physics.GrindingPower(energy, ploughing_force=60.0 * 1000.0 / (process.bead_width * speed))
    depths = physics.burn_onset(
        plough, physics.BurningLimit.published(),
        work_speed=feed, wheel_speed=speed, equivalent_diameter=170.0, wear_flat_area=0.0, depth_max=5.0,
    )  # fmt: skip
    ends = weldbead.MalkinBurnLimit.published(170.0).interval(process, feed)
    np.testing.assert_allclose(process.mean_cut(ends[0], feed), depths.lower, rtol=1e-9)
    if np.isfinite(ends[1]):
        np.testing.assert_allclose(process.mean_cut(ends[1], feed), depths.upper, rtol=1e-9)
    assert np.isinf(depths.upper) == np.isinf(ends[1]) == (energy < 6)


def test_malkin_limit_of_a_motor_that_is_too_weak():
    process, limit = BASE.replace(idle_power=60.0), weldbead.MalkinBurnLimit.published(170.0)
    light = limit.interval(process, 10.0)[0]
    weak = process.replace(
        speed_droop=process.free_speed**2 / (4e3 * 0.99 * float(process.grinding_power(light)))
    )
    assert limit.interval(weak, 10.0) == (np.inf, 0.0)  # light cuts burn, and deeper ones it cannot make
    assert np.all(limit.margin(weak, np.linspace(0.1, 1.0, 9) * weak.peak_force, 10.0) < 0)


def test_time_and_feed():
    assert P1.feed_rate(6) == 12.5
    assert P1.feed_rate(20) == pytest.approx(50 / 18)
    assert P1.duration(12.5) == 6.0
    for duration in P1.durations:
        assert P1.duration(P1.feed_rate(duration)) == pytest.approx(duration, rel=1e-15)


def test_force_intervals_of_the_presets():
    low, high = P1.force_interval(6.0)
    assert (low, high) == (pytest.approx(100 / 12.75), 50.0)
    p4 = weldbead.preset("P4")
    assert p4.force_interval(20.0)[1] == pytest.approx(26.67, abs=0.005)
    assert float(p4.cut(20.0, p4.force_interval(20.0)[1]).mean) == pytest.approx(0.6912, abs=5e-5)
    # Active below V = 9.77 mm/s.
    assert p4.feed_rate(7.12) == pytest.approx(9.77, abs=0.01)
    assert p4.force_interval(6.0)[1] == 50.0
    assert p4.force_interval(8.0)[1] < 50.0


def test_min_cut_raises_the_least_force():
    problem = P1.replace(min_cut=0.02)
    for duration in (6.0, 20.0):
        low, _ = problem.force_interval(duration)
        assert float(problem.cut(duration, low).mean) == pytest.approx(0.02, rel=1e-12)


def test_long_passes_under_a_burn_limit_remove_nothing():
    # (5.12): delta = C1 C3 C_B u + C2 u^2, u = sqrt((T - t_R)/L); best at u* = C1 C3 C_B/(2 |C2|), zero at 2
    # u*.
    p4 = weldbead.preset("P4").replace(durations=range(2 + 1, 400), stage=1.0, force_max=1e4, horizon=400)
    c = BASE.coefficients
    best = c.C1 * c.C3 * 16.0 / (2 * abs(c.C2))

    def depth(u):
        return float(BASE.mean_cut(p4.force_interval(2 + 50 * u * u)[1], 50 / (50 * u * u)))

    found = minimize_scalar(
        lambda u: -depth(u), bounds=(0.1, 2 * best), method="bounded", options={"xatol": 1e-9}
    )
    assert found.x == pytest.approx(best, rel=1e-5)
    assert -found.fun == pytest.approx((c.C1 * c.C3 * 16.0) ** 2 / (4 * abs(c.C2)), rel=1e-10)
    assert depth(2.001 * best) == 0.0
    low, high = p4.force_interval(2 + 50 * (2.001 * best) ** 2)
    assert low >= high


def test_breaks_are_where_the_law_changes():
    for duration in P1.durations:
        (switch,) = P1.force_breaks(duration)
        law = P1.cut(duration, [switch * (1 - 1e-6), switch * (1 + 1e-6)])
        assert law.support[0][0] == 0.0
        assert law.support[0][1] > 0.0
    assert weldbead.preset("C0").force_breaks(6.0) == ()
    assert P1.replace(force_max=10.0).force_breaks(6.0) == ()


def test_law_of_a_pass():
    law = P1.cut(6.0, [20.0, 50.0])
    assert isinstance(law, sdp.Rayleigh)
    np.testing.assert_allclose(law.mean, BASE.mean_cut([20.0, 50.0], 12.5))
    assert float(law.sd[1]) == pytest.approx(0.15 * 637.5 / (10 * 12.5 * 12.5))


def test_finish_charge():
    finish = weldbead.FinishCharge(0.4, exponent=2.0, reference_rate=12.5)
    np.testing.assert_allclose(finish([12.5, 6.25]), [0.4, 0.1])


def test_presets():
    infos = weldbead.presets()
    assert [info.name for info in infos] == ["P1", "P2", "P3", "P4", "P5", "C0"]
    for info in infos:
        problem = weldbead.preset(info.name)
        assert problem.durations == (6, 8, 10, 12, 14, 16, 18, 20)
        assert stored.decode(stored.encode(problem)) == problem
        assert info.source
        assert info.about
    p5 = weldbead.preset("P5")
    assert (p5.model.free_speed, p5.model.speed_droop, p5.late_window) == (560.0, 0.1, 60.0)
    assert p5.height_charge == sdp.Charge(under=sdp.Quadratic(2.0), over=sdp.Quadratic(20.0))
    c0 = weldbead.preset("C0")
    assert (c0.model.idle_power, c0.scatter.attribution, c0.scatter.relative_sd, c0.force_max) == (
        0.0,
        "K1",
        0.6,
        400.0,
    )
    assert weldbead.preset("P3").lateness_charge == sdp.Linear(0.1)


def test_c0_is_always_scaled():
    c0 = weldbead.preset("C0")
    law = c0.cut(6.0, np.linspace(0.0, 400.0, 9))
    np.testing.assert_array_equal(law.support[0], 0.0)
    np.testing.assert_allclose(law.sd[1:] / law.mean[1:], 1 / sdp.Rayleigh.SWITCH)
    assert law.sd[0] == 0.0


def test_one_last_pass_of_c0_in_closed_form():
    # f = sqrt(pi/2)/z, c = 1.049366 $/mm and 55.656 % of the first band: least E charge(x - D) over D's mean.
    charge = weldbead.preset("C0").height_charge

    def cost(f):
        return float(charge.expected(sdp.Rayleigh(f, 0.6 * f), 1.0))

    found = minimize_scalar(cost, bounds=(0.1, 1.0), method="bounded", options={"xatol": 1e-9})
    assert found.x == pytest.approx(0.556558, abs=1e-6)
    assert found.fun == pytest.approx(1.049366, abs=1e-6)


def test_replace_reaches_the_model():
    changed = P1.replace(specific_energy=12.0, horizon=30.0)
    assert (changed.model.specific_energy, changed.horizon) == (12.0, 30.0)
    with pytest.raises(ValueError, match="SequenceProblem has no field 'specific_enrgy'"):
        P1.replace(specific_enrgy=12.0)


@given(r=st.floats(0.0, 0.4), duration=st.sampled_from([6.0, 20.0]))
@settings(max_examples=30)
def test_admissible_forces_remove_something(r, duration):
    problem = weldbead.preset("P5").replace(scatter=weldbead.Scatter("mu", r))
    low, high = problem.force_interval(duration)
    assert low < high <= 50.0
    assert np.all(np.diff(problem.cut(duration, np.linspace(low, high, 20)).mean) > 0)


LINEAR = sdp.Linear(1.0)
MESSAGES = [
    (lambda: P1.replace(bead_length=0.0), r"bead_length must be > 0 \(mm\); got 0.0"),
    (lambda: P1.replace(reset_time=-1.0), r"reset_time must be >= 0 \(s\); got -1.0"),
    (lambda: P1.replace(stage=0.0), r"stage must be > 0 \(s\); got 0.0"),
    (lambda: P1.replace(height_max=np.nan), r"height_max must be finite \(mm\); got nan"),
    (lambda: P1.replace(height_max=0), r"height_max must be > 0 \(mm\); got 0.0"),
    (lambda: P1.replace(durations=()), r"durations must be at least one number \(s\); got \(\)"),
    (lambda: P1.replace(durations=(2.0, 6.0)), r"durations\[0\] must be > reset_time, 2 s \(s\); got 2.0"),
    (
        lambda: P1.replace(durations=(6.0, 7.0)),
        r"durations\[1\] must be a multiple of the stage, 2 s \(s\); got 7.0",
    ),
    (
        lambda: P1.replace(durations=(6.0, 6.0)),
        r"durations\[1\] must be > durations\[0\], 6 s \(s\); got 6.0",
    ),
    (lambda: P1.replace(durations=(-6.0,)), r"durations\[0\] must be >= 0 \(s\); got -6.0"),
    (lambda: P1.replace(horizon=61.0), r"horizon must be a multiple of the stage, 2 s \(s\); got 61.0"),
    (
        lambda: P1.replace(force_max=7.0),
        r"force_max must be > the threshold force 7.84314 N, .* \(N\); got 7.0",
    ),
    (
        lambda: P1.replace(burn_limit=weldbead.ForceBurnLimit(1.0)),
        r"force_max, burn_limit and min_cut must leave a force",
    ),
    (lambda: P1.replace(min_cut=5.0), r"force_max, burn_limit and min_cut must leave a force .* min_cut 5.0"),
    (lambda: P1.replace(pass_charge=-1.0), r"pass_charge must be >= 0 \(\$\); got -1.0"),
    (
        lambda: P1.replace(height_charge=sdp.Charge(under=LINEAR)),
        r"height_charge must have an over side \(\$/mm\): every pass may overgrind; got over=None",
    ),
    (
        lambda: P1.replace(height_charge=sdp.Charge(under=lambda z: 1 - z, over=LINEAR)),
        r"under must be 0 at the target \(\$\); got 1 at distance 0",
    ),
    (
        lambda: P1.replace(height_charge=sdp.Charge(under=lambda z: np.sin(z * 2), over=LINEAR)),
        r"under must be >= 0 \(\$\); got -0.00\d* at distance 1.5",
    ),
    (
        lambda: P1.replace(late_window=10.0),
        r"late_window must be None without a lateness_charge \(s\); got 10.0",
    ),
    (
        lambda: P1.replace(lateness_charge=LINEAR, late_window=11.0),
        r"late_window must be a multiple of the stage, 2 s \(s\); got 11.0",
    ),
    (
        lambda: P1.replace(lateness_charge=sdp.Constant(3.0)),
        r"late_window must be given with a lateness_charge that is not convex \(s\); got Constant",
    ),
    (
        lambda: P1.replace(lateness_charge=np.sqrt),
        r"late_window must be given with a lateness_charge that is not convex",
    ),
    (
        lambda: P1.replace(lateness_charge=lambda z: np.minimum(z, 20 - z), late_window=20.0),
        r"lateness_charge must be non-decreasing away from the target \(\$\); got 9.98 at distance 10.02",
    ),
    (lambda: weldbead.ForceBurnLimit(0.0), r"burn_coefficient must be > 0 \(N/\(mm/s\)\^\(1/2\)\); got 0.0"),
    (
        lambda: weldbead.PowerBurnLimit(-1.0),
        r"burn_coefficient must be > 0 \(W/\(mm/s\)\^\(1/2\)\); got -1.0",
    ),
    (lambda: weldbead.MalkinBurnLimit(6.2, 7.2, 0.0), r"diameter must be > 0 \(mm\); got 0.0"),
    (lambda: weldbead.FinishCharge(-0.1), r"charge must be >= 0 \(\$\); got -0.1"),
    (lambda: weldbead.FinishCharge(0.1, exponent=-1), r"exponent must be >= 0; got -1.0"),
    (lambda: weldbead.FinishCharge(0.1, reference_rate=0), r"reference_rate must be > 0 \(mm/s\); got 0.0"),
    (lambda: P1.feed_rate(2.0), r"duration must be > reset_time, 2 s \(s\); got 2.0"),
    (lambda: P1.duration(0.0), r"feed_rate must be > 0 \(mm/s\); got 0.0"),
    (lambda: weldbead.preset("P9"), "name must be one of P1, P2, P3, P4, P5, C0; got 'P9'"),
]


@pytest.mark.parametrize(("action", "message"), MESSAGES)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()


KINDS = [
    (lambda: P1.replace(model=3.0), "model must be GrindingProcess; got 3.0"),
    (lambda: P1.replace(scatter=0.15), "scatter must be Scatter; got 0.15"),
    (lambda: P1.replace(height_charge=LINEAR), "height_charge must be Charge; got Linear"),
    (
        lambda: P1.replace(burn_limit=16.0),
        "burn_limit must be ForceBurnLimit or PowerBurnLimit or MalkinBurnLimit; got 16.0",
    ),
    (lambda: P1.replace(finish_charge=0.4), "finish_charge must be FinishCharge; got 0.4"),
    (
        lambda: P1.replace(lateness_charge=0.25),
        "lateness_charge must be a one-sided charge, a function or None; got 0.25",
    ),
    (lambda: P1.replace(bead_length="long"), r"bead_length must be a number \(mm\); got 'long'"),
]


@pytest.mark.parametrize(("action", "message"), KINDS)
def test_kinds(action, message):
    with pytest.raises(TypeError, match=message):
        action()


def test_a_convex_lateness_needs_no_window():
    assert P1.replace(lateness_charge=sdp.Quadratic(0.01)).late_window is None
    constant = P1.replace(lateness_charge=sdp.Constant(3.0), late_window=20.0)
    assert constant.late_window == 20.0


def test_passes_that_are_all_longer_than_the_horizon():
    with pytest.raises(
        ValueError, match=r"durations\[0\] must be <= horizon, 60 s, without a lateness_charge: no pass"
    ):
        weldbead.preset("P1").replace(durations=[70.0])
