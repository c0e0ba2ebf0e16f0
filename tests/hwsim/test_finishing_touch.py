"""Where the tool touches, written down once more: exact geometry, the table by another solver, sums, traces
that are thinned.
"""

import numpy as np
import pytest
from finishing_fakes import AXIS, cell, controller, lever, motion, problem, truth
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy.optimize import brentq
from scipy.signal import TransferFunction, lsim

import hwsim
from sdpgrind import finishing
from sdpgrind.base.compiling.compiled import opened
from sdpgrind.finishing import kernels as torque
from sdpgrind.finishing.kernels import cell as core

keep = opened(core._keep)

TICK = AXIS.sample_time


def rough_truth(of, table=None):
    height = hwsim.HeightField.drawn(0.02, 3.0, np.random.default_rng(5))
    return truth(
        of,
        friction_ratio=0.25,
        torque_constant=0.19,
        load_torque=0.003,
        tool_mass=0.02,
        height=height,
        table=table,
    )


def slow_twin(of, real, log):
    """Everything that a part went through, from its commands, by other means: one tick after the other, in no
    compiled loop.
    """
    table = log["controller"]
    played, current = table.path_time.values, np.nan_to_num(table.current_command.values[:-1])
    profile = motion(of).profile
    joints = np.array([np.interp(played, profile[:, 0], column) for column in profile[:, 1:].T]).T
    late = joints[:, 5:7] - np.array([follow(real.table, joints[:, k], TICK) for k in (5, 6)]).T
    poses = np.array(
        [np.interp(played, profile[:, 0], c) for c in of.robot.forward_work(profile[:, 1:]).reshape(-1, 16).T]
    ).T
    poses = poses.reshape(-1, 4, 4)
    tip = poses[:, :3, 3] + of.lever_arm * poses[:, :3, 2]
    tip += of.path.points[0] - tip[0]
    c, s = np.cos(of.contact_angle), np.sin(of.contact_angle)
    normal, azimuth = c * poses[:, :3, 0] - s * poses[:, :3, 2], -s * poses[:, :3, 0] - c * poses[:, :3, 2]
    off = np.column_stack([late, np.zeros(len(late))])
    height = real.height.at(tip + off)
    error = height - np.sum(off * normal, axis=1)
    place = tip + off + error[:, np.newaxis] * (normal - np.tan(of.contact_angle) * azimuth)
    rate = np.diff(place, axis=0) / TICK
    feed = np.linalg.norm(rate, axis=1)
    forward = np.sum(rate * azimuth[1:], axis=1) / np.maximum(feed, 0.5)
    step = 1e-6
    slope = (real.height.at(tip + off + step * azimuth) - real.height.at(tip + off - step * azimuth)) / (
        2 * step
    )
    angle = of.contact_angle - np.arctan(slope[1:])
    arm = 0.095 * (np.cos(angle) + real.friction_ratio * np.sin(angle) * forward)
    weight = finishing.torque.gravity_torque(real.tool_mass, real.mass_radius, 0.0) * c
    touched = -error / (of.lever_arm * c)
    axis_state, force = np.zeros(torque.STATES), np.empty(len(current))
    axis_state[torque.ANGLE] = -0.05 / (of.lever_arm * c)
    for k in range(len(current)):
        load = real.load_torque - weight
        torque.axis_tick(axis_state, current[k], load, touched[k], touched[k + 1], real.axis.parameters)
        force[k] = axis_state[torque.MEAN_TORQUE] / arm[k]
    return {
        "force": force,
        "feed": feed,
        "error": error[1:],
        "place": place[1:],
        "moving": np.diff(played) > 0,
    }


def follow(table, command, tick):
    """The table by scipy, from its transfer function."""
    if table is None:
        return command
    system = TransferFunction(table.numerator, table.denominator)
    return command[0] + lsim(system, command - command[0], tick * np.arange(len(command)))[1]


@pytest.mark.parametrize("table", [None, finishing.timing.TableLoop()])
def test_a_part_is_what_its_slow_twin_says(table):
    of = problem(friction_ratio=0.3)
    real = rough_truth(of, table)
    log = hwsim.run(hwsim.FinishingCell(of, truth=real), controller(of, "damped"))
    out, twin = log.outcome.isel(part=0), slow_twin(of, real, log)
    assert out.sizes["sample"] == len(twin["force"])
    np.testing.assert_allclose(out.true_normal_force, np.maximum(twin["force"], 0), atol=1e-5)
    np.testing.assert_allclose(out.true_feed, twin["feed"], atol=1e-6)
    np.testing.assert_allclose(out.height_error, twin["error"], atol=1e-10)
    np.testing.assert_allclose(np.column_stack([out.true_x, out.true_y]), twin["place"][:, :2], atol=1e-9)
    moving = twin["moving"]
    for name, values in (("normal_force", twin["force"]), ("feed", twin["feed"])):
        assert float(out[name]) == pytest.approx(values[moving].mean(), rel=1e-5)
        assert float(out[f"{name}_sd"]) == pytest.approx(values[moving].std(), rel=1e-4)
    assert float(out.normal_force_min) == pytest.approx(twin["force"][moving].min(), abs=1e-5)
    assert float(out.normal_force_max) == pytest.approx(twin["force"][moving].max(), abs=1e-5)


def test_the_largest_deviation_is_that_across_the_path():
    of = problem()
    real = truth(of, table=finishing.timing.TableLoop())
    log = hwsim.run(hwsim.FinishingCell(of, truth=real), controller(of))
    place = slow_twin(of, real, log)["place"]
    planned, played = motion(of), log["controller"].path_time.values[1:]
    tips = np.array([np.interp(played, planned.time, column) for column in planned.points.T]).T
    leg = np.clip(
        np.searchsorted(planned.profile[:, 0], played, side="right") - 1, 0, len(planned.profile) - 2
    )
    once = np.concatenate([[True], np.diff(planned.time) > 0])
    ahead = np.diff(planned.points[once], axis=0)
    ahead /= np.linalg.norm(ahead, axis=1)[:, np.newaxis]
    off = (place - tips)[:, :2]
    across = np.abs(off[:, 0] * ahead[leg, 1] - off[:, 1] * ahead[leg, 0])
    assert float(log.outcome.path_deviation[0]) == pytest.approx(across.max(), rel=1e-6)


def course_of_two(place, normal, azimuth, table=(0.0, 0.0)):
    course = np.zeros((2, core.COLUMNS))
    course[:, core.TIME] = 0.0, 1.0
    course[:, core.TIP : core.TIP + 3], course[:, core.NORMAL : core.NORMAL + 3] = place, normal
    course[:, core.AZIMUTH : core.AZIMUTH + 3] = azimuth
    course[1, core.TABLE : core.TABLE + 2] = table
    return course


@given(
    tilt=some.floats(-0.6, 0.6),
    off=some.tuples(some.floats(-0.2, 0.2), some.floats(-0.2, 0.2)),
    contact=some.floats(0.0, 1.0),
    side=some.sampled_from([-1.0, 1.0]),
)
def test_the_tool_swings_until_it_touches_a_plane(tilt, off, contact, side):
    """Swung exactly about the motor's axis; what is left out of a swing q is tan(theta) q^2/2 and less."""
    normal, azimuth = (
        np.array([-np.sin(tilt), 0.0, np.cos(tilt)]),
        np.array([np.cos(tilt), 0.0, np.sin(tilt)]),
    )
    course = course_of_two([1.0, 2.0, 3.0], normal, azimuth, off)
    cell_now = np.zeros(core.SETTINGS)
    cell_now[[core.TICK, core.LEVER, core.CONTACT_ANGLE, core.SIDE]] = TICK, 95.0, contact, side
    stuck = np.zeros(18)  # a table that never moves: all of its command is error
    state = np.zeros(core.STATES)
    place, *_ = core.touch(course, np.empty((0, 5)), stuck, cell_now, state, 1.0)
    down = side * np.cos(contact) * azimuth - np.sin(contact) * normal  # from the motor to the tip
    away = np.array([*off, 0.0]) - 95.0 * down  # of the motor from the planned contact
    press = -side * np.sin(contact) * azimuth - np.cos(contact) * normal

    def above(angle):
        tip = away + 95.0 * (np.cos(angle) * down + np.sin(angle) * press)
        return tip @ normal

    exact = brentq(above, -0.05, 0.05, xtol=1e-14)
    swing = core.surface_angle(cell_now, state)
    assert abs(swing - exact) <= np.tan(contact) * exact**2 + abs(exact) ** 3 + 1e-12
    tip = np.array([1.0, 2.0, 3.0]) + away + 95.0 * (np.cos(exact) * down + np.sin(exact) * press)
    assert np.linalg.norm(place - tip) <= 95.0 * exact**2 / np.cos(contact) + 1e-9


@settings(deadline=None)  # the first example compiles
@given(some.integers(1, 400))
def test_a_trace_is_thinned_evenly(ticks):
    """Of n ticks and m rows at most: every 2^j-th, with the least j for which they fit."""
    state, trace = np.zeros(core.STATES), np.empty((8, len(core.TRACE)))
    state[core.EVERY] = 1.0
    cell_now = np.zeros(core.SETTINGS)
    cell_now[core.TICK] = 1.0
    for k in range(1, ticks + 1):
        state[core.TICKS], state[core.FORCE] = k, 10.0 * k
        keep(state, cell_now, trace)
    every = 1
    while ticks // every > 8:
        every *= 2
    kept = trace[: int(state[core.SAMPLES])]
    np.testing.assert_array_equal(kept[:, 0], np.arange(every, ticks + 1, every))
    np.testing.assert_array_equal(kept[:, 1], 10.0 * kept[:, 0])


def test_a_long_part_has_no_more_samples_than_there_is_room():
    plant = cell(problem()).replace(max_time=13.0)
    machine = plant.start(np.random.default_rng(0))
    machine.step({"current": 0.5}, 10**6)
    outcome = machine.outcome()
    assert machine.done and outcome["sample_time"].size == 3250
    np.testing.assert_allclose(outcome["sample_time"], 4e-3 * np.arange(1, 3251), rtol=1e-12)


def test_a_drawn_field_has_its_spread_and_its_waves():
    rng = np.random.default_rng(0)
    fields = [hwsim.HeightField.drawn(0.02, 4.0, rng) for _ in range(400)]
    places = rng.uniform(0, 50, (50, 3))
    heights = np.array([field.at(places) for field in fields])
    assert heights.std() == pytest.approx(0.02, rel=0.03) and abs(heights.mean()) < 3 * 0.02 / np.sqrt(400)
    lengths = np.concatenate([2 * np.pi / np.linalg.norm(field.waves, axis=1) for field in fields])
    assert 4.0 <= lengths.min() < 4.05 and 39.0 < lengths.max() <= 40.0
    assert np.median(lengths) == pytest.approx(4 * np.sqrt(10), rel=0.05)


@given(some.integers(0, 2**31), some.tuples(*[some.floats(-50, 50)] * 3))
def test_the_compiled_field_is_the_field(seed, place):
    field = hwsim.HeightField.drawn(0.02, 4.0, np.random.default_rng(seed))
    waves = np.column_stack([field.waves, field.phases, field.amplitudes])
    along = np.array([0.6, 0.0, 0.8])
    height, slope = core.field(waves, np.array(place), along)
    assert height == pytest.approx(field.at(place), abs=1e-14)
    step = 1e-5
    ends = field.at([np.array(place) + step * along, np.array(place) - step * along])
    assert slope == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-8)


def test_scatter_is_what_it_says():
    of = problem(friction_ratio=0.3)
    nominal, scatter, rng = hwsim.CellTruth.nominal(of, AXIS), hwsim.CellScatter(), np.random.default_rng(3)
    drawn = [scatter.drawn(nominal, rng) for _ in range(3000)]
    for name, sd in (("inertia", 0.05), ("contact_angular_stiffness", 0.2), ("torque_constant", 0.02)):
        logs = np.log([getattr(each.axis, name) / getattr(AXIS, name) for each in drawn])
        assert logs.std() == pytest.approx(sd, rel=0.06) and abs(logs.mean()) < 4 * sd / np.sqrt(3000)
    assert np.std([each.load_torque for each in drawn]) == pytest.approx(0.002, rel=0.06)
    assert np.mean([each.tool_mass for each in drawn]) == pytest.approx(0.005, rel=0.08)
    still = hwsim.CellScatter(0, 0, 0, 0, 0, 0, 0).drawn(nominal, np.random.default_rng(3))
    assert still == nominal


def test_equal_fields_are_equal():
    one, other = (hwsim.HeightField.wave(0.1, 5.0) for _ in range(2))
    assert one == other and hash(one) == hash(other) and one != hwsim.HeightField.flat() and one != 3
    assert hwsim.HeightField.flat().at([[1.0, 2.0, 3.0]]) == [0.0]


def rough(path, **options):
    of = finishing.FinishingProblem(path, friction_ratio=0.0, **options)
    found = controller(of, "damped", normal_force=1.0)
    return hwsim.run(hwsim.FinishingCell(of, truth=truth(of)), found).outcome.isel(part=0)


def test_roughness_is_that_of_the_model_at_the_mean_force():
    surface, model = finishing.surface.flat_surface(6.4), finishing.roughness.RoughnessModel.published()
    path = finishing.zigzag(surface, pitch=1.6)
    for diameter, extrapolated in ((3.5, 0.0), (6.0, 1.0)):
        out = rough(path, tool_diameter=diameter)
        held = model.median("zigzag", diameter, float(out.normal_force), extrapolate=True)
        assert (
            float(out.roughness_ra) == pytest.approx(float(held), rel=1e-12)
            and float(out.extrapolated) == extrapolated
        )
    out = rough(finishing.hilbert(surface, 2))
    assert np.isnan(float(out.roughness_ra)) and float(out.extrapolated) == 1.0


def test_roughness_is_drawn_from_the_law_of_the_model():
    of = finishing.FinishingProblem(
        finishing.zigzag(finishing.surface.flat_surface(6.4), pitch=1.6), friction_ratio=0.0
    )
    plant = hwsim.FinishingCell(of, truth=truth(of, roughness_error=None))
    read = hwsim.run(plant, controller(of, "damped"), parts=150, rng=1).outcome.roughness_ra.values
    logs = np.log(read)
    assert logs.std() == pytest.approx(0.06737, rel=0.15)
    middle = of.model.median("zigzag", 4.0, 1.11)
    assert logs.mean() == pytest.approx(np.log(middle), abs=4 * 0.06737 / np.sqrt(150))


def test_the_lever_of_the_fakes_is_that_of_the_library():
    of = problem()
    for ratio, forward in ((0.0, 1.0), (0.3, 1.0), (0.3, 0.0), (0.3, -1.0)):
        theirs = finishing.arm.torque_per_force(
            of.contact_angle, 95.0, friction_ratio=ratio, feed_angle=np.arccos(forward)
        )
        assert lever(of, ratio, forward) == pytest.approx(theirs, rel=1e-12)
