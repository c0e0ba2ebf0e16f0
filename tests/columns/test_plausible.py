"""Units that are wrong are refused with the right one; odd but right data pass."""

import importlib
import math
import re
from pathlib import Path

import numpy as np
import pytest

import centering
import hwsim
import sdpgrind
from sdpgrind import locus, plunge, weldbead
from sdpgrind.base.columns.pairs import slope_of_size
from sdpgrind.base.columns.table import KNOWN
from sdpgrind.base.quantities import Described, specs
from sdpgrind.base.unit_text import parse

SAMPLES = Path(__file__).parents[1] / "data" / "samples"
BRACKETS = {"time": "t", "size": "X", "command_rate": "v", "grinding_power": "P"}
GERMAN = {"time": "Zeit", "size": "Aufmaß Durchmesser", "command_rate": "Zustellung"}
BEAD = {
    "normal_force": "Fn",
    "tangential_force": "Ft",
    "grinding_power": "P",
    "removal_rate": "Q",
    "feed_rate": "feed",
    "cut_depth": "a",
}
SHAFT = {"time": "t", "grinding_power": "P", "infeed_rate": "v", "work_rotation": "n", "removed": "removed"}
RING = {"angle": "angle", "deviation": "deviation", "radius": 40.0}
WRONG = [
    ("plunge_brackets.csv", BRACKETS | {"size": ("X", "mm")}, 'size=("X", "um")'),
    ("plunge_brackets.csv", BRACKETS | {"size": ("X", "m")}, 'size=("X", "um")'),
    ("plunge_brackets.csv", BRACKETS | {"size": ("X", "in")}, 'size=("X", "um")'),
    ("plunge_brackets.csv", BRACKETS | {"size": ("X", "nm")}, 'size=("X", "um")'),
    ("plunge_brackets.csv", BRACKETS | {"size": ("X", "um", 2)}, 'without its factor of 2? Say size=("X", "um"), or'),
    ("plunge_brackets.csv", BRACKETS | {"size": ("X", "um", 0.5)}, "command_rate of the diameter"),
    ("plunge_brackets.csv", BRACKETS | {"size": ("X", "um", -1)}, "falling"),
    ("plunge_brackets.csv", BRACKETS | {"grinding_power": ("P", "W")}, 'grinding_power=("P", "kW")'),
    ("plunge_brackets.csv", BRACKETS | {"grinding_power": ("P", "mW")}, 'grinding_power=("P", "kW")'),
    ("plunge_brackets.csv", BRACKETS | {"command_rate": ("v", "mm/s")}, 'command_rate=("v", "mm/min")'),
    ("plunge_brackets.csv", BRACKETS | {"command_rate": ("v", "um/s")}, 'command_rate=("v", "mm/min")'),
    ("plunge_brackets.csv", BRACKETS | {"command_rate": ("v", "m/min")}, 'command_rate=("v", "mm/min")'),
    ("plunge_brackets.csv", BRACKETS | {"command_rate": ("v", "in/min")}, "command_rate in mm/min, not in/min"),
    ("plunge_brackets.csv", BRACKETS | {"time": ("t", "ms")}, 'time in s, not ms? Say time=("t", "s")'),
    ("plunge_brackets.csv", BRACKETS | {"time": ("t", "min")}, 'time in s, not min? Say time=("t", "s")'),
    ("plunge_deutsch.csv", GERMAN, "size is falling.*diameter.*-0\\.5"),
    ("plunge_deutsch.csv", GERMAN | {"size": ("Aufmaß Durchmesser", "um", 0.5)}, "falling"),
    ("plunge_deutsch.csv", GERMAN | {"size": ("Aufmaß Durchmesser", "um", -1.0)}, "diameter"),
    ("bead_passes.csv", BEAD | {"period": 1.0, "grinding_power": ("P", "W")}, 'grinding_power=("P", "kW")'),
    ("bead_passes.csv", BEAD | {"period": 1.0, "cut_depth": ("a", "mm")}, 'cut_depth=("a", "um")'),
    ("bead_passes.csv", BEAD | {"period": 1.0, "normal_force": "Ft", "tangential_force": "Fn"}, "exchanged"),
    ("shaft.h5", SHAFT | {"infeed_rate": ("v", "mm/s")}, 'infeed_rate=("v", "mm/min")'),
    ("shaft.h5", SHAFT | {"removed": ("removed", "um")}, 'removed=("removed", "mm")'),
    ("shaft.h5", SHAFT | {"time": ("t", "ms")}, 'time in s, not ms? Say time=("t", "s")'),
    ("ring_degrees.csv", RING | {"angle": ("angle", "rad")}, 'angle=("angle", "deg")'),
    ("ring_degrees.csv", RING | {"deviation": ("deviation", "mm")}, 'deviation=("deviation", "um")'),
]  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*the file says")
@pytest.mark.parametrize(("name", "call", "message"), WRONG)
def test_wrong_units_are_refused_with_the_right_one(name, call, message):
    door = centering.Profile.read if "radius" in call else hwsim.Log.read
    told = message if ".*" in message else re.escape(message)
    with pytest.raises(ValueError, match=told) as refused:
        door(SAMPLES / name, **call)
    assert str(refused.value).startswith(name) and "\n" not in str(refused.value)


def test_another_unit_than_that_of_the_file_warns():
    with pytest.warns(
        UserWarning,
        match=r"column 'P \[kW\]': grinding_power is taken in PS as the call says; the file says kW",
    ):
        log = hwsim.Log.read(SAMPLES / "plunge_brackets.csv", **BRACKETS | {"grinding_power": ("P", "PS")})
    assert log["data"].grinding_power.values[0] == pytest.approx(0.1739 * 735.49875)


def test_units_are_taken_as_told_without_the_check():
    with pytest.warns(UserWarning, match="the file says um"):
        log = hwsim.Log.read(
            SAMPLES / "plunge_brackets.csv", **BRACKETS | {"size": ("X", "mm")}, plausible=False
        )
    assert "plausible=False" in str(log.source)


def cycle(step=0.02, rate=0.04, tau=0.5, air=0.0, approach=0.0):
    """Noisy size (mm) of a bore behind its command (mm/s): rapid approach, air, roughing, spark-out."""
    time = np.arange(0.0, approach + air + 8.0, step)
    fast = time < approach
    command = np.where(fast, 3.0, np.where(time < approach + air + 5.0, rate, 0.0))
    contact = np.where((time >= approach + air) & (time < approach + air + 5.0), rate, 0.0)
    actual = np.zeros(time.size)
    for k in range(1, time.size):
        actual[k] = actual[k - 1] + step / tau * (contact[k - 1] - actual[k - 1])
    size = np.concatenate([[0.0], np.cumsum(actual[:-1] * step)])
    return {
        "t [s]": time,
        "v [mm/s]": command,
        "X [mm]": size + 3e-4 * np.random.default_rng(1).standard_normal(time.size),
    }


def read(table, **more):
    return hwsim.Log.read(table, time="t", size="X", command_rate="v", **more)


ODD = {
    "plain": cycle(),
    "air cut": cycle(air=4.0),
    "rapid approach": cycle(approach=3.0),
    "rapid approach and air cut": cycle(approach=2.0, air=2.0),
    "slow machine": cycle(tau=3.0),
    "ends at once": {name: values[:200] for name, values in cycle(tau=1.5).items()},
    "spike": {
        name: np.where(np.arange(values.size) == 99, 500.0, values) if name[0] == "X" else values
        for name, values in cycle().items()
    },
    "command in steps": {
        name: values if name[0] != "v" else np.round(values, 2) for name, values in cycle().items()
    },
    "size of zeros": cycle() | {"X [mm]": np.zeros(400)},
    "command of zeros": cycle() | {"v [mm/s]": np.zeros(400)},
}


@pytest.mark.parametrize("case", ODD)
@pytest.mark.parametrize("at", ["begin", "end"])
def test_odd_but_right_data_pass(case, at):
    assert len(read(ODD[case], commands_at=at)["data"].row) == ODD[case]["t [s]"].size


@pytest.mark.parametrize("case", ["plain", "air cut", "rapid approach", "rapid approach and air cut"])
@pytest.mark.parametrize("factor", [2.0, -1.0, 0.5, 1 / 25.4, -2.0])
def test_a_diameter_shows_behind_air(case, factor):
    table = ODD[case] | {"X [mm]": factor * ODD[case]["X [mm]"]}
    with pytest.raises(ValueError, match="the mapping: size must follow command_rate"):
        read(table)
    slope = slope_of_size(table["t [s]"], table["X [mm]"], table["v [mm/s]"])
    assert slope / factor == pytest.approx(1.0, abs=0.15)


def test_spike_of_power_and_zeros_pass():
    power = np.zeros(100)
    table = {"t [s]": np.arange(100.0), "P [W]": power}
    assert hwsim.Log.read(table, time="t", grinding_power="P") is not None
    table["P [W]"] = np.where(np.arange(100) == 3, 1e9, 800.0)
    assert hwsim.Log.read(table, time="t", grinding_power="P") is not None


def test_turns_against_the_speed_of_the_spindle():
    time = np.arange(0, 4, 0.01)
    angle = 20.0 * time
    table = {
        "t [s]": time,
        "a [rad]": np.mod(angle, 2 * np.pi),
        "n [1/min]": np.full(time.size, 20.0 * 60 / (2 * np.pi)),
    }
    columns = {"angle": "a", "spindle_speed": "n"}
    assert hwsim.Log.read(table, time="t", **columns) is not None
    with (
        pytest.warns(UserWarning, match="the file says 1/min"),
        pytest.raises(ValueError, match=r"angle must turn as spindle_speed says.*1/min for rad/s"),
    ):
        hwsim.Log.read(table, time="t", **columns | {"spindle_speed": ("n", "rad/s")})


def described():
    """Classes with declared fields of all modules that declare some."""
    source = Path(sdpgrind.__file__).parents[1]
    for path in source.rglob("*.py"):
        if "@described(" in path.read_text(encoding="utf-8"):
            importlib.import_module(
                ".".join(path.relative_to(source).with_suffix("").parts).removesuffix(".__init__")
            )
    waiting = [Described]
    while waiting:
        below = waiting.pop().__subclasses__()
        waiting += below
        yield from below


# names of a field that mean another quantity than the column: a tolerance of programs, an angle of a step
ANOTHER = {
    "deviation",
    "angle",
    "acceleration",
    "inertia",
    "speed",
    "start",
    "step",
    "phase",
    "profile",
    "value",
    "feed",
    "reset_time",
    "platform",
}


def usual(spec):
    """Usual range of a declared number; None: it has none."""
    names = spec.check.__code__.co_freevars if hasattr(spec.check, "__code__") else ()
    return spec.check.__closure__[names.index("usual")].cell_contents if "usual" in names else None


HERE = {("Lift", "height")}
"""Fields that mean another thing than the column in one class alone: a bead's height is measured."""


def test_no_name_has_two_units_or_two_ranges():
    """What is declared of a field holds for the column of its name; a bound of 0 or none is no range."""
    ranges = {}
    for cls in described():
        for name, spec in specs(cls).items():
            if name in KNOWN and name not in ANOTHER and (cls.__name__, name) not in HERE and spec.unit:
                relative = spec.unit in ("1", "relative")
                assert relative or parse(spec.unit) == parse(KNOWN[name].unit or "1"), (cls, name)
                if not relative and (given := usual(spec)) is not None:
                    low, high = ranges.get(name, given)
                    ranges[name] = min(low, given[0]), max(high, given[1])
    assert {"feed_rate", "wheel_diameter"} <= set(ranges)
    for name, (low, high) in ranges.items():
        meant = KNOWN[name]
        assert low <= 0 or meant.least == low, name
        assert math.isinf(high) or meant.greatest == high, name


def test_every_quantity_of_the_machines_may_be_read():
    machines = [
        hwsim.PlungeGrinder(plunge.preset("simulation")),
        hwsim.WeldBeadStand(weldbead.preset("P1")),
        hwsim.AdaptiveGrinder(locus.preset("grinding")),
    ]
    for machine in machines:
        for name, unit in {**machine.measures, **machine.accepts}.items():
            assert KNOWN[name].unit == unit, name


def cycle_with(code, *rows):
    """Cycle of a gauge in um with noise, whose rows show a code."""
    time = np.arange(0.0, 12.0, 0.05)
    rate = np.where(time < 6.0, 30.0, 0.0)
    size = 30.0 * np.minimum(time, 6.0) + np.random.default_rng(0).normal(0.0, 0.3, time.size)
    size[list(rows)] = code
    return {"t [s]": time, "x [um]": size, "v [um/s]": rate}


ASKED = {"time": "t", "size": "x", "command_rate": "v"}


@pytest.mark.parametrize(
    ("code", "rows", "told"),
    [
        (-9999.0, range(3, 240, 50), "is -9999 in 5 rows, .* say missing=.*-9999"),
        (9999.0, range(3, 240, 12), "is 9999 in 20 rows"),
        (0.0, range(101, 105), r"is 0 in 4 rows, .* make it none in a table: .*mask"),
    ],
)
def test_a_code_for_no_reading_is_told(code, rows, told):
    with pytest.warns(UserWarning, match=told):
        hwsim.Log.read(cycle_with(code, *rows), **ASKED)


def form_with(code=0.0, *rows, digits=3):
    """Deviations of three lobes of 2 um with the noise of a tester, whose rows show a code."""
    angle = np.arange(0.0, 360.0, 0.5)
    noise = np.random.default_rng(0).normal(0.0, 0.02, angle.size)
    deviation = np.round(np.cos(np.radians(3 * angle)) + noise, digits)
    deviation[list(rows)] = code
    return {"angle [deg]": angle, "dev [um]": deviation}


def test_zeros_of_a_form_are_told():
    """Some rows of 0 between others moved the centre and raised the roundness without a word."""
    with pytest.warns(UserWarning, match=r"is 0 in 4 rows, .* make it none in a table"):
        centering.Profile.read(form_with(0.0, 2, 3, 241, 480), angle="angle", deviation="dev", radius=40.0)


def test_zeros_of_a_form_are_told_where_its_file_begins_too():
    with pytest.warns(UserWarning, match=r"is 0 in 10 rows"):
        centering.Profile.read(form_with(0.0, *range(10)), angle="angle", deviation="dev", radius=40.0)


def passes_with(code, every=7):
    """Power and removal rate of 28 passes, some with a code in the place of the power."""
    rate = np.random.default_rng(0).uniform(50.0, 160.0, 28)
    power = np.where(np.arange(28) % every == 3, code, 114.0 + 12.8 * rate)
    return {"P [W]": power, "Q [mm^3/s]": rate}


PASSES = {"period": 1.0, "grinding_power": "P", "removal_rate": "Q"}


@pytest.mark.parametrize(
    ("code", "told"),
    [
        (0.0, "and no other is near 0: if .*make it none in a table"),
        (-999.0, r'and no other is near 0: if .*say missing=\["-999"\]'),
        (9999.0, r'far above all others: if .*say missing=\["9999"\]'),
        (99999.0, "far above all others"),
    ],
)
def test_a_code_among_loads_of_passes_is_told(code, told):
    """Four powers of 0 among 28 passes made an idle power of -6600 W, and 99999 one of -1 MW, without a word."""
    with pytest.warns(UserWarning, match=rf"is {code:g} in 4 rows, {told}"):
        hwsim.Log.read(passes_with(code), **PASSES)


@pytest.mark.parametrize(("code", "told"), [(0.0, "and no other is near 0"), (9.99, "far above all others")])
def test_a_code_among_roughnesses_is_told(code, told):
    roughness = [3.1, 3.6, code, 3.3, 2.9, code, 3.2, 3.5]
    with pytest.warns(UserWarning, match=rf"column 'Ra \[um\]' is {code:g} in 2 rows, {told}"):
        hwsim.Log.read({"Ra [um]": roughness}, period=1.0, roughness_ra="Ra")


def test_loads_of_few_digits_may_return_far_above_the_others():
    power = [0.3, 0.3, 1.4, 0.3, 0.4, 0.3, 1.4, 0.3, 0.4, 0.3, 0.3, 0.3]
    hwsim.Log.read({"P [kW]": power}, period=1.0, grinding_power="P")


@pytest.mark.parametrize(("code", "every"), [(0.0, 2), (0.0, 28), (300.0, 7)])
def test_a_machine_that_stands_one_zero_and_equal_loads_are_no_codes(code, every):
    hwsim.Log.read(passes_with(code, every), **PASSES)


@pytest.mark.parametrize("digits", [0, 1, 3])
def test_a_form_is_no_code_whatever_the_steps_of_its_gauge(digits):
    centering.Profile.read(form_with(digits=digits), angle="angle", deviation="dev", radius=40.0)


def test_dust_on_a_coarse_gauge_may_be_as_high_by_chance():
    table = form_with(23.0, 60, 400, digits=0)
    table["dev [um]"][[200, 550]] = 17.0, 31.0
    centering.Profile.read(table, angle="angle", deviation="dev", radius=40.0)


def test_two_codes_are_told():
    table = cycle_with(-9999.0, 53, 103)
    table["x [um]"][[77, 143]] = 9999.0
    with pytest.warns(UserWarning, match="9999 in 2 rows"):
        hwsim.Log.read(table, **ASKED)


def test_a_refusal_tells_a_code_too():
    with pytest.raises(ValueError, match=r"must follow command_rate.*; column .x \[um\]. is -9999.*missing="):
        hwsim.Log.read(cycle_with(-9999.0, *range(3, 240, 50)), **ASKED | {"command_rate": ("v", "um/s", 2)})


@pytest.mark.parametrize(
    ("code", "rows"), [(-9999.0, [50]), (0.0, range(9)), (150.0, range(100, 110)), (250.0, range(230, 240))]
)
def test_a_spike_an_air_cut_a_hold_and_a_gauge_that_is_withdrawn_are_no_codes(code, rows):
    hwsim.Log.read(cycle_with(code, *rows), **ASKED)


@pytest.mark.parametrize("word", ["-9999", "-9999.0", -9999])
def test_numbers_of_a_table_are_no_reading_as_those_of_a_text_are(word):
    """`missing=` was passed over in silence where a column held numbers."""
    log = hwsim.Log.read(cycle_with(-9999.0, 53, 103), **ASKED, missing=[word])
    assert [note.missing for note in log.source.columns] == [0, 2, 0]
