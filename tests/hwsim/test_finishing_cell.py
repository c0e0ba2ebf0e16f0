"""The finishing cell: forces in closed form, the same bits whole and step by step, seeds, executors,
journals.
"""

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from finishing_fakes import AXIS, Steady, by_the_loop, cell, controller, lever, line, motion, problem, truth

import hwsim
import sdpgrind
from hwsim._log.log import same
from hwsim.protocols import FOREVER
from sdpgrind import finishing

FORCE = 1.11
STEP = AXIS.torque_step / lever(problem())  # N: the converter knows no finer force
KINDS = ("constant", "pidff", "damped", "lqg")


def outcome(plant, kind="damped", parts=1, **options):
    return hwsim.run(plant, controller(plant.problem, kind, **options), parts=parts).outcome


@pytest.mark.parametrize("kind", ["pidff", "damped", "lqg"])
def test_a_flat_still_surface_without_friction_is_pressed_by_torque_over_lever(kind):
    out = outcome(cell(problem()), kind)
    assert abs(out.normal_force[0] - FORCE) < STEP and out.normal_force_sd[0] < 5 * STEP
    assert out.lift_off[0] == 0.0 and out.path_deviation[0] < 1e-9 and out.timed_out[0] == 0.0
    assert out.normal_force_min[0] <= out.normal_force[0] <= out.normal_force_max[0]


def test_the_motor_presses_as_its_torque_constant_has_it():
    plain, strong = (
        float(outcome(cell(problem(), torque_constant=0.185 * k)).normal_force[0]) for k in (1.0, 1.1)
    )
    assert strong / plain == pytest.approx(1.1, abs=1.5 * STEP / FORCE)


@pytest.mark.parametrize("kind", ["pidff", "damped", "lqg"])
def test_a_load_torque_is_taken_from_the_contact_whole(kind):
    plain, loaded = (
        float(outcome(cell(problem(), load_torque=load), kind).normal_force[0]) for load in (0.0, 0.01)
    )
    assert plain - loaded == pytest.approx(0.01 / lever(problem()), abs=1.5 * STEP)


def test_a_load_torque_is_measured_on_the_way_down_and_then_taken_into_account():
    """A larger gap gives a free motion from which the load torque is told; a controller that knows it holds
    the force.
    """
    of = problem()
    plant = cell(of, load_torque=0.01).replace(gap=2.0)
    log = hwsim.run(plant, controller(of, "damped"), parts=4, rng=1)
    until = float(log.outcome.touch_down.min()) - AXIS.sample_time
    known = finishing.identify(log, "load_torque", axis=AXIS, until=until)
    assert (
        known["load_torque"] == pytest.approx(0.01, abs=4 * known.covariance[0, 0] ** 0.5)
        and known.covariance[0, 0] < 1e-6
    )
    told = outcome(plant, load_torque=known["load_torque"])
    assert abs(log.outcome.normal_force[0] - FORCE) > 0.1 > 5 * abs(told.normal_force[0] - FORCE)


def test_weight_presses_on_a_flat_surface():
    """Mass m at r towards the tip presses with m g r cos(theta_f), over the lever R cos(theta_f)."""
    plain, heavy = (
        float(outcome(cell(problem(), tool_mass=m, mass_radius=40.0)).normal_force[0]) for m in (0.0, 0.05)
    )
    assert heavy - plain == pytest.approx(0.05 * 9.81 * 40.0 / 95.0, abs=1.5 * STEP)


def straight(out, axis, feed=25.0, settle=0.4):
    """Samples of each straight run at full feed along an axis (0: x, 1: y), without its first moments, and
    its direction.
    """
    time = out.sample_time.values
    speed = np.gradient(out[("true_x", "true_y")[axis]].values, time)
    steady = (np.abs(np.abs(speed) - feed) < 1e-6 * feed).astype(int)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], steady, [0]])))
    for first, last in zip(ends[::2], ends[1::2] - 1, strict=True):
        run = np.arange(first, last + 1)[time[first : last + 1] > time[first] + settle]
        if run.size > 10:
            yield run, np.sign(speed[first])


@pytest.mark.parametrize("azimuth", [0.0, np.pi])
@pytest.mark.parametrize(("believed", "real"), [(0.0, 0.2), (0.3, 0.3), (0.3, 0.0)])
def test_friction_changes_the_force_with_the_direction_of_feed(azimuth, believed, real):
    """The tool points along the azimuth: pushed there it takes less torque for a force, dragged back more."""
    of = line(azimuth=azimuth, friction_ratio=believed)
    out = hwsim.run(cell(of, friction_ratio=real), controller(of, "damped")).outcome.isel(part=0)
    found = set()
    for axis in (0, 1):
        for run, direction in straight(out, axis, settle=0.25):
            pointing = direction * np.cos(azimuth) if axis == 0 else 0.0
            held = FORCE * lever(of, believed, -pointing) / lever(of, real, -pointing)
            assert out.true_normal_force.values[run].mean() == pytest.approx(held, abs=2 * STEP)
            found.add(round(pointing))
    assert found == {-1, 0, 1}


@pytest.mark.parametrize("kind", ["damped", "pidff", "lqg"])
def test_a_wave_on_the_surface_is_felt_as_the_loop_has_it(kind):
    """2 Hz: amplitude of the force from the frequency response of the loop, and what converter and encoder
    add.
    """
    of = line(contact_angle=0.0)
    found = controller(of, kind)
    out = hwsim.run(cell(of, height=hwsim.HeightField.wave(0.1, 12.5)), found).outcome.isel(part=0)
    felt = [_amplitude(out, run) for run, _ in straight(out, 0, settle=0.6)]
    gain = abs(found.loop().response(4 * np.pi, "surface_angle")[0])
    assert len(felt) == 5
    np.testing.assert_allclose(felt, gain * (0.1 / 95.0) / 0.095, atol=1.5 * STEP)
    assert np.ptp(out.height_error.values) == pytest.approx(0.2, rel=1e-3)


def _amplitude(out, run):
    """Of 2 Hz in the force, over whole periods."""
    time, force = out.sample_time.values[run], out.true_normal_force.values[run]
    whole = time < time[0] + 0.5 * np.floor((time[-1] - time[0]) / 0.5)
    return 2 * np.abs(np.mean(force[whole] * np.exp(-4j * np.pi * time[whole])))


def test_constant_current_lifts_off_and_a_controller_does_not():
    rough = {"friction_ratio": 0.2}
    free, held = (outcome(cell(problem(), **rough), kind) for kind in ("constant", "lqg"))
    assert free.lift_off[0] > 0.05 > held.lift_off[0] == 0.0
    assert free.normal_force_sd[0] > 5 * held.normal_force_sd[0]


def test_the_force_that_is_wanted_gives_the_error():
    plant = cell(problem(), torque_constant=0.2)
    assert "force_error" not in outcome(plant)
    out = outcome(plant.replace(target_force=FORCE)).isel(part=0).drop_dims("sample")
    off = float(out.normal_force) - FORCE
    assert out.attrs["target_force"] == FORCE and "normal_force" not in out.attrs
    assert (
        float(out.force_error) == pytest.approx(np.hypot(off, float(out.normal_force_sd)), rel=1e-12)
        and off > 0.05
    )


def test_a_motion_takes_its_time_and_half_the_override_takes_twice_as_long():
    profile, plant = motion(problem()).profile, cell(problem())
    duration = profile[-1, 0]
    for override in (1.0, 0.5, 0.25):
        log = hwsim.run(plant, Steady(0.5, override, profile))
        assert log.outcome.time[0] == pytest.approx(duration / override, abs=1.0001e-3)
        assert log["controller"].path_time.values[-1] == duration and log.outcome.timed_out[0] == 0.0


def test_the_contact_runs_along_the_path():
    of = problem()
    out = hwsim.run(cell(of), controller(of)).outcome.isel(part=0)
    begun = out.true_feed.values > 0
    nodes = of.path.points
    assert out.feed[()] == pytest.approx(of.path.length / motion(of).duration, rel=2e-3)
    places = np.column_stack([out.true_x.values, out.true_y.values])[begun]
    for node in nodes[:, :2]:
        assert np.linalg.norm(places - node, axis=1).min() < 0.05
    assert out.true_feed.max() <= 25.0 * (1 + 1e-6)


def test_the_table_bends_the_path():
    of = problem()
    out = hwsim.run(hwsim.FinishingCell(of), controller(of)).outcome.isel(part=0)
    assert 0.02 < out.path_deviation[()] < 0.3
    assert out.normal_force[()] == pytest.approx(FORCE, abs=2 * STEP)  # a flat surface does not feel it


def test_a_part_that_is_never_played_is_broken_off():
    plant = cell(problem()).replace(max_time=0.2)
    for profile in (None, motion(problem()).profile):
        out = hwsim.run(plant, Steady(0.5, 0.0, profile)).outcome
        assert (
            out.time[0] == 0.2
            and out.timed_out[0] == 1.0
            and np.isnan(out.normal_force[0])
            and np.isnan(out.roughness_ra[0])
        )
        assert 0 < out.touch_down[0] < 0.2


def test_a_tool_that_is_not_pressed_never_touches():
    out = hwsim.run(cell(problem()).replace(max_time=0.2), Steady(0.0, 0.0)).outcome
    assert np.isnan(out.touch_down[0]) and not np.any(out.true_normal_force.values)


def test_time_to_touch_down_is_that_of_the_fall():
    """A gap g takes sqrt(2 J g/(R cos(theta_f) T)) under a torque T."""
    current = 205 * AXIS.current_step
    fall = np.sqrt(2 * AXIS.inertia * 0.5 / (95.0 * np.cos(np.pi / 6)) / (AXIS.torque_constant * current))
    out = hwsim.run(cell(problem()).replace(gap=0.5, max_time=0.3), Steady(current, 0.0)).outcome
    assert 0 <= out.touch_down[0] - fall < 1.001e-3


@pytest.mark.parametrize("kind", KINDS)
def test_whole_parts_are_those_of_the_loop(kind, monkeypatch):
    of = problem(friction_ratio=0.3)
    plant = hwsim.FinishingCell(of, scatter=hwsim.CellScatter(), target_force=FORCE)
    whole = hwsim.run(plant, controller(of, kind), parts=2, rng=3)
    by_the_loop(monkeypatch)
    assert same(hwsim.run(plant, controller(of, kind), parts=2, rng=3), whole)
    assert whole["controller"].motion_command.values[0] == len(motion(of).profile)


def test_whole_parts_that_are_broken_off_too(monkeypatch):
    of = problem()
    plant = hwsim.FinishingCell(of, max_time=0.4)
    whole = hwsim.run(plant, controller(of, load_torque=0.01))
    assert whole.outcome.timed_out[0] == 1.0
    by_the_loop(monkeypatch)
    assert same(hwsim.run(plant, controller(of, load_torque=0.01)), whole)


def test_a_controller_at_another_pace_goes_step_by_step():
    of = problem()
    plant = cell(of).replace(axis=AXIS.replace(sample_time=5e-4))
    log = hwsim.run(plant, controller(of, "damped"))
    assert same(
        hwsim.run(plant.replace(truth=truth(of, sample_time=0.1)), controller(of, "damped")), log
    )  # the cell has the clock
    assert log.outcome.normal_force[0] == pytest.approx(FORCE, abs=2 * STEP)
    np.testing.assert_allclose(np.diff(log["controller"].time.values)[:-1], 1e-3, rtol=1e-9)


def test_cells_and_controllers_travel_to_other_processes():
    of = problem(friction_ratio=0.3)
    plant, found = hwsim.FinishingCell(of, scatter=hwsim.CellScatter()), controller(of)
    log = hwsim.run(plant, found, rng=7)
    again = pickle.loads(pickle.dumps((plant, found)))
    assert same(hwsim.run(*again, rng=7), log)


def test_seeds_and_executors():
    of = problem(friction_ratio=0.3)
    plant, found = hwsim.FinishingCell(of, scatter=hwsim.CellScatter()), controller(of)
    log = hwsim.run(plant, found, parts=4, rng=7)
    assert same(hwsim.run(plant, found, parts=4, rng=7), log)
    with ThreadPoolExecutor(2) as pool:
        assert same(hwsim.run(plant, found, parts=4, rng=7, executor=pool), log)
    for name in (
        "true_torque_constant",
        "true_friction_ratio",
        "true_load_torque",
        "normal_force",
        "roughness_ra",
    ):
        assert len(set(log.outcome[name].values)) == 4
    assert not same(hwsim.run(plant, found, parts=4, rng=8), log)


def test_controllers_are_compared_on_equal_parts():
    of = problem(friction_ratio=0.3)
    plant = hwsim.FinishingCell(of, scatter=hwsim.CellScatter())
    out = hwsim.compare(
        plant, {kind: controller(of, kind) for kind in ("pidff", "lqg")}, parts=3, rng=1
    ).outcome
    for name in (
        "true_torque_constant",
        "true_contact_angular_stiffness",
        "true_friction_ratio",
        "true_load_torque",
    ):
        np.testing.assert_array_equal(out[name].sel(controller="pidff"), out[name].sel(controller="lqg"))


class PowerCut(Exception):
    pass


def cut_after(parts):
    def progress(share, text):
        if text.startswith(f"part {parts} "):
            raise PowerCut

    return progress


def test_a_cut_run_is_resumed(tmp_path):
    of = problem(friction_ratio=0.3)
    plant, found = hwsim.FinishingCell(of, scatter=hwsim.CellScatter()), controller(of)
    whole = hwsim.run(plant, found, parts=4, rng=7)
    with pytest.raises(PowerCut):
        hwsim.run(plant, found, parts=4, rng=7, journal=tmp_path / "run.db", progress=cut_after(2))
    assert same(hwsim.run(plant, found, parts=4, rng=7, journal=tmp_path / "run.db"), whole)
    with pytest.raises(ValueError, match="was begun with another plant"):
        hwsim.run(plant.replace(gap=0.1), found, parts=4, rng=7, journal=tmp_path / "run.db")


def test_a_log_is_saved_and_read_back(tmp_path):
    log = hwsim.run(hwsim.FinishingCell(problem()), controller(problem()), parts=2)
    log.save(tmp_path / "run.nc")
    assert same(sdpgrind.load(tmp_path / "run.nc"), log)


def test_a_copy_goes_its_own_way():
    machine = hwsim.FinishingCell(problem(), scatter=hwsim.CellScatter()).start(np.random.default_rng(1))
    machine.step({"motion": motion(problem()).profile, "current": 0.5, "feed_override": 1.0}, 100)
    other = copy.deepcopy(machine)
    assert other.step({}, 50) == machine.step({}, 50)
    other.step({}, 50)
    assert (other.time, machine.time) == (200, 150)
    machine.step({}, FOREVER)
    assert machine.done and machine.step({}, 10)["path_time"] == motion(problem()).duration


def test_many_short_steps_are_one_long_one():
    one, many = (cell(problem()).start(np.random.default_rng(1)) for _ in range(2))
    command = {"motion": motion(problem()).profile, "current": 0.5, "feed_override": 0.7}
    long = one.step(command, 300)
    many.step(command, 0)
    for _ in range(300):
        short = many.step({}, 1)
    assert short == long and one.outcome()["normal_force"] == many.outcome()["normal_force"]


def test_the_encoder_counts_and_the_converter_steps():
    machine = cell(problem()).start(np.random.default_rng(1))
    angles = np.array([machine.step({"current": 0.3}, 1)["motor_angle"] for _ in range(50)])
    counts = angles / AXIS.angle_step
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert np.ptp(counts) > 3
    fine, coarse = (cell(problem()).start(np.random.default_rng(1)) for _ in range(2))
    fine.step({"current": 100.4 * AXIS.current_step}, 500)
    coarse.step({"current": 100 * AXIS.current_step}, 500)
    assert fine.outcome()["true_normal_force"][-1] == coarse.outcome()["true_normal_force"][-1] > 0
    clipped, most = (cell(problem()).start(np.random.default_rng(1)) for _ in range(2))
    clipped.step({"current": 4.0}, 500)
    most.step({"current": AXIS.current_limit}, 500)
    assert np.array_equal(clipped.outcome()["true_normal_force"], most.outcome()["true_normal_force"])


def test_the_plant_fits_its_protocol():
    report = hwsim.check(hwsim.FinishingCell(problem()), controller(problem()))
    assert report, str(report)
    assert isinstance(hwsim.FinishingCell(problem()), hwsim.protocols.Plant)


def test_a_truth_that_is_drawn_for_each_part():
    of = problem()

    def drawn(rng):
        return truth(of, torque_constant=0.185 * (1 + 0.05 * rng.standard_normal()))

    log = hwsim.run(hwsim.FinishingCell(of, truth=drawn), controller(of), parts=3, rng=2)
    ratios = log.outcome.normal_force.values / log.outcome.true_torque_constant.values
    assert len(set(log.outcome.true_torque_constant.values)) == 3
    np.testing.assert_allclose(ratios, FORCE / 0.185, rtol=2 * STEP)


def test_the_axis_has_the_lever_of_the_problem():
    of = problem(lever_arm=90.0)
    plant = hwsim.FinishingCell(of)
    assert plant.axis is None and plant.torque_axis == finishing.TorqueAxis(lever_arm=90.0)
    found = finishing.TorqueController(plant.torque_axis, motion(of), normal_force=FORCE, kind="damped")
    assert float(hwsim.run(plant.replace(truth=None), found).outcome.normal_force[0]) == pytest.approx(
        FORCE, abs=2 * STEP
    )
    assert hwsim.FinishingCell(problem()).replace(problem=of).torque_axis == plant.torque_axis


def test_a_log_tells_which_motion_was_played(tmp_path):
    of = problem(order=1)
    played = {method: finishing.plan(of, method=method) for method in ("trapezoid", "min_time")}
    found = {
        method: finishing.TorqueController(AXIS, each, normal_force=FORCE, kind="damped")
        for method, each in played.items()
    }
    plant, digests = hwsim.FinishingCell(of), set()
    for method, each in played.items():
        hwsim.run(plant, found[method]).save(tmp_path / "run.nc")
        told = sdpgrind.load(tmp_path / "run.nc").outcome.attrs
        assert (told["motion_method"], told["motion_duration"]) == (method, each.duration)
        digests.add(told["motion_digest"])
    assert len(digests) == 2
    both = hwsim.compare(plant, found).outcome.attrs
    assert "motion_method" not in both and both["pattern"] == of.path.pattern  # only what is true of both


def test_the_rows_of_a_long_motion_stand_once_in_the_log_and_are_compared(tmp_path):
    of = problem(order=1)
    plan = finishing.plan(of, method="trapezoid")
    assert len(plan.profile) > 64
    found = finishing.TorqueController(AXIS, plan, normal_force=FORCE, kind="damped")
    plant = hwsim.FinishingCell(of)
    log = hwsim.run(plant, found, parts=3, rng=0, journal=tmp_path / "run.db")
    table = log[f"{log.tiers[0]}:motion"]
    assert table.part.values.tolist() == [0] * len(plan.profile)
    np.testing.assert_array_equal(table.motion_command, plan.profile)
    with hwsim.Journal(tmp_path / "run.db") as journal:
        assert hwsim.run(hwsim.Recording(journal.log(), part=2), found).outcome.same[0] == 1
    other = finishing.TorqueController(
        AXIS, finishing.plan(of, method="min_time"), normal_force=FORCE, kind="damped"
    )
    told = hwsim.run(hwsim.Recording(log, part=1), other).outcome
    assert told.same[0] == 0 and str(told.difference_name[0].values).startswith("motion")


def test_a_controller_without_a_motion_is_refused():
    of = problem()
    with pytest.raises(ValueError, match=r"controller must have a motion to be played in the cell"):
        hwsim.run(
            hwsim.FinishingCell(of), finishing.TorqueController(finishing.TorqueAxis(), normal_force=1.3)
        )
