"""Every area takes what was measured: arrays by name, a table, a log whatever its table is called."""

import h5py
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from measured import KP, SAMPLES, Log, table

import centering
from sdpgrind import finishing, identify, locus, plunge, units, weldbead
from sdpgrind.finishing import TorqueAxis

nan = float("nan")


def bore(part=0):
    read = pd.read_csv(SAMPLES / "plunge_brackets.csv")
    return table(
        part=part,
        time=(read["t [s]"], "s"),
        size=(1e-3 * read["X [um]"], "mm"),
        command_rate_command=(read["v [mm/min]"] / 60, "mm/s"),
        grinding_power=(1e3 * read["P [kW]"], "W"),
    )


def passes():
    read = pd.read_csv(SAMPLES / "bead_passes.csv", sep=";", decimal=",")
    return table(
        normal_force=(KP * read["Fn [kp]"], "N"),
        tangential_force=(KP * read["Ft [kp]"], "N"),
        grinding_power=(1e3 * read["P [kW]"], "W"),
        removal_rate=(1000 / 60 * read["Q [cm^3/min]"], "mm^3/s"),
        feed_rate=(1000 / 60 * read["feed [m/min]"], "mm/s"),
        cut_depth=(1e-3 * read["a [um]"], "mm"),
    )


def runs():
    read = pd.read_csv(SAMPLES / "finishing_runs.csv")
    return table(
        pattern=(read["pattern"].astype(str).to_numpy(), ""),
        tool_diameter=(read["tool [mm]"], "mm"),
        normal_force=(read["F [N]"], "N"),
        roughness_ra=(1e-3 * read["Ra [µm]"], "mm"),
    )


def forms(made, tier):
    """The same rows as a table, as the only table of a log, as one of several, and as arrays."""
    arrays = {str(name): made[name].values for name in made.variables}
    return made, Log(data=made), Log(**{"other": table(a=([1.0], "")), tier: made}), {"any": made}, arrays


SAME = {
    "bore": (bore(), "controller", lambda data: plunge.identify(data, "time_constant")),
    "power": (passes(), "sequence", lambda data: weldbead.identify(data, "power")),
    "friction": (passes(), "sequence", lambda data: weldbead.identify(data, "friction")),
    "roughness": (runs(), "data", lambda data: finishing.identify(data, "roughness")),
}


@pytest.mark.parametrize("name", SAME)
def test_one_door(name):
    made, tier, way = SAME[name]
    found = [way(data) for data in forms(made, tier)]
    assert all(np.array_equal(one.value, found[0].value) for one in found)


def test_sample_files():
    """Truth: 1.4 s; 12.8 J/mm^3, 114 W, 0.33; exponent -0.8. Value, sd in the last digits shown."""
    tau = plunge.identify(Log(data=bore()), "time_constant")
    assert abs(tau.value[0] - 1.4021) < 0.0015 and tau.sd[0] == pytest.approx(0.0015, abs=5e-4)
    power, ratio = (weldbead.identify(Log(data=passes()), what) for what in ("power", "friction"))
    assert [round(power.value[0], 3), round(power.value[1], 1)] == [12.903, 110.0]
    assert power.sd == pytest.approx([0.068, 2.5], rel=0.02)
    assert round(ratio.value[0], 4) == 0.3289
    rough = finishing.identify(Log(data=runs()), "roughness")
    at = rough.names.index("tool_exponent")
    assert round(rough.value[at], 3) == -0.813 and rough.sd[at] == pytest.approx(0.022, rel=0.03)


def test_friction_of_the_sample_passes():
    """Noise of 3 % of these forces gives 0.00204; as if the noise were even 0.0018, of which 91.5 % hold."""
    force, tangential = passes()["normal_force"].values, passes()["tangential_force"].values
    ratio = weldbead.identify(Log(data=passes()), "friction")
    grown = 0.03 * 0.33 * np.sqrt(np.sum(force**4)) / np.sum(force**2)
    assert ratio.sd[0] == pytest.approx(grown, rel=0.1)
    even = identify.least_squares(force[:, None], tangential)
    assert even.sd[0] == pytest.approx(0.0018, rel=0.02)


def test_from_a_shaft_to_a_plan():
    """One setting, a level and a slope: two fields, once the course of the wear is given."""
    problem, fields = locus.preset("grinding"), ("specific_energy", "curvature_pressure")
    group = h5py.File(SAMPLES / "shaft.h5")["shaft 1"]
    read = table(
        time=(group["t"][:], "s"),
        grinding_power=(group["P"][:], "W"),
        infeed_rate=(group["v"][:] / 60, "mm/s"),
        work_rotation=(units.rpm(group["n"][:]), "rad/s"),
        removed=(group["removed"][:], "mm"),
    )
    with pytest.raises(ValueError, match=r"wear_flat_area \(1\), on which grinding_power depends, a hidden"):
        locus.identify(Log(data=read), "specific_energy", problem=problem)
    low, high = problem.hidden["wear_flat_area"]
    worn = read.assign(wear_flat_area=low + (high - low) * read.removed / 0.6)
    found = locus.identify(worn, fields, problem=problem)
    # By hand: 900 W and 500 W/mm are the power at `low` and its growth.
    model, growth = problem.model, 500.0 * 0.6 / (high - low)
    touch = (model.equivalent_diameter * 2 * np.pi * 0.03 / units.rpm(240.0)) ** 0.5
    slide = growth / (model.width * 30.0 * touch)  # N/mm^2
    speed = units.rpm(240.0) * 30.0
    assert found["curvature_pressure"] == pytest.approx((slide - 7.55) * 30e3 * 50.0 / speed, rel=1e-9)
    chips = (900.0 - growth * low) / model.width - 0.962 * 30.0
    assert found["specific_energy"] == pytest.approx(chips / (np.pi * 60.0 * 0.03), rel=1e-9)
    corrected = problem.updated(found)
    assert corrected.model.grinding_power(0.03, units.rpm(240.0), low) == pytest.approx(900.0, rel=1e-9)
    assert locus.plan(corrected).problem == corrected
    with pytest.raises(ValueError, match=r"physically impossible.*\(specific_energy must be > 0 \(J/mm\^3\)"):
        locus.identify(
            worn.assign(wear_flat_area=worn.wear_flat_area * 0 + 0.0104), fields[0], problem=problem
        )


def test_other_estimates_take_a_log_too():
    log, model = Log(data=passes()), weldbead.preset("P1").model
    assert weldbead.identify(log, "scatter", model=model).message == "from 30 passes"
    assert len(weldbead.identify(log, "law", model=model).sample) == 30
    ring = table(angle=(np.radians(np.arange(360.0)), "rad"), reading=(np.full(360, 40.0), "mm"))
    assert centering.identify(Log(data=ring), "circle").radius == pytest.approx(40.0)
    axis = TorqueAxis()
    time = np.arange(100) * axis.sample_time
    angle = 0.5 * (0.185 * 0.05 - 0.02) / 0.0011 * time**2  # 50 mA against 20 mN m
    shown = np.round(angle / axis.angle_step) * axis.angle_step
    free = table(time=(time, "s"), motor_angle=(shown, "rad"), current_command=(np.full(100, 0.05), "A"))
    found = finishing.identify(Log(data=free), "load_torque", axis=axis)
    assert found["load_torque"] == pytest.approx(0.02, abs=1e-4)


def test_parts_and_missing_rows():
    both = xr.concat([bore(), bore(part=1)], "row")
    both.size[:] = np.where(both.part == 1, nan, both["size"])
    one = plunge.identify(bore(), "time_constant")
    assert plunge.identify(both, "time_constant", part=0).value == one.value
    assert plunge.identify(both, "time_constant").message.startswith("from 1 part; 1 left out, part 1:")
    holed = runs()
    holed["roughness_ra"][3] = nan
    holed["pattern"] = holed["pattern"].astype(object)
    holed["pattern"][7] = ""
    assert finishing.identify(holed, "roughness").message == "from 16 readings"
    turned = np.radians(np.arange(720.0))
    rings = table(
        part=np.repeat([0, 1], 360),
        time=(np.tile(np.arange(360.0), 2), "s"),
        angle=(turned, "rad"),
        reading=(np.repeat([40.0, 41.0], 360), "mm"),
    )
    assert centering.identify(rings, "circle", part=1).radius == pytest.approx(41.0)


def test_a_quantity_that_was_only_commanded():
    """The command of the row before led to the readings of a row; in arrays a row is a row."""
    made = table(part=[0, 0, 0, 1, 1], force_command=([1.0, 2.0, 3.0, 4.0, 5.0], "N"), cut=(np.ones(5), "mm"))
    read = identify.readings(made, {"force": "N", "cut": "mm"}, tier="data")
    assert read["force"].tolist() == [1.0, 2.0, 4.0] and read.dropped == 2
    assert identify.readings(made, {"force": "N"}, tier="data", part=1)["force"].tolist() == [4.0]


@pytest.mark.parametrize(
    ("data", "kind", "message"),
    [
        (
            Log(a=bore(), b=bore()),
            ValueError,
            r"data must hold the table 'controller'; it holds 'a', 'b': pass",
        ),
        (Log(data=passes()), ValueError, r"data must hold command_rate \(mm/s\); it holds normal_force"),
        (
            bore().assign(size=bore()["size"].assign_attrs(units="um")),
            ValueError,
            "size must be in mm, as hwsim.Log.read converts it; its units are 'um'",
        ),
        ({"time": ["a"], "size": ["b"], "command_rate": ["c"]}, TypeError, r"must be numbers \(mm/s\); got"),
        ([1.0], TypeError, "data must be arrays by name, or a log; got list"),
    ],
)
def test_refused(data, kind, message):
    with pytest.raises(kind, match=message):
        plunge.identify(data, "time_constant")
