"""What the torque axis refuses, and what it says."""

import types

import numpy as np
import pytest
from finishing_inside import identify_load_torque

from sdpgrind.finishing import TorqueAxis, TorqueController
from sdpgrind.finishing.torque import (
    AxisLoop,
    DampingGains,
    LqgGains,
    PidffGains,
    gravity_torque,
    observed_torque,
    simulate_axis,
    step_figures,
    stiffness_range,
    triple_pole_step,
    worst_case,
)

AXIS = TorqueAxis()


def controller(axis=AXIS, **options):
    return TorqueController(axis, **({"normal_force": 1.111} | options))


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("inertia", 0.0, r"inertia must be > 0 \(kg m\^2\); got 0.0"),
        ("contact_angular_stiffness", -1.0, r"contact_angular_stiffness must be > 0 \(N m/rad\); got -1.0"),
        ("torque_constant", 0.0, r"torque_constant must be > 0 \(N m/A\); got 0.0"),
        ("lever_arm", 0.0, r"lever_arm must be > 0 \(mm\); got 0.0"),
        ("current_limit", 6.0, r"current_limit must be <= current_range = 5 \(A\); got 6.0"),
        ("current_range", 0.0, r"current_range must be > 0 \(A\); got 0.0"),
        ("bits", 0, "bits must be >= 1; got 0"),
        ("inertia", 1.1, r"inertia must be <= 1: is it in kg m\^2\? \(kg m\^2\); got 1.1"),
        ("torque_constant", 185.0, r"torque_constant must be <= 20: is it in N m/A\? \(N m/A\); got 185.0"),
        ("lever_arm", 0.095, r"lever_arm must be >= 1; 95.0 for 0.095 m \(mm\); got 0.095"),
        ("encoder_counts", 0, "encoder_counts must be >= 1; got 0"),
        ("sample_time", 0.0, r"sample_time must be > 0 \(s\); got 0.0"),
        ("inertia", float("nan"), r"inertia must be finite \(kg m\^2\); got nan"),
    ],
)
def test_axis(field, value, message):
    with pytest.raises(ValueError, match=message):
        TorqueAxis(**{field: value})


def test_counts_are_whole():
    with pytest.raises(TypeError, match=r"encoder_counts must be a whole number; got 4000\.0"):
        TorqueAxis(encoder_counts=4000.0)


@pytest.mark.parametrize(
    ("options", "limit"),
    [({"kind": "pidff"}, 3.28e-3), ({"kind": "lqg"}, 2.5e-3), ({"kind": "damped"}, 1.92e-3)],
)
def test_sample_time_must_be_short_for_the_loop(options, limit):
    with pytest.raises(
        ValueError, match=rf"sample_time must be <= 1/\(5 p\) = {limit:.3g} for p = .* 1/s \(s\); got 0.004"
    ):
        controller(AXIS.replace(sample_time=4e-3), **options)
    controller(AXIS.replace(sample_time=4e-3), kind="constant")  # which has no loop


def test_a_loop_that_is_not_stable_is_refused_with_its_poles():
    with pytest.raises(
        ValueError,
        match=r"stable loop on the axis that is believed; its poles are .*±.*j.* 1/s; slowest sampled",
    ):
        controller(gains=PidffGains(ki=5e6))
    soft = AXIS.replace(contact_angular_stiffness=0.5 * AXIS.contact_angular_stiffness)
    with pytest.raises(ValueError, match=r"its poles are 3\.86±19\.11j"):
        controller(soft, observer="state")


def test_a_loop_that_only_sampling_makes_unstable_is_refused_too():
    gains = PidffGains.of_poles(AXIS, pole=61.0, observer_pole=1500.0)
    fast = AXIS.replace(sample_time=1e-5)
    assert controller(fast, gains=gains).poles.stable
    with pytest.raises(ValueError, match="slowest sampled -"):
        controller(gains=gains)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"normal_force": 0.0}, r"normal_force must be > 0 \(N\); got 0.0"),
        (
            {"normal_force": 1.96},
            "0.1862 N m and a load of 0 N m need 1.006 A, more than current_limit = 1 A",
        ),
        ({"normal_force": 1.667, "load_torque": 0.05}, "0.1584 N m and a load of 0.05 N m need 1.126 A"),
        ({"load_torque": float("nan")}, r"load_torque\[0\] must be finite \(N m\); got nan"),
        (
            {"load_torque": [0.0, 0.0]},
            r"load_torque must be one number or 1, one for each time of the motion; got shape \(2,\)",
        ),
        ({"kind": "pid"}, "kind must be one of constant, pidff, damped, lqg; got 'pid'"),
        ({"observer": "luenberger"}, "observer must be one of pid, state, ideal; got 'luenberger'"),
        (
            {"kind": "lqg", "observer": "state"},
            "observer and prefilter must be left as they are with kind 'lqg'; got 'state'",
        ),
        (
            {"kind": "damped", "prefilter": True},
            "observer and prefilter must be left as they are with kind 'damped'",
        ),
        (
            {"kind": "constant", "gains": PidffGains()},
            "gains must be left out with kind 'constant', which has no loop",
        ),
        ({"settle_time": -1.0}, r"settle_time must be >= 0 \(s\); got -1.0"),
    ],
)
def test_controller(options, message):
    with pytest.raises(ValueError, match=message):
        controller(**options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"kind": "lqg", "gains": PidffGains()},
            r"gains must be a LqgGains, for kind 'lqg'; got PidffGains\(\)",
        ),
        ({"kind": "lqg", "gains": "printed"}, "gains must be a LqgGains, for kind 'lqg'; got 'printed'"),
        (
            {"motion": 3.0},
            "motion must be a motion, as plan.problem. gives it, or None; it has no time, torque_per_force, profile",
        ),
    ],
)
def test_controller_of_wrong_types(options, message):
    with pytest.raises(TypeError, match=message):
        controller(**options)
    with pytest.raises(TypeError, match="axis must be a TorqueAxis; got 3"):
        TorqueController(3, normal_force=1.0)


@pytest.mark.parametrize(
    ("time", "per_force", "message"),
    [
        (
            [0.0, 1.0],
            [0.1],
            r"motion.torque_per_force must have one number for each time; got \(1,\) and \(2,\)",
        ),
        ([0.0, 1.0, 0.5], [0.1] * 3, "motion.time must begin at 0 and rise"),
        ([0.1, 1.0], [0.1] * 2, "motion.time must begin at 0 and rise"),
        ([0.0, 1.0], [0.1, 0.0], r"motion.torque_per_force must be > 0 \(N m/N\); got 0.0"),
        ([0.0, np.nan], [0.1, 0.1], r"motion.time\[1\] must be finite \(s\); got nan"),
    ],
)
def test_motion(time, per_force, message):
    played = types.SimpleNamespace(
        time=np.array(time), torque_per_force=np.array(per_force), profile=np.zeros((len(time), 8))
    )
    with pytest.raises(ValueError, match=message):
        controller(motion=played)


def test_a_motion_of_another_tool():
    problem = types.SimpleNamespace(lever_arm=80.0)
    played = types.SimpleNamespace(
        time=np.zeros(1), torque_per_force=np.ones(1), profile=np.zeros((1, 8)), problem=problem
    )
    with pytest.raises(ValueError, match=r"axis.lever_arm must be that of the motion, 80 \(mm\); got 95.0"):
        controller(motion=played)


def test_the_true_torque_is_known_in_simulations_only():
    law = controller(observer="ideal")
    with pytest.raises(
        ValueError,
        match="observer must be 'pid' or 'state' on a machine: no sensor has the true contact torque",
    ):
        law.step(motor_angle=0.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PidffGains(kd=0.0), r"kd must be > 0 \(1/s\); got 0.0"),
        (lambda: PidffGains(kp=float("inf")), r"kp must be finite \(1/s\^2\); got inf"),
        (lambda: PidffGains.of_poles(AXIS, pole=0.0), r"pole must be > 0 \(1/s\); got 0.0"),
        (
            lambda: PidffGains.of_poles(AXIS, observer_pole=-1.0),
            r"observer_pole must be > 0 \(1/s\); got -1.0",
        ),
        (lambda: DampingGains(damping=0.0), "damping must be > 0; got 0.0"),
        (lambda: DampingGains(highpass_time=0.0), r"highpass_time must be > 0 \(s\)"),
        (lambda: LqgGains(bandwidth=0.0), r"bandwidth must be > 0 \(rad/s\)"),
        (lambda: LqgGains(damping=-1.0), "damping must be > 0; got -1.0"),
        (lambda: LqgGains(density=0.0), r"density must be > 0 \(N m/s\^1.5\)"),
        (lambda: observed_torque(AXIS, observer="ideal"), "observer must be one of pid, state; got 'ideal'"),
        (lambda: gravity_torque(-1.0, 50.0, 0.0), r"mass must be >= 0 \(kg\); got -1.0"),
        (lambda: gravity_torque(1.0, -50.0, 0.0), r"centre_distance must be >= 0 \(mm\)"),
        (lambda: gravity_torque(1.0, 50.0, [0.0, np.nan]), r"angle\[1\] must be finite \(rad\); got nan"),
        (lambda: triple_pole_step([0.0, np.nan]), r"time\[1\] must be finite \(s\)"),
        (lambda: step_figures(triple_pole_step, horizon=0.0), r"horizon must be > 0 \(s\)"),
        (lambda: step_figures(triple_pole_step, band=0.0), r"band must be in \(0, 1\]"),
    ],
)
def test_gains_and_functions(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"duration": 0.0}, r"duration must be > 0 \(s\)"),
        ({"duration": 1e-3}, r"duration must be >= 0.002, two samples \(s\); got 0.001"),
        (
            {"height_error": lambda t: np.where(t > 0.2, np.nan, 0.0)},
            r"height_error\(time\)\[201\] must be finite \(mm\); got nan",
        ),
        (
            {"height_error": lambda t: t[:3]},
            r"height_error\(time\) must have one value for each time \(mm\); got shape \(3,\)",
        ),
        (
            {"load_torque": lambda t: t / 0 if False else np.full(t.size, np.nan)},
            r"load_torque\(time\)\[0\] must be finite \(N m\)",
        ),
        ({"load_torque": np.nan}, r"load_torque must be finite \(N m\); got nan"),
        ({"start_angles": 0}, "start_angles must be >= 1; got 0"),
        ({"start_angles": []}, r"start_angles must be a number, or of shape \(runs,\); got \(0,\)"),
        ({"start": "flying"}, "start must be one of touching, pressed; got 'flying'"),
    ],
)
def test_simulation(options, message):
    with pytest.raises(ValueError, match=message):
        simulate_axis(controller(), **({"duration": 0.3} | options))


def test_simulation_on_another_clock():
    slow = AXIS.replace(sample_time=2e-3)
    for run in (lambda: controller().loop(slow), lambda: simulate_axis(controller(), truth=slow)):
        with pytest.raises(
            ValueError, match=r"truth.sample_time must be that of the controller, 0.001 \(s\); got 0.002"
        ):
            run()


def test_figures_and_ranges():
    record = simulate_axis(controller(kind="lqg"), duration=0.3, start_angles=2)
    with pytest.raises(
        ValueError, match=r"frequency must be >= 84.34 for two periods in the second half \(rad/s\); got 12.0"
    ):
        record.error_amplitude(12.0)
    with pytest.raises(ValueError, match=r"band must be in \(0, 1\]; got 0"):
        record.settling(0.0)
    with pytest.raises(ValueError, match="low and high must have 1 between them; got 2 and 3"):
        stiffness_range(controller(), low=2, high=3)
    with pytest.raises(ValueError, match=r"factors must be > 0; got 0\.0"):
        worst_case(controller(), (1.0, 0.0))


def test_inputs_of_a_loop_have_names():
    loop = controller().loop()
    assert isinstance(loop, AxisLoop)
    for ask in (
        loop.dc_gain,
        lambda name: loop.step_response([0.1], name),
        lambda name: loop.response(1.0, name),
    ):
        with pytest.raises(
            ValueError, match="name must be one of torque_ref, load_torque, surface_angle; got 'force'"
        ):
            ask("force")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"time": [0.0, 0.1], "current": [0.0, 0.0]}, "motor_angle"),
        ({"time": [0.0, 0.0], "current": [0.0, 0.0], "motor_angle": [0.0, 0.0]}, "time must be rising"),
    ],
)
def test_data_of_free_motion(data, message):
    with pytest.raises((ValueError, TypeError), match=message):
        identify_load_torque(data, AXIS)
    with pytest.raises(TypeError, match="axis must be a TorqueAxis; got None"):
        identify_load_torque({}, None)
    with pytest.raises(ValueError, match=r"until must be > 0 \(s\); got 0.0"):
        identify_load_torque({"time": [0.0], "current": [0.0], "motor_angle": [0.0]}, AXIS, until=0.0)
