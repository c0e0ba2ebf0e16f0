"""Closed loops of the torque axis: poles with the observer, what the observer sees, steps, what a load and a
surface do.
"""

from math import exp, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.finishing import TorqueAxis, TorqueController
from sdpgrind.finishing.torque import (
    DampingGains,
    LqgGains,
    PidffGains,
    contact_step,
    observed_torque,
    simulate_axis,
    step_figures,
    stiffness_range,
    triple_pole_step,
    worst_case,
)

AXIS = TorqueAxis()
# A fine converter and encoder: what is left is the linear loop.
FINE = AXIS.replace(bits=40, encoder_counts=2**40, current_limit=4.9)
LOOPS = [
    {"kind": "constant"},
    {"kind": "pidff", "observer": "ideal"},
    {"kind": "pidff"},
    {"kind": "pidff", "observer": "state"},
    {"kind": "pidff", "observer": "state", "gains": PidffGains.of_poles(AXIS)},
    {"kind": "damped"},
    {"kind": "lqg"},
]


def named(options):
    return "-".join(str(value) for value in options.values() if isinstance(value, str))


def controller(axis=AXIS, **options):
    return TorqueController(axis, normal_force=1.111, **options)


def near(poles, wanted, within):
    wanted = [p for one in wanted for p in (one, np.conj(one))]
    return len(poles) == len(wanted) and all(min(abs(poles - p)) < within for p in wanted)


def test_printed_gains_are_triple_poles_of_loop_and_observer_alone():
    gains, J = PidffGains(), AXIS.inertia
    loop = [1, gains.kd, gains.kp + AXIS.contact_angular_stiffness / J, gains.ki]
    np.testing.assert_allclose(loop, np.poly([-61.0] * 3), atol=1e-4)
    np.testing.assert_allclose(
        np.array([J, gains.obs_kd, gains.obs_kp, gains.obs_ki]) / J, np.poly([-40.0] * 3), rtol=1e-9
    )
    np.testing.assert_allclose(
        np.poly(controller(observer="ideal").loop().A), np.poly([-61.0] * 3), rtol=1e-6
    )


def test_designed_gains_are_the_printed_ones_at_their_poles():
    designed = PidffGains.of_poles(AXIS, pole=61.0, observer_pole=40.0)
    for name in ("kp", "ki", "kd", "obs_kp", "obs_ki", "obs_kd"):
        assert getattr(designed, name) == pytest.approx(getattr(PidffGains(), name), rel=1e-6)


@pytest.mark.parametrize(
    ("observer", "wanted"),
    [
        ("pid", [-16.54 + 8.88j, -20.55 + 45.68j, -114.41 + 57.79j]),
        ("state", [-0.97 + 17.2j, -57.4385 + 34.7674j, -93.0912 + 46.6936j]),
    ],
)
def test_true_poles_with_the_observer(observer, wanted):
    poles = controller(observer=observer).poles
    assert near(poles.continuous, wanted, 1e-2)
    assert poles.continuous[0].real == max(poles.continuous.real)
    assert poles.stable
    assert poles.slowest == pytest.approx(-wanted[0].real, abs=0.03)


def test_the_state_form_with_the_printed_gains_falls_over_on_half_the_stiffness():
    half = AXIS.replace(contact_angular_stiffness=0.5 * AXIS.contact_angular_stiffness)
    assert not controller(observer="state").poles_at(half).stable
    assert controller().poles_at(half).stable


@pytest.mark.parametrize("options", LOOPS[2:], ids=named)  # the ideal loop has a triple pole, which moves far
def test_sampled_poles_come_near_those_in_continuous_time(options):
    fast = AXIS.replace(sample_time=1e-5)
    loop = controller(fast, **options)
    z = loop.poles.sampled
    s = np.log(z[np.abs(z) > 0.5]) / 1e-5
    slow = [p for p in loop.poles.continuous if p.real > -200]
    assert all(min(abs(s - p)) < 0.02 * abs(p) for p in slow)


@pytest.mark.parametrize("options", LOOPS, ids=named)
def test_sampled_loop_is_what_the_compiled_code_does(options):
    """Matrices by unit vectors against a run of the axis that never lifts: both without rounding to speak of."""
    loop = controller(FINE, **options)
    torque, begin = 1.111 * 0.095, 700  # the controller has woken, and the tool has come back to the surface
    later = {"load_torque": lambda t: 2e-3 * (t >= begin * 1e-3 - 1e-9)}
    record = simulate_axis(loop, duration=1.0, start="pressed", start_angles=[0.0], **later)
    other = simulate_axis(loop, duration=1.0, start="pressed", start_angles=[0.0])
    answer = loop.loop(sampled_time=True).step_response(
        record.time[: record.time.size - begin], "load_torque"
    )
    np.testing.assert_allclose(
        (record.contact_torque - other.contact_torque)[0, begin:], 2e-3 * answer[:, 0], atol=2e-8 * torque
    )
    np.testing.assert_allclose(
        (record.estimate - other.estimate)[0, begin:], 2e-3 * answer[:, 1], atol=1e-5 * torque
    )


def test_poles_of_the_lqg_are_those_of_filter_and_feedback():
    gains = LqgGains()
    (first, second), A = gains.feedback(AXIS), gains.model(AXIS)[0]
    regulator = np.roots([AXIS.inertia, second, AXIS.contact_angular_stiffness + first])
    np.testing.assert_allclose(
        sorted(regulator.imag), [-80 * np.sqrt(1 - 0.81), 80 * np.sqrt(1 - 0.81)], rtol=1e-9
    )
    error = np.linalg.eigvals(A - np.outer(gains.kalman_continuous(AXIS), [1, 0, 0, 0]))
    wanted = np.concatenate([regulator, error])
    found = controller(kind="lqg").poles.continuous
    assert len(found) == 6
    assert all(min(abs(found - p)) < 1e-6 * abs(p) for p in wanted)


@pytest.mark.parametrize("observer", ["pid", "state"])
@settings(max_examples=25, deadline=None)
@given(inertia=st.floats(0.7, 1.5), motor=st.floats(0.8, 1.2), w=st.floats(0.1, 500))
def test_what_the_observer_sees_is_wang_9_corrected(observer, inertia, motor, w):
    """That = (N/D) [(k_t^/k_t) (T_f + T_L) + J^ (J k_t^/(J^ k_t) - 1) s omega], in a loop whose parameters
    are wrong.
    """
    truth = AXIS.replace(inertia=inertia * AXIS.inertia, torque_constant=motor * AXIS.torque_constant)
    loop = controller(observer=observer).loop(truth)
    contact, estimate = loop.response(w, "load_torque")
    speed = 1j * w * contact / truth.contact_angular_stiffness
    seen = observed_torque(AXIS, observer=observer, truth=truth).response(w)
    assert estimate == pytest.approx(seen[0] * (contact + 1) + seen[1] * speed, rel=1e-9, abs=1e-12)
    J, g, s = AXIS.inertia, PidffGains(), 1j * w
    N = g.obs_kd * s**2 + g.obs_kp * s + g.obs_ki
    D = J * s**3 + N
    N = N if observer == "pid" else g.obs_ki
    k = AXIS.torque_constant / truth.torque_constant
    np.testing.assert_allclose(
        seen, [N / D * k, N / D * J * (truth.inertia * k / J - 1) * s], rtol=1e-12, atol=1e-15
    )


@pytest.mark.parametrize("options", LOOPS, ids=named)
def test_no_controller_tells_the_load_from_the_contact(options):
    loop = controller(**options).loop()
    contact, estimate = loop.dc_gain("load_torque")
    if options.get("observer") == "ideal":  # which is told the contact torque
        assert contact == pytest.approx(0, abs=1e-12)
    else:
        assert contact == pytest.approx(-1, abs=1e-9)
        assert estimate == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(loop.dc_gain("torque_ref"), [1, 1], rtol=1e-9)
    np.testing.assert_allclose(loop.dc_gain("surface_angle"), [0, 0], atol=1e-8)


@pytest.mark.parametrize("options", LOOPS[2:], ids=named)
def test_nor_as_it_is_sampled(options):
    loop = controller(**options).loop(sampled_time=True)
    np.testing.assert_allclose(loop.dc_gain("load_torque"), [-1, 0], atol=1e-8)


def test_the_true_torque_leaves_an_error_of_a_load_that_rises():
    """e = (k_e/J) c / k_fi for T_L = c t: 0.04786 s times c."""
    loop = controller(observer="ideal").loop()
    w = 1e-4
    assert abs(loop.response(w, "load_torque")[0]) / w == pytest.approx(0.04786, rel=1e-3)


@pytest.mark.parametrize(
    ("options", "gain"),
    [
        ({"kind": "constant"}, 0.0147),
        ({"kind": "pidff", "observer": "ideal"}, 0.120),
        ({"kind": "lqg"}, 0.039),
    ],
    ids=["constant", "pidff", "lqg"],
)
def test_damping_on_the_speed_adds_error_on_a_surface_that_moves(options, gain):
    """E22: at 2 Hz, of k_e theta_s. Constant current has the inertia alone: w^2/(w0^2 - w^2)."""
    w = 4 * pi
    found = abs(controller(**options).loop().response(w, "surface_angle")[0]) / AXIS.contact_angular_stiffness
    assert found == pytest.approx(gain, rel=0.01)
    if options["kind"] == "constant":
        assert found == pytest.approx(w**2 / (AXIS.natural_frequency**2 - w**2), rel=1e-9)


def test_steps_of_wang_8():
    time = np.array([0.01, 0.02, 0.05, 0.1, 0.15])
    wanted = [0.327386, 0.784010, 1.248753, 1.067533, 1.007815]
    np.testing.assert_allclose(triple_pole_step(time), wanted, atol=1e-6)
    np.testing.assert_allclose(contact_step(time), wanted, atol=1e-6)
    np.testing.assert_allclose(
        contact_step(time, gains=PidffGains.of_poles(AXIS)), triple_pole_step(time), atol=1e-12
    )
    np.testing.assert_allclose(
        controller(observer="ideal").loop().step_response(time)[:, 0], contact_step(time), atol=1e-12
    )


def test_overshoot_peak_and_settling_of_wang_8():
    figures = step_figures(contact_step)
    assert figures.overshoot == pytest.approx(0.24894, abs=1e-5)
    assert figures.peak_time == pytest.approx(49.18e-3, abs=1e-4)
    assert figures.settling == pytest.approx(129.3e-3, abs=1e-4)
    ideal = step_figures(triple_pole_step)
    assert ideal.overshoot == pytest.approx(5 * exp(-3), rel=1e-9)
    assert ideal.peak_time == pytest.approx(3 / 61, rel=1e-6)


def test_a_prefilter_takes_the_overshoot_away():
    figures = step_figures(lambda t: triple_pole_step(t, prefilter=True))
    assert figures.overshoot < 1e-9
    assert figures.settling == pytest.approx(7.517 / 61, rel=1e-3)
    assert PidffGains.of_poles(AXIS).prefilter_rate(AXIS) == pytest.approx(61 / 3, rel=1e-12)
    record = simulate_axis(
        controller(FINE, observer="ideal", prefilter=True), duration=0.4, start_angles=[0.0]
    )
    found = record.contact_torque[0] / (1.111 * 0.095)
    # sampled at 1 ms
    np.testing.assert_allclose(found, triple_pole_step(record.time, prefilter=True), atol=0.03)
    assert record.overshoot[0] < 5e-3


def test_step_with_the_observer():
    figures = step_figures(controller().loop())
    assert figures.overshoot == pytest.approx(0.335, rel=0.01)
    assert figures.settling == pytest.approx(0.2115, rel=0.01)


def test_an_observer_faster_than_the_loop_is_one_argument_away():
    fast = controller(gains=PidffGains.of_poles(AXIS))
    assert fast.poles.slowest > 2 * controller().poles.slowest
    assert step_figures(fast.loop()).settling < 0.7 * step_figures(controller().loop()).settling


def test_a_step_that_does_not_settle_says_so():
    assert step_figures(controller(kind="constant").loop(), horizon=0.3).settling == float("inf")


def test_ranges_of_stiffness():
    assert stiffness_range(controller(), low=0.1, high=10) == (0.1, 10)
    low, high = stiffness_range(controller(kind="lqg"), low=0.3, high=10)
    assert low == 0.3
    assert 2 < high < 5
    truth = [
        AXIS.replace(contact_angular_stiffness=f * high * AXIS.contact_angular_stiffness)
        for f in (0.99, 1.01)
    ]
    assert [controller(kind="lqg").loop(t, sampled_time=True).stable for t in truth] == [True, False]
    low, high = stiffness_range(controller(kind="damped"), low=0.3, high=3)
    assert (low, high) == (0.3, 3)
    assert stiffness_range(controller(kind="constant")) == (1.0, 1.0)  # nothing damps it


@settings(max_examples=20, deadline=None)
@given(counts=st.integers(2000, 10**8), step=st.floats(2e-4, 2e-3), density=st.floats(0.01, 100))
def test_the_filter_is_stable_whatever_the_encoder(counts, step, density):
    axis, gains = AXIS.replace(encoder_counts=counts, sample_time=step), LqgGains(density=density)
    A = gains.sampled(axis)[0]
    assert np.abs(np.linalg.eigvals(A - A @ np.outer(gains.kalman(axis), [1, 0, 0, 0]))).max() < 1
    still = gains.model(axis)[0] - np.outer(gains.kalman_continuous(axis), [1, 0, 0, 0])
    assert np.linalg.eigvals(still).real.max() < 0


def test_loops_and_records_are_told_in_a_line():
    law = controller(kind="lqg")
    assert repr(law.poles) == f"AxisPoles({law.poles})"
    assert repr(law.loop(sampled_time=True)).startswith(
        "AxisLoop(6 states, sampled every 0.001 s, stable; slowest pole 0.949"
    )
    assert repr(controller(kind="constant").loop()).startswith("AxisLoop(2 states, continuous, not stable")
    record = simulate_axis(law, duration=0.5, start_angles=3)
    assert repr(record).startswith("AxisRecord(3 runs of 0.5 s, 1.111 N: 2 % within 0.0")
    case = worst_case(law, (0.5, 1.0), duration=0.5, start_angles=3)
    assert repr(case).startswith(
        "StiffnessCase(at worst of k_e x 0.5 to 1: 5 % within "
    ) and "to 4.35)" in repr(case)


def test_poles_are_told():
    assert "-16.54±8.88j" in str(controller().poles)
    assert (
        "±"
        not in str(controller(observer="ideal", gains=PidffGains(kp=-9000.0, ki=2e3, kd=150.0)).poles).split(
            "1/s"
        )[0]
    )
    assert DampingGains(damping=1.0).speed_gain(AXIS) == pytest.approx(2 * DampingGains().speed_gain(AXIS))
