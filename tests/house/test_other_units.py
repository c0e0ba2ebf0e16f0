"""What was typed in another unit is refused, and the message names the conversion that was forgotten."""

from pathlib import Path

import pytest

import centering
import hwsim
from centering import friction, setup
from centering.push import Part, plan_push
from hwsim.command._plunge.toml import read
from sdpgrind import finishing, locus, plunge, units, weldbead
from sdpgrind.finishing.kernels import CellScatter
from sdpgrind.weldbead import force, passes

CYCLE = plunge.preset("simulation")
GRINDER = hwsim.PlungeGrinder(CYCLE)
ADAPTIVE = hwsim.AdaptiveGrinder(locus.preset("grinding"))
GRINDING = locus.preset("grinding").model
ROUGHNESS = locus.preset("grinding-roughness").model.grinding.roughness
TURNING = locus.preset("turning").model
AXIS = locus.preset("motor").model
PROCESS = weldbead.preset("P1").model
BEAD = weldbead.preset("P1")
RING = hwsim.Ring(61.94)
STOCK = setup.Stock(mean=0.15, sd=0.02, roundness=0.01, roundness_sd=0.004)
CHANGE = setup.Changeover(
    STOCK, finish_radius=35.0, gap=0.01, approach_rate=0.026, largest_radius=35.16, radius_sd=5e-4
)
CENTERING = centering.preset("printed")
MALKIN = weldbead.MalkinBurnLimit.published(diameter=170.0)
FINISHING = finishing.preset("specimen")
TORQUE = finishing.torque.TorqueAxis()
TURNED = locus.preset("turning")

SCANNER = hwsim.devices.Scanner()
TABLE = hwsim.Scheduler([hwsim.Task("model", angle_step=0.1)], spindle_speed_max=10.0)
DISC = passes.TiltedDisc(PROCESS, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
PASS = passes.PassProblem(DISC, passes.Contour([0, 150], [1.0, 1.0]), mean_cut=0.2, feed_rate=20.0)

CALLS = [
    (SCANNER, {"spacing": 0.00025}, "mm, some 0.25; units.m(...) for metres; got 0.00025"),
    (SCANNER, {"spacing": 250}, "mm, some 0.25; units.um(...) for micrometres; got 250"),
    (TABLE, {"spindle_speed_max": 3000}, "rad/s, some 10; units.rpm(...) for rev/min; got 3000"),
    (CYCLE, {"stiffness": 8.0}, "N/mm, some 10000; multiply by 1000 for N/µm; got 8.0"),
    (CYCLE, {"stiffness": 8e6}, "N/mm, some 10000; multiply by 0.001 for N/m; got 8000000.0"),
    (CYCLE, {"diffusivity": 1.25e-5}, "mm^2/s, some 12; multiply by 1000000 for m^2/s; got 1.25e-05"),
    (CYCLE, {"diffusivity": 1250.0}, "mm^2/s, some 12; got 1250.0"),
    (CYCLE, {"wheel_speed": 37e3 * 60}, "mm/s, some 30000; units.mm_per_min(...) for mm/min; got 2220000.0"),
    (CYCLE, {"sample_time": 40.0}, "s, some 0.04; multiply by 0.001 for ms; got 40.0"),
    (CYCLE.model.burning, {"u0": 6205.0}, "J/mm^3, some 6; multiply by 0.001 for J/cm^3; got 6205.0"),
    (GRINDER, {"power_max": 3.0}, "W, some 3000; multiply by 1000 for kW; got 3.0"),
    (GRINDER, {"contact_zero_sd": 5.0}, "mm, some 0.01; units.um(...) for micrometres; got 5.0"),
    (hwsim.GrinderNoise(), {"size_sd": 0.5}, "mm, some 0.0005; units.um(...) for micrometres; got 0.5"),
    (CYCLE, {"wheel_diameter": 0.05}, "mm, some 50; units.m(...) for metres; got 0.05"),
    (CYCLE, {"work_diameter": 0.07}, "mm, some 70; units.m(...) for metres; got 0.07"),
    (CYCLE, {"width": 0.009}, "mm, some 10; units.m(...) for metres; got 0.009"),
    (CYCLE, {"wheel_speed": 37}, "mm/s, some 30000; units.m_per_s(...) for m/s; got 37"),
    (CYCLE, {"work_rotation": 1200.0}, "rad/s, some 30; units.rpm(...) for rev/min; got 1200.0"),
    (CYCLE, {"roundness_base": 1.59}, "mm, some 0.002; units.um(...) for micrometres; got 1.59"),
    (CYCLE, {"roundness_max": 3.0}, "mm, some 0.003; units.um(...) for micrometres; got 3.0"),
    (CYCLE, {"stock": 0.000282}, "mm, some 0.3; units.m(...) for metres; got 0.000282"),
    (CYCLE, {"command_rate_max": 4.48e-5}, "mm/s, some 0.05; units.m_per_s(...) for m/s; got 4.48e-05"),
    (CYCLE, {"command_rate_max": 2.7}, "mm/s, some 0.05; units.mm_per_min(...) for mm/min; got 2.7"),
    (plunge.RoughnessLaw(), {"roughness_scale": 98}, "mm, some 0.1; units.um(...) for micrometres; got 98"),
    (plunge.Wear(0.02), {"reference_rate": 1e-5}, "mm/s, some 0.01; units.m_per_s(...) for m/s; got 1e-05"),
    (GRINDER, {"command_quantum": 1.0}, "mm, some 0.001; units.um(...) for micrometres; got 1.0"),
    (GRINDING, {"wheel_diameter": 0.3}, "mm, some 300; units.m(...) for metres; got 0.3"),
    (GRINDING, {"work_diameter": 0.06}, "mm, some 60; units.m(...) for metres; got 0.06"),
    (GRINDING, {"width": 0.0093}, "mm, some 10; units.m(...) for metres; got 0.0093"),
    (GRINDING, {"wheel_speed": 30}, "mm/s, some 30000; units.m_per_s(...) for m/s; got 30"),
    (ROUGHNESS, {"lead": 100}, "mm, some 0.1; units.um(...) for micrometres; got 100"),
    (ROUGHNESS, {"lead_reference": 1e-4}, "mm, some 0.1; units.m(...) for metres; got 0.0001"),
    (ROUGHNESS, {"chip_thickness": 0.1}, "mm, some 0.0001; units.um(...) for micrometres; got 0.1"),
    (TURNING, {"life_speed": 3}, "mm/s, some 3000; units.m_per_s(...) for m/s; got 3"),
    (TURNING, {"life_feed": 3e-4}, "mm, some 0.3; units.m(...) for metres; got 0.0003"),
    (AXIS, {"angle": 3438}, "rad, some 60; units.deg(...) for degrees; got 3438"),
    (ADAPTIVE, {"stock": 3e-4}, "mm, some 0.3; units.m(...) for metres; got 0.0003"),
    (ADAPTIVE, {"stock": 300}, "mm, some 0.3; units.um(...) for micrometres; got 300"),
    (PROCESS, {"disk_radius": 0.09}, "mm, some 90; units.m(...) for metres; got 0.09"),
    (PROCESS, {"disk_radius": 3.5}, "mm, some 90; units.inch(...) for inches; got 3.5"),
    (PROCESS, {"free_speed": 8500}, "rad/s, some 500; units.rpm(...) for rev/min; got 8500"),
    (
        PROCESS,
        {"free_speed": 4775.0},
        "rad/s, some 500; the rim of a disc of 85 mm would run at 405.9 m/s, 125 at most;"
        " units.rpm(...) for rev/min; got 4775.0",
    ),
    (BEAD, {"specific_energy": 11000.0}, "J/mm^3, some 10; multiply by 0.001 for J/cm^3; got 11000.0"),
    (BEAD, {"specific_energy": 0.011}, "J/mm^3, some 10; multiply by 1000 for kJ/mm^3; got 0.011"),
    (DISC, {"specific_energy": 11000.0}, "J/mm^3, some 10; multiply by 0.001 for J/cm^3; got 11000.0"),
    (BEAD, {"force_max": 5e4}, "N, some 50; got 50000.0"),
    (PASS, {"normal_force_max": 5e4}, "N, some 50; got 50000.0"),
    (
        hwsim.WeldBeadStand(BEAD),
        {"height_noise": 3.0},
        "mm, some 0.002; units.um(...) for micrometres; got 3.0",
    ),
    (FINISHING, {"feed_rate": 1800}, "mm/s, some 25; units.mm_per_min(...) for mm/min; got 1800"),
    (
        finishing.Lift(),
        {"air_feed": 6000.0},
        "mm/s, some 100; units.mm_per_min(...) for mm/min; got 6000.0",
    ),
    (PROCESS, {"bead_width": 0.0125}, "mm, some 12; units.m(...) for metres; got 0.0125"),
    (BEAD, {"bead_length": 0.15}, "mm, some 150; units.m(...) for metres; got 0.15"),
    (BEAD, {"height_max": 0.002}, "mm, some 2; units.m(...) for metres; got 0.002"),
    (BEAD, {"min_cut": 50}, "mm, some 0.1; units.um(...) for micrometres; got 50"),
    (MALKIN, {"diameter": 0.17}, "mm, some 170; units.m(...) for metres; got 0.17"),
    (
        weldbead.FinishCharge(1.0),
        {"reference_rate": 750},
        "mm/s, some 10; units.mm_per_min(...) for mm/min; got 750",
    ),
    (FINISHING, {"tool_diameter": 0.004}, "mm, some 4; units.m(...) for metres; got 0.004"),
    (FINISHING, {"tool_diameter": 4000}, "mm, some 4; units.um(...) for micrometres; got 4000"),
    (FINISHING, {"acceleration": 0.9}, "mm/s^2, some 1000; units.m(...) for m/s^2; got 0.9"),
    (FINISHING, {"acceleration": 5.0}, "mm/s^2, some 1000; units.m(...) for m/s^2; got 5.0"),
    (TORQUE, {"sample_time": 1.0}, "s, some 0.001; multiply by 0.001 for ms; got 1.0"),
    (
        CYCLE,
        {"work_rotation": 280.0},
        "rad/s, up to 211.4, with the work's surface below 7400 mm/s; units.rpm(...) for rev/min; got 280.0",
    ),
    (
        TURNED,
        {"controls": TURNED.controls | {"cutting_speed": (60.0, 300.0)}},
        "mm/s, its greatest some 3000 as life_speed; units.m_per_min(...) for m/min; got 300.0",
    ),
    (FINISHING.path, {"deviation": 2000}, "mm, some 0.1; units.um(...) for micrometres; got 2000"),
    (finishing.Arm.generic(), {"a2": 0.3}, "mm, some 300; units.m(...) for metres; got 0.3"),
    (finishing.Arm.generic(), {"d1": 400e3}, "mm, some 400; units.um(...) for micrometres; got 400000.0"),
    (
        finishing.timing.Trapezoid(1.0, 25.0, 1000.0),
        {"speed_max": 2.5e-5},
        "mm/s, some 25; units.m_per_s(...) for m/s; got 2.5e-05",
    ),
    (CellScatter(), {"shortest_wavelength": 0.005}, "mm, some 5; units.m(...) for metres; got 0.005"),
    (DISC, {"relaxed_angle": 20.0}, "(0, 1.3] (rad); units.deg(20) for degrees; got 20.0"),
    (PASS, {"mean_cut": 200}, "mm, some 0.2; units.um(...) for micrometres; got 200"),
    (PASS, {"feed_rate": 0.02}, "mm/s, some 20; units.m_per_s(...) for m/s; got 0.02"),
    (PASS, {"feed_rate": 1200}, "mm/s, some 20; units.mm_per_min(...) for mm/min; got 1200"),
    (PASS, {"spacing": 5e-5}, "mm, some 0.05; units.m(...) for metres; got 5e-05"),
    (
        passes.Freedom(5.0, 40.0),
        {"feed_rate_min": 0.005},
        "mm/s, some 10; units.m_per_s(...) for m/s; got 0.005",
    ),
    (hwsim.Motor(300.0), {"free_speed": 8500}, "rad/s, some 300; units.rpm(...) for rev/min; got 8500"),
    (force.Limits(), {"command_rate_max": 0.02}, "mm/s, some 20; units.m_per_s(...) for m/s; got 0.02"),
    (force.Limits(), {"command_max": 20000}, "mm, some 10; units.um(...) for micrometres; got 20000"),
    (force.table_drive(), {"backlash": 10}, "mm, some 0.05; units.um(...) for micrometres; got 10"),
    (hwsim.ForceTableStand(PASS), {"runout": 100}, "mm, some 0.1; units.um(...) for micrometres; got 100"),
    (
        hwsim.ForceTableStand(PASS),
        {"lead_in": 10000},
        "mm, some 10; units.um(...) for micrometres; got 10000",
    ),
    (CHANGE, {"finish_radius": 0.035}, "mm, some 35; units.m(...) for metres; got 0.035"),
    (CHANGE, {"largest_radius": 0.03516}, "mm, some 35; units.m(...) for metres; got 0.03516"),
    (CHANGE, {"approach_rate": 2.6e-5}, "mm/s, some 0.03; units.m_per_s(...) for m/s; got 2.6e-05"),
    (
        friction.LuGreFriction(37, 28),
        {"stribeck_speed": 1e-3},
        "mm/s, some 1; units.m_per_s(...) for m/s; got 0.001",
    ),
    (RING, {"radius": 0.06194}, "mm, some 60; units.m(...) for metres; got 0.06194"),
    (RING, {"radius": 61940.0}, "mm, some 60; units.um(...) for micrometres; got 61940.0"),
    (hwsim.Probe(RING), {"tip_radius": 3750}, "mm, some 3.75; units.um(...) for micrometres; got 3750"),
    (Part(18.9, 89.5), {"radius": 0.0895}, "mm, some 90; units.m(...) for metres; got 0.0895"),
    (Part(18.9, 89.5), {"radius": 3.52}, "mm, some 90; units.inch(...) for inches; got 3.52"),
    (CENTERING, {"tolerance": 2.5e-6}, "mm, some 0.0025; units.m(...) for metres; got 2.5e-06"),
    (CENTERING, {"offset_max": 10000.0}, "mm, some 10; units.um(...) for micrometres; got 10000.0"),
    (CENTERING, {"push_speed_max": 0.08}, "mm/s, some 80; units.m_per_s(...) for m/s; got 0.08"),
    (CENTERING, {"approach_speed": 5000.0}, "mm/s, some 80; units.mm_per_min(...) for mm/min; got 5000.0"),
    (CENTERING, {"follow_gap": 0.008}, "mm, some 8; units.m(...) for metres; got 0.008"),
    (centering.CycleSettings(), {"manual_lead": 10.0}, "rad, some 0.1; units.deg(...) for degrees; got 10.0"),
    (
        centering.cycle.FollowingLimits(),
        {"speed": 0.12},
        "mm/s, some 120; units.m_per_s(...) for m/s; got 0.12",
    ),
    (
        hwsim.CenteringMachine(CENTERING),
        {"tip_radius": 3750.0},
        "mm, some 4; units.um(...) for micrometres; got 3750.0",
    ),
]


@pytest.mark.parametrize(
    ("thing", "change", "told"), CALLS, ids=[next(iter(change)) for _, change, _ in CALLS]
)
def test_the_conversion_is_named(thing, change, told):
    with pytest.raises(ValueError) as refused:
        thing.replace(**change)
    name = "cutting_speed" if "controls" in change else next(iter(change))
    assert str(refused.value) == f"{name} must be in {told}"


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"normal_force_ratio": 0.1}, ">= 0.12 (normal over tangential: 4, not 0.25); got 0.1"),
        ({"roundness_gain": 2750.0}, "<= 50 (mm per mm: 2 for 2000 µm/mm); got 2750.0"),
    ],
)
def test_a_ratio_the_other_way_or_in_a_thousandth(change, told):
    with pytest.raises(ValueError) as refused:
        CYCLE.replace(**change)
    assert str(refused.value) == f"{next(iter(change))} must be {told}"


def test_a_friction_ratio_in_percent_is_refused():
    said = (
        "friction_ratio must be tangential over normal force, some 0.3; divide by 100 where percent is meant"
    )
    with pytest.raises(ValueError, match=said):
        BEAD.replace(friction_ratio=30.0)


def test_an_idle_power_in_kilowatts_warns():
    """It is estimated, too: a bead whose idle power was found to be small is planned."""
    with pytest.warns(UserWarning, match=r"idle_power is 0.12 W, .*: multiply by 1000 for kW"):
        BEAD.replace(idle_power=0.12)
    BEAD.replace(idle_power=0.0)


PUSH = {"offset": 1.0, "spindle_speed": 2.0, "push_speed": 10.0}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"push_speed": 4800.0}, "(mm/s); units.mm_per_min(...) for mm/min; got 4800.0"),
        ({"spindle_speed": 20.0}, "rad/s; units.rpm(...) for rev/min); got 20.0"),
    ],
)
def test_a_push_names_the_conversion(change, told):
    with pytest.raises(ValueError) as refused:
        plan_push(CENTERING, **PUSH | change)
    assert str(refused.value).endswith(told)


def test_a_text_with_its_unit_is_told_as_written(tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(Path("examples/plunge.toml").read_text().replace('"37 m/s"', '"37 m/min"'))
    with pytest.raises(ValueError, match=r"wheel_speed must be some 30000 mm/s; got '37 m/min'"):
        read(job)
