"""Torque controllers: against slow twins, the published table, what they do along a motion, state and copies."""

import copy
import dataclasses
import pickle
import types
from math import inf, nan, pi

import numpy as np
import pytest
from torque_twins import DampedTwin, LqgTwin, PidffTwin

from sdpgrind.base.states import named
from sdpgrind.finishing import TorqueAxis, TorqueController, kernels
from sdpgrind.finishing.torque import DampingGains, LqgGains, PidffGains, simulate_axis, worst_case

AXIS = TorqueAxis()
COARSE = AXIS.replace(encoder_counts=4000)
TWO_HERTZ = 4 * pi
KINDS = ("constant", "pidff", "damped", "lqg")
TORQUE = 1.111 * 0.095


def controller(axis=AXIS, **options):
    return TorqueController(axis, **({"normal_force": 1.111} | options))


def wave(time):
    return 0.1 * np.sin(TWO_HERTZ * time)


def motion(time=(0.0, 1.0, 1.0, 2.0), per_force=(0.095, 0.1, 0.12, 0.09), job=None):
    profile = np.column_stack([time, np.zeros((len(time), 7))])
    problem = types.SimpleNamespace(job=job or {"path_digest": "a"})
    return types.SimpleNamespace(
        time=np.array(time), torque_per_force=np.array(per_force), profile=profile, problem=problem
    )  # fmt: skip


@pytest.mark.parametrize(
    ("options", "twin"),
    [
        ({"kind": "pidff"}, lambda a: PidffTwin(a, PidffGains())),
        ({"kind": "pidff", "prefilter": True}, lambda a: PidffTwin(a, PidffGains(), prefilter=True)),
        ({"kind": "pidff", "observer": "state"}, lambda a: PidffTwin(a, PidffGains(), "state")),
        ({"kind": "damped"}, lambda a: DampedTwin(a, DampingGains())),
        ({"kind": "lqg"}, lambda a: LqgTwin(a, LqgGains())),
    ],
    ids=["pidff", "prefilter", "state", "damped", "lqg"],
)
@pytest.mark.parametrize("limit", [1.0, 0.4])
def test_compiled_samples_are_those_of_a_plain_twin(options, twin, limit):
    """With a fine converter, so that rounding does not hide or make differences; with limits that are met,
    too.
    """
    axis = AXIS.replace(bits=40, current_limit=limit)
    law, plain = controller(axis, normal_force=0.6, **options), twin(axis)
    rng, angle = np.random.default_rng(3), 0.0
    limited = 0
    for k in range(400):
        angle += rng.normal(0, 4e-4) + 1e-3 * np.cos(0.05 * k)
        current = law.step(motor_angle=angle)["current"]
        wanted, estimate = plain.sample(angle, 0.6 * 0.095)
        limited += abs(abs(wanted) - limit) < 1e-6
        assert current == pytest.approx(wanted, abs=2e-9)
        assert law.report()["torque_estimate"] == pytest.approx(estimate, abs=2e-9)
    assert limited > 0 or limit == 1.0


TABLE = [
    # kind and axis; 2 % settling (s), overshoot, rms (N), 2 Hz error (N) of the specification
    ("ideal", {"observer": "ideal"}, AXIS, 0.132, 0.24, None, 0.0159),
    ("pidff", {}, AXIS, 0.201, 0.32, 0.008, 0.0155),
    ("pidff, 4000 counts", {}, COARSE, inf, 0.34, 0.098, None),
    ("damped", {"kind": "damped"}, AXIS, None, None, None, 0.017),
    ("lqg", {"kind": "lqg"}, AXIS, 0.063, None, 0.006, 0.005),
    ("constant", {"kind": "constant"}, AXIS, inf, 1.0, None, 0.0020),
]


@pytest.mark.parametrize(
    ("options", "axis", "settling", "overshoot", "rms", "error"),
    [row[1:] for row in TABLE],
    ids=[row[0] for row in TABLE],
)
def test_table_of_controllers(options, axis, settling, overshoot, rms, error):
    """Means over 20 start angles within 20 % of the specification.

    Noise is that of limit cycles, which some start angles have and others not: 20 of them give 0.0062 to
    0.0065 N for PIDFF, 400 give 0.0065 to 0.0068, in every order of rounding that was tried."""
    found = simulate_axis(controller(axis, **options), duration=1.0)
    figures = found.figures
    if settling is not None:
        assert figures["settling_2"] == (inf if settling == inf else pytest.approx(settling, rel=0.2))
    if overshoot is not None:
        assert figures["overshoot"] == pytest.approx(overshoot, rel=0.2)
    if rms is not None:
        many = simulate_axis(controller(axis, **options), duration=1.0, start_angles=400)
        assert many.figures["rms_error"] == pytest.approx(rms, rel=0.2)
    if error is not None:
        moved = simulate_axis(controller(axis, **options), duration=4.0, height_error=wave, start="pressed")
        assert np.mean(moved.error_amplitude(TWO_HERTZ)) == pytest.approx(error, rel=0.2)


def test_rest_of_the_table():
    damped = simulate_axis(controller(kind="damped"))
    assert damped.figures["settling_5"] == pytest.approx(0.07, rel=0.2)
    assert 0.004 < damped.figures["ripple"] < 0.008
    assert simulate_axis(controller(observer="ideal")).figures["ripple"] < 0.001
    lqg = simulate_axis(controller(kind="lqg"))
    assert 0.005 < lqg.figures["overshoot"] < 0.015  # 1 %, rounded
    chatter = simulate_axis(controller(COARSE)).current[:, 500:].std(axis=1).mean()
    assert chatter == pytest.approx(0.347, rel=0.2)
    moved = simulate_axis(controller(kind="lqg"), duration=4.0, height_error=wave, start="pressed")
    quantised = np.sqrt(2 * np.mean((moved.normal_force[:, 2000:] - 1.111) ** 2))
    assert quantised == pytest.approx(0.010, rel=0.2)


def test_speed_is_paid_for_in_tolerance():
    """Settling to 5 % at the stiffness that is believed, and over which stiffnesses it still settles."""
    lqg = worst_case(controller(kind="lqg"), (0.3, 1.0, 2.0, 5.0), duration=1.5)
    damped = worst_case(controller(kind="damped"), (0.3, 1.0, 2.0, 3.0), duration=1.5)
    assert lqg.settling_5[1] < damped.settling_5[1]
    assert np.all(np.isfinite(lqg.settling_5[:3])) and lqg.settling_5[3] == inf and lqg.overshoot[3] > 1
    assert np.all(np.isfinite(damped.settling_5))
    assert lqg.stable[1] < 5 < damped.stable[1]
    assert 0.010 < lqg.ripple[2] < 0.0222  # at twice the stiffness it fills most of the 2 % band
    assert lqg.worst["settling_5"] == inf and damped.worst["overshoot"] == damped.overshoot.max()
    assert "stable for k_e x" in str(lqg) and "inf" in str(lqg)


@pytest.mark.parametrize("kind", KINDS)
def test_a_load_that_is_not_known_is_an_error_of_the_force(kind):
    load = 0.02
    blind = simulate_axis(controller(kind=kind), duration=2.0, load_torque=load, start="pressed")
    known = simulate_axis(
        controller(kind=kind, load_torque=load), duration=2.0, load_torque=load, start="pressed"
    )
    assert np.mean(blind.offset) == pytest.approx(-load / 0.095, rel=0.03)
    assert np.mean(known.offset) == pytest.approx(0, abs=0.004)
    believed = blind.estimate[:, 1000:].mean()
    assert believed == pytest.approx(TORQUE, rel=0.01)  # and does not know it


@pytest.mark.parametrize("kind", KINDS)
def test_an_error_of_the_motor_is_one_of_the_force(kind):
    strong = AXIS.replace(torque_constant=1.1 * AXIS.torque_constant)
    record = simulate_axis(controller(kind=kind), truth=strong, duration=2.0, start="pressed")
    assert np.mean(record.offset) == pytest.approx(0.1 * 1.111, rel=0.05)


def test_headroom_is_short_at_the_greatest_force():
    """T* = 0.158 N m with a quarter of overshoot needs more than 0.185: limited; the prefilter needs less."""
    plain = simulate_axis(controller(normal_force=1.667))
    gentle = simulate_axis(controller(normal_force=1.667, prefilter=True))
    most = AXIS.current_step * np.floor(1.0 / AXIS.current_step)
    assert plain.current.max() == most
    assert np.mean(plain.settling(0.05) < 0.3) >= 0.9  # the others chatter
    assert gentle.overshoot.mean() < 0.05 < plain.overshoot.mean()


def test_the_integral_waits_at_the_limit():
    """A reference that the motor cannot give for 0.1 s leaves nothing behind in the integral."""
    law = controller().law
    state = law.start.copy()
    for _ in range(100):
        current = kernels.controller_sample(law.parameters, state, 0.0, 5.0, 0.0, 0.0)
    assert current == pytest.approx(1.0, abs=AXIS.current_step)
    assert named(state, kernels.CONTROLLER).integral == 0.0
    kernels.controller_sample(law.parameters, state, 0.0, -0.01, 0.0, 0.0)
    assert named(state, kernels.CONTROLLER).integral != 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_step_batch_and_compiled_loop_give_the_same_bits(kind):
    """Along a motion, with the feed that waits: Python's steps against the batch."""
    axis, played = AXIS, motion()
    law = controller(kind=kind, motion=played, settle_time=0.05, load_torque=[0.0, 0.01, 0.01, 0.0])
    record = simulate_axis(
        law, duration=1.5, start_angles=[1e-4], height_error=lambda t: 0.02 * np.sin(9 * t), load_torque=0.01
    )
    stepped = copy.deepcopy(law)
    state, path_time, override, contact = np.array([1e-4, 0.0, 0.0]), 0.0, 0.0, 0.0
    surface = np.append(record.height_error, 0.02 * np.sin(9 * 1.5)) / axis.lever_arm
    for k in range(record.time.size):
        assert (state[0], contact) == (record.angle[0, k], record.contact_torque[0, k])
        shown = kernels.encoder_reading(state[0], axis.angle_step)
        command = stepped.step(motor_angle=shown, path_time=path_time, other=1.0)
        assert ("motion" in command) == (k == 0)
        override = command["feed_override"]
        assert command["current"] == record.current[0, k]
        assert override == (k >= 50)
        contact = kernels.axis_tick(
            state, command["current"], 0.01, 1e-4 + surface[k], 1e-4 + surface[k + 1], axis.parameters
        )
        path_time += override * 1e-3
    assert path_time == pytest.approx(1.45)
    assert not law.state.any()  # the batch had its own


def test_the_torque_follows_the_motion():
    law = controller(kind="constant", motion=motion(), settle_time=0.0)
    for path_time, wanted in [
        (0.0, 0.095),
        (0.5, 0.0975),
        (1.0, 0.12),
        (0.25, 0.09625),
        (1.5, 0.105),
        (9.0, 0.09),
    ]:
        law.step(motor_angle=0.0, path_time=path_time)
        assert law.report()["torque_ref"] == pytest.approx(1.111 * wanted, rel=1e-12)
    law.step(motor_angle=0.0)  # it is not told: as before
    assert law.report()["torque_ref"] == pytest.approx(1.111 * 0.09, rel=1e-12)


def test_references_between_times_are_those_of_numpy():
    rng = np.random.default_rng(0)
    time = np.concatenate([[0.0], np.cumsum(rng.exponential(0.1, 40))])
    torque, state = rng.normal(size=41), np.zeros(kernels.CONTROL)
    for asked in rng.uniform(-0.1, time[-1] + 0.1, 200):
        found = kernels.torque_at(time, torque, asked, state)
        assert found == pytest.approx(np.interp(asked, time, torque), rel=1e-12, abs=1e-14)


def test_force_along_a_motion_is_the_torque_over_its_lever():
    law = controller(kind="lqg", motion=motion(), settle_time=0.0)
    record = simulate_axis(law, duration=0.9)
    assert np.mean(record.offset) == pytest.approx(0, abs=0.005)
    assert record.contact_torque[0, -1] == pytest.approx(1.111 * (0.095 + 0.005 * 0.9), rel=0.02)


def test_what_is_said_to_the_loop():
    still, moving = controller(), controller(motion=motion())
    assert dict(still.commands) == {"current": "A"} and dict(still.reads) == {"motor_angle": "rad"}
    assert set(moving.commands) == {"current", "feed_override", "motion"} and moving.reads["path_time"] == "s"
    force = {"target_force": (1.111, "N")}
    assert moving.job == {"path_digest": "a"} | force and still.job == force
    assert still.description == {} and moving.description["motion_duration"] == 2.0
    assert moving.description != controller(motion=motion(time=(0.0, 1.0, 1.0, 2.5))).description
    assert still.period == 1e-3
    assert set(still.report()) == set(still.reports)
    assert set(still.step(motor_angle=0.0)) == {"current"}
    np.testing.assert_array_equal(
        moving.step(motor_angle=0.0, path_time=0.0)["motion"], moving.motion.profile
    )


def test_the_motion_waits_until_the_contact_has_settled():
    assert controller().settling == pytest.approx(4 / 16.54, rel=1e-3)
    assert controller(kind="lqg").settling < 0.12
    assert controller(kind="constant").settling == 0.5


@pytest.mark.parametrize("kind", KINDS)
def test_copies_have_a_state_of_their_own(kind):
    law = controller(kind=kind, motion=motion())
    for k in range(20):
        law.step(motor_angle=1e-4 * k, path_time=0.0)
    twins = copy.deepcopy(law), pickle.loads(pickle.dumps(law))
    wanted = [law.step(motor_angle=2e-3 - 1e-4 * k, path_time=0.0)["current"] for k in range(20)]
    for twin in twins:
        assert [twin.step(motor_angle=2e-3 - 1e-4 * k, path_time=0.0)["current"] for k in range(20)] == wanted
    assert twins[0].motion is law.motion
    law.reset()
    fresh = controller(kind=kind, motion=motion())
    assert (
        law.step(motor_angle=1e-4, path_time=0.0)["current"]
        == fresh.step(motor_angle=1e-4, path_time=0.0)["current"]
    )
    other = law.replace(normal_force=0.556)
    assert other.report()["torque_ref"] == 0.0


@pytest.mark.parametrize("kind", ["pidff", "damped", "lqg"])
def test_a_reading_that_is_missing_does_little_harm(kind):
    axis, law = AXIS, controller(kind=kind)
    state, contact, forces = np.array([0.0, 0.0, 0.0]), 0.0, []
    for k in range(600):
        shown = kernels.encoder_reading(state[0], axis.angle_step)
        current = law.step(motor_angle=np.nan if k % 50 == 49 else shown)["current"]
        contact = kernels.axis_tick(state, current, 0.0, 0.0, 0.0, axis.parameters)
        forces.append(contact / 0.095)
    assert np.all(np.isfinite(forces))
    assert np.abs(np.array(forces[400:]) - 1.111).max() < 0.08


def test_controllers_touch_down_from_the_air():
    """Half a millimetre above the surface: it falls, touches, bounces at most, and holds."""
    record = simulate_axis(controller(kind="lqg"), duration=1.5, height_error=lambda t: 0.5 * (t > 0))
    assert np.all(record.contact_torque[:, 1:10] == 0)
    assert np.all(np.isfinite(record.settling(0.05)))


@pytest.mark.parametrize(
    ("kind", "hertz"), [("pidff", 5.56), ("damped", 8.15), ("lqg", 9.40), ("constant", 10.68)]
)
def test_force_is_held_on_slow_waves_only(kind, hertz):
    """Above some 10 Hz a surface that moves is felt in full by every controller: at 25 mm/s, waves shorter
    than 2.5 mm.
    """
    loop = controller(kind=kind).loop()
    felt = np.abs(loop.response(2 * pi * np.array([0.98 * hertz, 1.02 * hertz, 12.0]), "surface_angle")[:, 0])
    felt /= AXIS.contact_angular_stiffness
    assert felt[0] < 0.5**0.5 < felt[1]
    assert felt[2] > 1


def test_figures_of_a_record_by_hand():
    record = simulate_axis(controller(kind="lqg"), duration=0.4, start_angles=3)
    force = record.normal_force
    for run, settled in enumerate(record.settling(0.05)):
        inside = np.abs(force[run] / 1.111 - 1) <= 0.05
        first = next(k for k in range(400) if inside[k:].all())
        assert settled == pytest.approx(record.time[first])
    np.testing.assert_allclose(record.overshoot, force.max(axis=1) / 1.111 - 1)
    np.testing.assert_allclose(record.rms_error**2, record.ripple**2 + record.offset**2, rtol=1e-12)
    assert record.figures["overshoot"] == pytest.approx(record.overshoot.mean())
    time = np.arange(4000) * 1e-3
    swinging = 1.111 + 0.05 * np.sin(20 * time) + 0.02 * np.sin(104 * time)
    long = dataclasses.replace(record, time=time, normal_force=swinging[np.newaxis])
    assert long.error_amplitude(20.0)[0] == pytest.approx(0.05, rel=1e-3)


def test_a_record_is_drawn():
    plt = pytest.importorskip("matplotlib.pyplot")
    record = simulate_axis(controller(), duration=0.1, start_angles=4)
    figure = record.plot()
    (ax,) = figure.axes
    assert len(ax.lines) == 5 and record.plot(ax) is figure and len(ax.lines) == 10
    assert ax.get_xlabel() == "time [s]" and ax.get_ylabel() == "normal force [N]"
    plt.close(figure)


@pytest.mark.parametrize("kind", ["pidff", "damped", "lqg"])
def test_it_does_not_matter_where_the_encoder_has_its_zero(kind):
    """Far from it the tool comes down as it does at it, to what rounding of the encoder makes of it."""
    law = controller(kind=kind)
    shares = (np.arange(20) + 0.5) / 20 * AXIS.angle_step
    here = simulate_axis(law, start_angles=shares).normal_force.max(axis=1)
    for far in (-0.5, 0.02, 3.0):
        there = simulate_axis(law, start_angles=far + shares).normal_force.max(axis=1)
        assert there.mean() == pytest.approx(here.mean(), rel=0.01)


@pytest.mark.parametrize("kind", ["pidff", "damped", "lqg"])
def test_a_first_reading_that_is_missing_starts_nothing(kind):
    """Until there is one, the current is that of the reference; the observer begins at the first."""
    with_all, without = controller(kind=kind), controller(kind=kind)
    assert without.step(motor_angle=nan)["current"] == pytest.approx(1.111 * 0.095 / 0.185, abs=0.0013)
    for angle in (0.5, 0.5001, 0.5003):
        wanted, found = (
            with_all.step(motor_angle=angle)["current"],
            without.step(motor_angle=angle)["current"],
        )
        assert found == pytest.approx(wanted, abs=2 * 0.00245)


def test_a_lever_that_is_not_as_believed_is_an_error_of_the_force():
    record = simulate_axis(controller(kind="lqg"), truth=AXIS.replace(lever_arm=80.0))
    settled = record.normal_force[:, -200:].mean()
    assert settled == pytest.approx(record.contact_torque[:, -200:].mean() / 0.080, rel=1e-12)
    assert settled == pytest.approx(1.111 * 95 / 80, rel=0.005)
