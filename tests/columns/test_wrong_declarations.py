"""Units that are declared wrongly are refused or doubted; what a machine may do is not."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from foreign_truth import POWER, RATE, SIZE, TIME

import hwsim
from centering import Profile
from sdpgrind import weldbead
from sdpgrind.weldbead._doubts.passes import checks_of

SAMPLES = Path(__file__).parents[1] / "data" / "samples"
RNG = np.random.default_rng(7)
DEPTH, FEED = RNG.uniform(0.1, 0.4, 40), RNG.uniform(6, 12, 40)  # mm, mm/s
FORCE = RNG.uniform(12, 45, 40)  # N
SECONDS = np.arange(0.0, 20.0, 0.1)
SPIN = 25.0  # rad/s
DEGREES = np.arange(0.0, 360.0, 1.0)
AREAS = {
    "plunge": (
        {"t": TIME, "X": 1e3 * SIZE, "v": 60 * RATE, "P": POWER / 1e3},
        {"time": ("t", "s"), "size": ("X", "um"), "command_rate": ("v", "mm/min"), "grinding_power": ("P", "kW")},
    ),
    "weld bead": (
        {"a": 1e3 * DEPTH, "f": 0.06 * FEED, "Fn": FORCE / 9.80665, "Ft": 0.31 * FORCE / 9.80665,
         "P": 0.1 + 0.0137 * FORCE, "Q": 0.06 * 12.7 * DEPTH * FEED},
        {"period": 1.0, "cut_depth": ("a", "um"), "feed_rate": ("f", "m/min"), "normal_force": ("Fn", "kp"),
         "tangential_force": ("Ft", "kp"), "grinding_power": ("P", "kW"), "removal_rate": ("Q", "cm^3/min")},
    ),
    "finishing": (
        {"Ra": RNG.uniform(0.2, 0.9, 40), "D": RNG.uniform(6, 20, 40), "F": FORCE, "i": RNG.uniform(-2, 2, 40),
         "a": 8.0 * np.arange(40)},
        {"period": 0.01, "roughness_ra": ("Ra", "um"), "tool_diameter": ("D", "mm"), "normal_force": ("F", "N"),
         "current": ("i", "A"), "motor_angle": ("a", "deg")},
    ),
    "locus": (
        {"t": SECONDS, "v": np.full(200, 1.8), "n": np.full(200, 240.0), "R": 0.03 * SECONDS, "P": 0.9 + 0.015 * SECONDS,
         "V": np.full(200, 35.0), "D": np.full(200, 500.0)},
        {"time": ("t", "s"), "infeed_rate": ("v", "mm/min"), "work_rotation": ("n", "1/min"), "removed": ("R", "mm"),
         "grinding_power": ("P", "kW"), "wheel_speed": ("V", "m/s"), "wheel_diameter": ("D", "mm")},
    ),
    "centering": (
        {"t": SECONDS, "a": np.mod(np.degrees(SPIN * SECONDS), 360), "n": np.full(200, SPIN * 30 / np.pi), "r": 40 + 0.1 * np.cos(SPIN * SECONDS)},
        {"time": ("t", "s"), "angle": ("a", "deg"), "spindle_speed": ("n", "1/min"), "reading": ("r", "mm")},
    ),
}  # fmt: skip
WRONG = {
    "plunge": {
        "size": ["mm", "m", "cm", "in", "nm", ("um", 2), ("um", 0.5), ("um", -1), ("um", -0.5), ("um", -2)],
        "command_rate": ["mm/s", "um/s", "m/min", "m/s", "in/min", "in/s"],
        "time": ["ms", "us", "min", "h"],
        "grinding_power": ["W", "mW"],
    },
    "weld bead": {
        "cut_depth": ["mm", "in", "m"],
        "feed_rate": ["mm/min"],
        "normal_force": ["N"],
        "tangential_force": ["N"],
        "grinding_power": ["W", "mW"],
    },
    "finishing": {
        "roughness_ra": ["mm", "nm", "m", "in"],
        "tool_diameter": ["m", "um"],
        "normal_force": ["kN"],
        "current": [("A", 1000)],
        "motor_angle": ["rad"],
    },
    "locus": {
        "infeed_rate": ["mm/s", "um/s", "m/min", "in/min"],
        "removed": ["um", "m", "in", ("mm", 2), ("mm", -1)],
        "time": ["ms", "min"],
        "work_rotation": ["Hz"],
        "grinding_power": ["W"],
        "wheel_speed": ["m/min", "mm/s"],
        "wheel_diameter": ["m", "um", "in"],
    },
    "centering": {
        "angle": ["rad"],
        "spindle_speed": ["rad/s", "Hz", "deg/s"],
        "reading": ["um", "m"],
        "time": ["ms", "min"],
    },
}
CASES = [
    (area, name, each if isinstance(each, tuple) else (each,))
    for area, wrong in WRONG.items()
    for name, declared in wrong.items()
    for each in declared
]


@pytest.mark.parametrize("area", AREAS)
def test_right_declarations_pass(area):
    table, right = AREAS[area]
    assert hwsim.Log.read(table, **right) is not None


@pytest.mark.parametrize(("area", "name", "declared"), CASES)
def test_wrong_declarations_are_refused(area, name, declared):
    table, right = AREAS[area]
    with pytest.raises(ValueError, match="must") as told:
        hwsim.Log.read(table, **right | {name: (right[name][0], *declared)})
    assert "plausible=False" in str(told.value) and "\n" not in str(told.value)


@pytest.mark.parametrize("deviation", [("d", "mm"), ("d", "m"), ("d", "in"), ("d", "um", 1e-6)])
def test_wrong_deviations_are_refused(deviation):
    table = {"a [deg]": DEGREES, "d": 50 * np.cos(np.radians(DEGREES))}
    with pytest.raises(ValueError, match="deviation must be"):
        Profile.read(table, angle="a", deviation=deviation, radius=40.0)


BEAD = {"normal_force": ("Fn", "kp"), "tangential_force": ("Ft", "kp"), "grinding_power": ("P", "kW"),
        "removal_rate": ("Q", "cm^3/min"), "feed_rate": ("feed", "m/min"), "cut_depth": ("a", "um")}  # fmt: skip
DOUBTED = {
    "Q in mm^3/s": {"removal_rate": ("Q", "mm^3/s")},
    "feed in mm/s": {"feed_rate": ("feed", "mm/s")},
    "feed in m/s": {"feed_rate": ("feed", "m/s")},
    "depth in nm": {"cut_depth": ("a", "nm")},
    "twice the depth": {"cut_depth": ("a", "um", 2)},
    "both forces in N": {"normal_force": ("Fn", "N"), "tangential_force": ("Ft", "N")},
}


@pytest.mark.filterwarnings("ignore:.*the file says")
@pytest.mark.parametrize("wrong", DOUBTED)
def test_what_is_taken_as_it_is_the_problem_doubts(wrong):
    log = hwsim.Log.read(SAMPLES / "bead_passes.csv", period=1.0, plausible=False, **BEAD | DOUBTED[wrong])
    told = " ".join(checks_of(weldbead.preset("P1"), log["data"]))
    assert "a unit, or a size of the problem, is wrong" in told


def test_a_power_with_that_of_the_motor_is_told_so():
    log = hwsim.Log.read(SAMPLES / "bead_passes.csv", period=1.0, **BEAD)
    table = {name: np.asarray(log["data"][name]) for name in ("grinding_power", "tangential_force")}
    told = "or the power is that of a motor, with what it takes while the disc touches nothing"
    problem = weldbead.preset("P1")
    assert told not in " ".join(checks_of(problem, table))
    assert told not in " ".join(checks_of(problem, table | {"grinding_power": table["grinding_power"] / 10}))
    assert told in " ".join(checks_of(problem, table | {"grinding_power": table["grinding_power"] + 500.0}))


def plunge(time, command, size, power=None):
    columns = {"t [s]": time, "v [mm/s]": command, "X [mm]": size}
    return columns if power is None else columns | {"P [W]": power}


def followed(command, step=0.02, tau=0.4, contact=None, noise=3e-4, start=0.0):
    """Cycle of a command (mm/s) that the size follows where there is contact."""
    fed = np.where(np.ones(command.size, bool) if contact is None else contact, command, 0.0)
    actual = np.zeros(command.size)
    for k in range(1, command.size):
        actual[k] = actual[k - 1] + step / tau * (fed[k - 1] - actual[k - 1])
    size = start + np.concatenate([[0.0], np.cumsum(actual[:-1] * step)])
    return plunge(step * np.arange(command.size), command, size + noise * RNG.standard_normal(size.size))


ROW = np.arange(500)
FEEDS = np.where(ROW < 300, 0.03, 0.0)
PLAIN = followed(FEEDS)
TRAPS = {
    "air for three quarters": followed(np.full(500, 0.03), contact=ROW > 375),
    "rapid approach": followed(np.where(ROW < 60, 4.0, FEEDS), contact=ROW >= 60),
    "rapid retract": followed(np.where(ROW > 470, -5.0, FEEDS), contact=ROW <= 470),
    "spark-out of nine tenths": followed(np.where(ROW < 60, 0.03, 0.0)),
    "a spike": PLAIN | {"X [mm]": np.where(ROW == 77, 900.0, PLAIN["X [mm]"])},
    "zeros of size": PLAIN | {"X [mm]": np.zeros(500)},
    "zeros of the command": PLAIN | {"v [mm/s]": np.zeros(500)},
    "zeros of power": PLAIN | {"P [W]": np.zeros(500)},
    "a power meter below zero": PLAIN | {"P [W]": np.where(ROW < 300, 900.0, -12.0)},
    "no reading before contact": followed(np.full(500, 0.03), contact=ROW > 100),
    "8 um in all": followed(np.where(ROW < 300, 0.0014, 0.0), noise=1e-4),
    "a soft machine": followed(FEEDS, tau=3.5),
    "noise of 3 um": followed(FEEDS, noise=3e-3),
    "steps of 2 um": PLAIN | {"X [mm]": np.round(PLAIN["X [mm]"] / 0.002) * 0.002},
    "a gauge from 12 mm on": followed(FEEDS, start=12.0),
    "a pause": followed(np.where((ROW > 100) & (ROW < 200), 0.0, FEEDS)),
    "three rates": followed(np.select([ROW < 200, ROW < 300, ROW < 380], [0.05, 0.012, 0.003], 0.0)),
    "a very small bead": {"t [s]": ROW * 1.0, "a [um]": np.full(500, 0.4), "Fn [N]": np.full(500, 0.5), "Ft [N]": np.full(500, 0.1)},
    "a very large shaft": {"t [s]": ROW * 1.0, "v [mm/s]": np.full(500, 2e-4), "R [mm]": 2e-4 * ROW, "n [1/min]": np.full(500, 2.0), "D [mm]": np.full(500, 2500.0)},
    "a spindle at rest": {"t [s]": ROW * 0.1, "angle [rad]": np.full(500, 1.2), "s [rad/s]": np.zeros(500)},
    "a spindle that reverses": {"t [s]": ROW * 0.01, "angle [rad]": 3 * np.sin(ROW * 0.01), "s [rad/s]": 3 * np.cos(ROW * 0.01)},
    "a slow turn": {"t [s]": ROW * 0.1, "angle [rad]": ROW * 0.1 * 0.13, "s [rad/s]": np.full(500, 0.13)},
    "an angle of many turns that is set back": {"t [s]": ROW * 0.01, "angle [rad]": np.mod(ROW * 0.2, 40.0), "s [rad/s]": np.full(500, 20.0)},
}  # fmt: skip
TRAPS["no reading before contact"]["X [mm]"][:100] = np.nan
NAMES = {"t": "time", "v": "command_rate", "X": "size", "P": "grinding_power", "a": "cut_depth", "Fn": "normal_force",
         "Ft": "tangential_force", "R": "removed", "n": "work_rotation", "D": "wheel_diameter", "angle": "angle",
         "s": "spindle_speed"}  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*has no reading")
@pytest.mark.parametrize("trap", TRAPS)
def test_what_a_machine_may_do_passes(trap):
    names = {header.split(" ")[0] for header in TRAPS[trap]}
    call = {NAMES[name]: name for name in names}
    if "R" in names:
        call["infeed_rate"] = call.pop("command_rate")
    table = hwsim.Log.read(pd.DataFrame(TRAPS[trap]), **call)["data"]
    assert table.sizes["row"] == ROW.size
