"""The force table: what it cuts against closed forms, volumes, time, motor, sensors, seeds, refusals."""

import copy
from typing import ClassVar

import numpy as np
import pytest
from force_table_fakes import PROCESS, STEADY, Held, Passes, Tiers, disc, platform, problem, quiet

import hwsim
from hwsim._log.log import same
from hwsim.protocols import FOREVER
from sdpgrind import weldbead
from sdpgrind.weldbead import passes
from sdpgrind.weldbead.force import SensorChain, table_drive
from sdpgrind.weldbead.kernels import force_table as kernels


def held(stand, tip, *, force=None, number=1, feed_rate=20.0, rng=0, gain=0.002):
    tiers = Tiers(sequence=Passes(number, feed_rate), force=Held(platform(tip), force, gain))
    return hwsim.run(stand, tiers, rng=rng)


def middle(log, name, cut=0.3):
    """Readings of the force tier well inside the bead."""
    table = log["force"]
    values = table[name].values[table.phase.values == 2.0]
    return values[int(cut * values.size) : -int(0.1 * values.size)]


@pytest.mark.parametrize("feed_rate", [10.0, 20.0])
def test_steady_cut_is_the_static_cut_of_the_process(feed_rate):
    log = held(quiet(problem()), 0.7, feed_rate=feed_rate)
    contour = log.outcome.contour.values[0]
    forces = middle(log, "force", 0.6)
    assert np.ptp(forces) < 0.02  # N, steady
    assert 1.0 - contour[500:700].mean() == pytest.approx(
        float(PROCESS.mean_cut(forces.mean(), feed_rate)), rel=2e-3
    )


def test_the_stand_agrees_with_the_planner_s_simulation():
    given = problem(wave=0.1)
    machine = quiet(given).start(np.random.default_rng(0))
    machine.step({"start": 1.0, "feed_rate": 20.0, "platform_command": platform(0.75)}, FOREVER)
    x = np.arange(machine._setup.stand.start_x, 40 + 100, 1 / 42)
    height = np.full(x.size, -platform(0.75))
    settled = passes.simulate(
        given.disc, given.bead, center_x=x, fly_height=height, feed_rate=20.0, spacing=0.05
    )
    nodes = np.linspace(0, 40, 801)
    # the platform settles while the disc is before the bead, so that both come to it at one height
    np.testing.assert_allclose(machine.outcome()["contour"], settled.contour.at(nodes), atol=1e-6)


def test_volume_is_kept():
    given = problem(wave=0.15)
    log = held(hwsim.ForceTableStand(given, runout=0.2), 0.7, number=2)
    x = np.linspace(0, 40, 801)
    lost = PROCESS.bead_width * np.trapezoid(given.bead.at(x) - log.outcome.contour.values[0], x)
    volumes = log.outcome.true_volume.values[0]
    assert volumes.sum() == pytest.approx(lost, rel=1e-10)
    np.testing.assert_allclose(
        volumes / (40 * PROCESS.bead_width), log.outcome.true_cut_depth.values[0], rtol=1e-12
    )


def test_volume_is_the_integral_of_the_removal_rate():
    machine = quiet(problem()).start(np.random.default_rng(0))
    machine.step({"start": 1.0, "feed_rate": 20.0, "platform_command": platform(0.6)}, FOREVER)
    assert machine._table.state[kernels.INTEGRAL] == pytest.approx(
        machine._table.state[kernels.REMOVED], rel=1e-3
    )


def test_runout_lifts_the_disc_off_and_raises_the_mean_force():
    """Force is never negative: of K r sin, the half that presses remains when the disc only grazes."""
    still, wobbling = (held(quiet(problem(), runout=r), 0.95) for r in (0.0, 0.4))
    assert wobbling.outcome.true_force.values[0, 0] > still.outcome.true_force.values[0, 0] + 1.0


def test_spin_appears_at_its_alias():
    """Spin of 50 Hz is read at 10 Hz by a sensor that answers 60 times a second."""
    slow = PROCESS.replace(free_speed=2 * np.pi * 50)
    stand = quiet(problem(120.0, process=slow), runout=0.05)
    forces = middle(held(stand, 0.4), "force")
    spectrum = np.abs(np.fft.rfft((forces - forces.mean()) * np.hanning(forces.size)))
    peak = np.fft.rfftfreq(forces.size, 1 / 60)[np.argmax(spectrum[3:]) + 3]
    assert peak == pytest.approx(10.0, abs=0.5)


def test_wear_raises_the_contour_along_the_bead():
    fresh, worn = (
        held(quiet(problem(grinding_ratio=G)), 0.7).outcome.contour.values[0] for G in (np.inf, 5.0)
    )
    assert abs(fresh[700] - fresh[300]) < 1e-6
    assert 0.001 < worn[700] - worn[300] < 20 * 12.7 * np.sin(np.deg2rad(20)) / (2 * np.pi * 88.9 * 5)


def test_lead_in_and_lead_out_and_reset_take_time():
    log = held(quiet(problem(), lead_in=8.0, lead_out=4.0), 1.5, number=2)
    assert float(log.outcome.time[0]) == pytest.approx(2 * ((8 + 40 + 4) / 20 + 2.0), abs=2 * 2 / 60)
    assert float(log.outcome.lead_time[0]) == pytest.approx(2 * 12 / 20, abs=4 / 60)
    assert log["sequence"].time.size == 3  # start, and two events
    np.testing.assert_array_equal(np.unique(log["force"].phase.values[:-1]), [0, 1, 2, 3, 4])
    assert float(log.outcome.attrs["start_time"]) == 60.0


def test_commands_take_effect_after_the_delay():
    def moves(delay):
        stand = quiet(problem(), delay_samples=delay)
        machine = stand.start(np.random.default_rng(0))
        command = {"start": 1.0, "feed_rate": 20.0, "platform_command": platform(1.2)}
        positions = [machine.step(command if k == 0 else {}, 1)["table_position"] for k in range(8)]
        return next(k for k, position in enumerate(positions) if position != machine._table.drawn_back())

    assert [moves(delay) for delay in (0, 1, 3)] == [0, 1, 3]


OF_PASS = (
    "height",
    "grinding_power",
    "removal_rate",
    "normal_force",
    "tangential_force",
    "feed_rate",
    "cut_depth",
)


class Recording(Passes):
    """Other forces and feeds in each pass; all that is known of a pass is read."""

    reads: ClassVar = {name: hwsim.ForceTableStand(problem()).measures[name] for name in OF_PASS}
    commands: ClassVar = {**Passes.commands, "wanted": "N"}

    def step(self, **measured):
        k = self.begun % 4
        self.feed_rate = (10.0, 20.0, 15.0, 30.0)[k]
        return {**super().step(**measured), "wanted": (30.0, 70.0, 50.0, 60.0)[k]}


class Pressing(Held):
    reads: ClassVar = {**Held.reads, "wanted": "N"}

    def step(self, *, wanted, **measured):
        self.force = wanted
        return super().step(**measured)


def test_coefficients_can_be_identified_from_the_log():
    stand = hwsim.ForceTableStand(problem(60.0, 4.0), pass_scatter=STEADY)
    log = hwsim.run(stand, Tiers(sequence=Recording(8), force=Pressing(platform(3.2), gain=0.004)), rng=1)
    energy = weldbead.identify(log, "power")
    assert energy["specific_energy"] == pytest.approx(12.8, rel=0.03)
    assert energy["idle_power"] == pytest.approx(114.0, rel=0.12)
    ratio = log["sequence"].tangential_force / log["sequence"].normal_force
    assert float(ratio.mean()) == pytest.approx(0.33, rel=0.01)


def test_nothing_is_read_outside_a_pass_and_scans_only_at_events():
    machine = hwsim.ForceTableStand(problem()).start(np.random.default_rng(0))
    first = machine.step({}, 0)
    assert first["profile"].shape == first["profile_x"].shape == (161,) and np.isnan(first["force"])
    during = machine.step({"start": 1.0, "feed_rate": 20.0, "platform_command": platform(0.8)}, 30)
    assert (
        np.isnan(during["height"])
        and np.isnan(during["profile"])
        and during["pass_time"] == pytest.approx(0.5)
    )
    after = machine.step({}, FOREVER)
    assert machine.event and after["cut_depth"] == pytest.approx(first["height"] - after["height"])
    assert after["time_left"] == pytest.approx(60.0 - machine.time / 60)


def test_scan_noise_is_that_of_three_tracks():
    machine = hwsim.ForceTableStand(problem(150.0)).start(np.random.default_rng(5))
    assert np.std(machine.step({}, 0)["profile"] - 1.0) == pytest.approx(0.01 / 3**0.5, rel=0.12)


def test_a_spring_before_the_sensor_keeps_the_grinder_s_ringing_out():
    """Brown (1988), 8.3.2; without inertia both arrangements read the same."""

    def spread(inertia, first):
        stand = quiet(problem(60.0), runout=0.1, grinder_inertia=inertia, spring_first=first)
        return middle(held(stand, 0.5), "force").std()

    assert spread(0.0, True) == spread(0.0, False)
    assert spread(5.4, True) < 0.85 * spread(5.4, False)


def test_air_motor_droops_and_stalls():
    motor = hwsim.Motor.air()
    light, heavy = (
        held(quiet(problem(), motor=motor), 0.8, force=f, gain=0.001 * f / 10) for f in (20.0, 90.0)
    )
    assert light.outcome.stalls.values == [0] and heavy.outcome.stalls.values == [1]
    speeds, forces = middle(light, "disk_speed", 0.8), middle(light, "force", 0.8)
    expected = motor.free_speed - motor.speed_droop * 0.33 * 88.9 * forces
    np.testing.assert_allclose(speeds, expected, rtol=0.03)  # the sensor lags behind the spin
    assert heavy.outcome.true_volume.values[0, 0] < light.outcome.true_volume.values[0, 0]  # broken off


def test_stall_guard_keeps_the_platform_from_rising():
    def highest(guard):
        motor = hwsim.Motor.air().replace(guard=guard, stall=0.0)
        machine = quiet(problem(), motor=motor, overload=1e6).start(np.random.default_rng(0))
        machine.step({"start": 1.0, "feed_rate": 20.0, "platform_command": platform(0.6)}, 40)
        while machine._table.phase < 3:
            machine.step({"platform_command": machine._command + 0.01}, 1)
        return machine._table.drive[4]

    assert highest(hwsim.Motor.air().guard) < highest(0.0) - 0.2


def test_truth_is_drawn_for_each_pass_and_is_the_same_for_all_controllers():
    stand = hwsim.ForceTableStand(problem(15.0))
    controllers = {
        f: Tiers(sequence=Passes(2), force=Held(platform(tip))) for f, tip in (("low", 0.8), ("high", 0.9))
    }
    out = hwsim.compare(stand, controllers, parts=2, rng=4).outcome
    for name in ("true_specific_energy", "true_idle_power", "true_friction_ratio"):
        np.testing.assert_array_equal(out[name][0], out[name][1])
        assert np.unique(out[name][0]).size == 4
    assert not np.array_equal(out.height[0], out.height[1])


def test_scatter_has_the_moments_that_it_says():
    rng = np.random.default_rng(0)
    drawn = [hwsim.CoefficientScatter().drawn(PROCESS, rng) for _ in range(4000)]
    for name, cv in (("specific_energy", 0.15), ("idle_power", 0.20), ("friction_ratio", 0.15)):
        values = np.array([getattr(each, name) for each in drawn])
        assert values.mean() == pytest.approx(getattr(PROCESS, name), rel=4 * cv / 4000**0.5)
        assert values.std() / values.mean() == pytest.approx(cv, rel=0.06)


def test_truth_may_be_a_disc_or_drawn_for_each_bead():
    other = disc(PROCESS.replace(specific_energy=20.0))
    given, drawn = (quiet(problem(15.0), truth=t) for t in (other, lambda rng: other))
    energies = [held(stand, 0.8).outcome.true_specific_energy.values for stand in (given, drawn)]
    np.testing.assert_array_equal(energies, [[[20.0]], [[20.0]]])
    spread = quiet(problem(15.0), bead_scatter=hwsim.CoefficientScatter(0.2, 0.0, 0.0))
    tiers = Tiers(sequence=Passes(2), force=Held(platform(0.8)))
    energy = hwsim.run(spread, tiers, parts=3).outcome.true_specific_energy.values
    assert np.unique(energy[:, 0]).size == 3 and np.array_equal(energy[:, 0], energy[:, 1])


def test_runs_repeat_and_machines_can_be_copied(tmp_path):
    stand, tiers = hwsim.ForceTableStand(problem(15.0)), Tiers(sequence=Passes(1), force=Held(platform(0.8)))
    assert hwsim.check(stand, tiers)
    log = hwsim.run(stand, tiers, parts=2, rng=7)
    assert same(log, hwsim.run(stand, tiers, parts=2, rng=7, journal=tmp_path / "run.db"))
    machine = stand.start(np.random.default_rng(0))
    machine.step({"start": 1.0, "feed_rate": 20.0, "platform_command": platform(0.8)}, 50)
    twin = copy.deepcopy(machine)
    one, other = (each.step({}, FOREVER) for each in (machine, twin))
    np.testing.assert_array_equal(one["profile"], other["profile"])
    assert machine.outcome()["height"] == twin.outcome()["height"] < 1.0


def test_outcome_is_charged_for_height_lateness_and_what_is_ground_too_deep():
    charges = weldbead.preset("P2")
    stand = quiet(problem(15.0), sequence=charges, time=1.0)
    out = held(stand, -0.6, number=1).outcome
    late, height = float(out.lateness[0]), float(out.height[0])
    assert late == pytest.approx(float(out.time[0]) - 1.0)
    assert float(out.penalty[0]) == pytest.approx(charges.height_charge(height) + 0.25 * late)
    assert float(out.overground_worst[0]) >= float(out.overground[0]) >= 0.0
    hill = passes.PassProblem(
        disc(), passes.Contour([0, 15], [1, 1]), 0.1, 20.0, parent=passes.Contour([0, 15], [0, 0.9])
    )
    assert quiet(hill).start(np.random.default_rng(0)).step({}, 0)["height"] == pytest.approx(0.55)


def test_burning_is_told():
    limit = weldbead.ForceBurnLimit(4.0)  # N/(mm/s)^(1/2): 17.9 N at 20 mm/s
    charges = weldbead.preset("P1").replace(burn_limit=limit)
    gentle, hard = (held(quiet(problem(15.0), sequence=charges), tip).outcome for tip in (0.95, 0.5))
    assert gentle.burned.values == [0] and hard.burned.values == [1] and hard.burn_time.values > [0.1]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"runout": -0.1}, r"runout must be >= 0 \(mm\); got -0.1"),
        ({"overload": 0.0}, r"overload must be > 0 \(N\); got 0.0"),
        ({"delay_samples": -1}, "delay_samples must be >= 0; got -1"),
        ({"truth": 3.0}, "truth must be None, a TiltedDisc or a function of rng that gives one; got 3.0"),
        (
            {"scanner": hwsim.devices.Scanner(spacing=50.0)},
            r"bead must be longer than the scanner's spacing 50 \(mm\); got 40.0",
        ),
    ],
)
def test_bad_stands(options, message):
    with pytest.raises((TypeError, ValueError), match=message):
        hwsim.ForceTableStand(problem(), **options)


def test_inertia_needs_one_stiffness():
    table = problem(rotational_stiffness=None, compliance=((0.0, 0.0), (0.01, 5e3), (0.02, 12e3)))
    with pytest.raises(ValueError, match="grinder_inertia must be 0 with a compliance table"):
        hwsim.ForceTableStand(table, grinder_inertia=5.4)
    assert held(quiet(table), 0.8).outcome.passes.values == [1]
    with pytest.raises(TypeError, match="problem must be a PassProblem; got 3"):
        hwsim.ForceTableStand(3)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ({"start": 1.0}, r"a pass needs feed_rate \(mm/s\) with its start"),
        ({"start": 1.0, "feed_rate": 0.0}, r"feed_rate must be > 0 \(mm/s\); got 0.0"),
        (
            {"start": 1.0, "feed_rate": 20.0, "start_x": 90.0},
            r"start_x must be <= 83.5387, so that the tip is before the bead",
        ),
        ({"platform_command": np.inf}, r"platform_command must be finite \(mm\); got inf"),
    ],
)
def test_bad_commands(command, message):
    with pytest.raises(ValueError, match=message):
        quiet(problem()).start(np.random.default_rng(0)).step(command, 1)


def test_a_pass_cannot_start_during_another():
    machine = quiet(problem()).start(np.random.default_rng(0))
    machine.step({"start": 1.0, "feed_rate": 20.0}, 5)
    with pytest.raises(ValueError, match="start must wait for the end of the pass before"):
        machine.step({"start": 1.0, "feed_rate": 20.0}, 5)


def test_other_beads_are_refused():
    class Planned(Passes):
        job: ClassVar = {"bead_length": (150.0, "mm")}

    report = hwsim.check(quiet(problem()), Tiers(sequence=Planned(1), force=Held(platform(0.8))))
    assert "its bead_length is 150.0 mm, that of the plant 40.0 mm" in str(report)


def test_devices_refuse_nonsense():
    with pytest.raises(ValueError, match=r"noise_sd must be >= 0; got -1.0"):
        hwsim.devices.Gauge(noise_sd=-1.0)
    with pytest.raises(ValueError, match=r"spacing must be > 0 \(mm\); got 0.0"):
        hwsim.devices.Scanner(spacing=0.0)
    with pytest.raises(ValueError, match=r"stall must be in \[0, 1\]; got 2.0"):
        hwsim.Motor(300.0, stall=2.0)


def test_sensor_sets_the_tick():
    assert hwsim.ForceTableStand(problem(), sensor=SensorChain(sample_time=1 / 120)).tick == 1 / 120
    assert hwsim.ForceTableStand(problem(), drive=table_drive("appendix-b")).drive.stuck_band > 0


def test_picture():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")

    class Scanning(Passes):
        reads: ClassVar = {"height": "mm", "profile": "mm", "profile_x": "mm"}

    log = hwsim.run(
        hwsim.ForceTableStand(problem(15.0)), Tiers(sequence=Scanning(2), force=Held(platform(0.8))), parts=2
    )
    figure = log.plot()
    contours = figure.axes[1].lines
    assert len(contours) == 3 + 2 and figure.axes[0].lines  # three scans, what was left, the target
    np.testing.assert_allclose(contours[3].get_ydata(), log.outcome.contour.values[0])
    pyplot.close(figure)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"pass_scatter": 0.1}, "pass_scatter must be a CoefficientScatter; got 0.1"),
        ({"drive": "slow"}, "drive must be a TableDrive"),
    ],
)
def test_parts_of_another_kind(change, message):
    with pytest.raises(TypeError, match=message):
        hwsim.ForceTableStand(problem(), **change)
