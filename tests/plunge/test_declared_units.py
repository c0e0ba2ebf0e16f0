"""Units of a commissioning cycle: eight mistakes are named, right cycles pass, and what cannot be told is said."""

import dataclasses

import numpy as np
import pytest
from machine_readings import PROBLEM, recorded
from plunge_inside import cycles, refuse_other_units

import hwsim
from sdpgrind import plunge

WRONG = {
    "size in um, not mm? Say size=(\"size\", \"um\")": ("size", 1000.0),
    "size in in, not mm? Say size=(\"size\", \"in\")": ("size", 1 / 25.4),
    "size of the diameter? Say size=(\"size\", \"mm\", 0.5)": ("size", 2.0),
    "command_rate in um/s, not mm/s? Say command_rate=(\"command_rate\", \"um/s\")": ("command_rate", 1000.0),
    "command_rate in mm/min, not mm/s? Say command_rate=(\"command_rate\", \"mm/min\")": ("command_rate", 60.0),
    "command_rate of the diameter? Say command_rate=(\"command_rate\", \"mm/s\", 0.5)": ("command_rate", 2.0),
    "time in ms, not s? Say time=(\"time\", \"ms\")": ("time", 1000.0),
    "grinding_power in kW, not W? Say grinding_power=(\"grinding_power\", \"kW\")": ("grinding_power", 1e-3),
}  # fmt: skip
SETTLED = ((1.0, 9.0), (0.2, 4.0))  # a hold of 9 s: more than three time constants


def commission(data, problem=PROBLEM):
    return plunge.identify(data, "machine", problem=problem)


@pytest.mark.parametrize("told", WRONG)
@pytest.mark.parametrize("seed", range(3))
def test_each_mistake_is_named_first(told, seed):
    name, factor = WRONG[told]
    data = recorded(seed)
    with pytest.raises(ValueError) as refused:
        commission(data | {name: data[name] * factor})
    message = str(refused.value)
    assert message.partition(": ")[2].startswith(told) and message.endswith(" to hwsim.Log.read")


@pytest.mark.parametrize("seed", range(20))
def test_right_cycles_pass(seed):
    """Force ratio, area, energy and wear up to 40 % off, a grinding ratio of 6: no alarm."""
    rng = np.random.default_rng(seed)
    area, energy, ratio = 1 + rng.uniform(-0.4, 0.4, 3)
    wear = rng.uniform(0.0, 70 / (50 * 6))
    data = recorded(seed, SETTLED, wear_flat_area=0.026 * area, specific_energy=13.8 * energy,
                    normal_force_ratio=9.78 * ratio, wheel_wear=wear)  # fmt: skip
    assert refuse_other_units(cycles.cycles(data, power=True), PROBLEM, data)


def test_the_call_names_the_columns_of_the_file():
    """A file whose units were overruled: its own headers, and the unit that it says."""
    data = recorded()
    table = {"t [s]": data["time"], "X [um]": 1000 * data["size"], "v [mm/min]": 60 * data["command_rate"],
             "P [kW]": data["grinding_power"] / 1000}  # fmt: skip
    right = hwsim.Log.read(table, time="t", size="X", command_rate="v", grinding_power="P")
    fit = commission(right)
    assert fit.ok and "units were not checked" not in fit.message
    with pytest.warns(UserWarning):
        log = hwsim.Log.read(
            table, time="t", size=("X", "mm"), command_rate="v", grinding_power="P", plausible=False
        )
    with pytest.raises(ValueError, match=r'size in um, not mm\? Say size=\("X", "um"\) to hwsim.Log.read'):
        commission(log)
    with pytest.warns(UserWarning):
        log = hwsim.Log.read(table, time="t", size="X", command_rate="v", grinding_power=("P", "W"),
                             plausible=False)  # fmt: skip
    with pytest.raises(
        ValueError, match=r'grinding_power must be 5 ... 200 J/mm\^3 .* Say grinding_power=\("P", "kW"\)'
    ):
        commission(log)


def test_a_power_that_no_unit_explains():
    data = recorded()
    with pytest.raises(ValueError, match="is the width another than 9 mm"):
        commission(data | {"grinding_power": 10.5 * data["grinding_power"]})


@pytest.mark.parametrize(
    "problem", [dataclasses.replace(PROBLEM, time_constant=3.5), PROBLEM.replace(grinding_ratio=5.0)]
)
def test_what_cannot_be_told_is_said(problem):
    """A hold below three time constants, or a wheel that wears fast, tells no unit."""
    fit = commission(recorded(), problem)
    assert (
        "units were not checked: that takes a hold of 3 time constants, and a grinding ratio of 6"
        in fit.message
    )


def test_a_constant_command_of_zero_is_no_alarm():
    data = recorded()
    fit = commission(data | {"command_rate": 0 * data["command_rate"]})
    assert fit.message == "not identified: the command feeds 0 mm in all: a part needs an infeed"


@pytest.mark.parametrize(
    ("column", "times", "said"),
    [
        ("size", 1e3, 'size in um, not mm? Say size=("size", "um")'),
        ("time", 1e3, 'time in ms, not s? Say time=("time", "ms")'),
        (
            "command_rate",
            60.0,
            'command_rate in mm/min, not mm/s? Say command_rate=("command_rate", "mm/min")',
        ),
    ],
)
def test_a_lag_that_is_not_told_names_the_unit(column, times, said):
    """Arrays in another unit say too little of a lag for no other reason."""
    time = np.arange(0.0, 6.4, 0.04)
    data = {
        "time": time, "command_rate": np.full(160, 0.0448),
        "size": 0.0448 * (time - 1.9 * (1 - np.exp(-time / 1.9))),
    }  # fmt: skip
    fit = plunge.identify(data | {column: times * data[column]}, "time_constant")
    assert not fit.ok and said in fit.message and "while the rate changes" not in fit.message
    assert plunge.identify(data, "time_constant").ok


def test_a_slender_quill_is_soft_and_a_stiffness_in_newton_per_micrometre_is_refused():
    """80 N/mm in a bore of 1.5 mm lags 4 s; 8 to 90 N/µm taken as N/mm lag minutes."""
    model = plunge.preset("simulation").model
    quill = {"wheel_diameter": 1.0, "work_diameter": 1.5, "width": 3.0, "wheel_speed": 8e3}
    assert model.replace(**quill, stiffness=80.0).stiffness == 80.0
    for stiffness in (8.0, 20.0, 90.0):
        with pytest.raises(ValueError, match="N/mm, some 10000; multiply by 1000 for N/µm"):
            model.replace(stiffness=stiffness)
