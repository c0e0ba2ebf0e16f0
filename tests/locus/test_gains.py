"""Gains by design: Koren's example in closed form, brute force, worst drifts, refusals."""

import re
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from koren_stretch import START, koren, loop_slope_of, v_of
from locus_inside import Lag, Pid, lagged_map, radius, sampled_radius

from sdpgrind import locus
from sdpgrind.locus import gains
from sdpgrind.locus.gains import _drift
from sdpgrind.locus.gains._drift import Drift

KOREN = koren()
WHOLE = gains.design_gain(KOREN, x=(0.5, 20.0))


def at(x):
    """A design for hardly more than one hidden state."""
    return gains.design_gain(KOREN, x=(x * (1 - 1e-7), x * (1 + 1e-7)))


@pytest.mark.parametrize(
    ("x", "stable", "free"),
    [
        (0.52, 0.8436, 0.4218),
        (1.0, 1.3333, 0.6667),
        (1.1235, 1.3462, 0.6731),
        (2.0, 1.1, 0.55),
        (4.0, 0.6078, 0.3039),
        (19.99, 0.1086, 0.0543),
    ],
)
def test_gains_of_one_state(x, stable, free):
    design = at(x)
    assert design.stable == pytest.approx(2 / -loop_slope_of(x), rel=1e-5) and design.stable == pytest.approx(
        stable, abs=1e-4
    )
    assert design.deadbeat == pytest.approx(free, abs=1e-4)


def test_gains_of_the_whole_range():
    assert WHOLE.stable == pytest.approx(2 * 479 / (401 * 22), rel=1e-5)
    # e is concave: the steepest slope decides
    assert WHOLE.violation_free == pytest.approx(479 / (401 * 22), rel=1e-5)
    assert WHOLE.gain == pytest.approx(0.9 * WHOLE.violation_free)
    assert WHOLE.start == pytest.approx(START, abs=1e-9)


def test_where_the_printed_gains_are_stable():
    """Errata 1 and 2: k = 0.6 for x < 4.052 only, k = 0.9 from 0.548 to 2.619."""
    assert WHOLE.stable_range(0.6) == (pytest.approx((0.5, 4.05217), abs=1e-5),)
    assert WHOLE.stable_range(0.9) == (pytest.approx((0.54758, 2.61890), abs=1e-5),)
    assert WHOLE.stable_range(0.05) == (pytest.approx((0.5, 20.0)),) and WHOLE.stable_range(3.0) == ()


@pytest.mark.parametrize("gain", [0.6, 0.9])
def test_where_runs_are_stable(gain):
    """The same limits by bisection on runs: no linearisation, no table of slopes."""

    def settles(x):
        s = v_of(x) + 1e-7
        for _ in range(300):
            s += gain * (1 + np.sqrt(max(5 - (s - 2) ** 2, 0.0)) - x * s)
        return abs(s - v_of(x)) < 1e-7

    (low, high), middle = WHOLE.stable_range(gain)[0], 1.2
    for inside, outside, known in ((middle, 2 * high, high), (middle, 0.5 * low + 0.25, low)):
        if known < 0.51:
            continue
        for _ in range(30):
            half = 0.5 * (inside + outside)
            inside, outside = (half, outside) if settles(half) else (inside, half)
        assert inside == pytest.approx(known, abs=1e-5)


def test_koren_s_gain_is_right_between_0758_and_1721():
    design = gains.design_gain(KOREN, along="v", x=(0.758, 1.721))
    assert design.violation_free == pytest.approx(0.6, abs=1e-4)
    assert design.violation_free == pytest.approx(0.5 * design.stable)


@settings(deadline=None, max_examples=25)
@given(st.floats(0.5, 15.0), st.floats(1.05, 10.0))
def test_no_violation_up_to_the_designed_gain(x, ratio):
    """And one beyond it, started anywhere on the way, does violate."""
    high = min(x * ratio, 20.0)
    design = gains.design_gain(KOREN, x=(x, high))
    state = np.repeat(np.linspace(x, high, 40)[:, None], 40, axis=1)
    for gain, violates in ((design.violation_free, False), (1.1 * design.violation_free, True)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            controller = locus.LocusController(KOREN, gain=gain, x=(x, high))
        shares = np.linspace(0, 0.999, 60)
        best = KOREN.coordinate_of(state[:, :1])
        s = design.start + shares * (best - design.start)
        after = s + gain * KOREN.slack(s, state[:, :1])
        assert bool(np.any(after > best + 1e-7)) == violates
        assert violates or controller.simulate(state).worst_violation.max() < 1e-6


def test_a_convex_slack_allows_less_than_the_loop_slope():
    """e falls steeply far from the optimum: the chord decides, which the slope there does not know."""
    s, bend = np.linspace(0.0, 1.0, 101), 4.0
    x = 1 - s  # slack(s, x) = f(1 - x) - f(s) with f = (exp(-bend s) - 1)/-bend: steep at first

    def f(t):
        return -np.expm1(-bend * t) / bend

    stretch = locus.Stretch(
        along="s", names=("s",), hidden_name="x", coordinate=s, controls=s[:, None], hidden=x, limit=0 * s,
        response_slope=np.exp(-bend * s), controls_slope=np.ones((101, 1)), hidden_slope=-np.ones(101), limit_slope=0 * s,
        ends=("range", "range"), values=lambda c, h: (f(c[..., 0]) - f(1 - h), 0 * h),
    )  # fmt: skip
    design = gains.design_gain(stretch, x=(0.0, 0.5), start=0.0)
    ways = np.linspace(0, 1, 400, endpoint=False)
    brute = min(
        np.min((best - best * ways) / (f(best) - f(best * ways))) for best in np.linspace(0.5, 1, 400)
    )
    assert design.violation_free == pytest.approx(brute, rel=1e-3)
    assert design.violation_free < 0.4 * design.deadbeat
    assert design.gain == pytest.approx(0.9 * design.violation_free)


@pytest.mark.parametrize(("gain", "gained"), [(0.2, 0.280), (0.6, 0.603), (0.9, 0.961)])
def test_noise(gain, gained):
    """Errata 2: 0.2 is more accurate than 0.6. By formula and by a run (uniform noise, small)."""
    design = at(1.0)
    assert design.noise_gain_at(gain, x=1.0) == pytest.approx(gained, abs=5e-4)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        controller = locus.LocusController(KOREN, gain=gain, x=(0.9, 1.1), start=3.0)
    noise = np.random.default_rng(1).uniform(-1, 1, (2000, 60)) * 0.01
    run = controller.simulate(np.ones((2000, 60)), noise=noise)
    assert run.coordinate[:, 40:].std() / noise.std() == pytest.approx(gained, rel=0.02)


def test_noise_at_the_worst_state():
    gains = [WHOLE.noise_gain_at(0.09, x=x) for x in np.linspace(0.5, 20, 400)]
    assert WHOLE.noise_gain_at(0.09) == pytest.approx(max(gains), rel=1e-4)
    with pytest.raises(ValueError, match=r"gain must be < 0\.1085\d*, where it is stable; got 0\.6"):
        WHOLE.noise_gain_at(0.6)


def test_the_schedule():
    schedule = WHOLE.schedule(0.7)
    for x in (0.5, 1.0, 8.0):
        assert schedule(v_of(x)) == pytest.approx(0.7 / -loop_slope_of(x), rel=1e-5)
    assert WHOLE.schedule().theta == WHOLE.theta == pytest.approx(0.9 * WHOLE.theta_free)
    best, ways = KOREN.coordinate[1:, None], np.linspace(0, 1, 200, endpoint=False)
    s = START + ways * (best - START)
    brute = np.min((best - s) * -KOREN.at(s).loop_slope / KOREN.slack(s, KOREN.at(best).hidden))
    assert WHOLE.theta_free == pytest.approx(brute, rel=1e-3)


def adversaries(rate, runs, steps, rng, low=0.5, high=20.0):
    """Random walks, walks of full steps that turn now and then, and ramps from a loop that has settled; half
    of them tighten.
    """
    walk = rng.uniform(-rate, rate, (runs, steps))
    turning = rate * np.cumprod(np.where(rng.random((runs, steps)) < 0.02, -1, 1), axis=1)
    ramp = np.where(np.arange(steps) < steps // 2, 0.0, rate) * np.ones((runs, 1))
    ramp[np.arange(runs), steps // 2] = rng.uniform(0, rate, runs)
    kinds = rng.integers(0, 3, runs)[:, None]
    change = np.where(kinds == 0, walk, np.where(kinds == 1, turning, ramp))
    x = np.empty((runs, steps))
    x[:, 0] = np.where(kinds[:, 0] == 2, low, np.exp(rng.uniform(np.log(low), np.log(high), runs)))
    for k in range(1, steps):
        x[:, k] = np.clip(x[:, k - 1] + change[:, k], low, high)
    return x


@pytest.mark.parametrize("rate", [0.003, 0.03, 0.3, 3.0])
def test_drifts_stay_within_the_margin_and_come_near_it(rate):
    """10 000 drifts in four batches; the margin is at most 1.5 times the worst violation."""
    margin = WHOLE.drift_margin(rate)
    controller = locus.LocusController(KOREN, gain=WHOLE.gain, x=(0.5, 20.0))
    x = adversaries(rate, 2500, 700, np.random.default_rng(3))
    assert np.abs(np.diff(x)).max() <= rate * (1 + 1e-9)
    worst = controller.simulate(x).worst_violation.max()
    assert worst <= margin <= 1.5 * worst
    if margin < (greatest := np.max(controller.stretch.limit)):
        assert controller.replace(margin=margin).simulate(x).worst_violation.max() <= 1e-9
    else:  # the fastest drift leaves nothing of the limit
        with pytest.raises(
            ValueError, match=rf"margin must be < {greatest:.6g}, the greatest limit on the curve"
        ):
            controller.replace(margin=margin)
    assert (margin >= greatest) == (rate == 3.0)


def test_margins_of_slow_loops_leave_nothing():
    """Slow loops need many rounds: at a hundredth of the gain the margin is a hundred times as large."""
    assert WHOLE.drift_margin(0.01, gain=0.01 * WHOLE.gain) == pytest.approx(
        100 * WHOLE.drift_margin(0.01), rel=1e-3
    )


def test_a_loop_that_cannot_follow_is_refused():
    with pytest.raises(ValueError, match=r"rate must be so small that the loop keeps up with it; got 0\.01"):
        WHOLE.drift_margin(0.01, gain=1e-4 * WHOLE.gain)


def test_margin_of_a_schedule():
    schedule, rate = WHOLE.schedule(), 0.05
    margin = WHOLE.drift_margin(rate, gain=schedule)
    controller = locus.LocusController(KOREN, gain=schedule, x=(0.5, 20.0))
    worst = controller.simulate(adversaries(rate, 500, 400, np.random.default_rng(4))).worst_violation.max()
    assert worst <= margin <= 1.5 * worst


def test_margin_of_a_gain_that_overshoots():
    design = gains.design_gain(KOREN, x=(0.52, 1.0))
    margin = design.drift_margin(0.01, gain=0.6)
    with pytest.warns(UserWarning, match="may step beyond the limit"):
        controller = locus.LocusController(KOREN, gain=0.6, x=(0.52, 1.0))
    worst = controller.simulate(
        adversaries(0.01, 1000, 200, np.random.default_rng(5), 0.52, 1.0)
    ).worst_violation.max()
    assert 0 < worst <= margin <= 1.5 * worst


def test_a_start_that_creeps_on_is_bounded_by_the_furthest_place(monkeypatch):
    """Where a search ends too early the bound holds, and is wider; the start only counts with overshoot."""
    design = gains.design_gain(KOREN, x=(1.0, 4.0))
    drift = Drift(KOREN, design.loose, design.tight, 0.01, lambda s: np.full(np.shape(s), 0.6), design.start)
    known = drift._played(0.0, drift.furthest)[0]
    settled = drift._settled(drift._start(0.0), 0.0)
    monkeypatch.setattr(_drift, "LONGEST", 0)
    furthest = drift._settled(drift._start(0.0), 0.0)
    assert np.all(drift.direction * (furthest - settled) > 0)
    assert drift._played(0.0, drift.furthest)[0] >= known > 0


@settings(deadline=None, max_examples=20)
@given(
    st.floats(0.5, 4.0), st.floats(1.2, 4.0), st.floats(1e-3, 0.3), st.floats(0.2, 1.0), st.integers(0, 1000)
)
def test_margins_hold(low, ratio, rate, share, seed):
    high = min(low * ratio, 20.0)
    design = gains.design_gain(KOREN, x=(low, high))
    gain = share * design.gain
    margin = design.drift_margin(rate, gain=gain)
    x = adversaries(rate, 60, 300, np.random.default_rng(seed), low, high)
    controller = locus.LocusController(KOREN, gain=gain, x=(low, high))
    assert controller.simulate(x).worst_violation.max() <= margin + 1e-9
    assert controller.replace(margin=margin).simulate(x).worst_violation.max() <= 1e-9


def test_a_slow_drift_is_that_of_spec():
    """|ds*/dx| r/k at the worst state, to first order; and never less than the onset P_x r."""
    x = np.linspace(0.5, 20, 4000)
    slope = np.abs(2 - 8 * x - 2 * x**2) / (1 + x**2) ** 2
    assert WHOLE.drift_margin(1e-4) == pytest.approx(slope.max() * 1e-4 / WHOLE.gain, rel=0.05)
    assert WHOLE.drift_margin(2.0) >= v_of(0.5) * 2.0 * 0.9
    assert (
        WHOLE.drift_margin(1e-4)
        < WHOLE.drift_margin(1e-3)
        < WHOLE.drift_margin(1e-2)
        < WHOLE.drift_margin(0.1)
    )


def test_turning_walks_back_as_the_tool_wears():
    """A coordinate against which the slack rises, over a kink where a bound is left: the same bounds hold."""
    curve = locus.plan(locus.preset("turning"))
    design = gains.design_gain(curve, along="cutting_speed")
    assert design.start == pytest.approx(design.stretch.high) and design.gain > 0
    low, high = design.x
    for rate in (3e-4, 3e-3):
        margin = design.drift_margin(rate)
        controller = locus.LocusController(curve, along="cutting_speed", gain=design.gain, x=design.x)
        x = adversaries(rate, 300, 600, np.random.default_rng(6), low, high)
        worst = controller.simulate(x).worst_violation.max()
        assert worst <= margin <= 1.5 * worst
        assert controller.replace(margin=margin).simulate(x).worst_violation.max() < 1e-6


def test_pid_poles_against_jury():
    """Spec 3.7: z^2 - (1 - (K1 + K2) g) z - K2 g is stable for 0 < g < 2/(K1 + 2 K2) and K2 g < 1."""
    k1, k2 = 3.3, 5.3
    for g in np.linspace(0.001, 0.4, 200):
        assert (radius(np.array(g), Pid(k1, k2)) < 1) == (g < 2 / (k1 + 2 * k2) and k2 * g < 1)
    assert 2 / (k1 + 2 * k2) == pytest.approx(0.1439, abs=1e-4)


@settings(deadline=None)
@given(st.floats(0.01, 2.0), st.floats(0.0, 1.0), st.floats(0.0, 0.5), st.floats(0.01, 2.0))
def test_pid_poles_against_a_run(ki, kp, kd, g):
    """The linear loop, played."""
    rho = float(radius(np.array(g), Pid(ki, kp, kd)))
    s, errors, largest = 1.0, [0.0, 0.0], []
    for _ in range(400):
        e = -g * s
        s += ki * e + kp * (e - errors[0]) + kd * (e - 2 * errors[0] + errors[1])
        errors = [e, errors[0]]
        largest.append(abs(s))
        if abs(s) > 1e100:
            break
    if abs(rho - 1) > 0.05:
        assert (max(largest[-20:]) < 1) == (rho < 1)


@settings(deadline=None)
@given(
    st.floats(0.1, 3.0), st.floats(0.0, 1.0), st.floats(-0.5, 0.5), st.floats(0.05, 1.0), st.floats(0.2, 3.0)
)
def test_the_lagged_map_against_small_steps(ki, kp, at_once, sensor, lag):
    """The map of one sample, against the plant integrated in small steps."""
    limit, response, period = (0.0, 0.7), (1.5, at_once), 0.5
    map_ = lagged_map(limit, response, Pid(ki, kp), Lag(lag, sensor, period))
    y, p, s, e1, _ = start = np.array([0.3, -0.2, 0.5, 0.1, -0.4])
    n = 4000
    for _ in range(n):  # midpoints
        h = period / n
        ym, pm = y + h / 2 * (s - y) / lag, p + h / 2 * (response[0] * y + response[1] * s - p) / sensor
        y, p = y + h * (s - ym) / lag, p + h * (response[0] * ym + response[1] * s - pm) / sensor
    e = limit[1] * s - p
    s += ki * e + kp * (e - e1)
    np.testing.assert_allclose(map_ @ start, [y, p, s, e, e1], atol=1e-6)


def test_without_lag_the_map_is_the_static_one():
    g, pid = 0.4, Pid(1.0, 0.5)
    map_ = lagged_map((0.0, 0.7), (1.1, 0.0), pid, Lag(1e-3, 0.0, 0.5))
    assert np.abs(np.linalg.eigvals(map_)).max() == pytest.approx(float(radius(np.array(g), pid)), abs=1e-9)


def test_several_constraints():
    E = np.array([[-2.0, 0.4, 0.1], [0.3, -1.0, 0.2], [0.0, 0.5, -3.0]])
    for theta in (1.0, 0.4):
        K = gains.decoupling_gains(E, theta)
        assert gains.spectral_radius(E, K) == pytest.approx(1 - theta, abs=1e-9)
        np.testing.assert_allclose(np.eye(3) + K @ E, (1 - theta) * np.eye(3), atol=1e-12)
    assert gains.spectral_radius(E, np.diag([1.9, 0.0, 0.0])) > 1
    np.testing.assert_allclose(gains.decoupling_gains([[-1.5]], 0.9), [[0.6]])


REFUSED = [
    (lambda: WHOLE.check(0.6), "gain must be < 0.1086 to be stable for x in 0.5..20; got 0.6, stable for 0.5..4.052"),
    (lambda: WHOLE.check(-0.1), "gain must be > 0; got -0.1"),
    (lambda: WHOLE.check(0.05, kp=0.1), "gain must be smaller with these kp and kd to be stable for x in 0.5..20; got 0.05"),
    (lambda: gains.design_gain(KOREN, along="u"), "along must be 'v', the coordinate of the stretch; got 'u'"),
    (lambda: gains.design_gain(KOREN, x=(2.0, 1.0)), "x must be a least and a greatest x, rising; got (2.0, 1.0)"),
    (lambda: gains.design_gain(KOREN, x=2.0), "x must be a least and a greatest x; got 2.0"),
    (lambda: gains.design_gain(KOREN, x=(1.0, 30.0)), "x must lie in 0.5..20, where the stretch ends (interior, range)"),
    (lambda: gains.design_gain(KOREN, start=5.0), "start must be in [0.109726, 4]; got 5.0"),
    (lambda: gains.design_gain(KOREN, start="best"), "start must be \"feasible\" or a coordinate; got 'best'"),
    (lambda: gains.design_gain(KOREN, start=3.0), "every x in 0.5..20, as 0.109726 has; got 3, with -57 at 20"),
    (lambda: WHOLE.drift_margin(0.0), "rate must be > 0; got 0.0"),
    (lambda: WHOLE.drift_margin(0.1, gain=0.6), "gain must be < 0.1086 to be stable"),
    (lambda: WHOLE.schedule(1.2), "theta must be in (0, 1]; got 1.2"),
    (lambda: WHOLE.radius(0.05, lag=-1.0), "lag must be >= 0 (s); got -1.0"),
    (lambda: gains.decoupling_gains([[1.0, 2.0]]), "slopes must be square, a row for each constraint and a column for"),
    (lambda: gains.decoupling_gains([[1.0, 2.0], [2.0, 4.0]]), "slopes must be regular: the constraints must answer differently"),
    (lambda: gains.spectral_radius(np.eye(2), np.eye(3)), "gains must be of the shape of the slopes, (2, 2); got (3, 3)"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "said"), REFUSED)
def test_refused(call, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        call()


def test_of_another_kind():
    with pytest.raises(
        TypeError, match=r"curve must be a locus of one hidden state, .*, or a stretch; got 3"
    ):
        gains.design_gain(3)


def test_a_range_beyond_the_onset_is_the_clamped_one():
    """Below x = 1/2 the constraint is active no longer, and the clamped place is the optimum."""
    assert gains.design_gain(KOREN, x=(0.2, 20.0)).x == (0.5, pytest.approx(20.0))


def test_a_turning_slack_is_refused():
    s = np.linspace(0, 1, 21)
    stretch = locus.Stretch(
        along="s", names=("s",), hidden_name="x", coordinate=s, controls=s[:, None], hidden=s, limit=0 * s,
        response_slope=s - 0.5, controls_slope=np.ones((21, 1)), hidden_slope=np.ones(21), limit_slope=0 * s,
        ends=("range", "fold"), values=lambda c, h: (h, 0 * h),
    )  # fmt: skip
    with pytest.raises(
        ValueError, match="a coordinate along which the slack changes one way; along 's' it does not"
    ):
        gains.design_gain(stretch)
    with pytest.raises(ValueError, match=r"x must lie in 0\.\.1, where the stretch ends \(range, fold\)"):
        gains.design_gain(stretch, x=(0.5, 1.5))


def test_poles_of_the_grinder():
    """Spec 6: with lags, the printed gains are stable up to a width of 43 mm at 15 um/s, 26 at 5, 11 at 1.5."""
    for rate, width in ((15.1e-3, 43.0), (5e-3, 26.0), (1.5e-3, 11.0)):
        radii = []
        for wide in (0.95 * width, 1.05 * width):
            problem = locus.preset("grinding")
            problem = problem.replace(width=wide)
            stretch = locus.plan(problem, points=200).stretch("infeed_rate")
            radii.append(sampled_radius(stretch, rate, Pid(3.3e-6, 5.3e-6), Lag(1.25, 0.2, 0.5), "command"))
        assert radii[0] < 1 < radii[1]
    nominal = locus.plan(locus.preset("grinding"), points=200).stretch("infeed_rate")
    assert nominal.at(15.1e-3).loop_slope == pytest.approx(-0.01389e6, rel=2e-3)  # W s/mm
