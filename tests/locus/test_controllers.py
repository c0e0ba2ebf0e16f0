"""Controllers on the locus: Koren's runs, his claims both ways, lags, learned starts, refusals."""

import copy
import re
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from koren_stretch import START, koren, loop_slope_of, u_of, v_of

import hwsim
from sdpgrind import locus
from sdpgrind.locus import LocusController

KOREN = koren()
PRINTED = {"gain": 0.6, "x": (0.76, 1.72), "start": START}


def loud(**options):
    """A controller that may violate, on purpose."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return LocusController(KOREN, **options)


def pb(v):
    return 17 + np.sqrt(5 - (v - 2) ** 2) - 4 * v


def corrections(run, x, tolerance=0.005):
    """Until v stays within 0.5 %; None: never."""
    off = np.flatnonzero(np.abs(run.coordinate / v_of(x) - 1) > tolerance)
    return None if off.size and off[-1] == run.coordinate.size - 1 else int(off[-1]) + 1


def test_the_printed_run():
    """x = 1, k = 0.6: v_1 to v_5; errors after five are below 0.5 %, after three that of P_b is 7.1 %, not
    below 4 %.
    """
    run = LocusController(KOREN, **PRINTED).simulate(np.ones(20))
    np.testing.assert_allclose(run.coordinate[1:6], [1.36060, 2.42986, 2.88856, 2.98659, 2.99863], atol=1e-5)
    v = run.coordinate
    u = np.sqrt(5 - (v - 2) ** 2)
    errors = 100 * np.abs(np.array([v / 3, u / 2, pb(v) / 7]) - 1)
    np.testing.assert_allclose(errors[:, 5], [0.046, 0.034, 0.088], atol=1e-3)
    np.testing.assert_allclose(errors[:, 4], [0.45, 0.33, 0.86], atol=5e-3)
    np.testing.assert_allclose(errors[:, 3], [3.715, 2.597, 7.110], atol=1e-3)
    assert errors[2, 3] > 4  # an error of the paper
    assert run.worst_violation == 0


def test_the_printed_run_step_by_step():
    """The protocol, and the same bits as in a batch."""
    controller = LocusController(KOREN, **PRINTED)
    run = controller.simulate(np.ones((3, 12)))
    command = controller.command
    for k in range(12):
        assert command["v"] == run.coordinate[0, k] == run.coordinate[2, k]
        assert command["u"] == pytest.approx(np.sqrt(5 - (command["v"] - 2) ** 2), abs=1e-9)
        command = controller.step(response=float(1.0 * command["v"] + 16 - 4 * command["v"]))


@pytest.mark.filterwarnings("ignore:kd")
@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6), st.sampled_from(["fixed", "schedule", "pid", "inversion"]), st.floats(0.0, 0.5))
def test_batches_are_steps(seed, kind, margin):
    options = {
        "fixed": {"gain": 0.05},
        "schedule": {"gain": "schedule"},
        "pid": {"gain": 0.02, "kp": 0.01, "kd": 0.005},
        "inversion": {"method": "inversion", "filter": 0.6},
    }[kind]
    controller = LocusController(KOREN, margin=margin, **options)
    rng = np.random.default_rng(seed)
    x, noise = rng.uniform(0.5, 20, (4, 15)), rng.normal(0, 0.3, (4, 15))
    run = controller.simulate(x, noise=noise)
    for k in (0, 3):
        controller.reset()
        for i in range(15):
            command = controller.command
            assert command["v"] == run.coordinate[k, i]
            response = KOREN.values(KOREN.rows(command["v"])[:2], x[k, i])[0]
            controller.step(response=float(response + noise[k, i]))


def test_corrections_at_other_gains():
    """Errata 2: u, v and P_b stay within 0.5 % after 20 (k 0.2), 5 (0.6), 5 (0.9) corrections; 0.9
    overshoots.
    """
    counts, worst = [], []
    for gain in (0.2, 0.6, 0.9):
        run = loud(gain=gain, x=(0.6, 2.0), start=START).simulate(np.ones(60))
        v = run.coordinate
        errors = np.abs(np.array([v / 3, np.sqrt(5 - (v - 2) ** 2) / 2, pb(v) / 7]) - 1).max(axis=0)
        counts.append(int(np.flatnonzero(errors > 0.005)[-1]) + 1)
        worst.append(float(run.worst_violation))
    assert counts == [20, 5, 5]
    assert worst == [0.0, 0.0, pytest.approx(0.1705, abs=1e-4)]


@pytest.mark.parametrize(("x", "worst"), [(6.0, 3.17), (10.0, 4.81)])
def test_the_printed_gain_violates_beyond_4(x, worst):
    """Errata 1: a limit cycle between the clamps."""
    run = loud(gain=0.6, x=(0.5, 4.0), start=START).simulate(np.full(400, x))
    assert run.worst_violation == pytest.approx(worst, abs=0.01)
    assert np.ptp(run.coordinate[-20:]) > 0.1


SPEC_7 = {
    "fixed 0.6": ({"gain": 0.6, "x": (0.5, 4.0)}, [(5, 0.080), (4, 0.0), (171, 1.58), (None, 4.81)]),
    "fixed 0.0543": ({"gain": 0.0543}, [(59, 0.0), (71, 0.0), (27, 0.0), (8, 0.0)]),
    "schedule": ({"gain": locus.gains.GainSchedule(KOREN, 1.0)}, [(7, 0.080), (7, 0.0), (5, 0.0), (4, 0.0)]),
    "inversion": ({"method": "inversion"}, [(1, 0.0)] * 4),
}


@pytest.mark.parametrize("name", SPEC_7)
def test_gains_table(name):
    """Spec 7: corrections to 0.5 % in v and worst violation at x = 0.52, 1, 4, 10."""
    options, rows = SPEC_7[name]
    controller = loud(start=START, **options)
    for x, (count, worst) in zip((0.52, 1.0, 4.0, 10.0), rows, strict=True):
        run = controller.simulate(np.full(1500, x))
        assert corrections(run, x) == count
        assert run.worst_violation == pytest.approx(worst, abs=6e-3)


def test_the_designed_schedule_violates_nothing():
    run = LocusController(KOREN).simulate(np.repeat(np.geomspace(0.5, 20, 60)[:, None], 80, axis=1))
    assert run.worst_violation.max() < 1e-6
    np.testing.assert_allclose(run.coordinate[:, -1], v_of(run.hidden[:, -1]), rtol=1e-6)


def test_a_ramp_that_relaxes():
    """x from 1 to 0.52 by 0.01 (errata 5, 6): v within 1.21 %, u within 2.09 % from iteration 4 on; P =
    0.0118 after it stops.
    """
    x = np.concatenate([np.arange(100, 51, -1) / 100, np.full(40, 0.52)])
    run = loud(gain=0.6, x=(0.5, 4.0), start=START).simulate(x)
    v, best = run.coordinate, v_of(x)
    assert 100 * np.abs(v / best - 1)[4:].max() == pytest.approx(1.21, abs=0.01)
    u = np.sqrt(5 - (v - 2) ** 2)
    assert 100 * np.abs(u / u_of(x) - 1)[4:].max() == pytest.approx(2.09, abs=0.01)
    assert run.slack[:49].min() > -1e-9
    assert run.worst_violation == pytest.approx(0.0118, abs=1e-4)
    assert 100 * (-run.slack / run.limit).max() == pytest.approx(0.5, abs=0.05)


def test_a_ramp_that_tightens():
    """What wear does, which Koren did not show: P = 0.0397, 1.8 % of P_b, at once."""
    x = np.concatenate([np.full(5, 0.52), np.arange(53, 101) / 100])
    run = loud(gain=0.6, x=(0.5, 4.0), start=float(v_of(0.52))).simulate(x)
    assert -run.slack[5] == pytest.approx(0.0397, abs=1e-4)
    assert 100 * (-run.slack / run.limit).max() == pytest.approx(1.8, abs=0.05)


def test_noise_of_5_and_20_percent():
    """Errata 7: uniform +-5 % of P_c scatters v by 0.12, and violates by 5 % of P_b typically; 20 % by half."""
    scatter, worst = [], []
    for share in (0.05, 0.2):
        controller, rng, places = loud(gain=0.6, x=(0.76, 1.72), start=3.0), np.random.default_rng(0), []
        for _ in range(4000):
            v = controller.command["v"]
            places.append(v)
            controller.step(response=(v + 16 - 4 * v) * (1 + share * rng.uniform(-1, 1)))
        v = np.array(places).reshape(-1, 50)
        scatter.append(v.std())
        worst.append(float(np.median(((v + 16 - 4 * v) / pb(v) - 1).max(axis=1))))
    assert scatter[0] == pytest.approx(0.12, abs=0.01) and worst[0] == pytest.approx(0.05, abs=0.01)
    assert 0.4 < worst[1] < 0.7


def test_a_model_that_is_wrong_in_x_only_does_not_matter():
    """Errata 9: P_c = m x v + 16 - 4 v. Feedback finds the right point at any m, and so does inversion: only
    x is renamed.
    """
    for options in (PRINTED, {"method": "inversion"}):
        controller = LocusController(KOREN, **options)
        for _ in range(60):
            command = controller.command
            command = controller.step(response=1.3 * 1.0 * command["v"] + 16 - 4 * command["v"])
        assert command["v"] == pytest.approx(v_of(1.3), abs=1e-6) and command["u"] == pytest.approx(
            u_of(1.3), abs=1e-6
        )


def test_no_winding_up():
    """Clamped at the end of the locus for long, it turns at the first reading that asks for it."""
    controller = LocusController(KOREN, **PRINTED)
    for _ in range(50):
        command = controller.step(response=-1e6)
    assert command["v"] == 4.0 and command["u"] == pytest.approx(1.0, abs=1e-9)
    assert controller.step(response=float(pb(4.0) + 0.5))["v"] == pytest.approx(4.0 - 0.3)


def test_a_missing_reading_keeps_the_command():
    controller = LocusController(KOREN, gain=0.02, kp=0.01)
    first = controller.step(response=5.0)
    assert controller.step(response=float("nan")) == first
    slack = pb(first["v"]) - 3.0
    # no change of the error is known
    assert controller.step(response=3.0)["v"] == pytest.approx(first["v"] + 0.02 * slack)


def test_pid_by_hand():
    """Koren (36) and Fig. 3: the first update has no proportional term."""
    ki, kp, kd = 0.02, 0.01, 0.005
    with pytest.warns(UserWarning, match="kd = 0.005 may step beyond the limit"):
        controller = LocusController(KOREN, gain=ki, kp=kp, kd=kd, start=1.0)
    s, errors = 1.0, []
    for reading in (10.0, 12.0, 9.0, 11.0):
        errors.append(pb(s) - reading)
        s += ki * errors[-1]
        s += kp * (errors[-1] - errors[-2]) if len(errors) > 1 else 0.0
        s += kd * (errors[-1] - 2 * errors[-2] + errors[-3]) if len(errors) > 2 else 0.0
        assert controller.step(response=reading)["v"] == pytest.approx(s, abs=1e-8)


def test_margins_are_kept():
    for options in ({"gain": 0.05}, {"method": "inversion"}):
        run = LocusController(KOREN, margin=0.25, **options).simulate(np.full(600, 2.0))
        assert run.slack[-1] == pytest.approx(0.25, abs=1e-6)


def test_a_filter_blends_inversions():
    rng = np.random.default_rng(2)
    noise = 0.2 * rng.standard_normal((300, 80))
    scatter = {
        f: LocusController(KOREN, method="inversion", filter=f)
        .simulate(np.ones((300, 80)), noise=noise)
        .coordinate[:, 40:]
        .std()
        for f in (1.0, 0.3)
    }
    assert scatter[0.3] == pytest.approx(scatter[1.0] * np.sqrt(0.3 / 1.7), rel=0.1)


def test_reset_copies_and_starts():
    controller = LocusController(KOREN, **PRINTED)
    controller.step(response=9.0)
    twin = copy.deepcopy(controller)
    assert twin.command == controller.command and twin.stretch is controller.stretch
    twin.step(response=9.0)
    assert twin.command != controller.command
    controller.reset()
    assert controller.command["v"] == START
    learned = LocusController(KOREN, gain=0.6, x=(0.76, 1.72), start="learned")
    first = learned.command["v"]
    for _ in range(30):
        learned.step(response=learned.command["v"] + 16 - 4 * learned.command["v"])
    learned.reset()
    assert first == pytest.approx(v_of(1.72)) and learned.command["v"] == pytest.approx(3.0, abs=1e-6)
    assert LocusController(KOREN, start={"v": 2.0, "u": 7.0}).command["v"] == 2.0
    assert LocusController(KOREN, start={"x": 1.0}).command["v"] == pytest.approx(3.0)
    assert LocusController(KOREN, floor=1.0).command["v"] == 1.0


def test_reports():
    controller = LocusController(KOREN, gain=0.05, start=3.0, margin=0.1)
    assert controller.report() == {
        "coordinate": 3.0,
        "x": pytest.approx(1.0),
        "slack": pytest.approx(float("nan"), nan_ok=True),
        "saturated": 0.0,
    }
    controller.step(response=6.0)
    assert controller.report()["slack"] == pytest.approx(1.0)
    assert controller.reports == {
        "coordinate": "",
        "x": "",
        "slack": "",
        "saturated": "",
    } and controller.reads == {"response": ""}
    assert isinstance(controller, hwsim.protocols.Controller)


@pytest.mark.parametrize("options", [{}, {"margin": 0.2}, {"method": "inversion"}, {"floor": 1.0}])
def test_a_command_that_is_saturated_while_the_limit_is_broken_says_so(options):
    """The process is worse than at any planned hidden state; the coordinate stays at the end."""
    controller = LocusController(KOREN, **options)
    for _ in range(19):
        controller.step(response=100.0)
        assert controller.report()["slack"] < 0
    assert controller.report()["saturated"] == 1.0
    advice = "floor is lower" if "floor" in options else "wider range of x"
    with pytest.warns(
        UserWarning, match=f"limit has been exceeded in 20 readings .* v stands at the end .*{advice}"
    ):
        controller.step(response=100.0)
    controller.step(response=100.0)  # once is enough
    controller.step(response=float("nan"))
    assert controller.report()["saturated"] == 0.0
    controller.step(response=100.0)
    controller.reset()
    assert controller.report()["saturated"] == 0.0


def test_an_end_with_slack_is_nothing_to_warn_of():
    controller = LocusController(KOREN)
    for _ in range(40):
        controller.step(response=-100.0)
    assert controller.report()["saturated"] == 1.0 and controller.report()["slack"] > 0


@pytest.mark.parametrize("method", ["feedback", "inversion"])
def test_a_margin_beyond_every_limit_is_refused(method):
    greatest = float(KOREN.limit.max())
    with pytest.raises(
        ValueError, match=r"margin must be < [\d.]+, the greatest limit on the curve; got 6000"
    ):
        LocusController(KOREN, margin=6000.0, method=method)
    LocusController(KOREN, margin=0.9 * greatest, method=method)


def test_a_coordinate_against_which_the_slack_rises():
    """By x itself: more of it is further back on the locus; the gain stays positive."""
    run = LocusController(koren(along="x"), x=(0.5, 20.0)).simulate(np.full(60, 3.0))
    assert run.coordinate[0] == pytest.approx(20.0) and run.coordinate[-1] == pytest.approx(3.0, abs=1e-6)
    assert run.worst_violation < 1e-6


GRINDING = locus.preset("grinding")
K36 = {"along": "infeed_rate", "gain": 3.3e-6, "kp": 5.3e-6, "start": 1e-3, "floor": 0.8e-3, "at": "command"}


@pytest.fixture(scope="module")
def curve():
    return locus.plan(GRINDING)


def ground(controller, parts=3, adapt=True, **options):
    learned = locus.LearnedStart() if adapt else None
    return hwsim.run(
        hwsim.AdaptiveGrinder(GRINDING, **options), controller, parts=parts, rng=0, adapt=learned
    ).outcome


def test_koren_36(curve):
    """27.5 s, then 4.0, 3.5, 3.5, 3.5 s; slack +4 W, then -3 to -6 W. The plant is calibrated to it."""
    became = ground(LocusController(curve, hold=3.0, **K36), parts=5)
    np.testing.assert_allclose(became.convergence_time, [27.5, 4.0, 3.5, 3.5, 3.5], atol=1.0)
    np.testing.assert_allclose(became.slack[0], 4.0, atol=2.0)
    assert np.all(became.slack[1:] < -1.2) and np.all(became.slack[1:] > -8.0)  # small, and real
    naive = ground(LocusController(curve, hold="none", **K36))
    assert np.all(naive.slack[1:] < -20.0)  # without a hold it winds up
    assert np.all(naive.convergence_time[1:] > 10.0)


def test_the_designed_controller_on_the_grinder(curve):
    """It knows the actual infeed only; a margin covers the dulling of the wheel."""
    became = ground(LocusController(curve, along="infeed_rate"))
    assert became.convergence_time[0] < 20 and np.all(became.convergence_time[1:] < 5)
    assert np.all(became.slack > -2.0) and np.all(became.slack < 0.0)
    backed = ground(LocusController(curve, along="infeed_rate", margin=2.0))
    assert np.all(backed.slack > 0.0)
    inverted = ground(LocusController(curve, along="infeed_rate", method="inversion"))
    assert inverted.convergence_time[0] < 10 and np.all(inverted.slack > -2.5)


def test_a_known_lag_stands_for_a_measured_infeed(curve):
    """Without the actual infeed: by an estimate of it, which is exact here."""

    class Blind(LocusController):
        def step(self, **measurement):
            measurement.pop("infeed_rate")
            return super().step(**measurement)

    seen = ground(LocusController(curve, along="infeed_rate"), adapt=False, parts=1)
    blind = ground(Blind(curve, along="infeed_rate", lag=1.25), adapt=False, parts=1)
    assert float(blind.convergence_time[0]) == float(seen.convergence_time[0])
    assert float(blind.slack[0]) == pytest.approx(float(seen.slack[0]), abs=0.02)


def test_an_infeed_that_never_gets_there_is_not_waited_for():
    """The slide stays 20 % behind: after a while readings count all the same, and the power comes down."""
    controller = LocusController(KOREN, start=3.0)
    places = [controller.step(response=20.0, v=0.8 * controller.command["v"])["v"] for _ in range(60)]
    assert places[10] == 3.0 and places[25] < 3.0


def test_readings_wait_until_the_lag_has_settled():
    controller = LocusController(KOREN, start=2.0)
    assert controller.step(response=0.0, v=1.5) == controller.step(response=0.0, v=1.89)
    assert controller.step(response=0.0, v=1.95)["v"] != 2.0
    timed = LocusController(KOREN, start=2.0, hold=1.0, period=0.5)
    assert [timed.step(response=10.0)["v"] == 2.0 for _ in range(4)] == [True, True, True, False]


REFUSED = [
    (
        lambda: LocusController(KOREN, gain=0.6),
        "gain must be < 0.1086 to be stable for x in 0.5..20; got 0.6, stable for 0.5..4.052",
    ),
    (lambda: LocusController(KOREN, along="u"), "along must be 'v', the coordinate of the stretch; got 'u'"),
    (lambda: LocusController(KOREN, gain="best"), "gain must be one of schedule; got 'best'"),
    (lambda: LocusController(KOREN, gain=0.0), "gain must be > 0; got 0.0"),
    (lambda: LocusController(KOREN, start=5.0), "start must be in [0.109726, 4]; got 5.0"),
    (lambda: LocusController(KOREN, start="there"), "start must be one of feasible, learned; got 'there'"),
    (lambda: LocusController(KOREN, start={"u": 1.0}), "start must name v or x; got u"),
    (lambda: LocusController(KOREN, method="pid"), "method must be one of feedback, inversion; got 'pid'"),
    (lambda: LocusController(KOREN, hold="long"), "hold must be one of none, settled; got 'long'"),
    (lambda: LocusController(KOREN, hold=-1.0), "hold must be >= 0 (s); got -1.0"),
    (
        lambda: LocusController(KOREN, hold=1.0, period=None),
        "period must be a number (s) where lag or hold is a time; got None",
    ),
    (lambda: LocusController(KOREN, lag=-1.0), "lag must be >= 0 (s); got -1.0"),
    (lambda: LocusController(KOREN, margin=-0.1), "margin must be >= 0; got -0.1"),
    (lambda: LocusController(KOREN, filter=0.0), "filter must be in (0, 1]; got 0.0"),
    (lambda: LocusController(KOREN, floor=9.0), "floor must be in [0.109726, 4]; got 9.0"),
    (lambda: LocusController(KOREN, at="there"), "at must be one of command, actual; got 'there'"),
    (lambda: LocusController(KOREN).step(power=3.0), "measurement must have 'response'; got power"),
    (lambda: LocusController(KOREN).simulate([1.0, np.nan]), "x[1] must be finite; got nan"),
]


@pytest.mark.parametrize(("call", "said"), REFUSED)
def test_refused(call, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        call()


def test_a_gain_that_a_lag_makes_unstable_is_refused(curve):
    with pytest.raises(
        ValueError,
        match=r"gain must be smaller, or hold 'settled', to be stable with a lag of 1\.25 s; got 5e-05",
    ):
        LocusController(curve, along="infeed_rate", gain=5e-5, lag=1.25, hold="none", at="command")


def test_a_gain_that_may_violate_is_warned_of():
    with pytest.warns(
        UserWarning,
        match=r"gain 0\.06 may step beyond the limit from the start at v = 0\.109726: it never does up to 0\.0543",
    ):
        LocusController(KOREN, gain=0.06)


def test_a_schedule_that_may_violate_is_warned_of():
    with pytest.warns(UserWarning, match=r"theta 1 may step beyond the limit .*: it never does up to 0\.91"):
        LocusController(KOREN, gain=locus.gains.GainSchedule(KOREN, 1.0))


def test_traced_and_closed_form_agree():
    """The same controller on the traced locus; u and, in grinding, the work's rotation are refused as
    coordinates.
    """
    curve = locus.plan(locus.preset("koren-example"))
    ours = LocusController(curve, along="v", **PRINTED).simulate(np.ones(12))
    np.testing.assert_allclose(
        ours.coordinate, LocusController(KOREN, **PRINTED).simulate(np.ones(12)).coordinate, atol=1e-7
    )
    with pytest.raises(ValueError, match="'u' is not, but v and x are"):
        LocusController(curve, along="u")
    with pytest.raises(
        ValueError, match="along must be the name of a control or of the hidden state; got None"
    ):
        LocusController(curve)


def test_what_the_process_says_of_the_machine_is_passed_on(curve):
    class Known(locus.processes.Grinding):
        @property
        def job(self):
            return {"width": (self.width, "mm")}

    given = {
        name: getattr(GRINDING.model, name)
        for name in ("wheel_diameter", "work_diameter", "width", "wheel_speed")
    }
    problem = GRINDING.replace(model=Known(**given))
    assert LocusController(locus.plan(problem, points=200), along="infeed_rate").job == {"width": (9.3, "mm")}
    assert LocusController(KOREN).job == {}


def test_grinding_has_one_coordinate(curve):
    with pytest.raises(ValueError, match="'work_rotation' is not, but infeed_rate and wear_flat_area are"):
        LocusController(curve, along="work_rotation")


def test_no_controller_across_a_jump():
    """A double well, pushed over: at the jump no controller gets to the other branch."""
    problem = locus.Problem(
        controls={"p": (-3.0, 3.0), "q": (0.0, 5.0)},
        hidden={"x": (0.2, 4.0)},
        cost=lambda s, c: (c.p**2 - 1) ** 2 + 0.3 * c.p + 0.4 * (c.q - 3) ** 2,
        constraints=[
            locus.Varying(response=lambda s, c: s.x + c.q * (1 - 0.4 * c.p), limit=lambda s, c: 4.0 + 0 * c.q)
        ],
    )
    curve = locus.plan(problem)
    assert curve.jumps
    with pytest.raises(ValueError, match="jump"):
        LocusController(curve, along="q")


def test_the_slope_of_the_design_is_that_of_the_example():
    assert LocusController(KOREN).design.slope_at(v_of(2.0)) == pytest.approx(-loop_slope_of(2.0), rel=1e-5)
