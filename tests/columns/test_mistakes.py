"""One wrong declaration is told by its name, the most probable first; columns exchanged, two parts, coarse clocks too."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import hwsim
from centering import Profile

SAMPLES = Path(__file__).parents[1] / "data" / "samples"
BRACKETS = {
    "time": ("t", "s"),
    "size": ("X", "um"),
    "command_rate": ("v", "mm/min"),
    "grinding_power": ("P", "kW"),
}
GERMAN = {"time": "Zeit", "size": ("Aufmaß Durchmesser", "um", -0.5), "command_rate": "Zustellung"}
SHAFT = {"time": "t", "grinding_power": "P", "infeed_rate": "v", "work_rotation": "n", "removed": "removed"}
PARTS = {"size": "size", "command_rate": "rate"}
BEAD = {"period": 1.0, "normal_force": "Fn", "tangential_force": "Ft", "grinding_power": "P", "removal_rate": "Q",
        "feed_rate": "feed", "cut_depth": "a"}  # fmt: skip
RIGHT = {"plunge_brackets.csv": BRACKETS, "plunge_deutsch.csv": GERMAN, "shaft.h5": SHAFT, "plunge_parts.tdms": PARTS,
         "bead_passes.csv": BEAD}  # fmt: skip
TWENTY = [
    ("plunge_brackets.csv", {"size": ("X", "mm")}, 'size=("X", "um")'),
    ("plunge_brackets.csv", {"size": ("X", "in")}, 'size=("X", "um")'),
    ("plunge_brackets.csv", {"size": ("X", "um", 2)}, 'size without its factor of 2? Say size=("X", "um")'),
    ("plunge_brackets.csv", {"size": ("X", "um", -1)}, 'size without its factor of -1? Say size=("X", "um")'),
    ("plunge_brackets.csv", {"command_rate": ("v", "um/s")}, "got 16.6: command_rate in mm/min, not um/s?"),
    ("plunge_brackets.csv", {"command_rate": ("v", "mm/s")}, "got 0.0166: command_rate in mm/min, not mm/s?"),
    ("plunge_brackets.csv", {"command_rate": ("v", "mm/min", 0.5)}, "got 1.99: command_rate without its factor of 0.5?"),
    ("plunge_brackets.csv", {"time": ("t", "ms")}, 'got 995: time in s, not ms? Say time=("t", "s")'),
    ("plunge_brackets.csv", {"time": ("t", "min")}, 'got 0.0166: time in s, not min? Say time=("t", "s")'),
    ("plunge_brackets.csv", {"grinding_power": ("P", "W")}, 'grinding_power=("P", "kW")'),
    ("plunge_brackets.csv", {"size": ("v", "um"), "command_rate": ("X", "mm/min")},
     'exchanged? Say size=("X", "um"), command_rate=("v", "mm/min")'),
    ("plunge_deutsch.csv", {"size": ("Aufmaß Durchmesser", "um", -1)}, "got 1.99: size of the diameter? Say"),
    ("plunge_deutsch.csv", {"size": ("Aufmaß Durchmesser", "um")}, "size of the diameter with the other sign? Say"),
    ("plunge_deutsch.csv", {"time": ("Zeit", "ms")}, 'time in s, not ms? Say time=("Zeit", "s")'),
    ("shaft.h5", {"removed": ("removed", "in")}, 'removed in mm, not in? Say removed=("removed", "mm")'),
    ("shaft.h5", {"infeed_rate": ("v", "mm/s")}, "infeed_rate in mm/min, not mm/s?"),
    ("shaft.h5", {"infeed_rate": ("removed", "mm/min"), "removed": ("v", "mm")}, "exchanged? Say removed="),
    ("shaft.h5", {"grinding_power": ("P", "hp")}, 'grinding_power=("P", "W")'),
    ("plunge_parts.tdms", {"size": ("rate", "um"), "command_rate": ("size", "mm/s")}, "exchanged? Say size="),
    ("bead_passes.csv", {"removal_rate": ("Q", "mm^3/s")}, 'removal_rate=("Q", "cm^3/min")'),
]  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*the file says")
@pytest.mark.parametrize(("name", "wrong", "told"), TWENTY)
def test_wrong_declarations_are_told_by_their_name(name, wrong, told):
    assert hwsim.Log.read(SAMPLES / name, **RIGHT[name]) is not None
    with pytest.raises(ValueError, match="plausible=False") as refused:
        hwsim.Log.read(SAMPLES / name, **RIGHT[name] | wrong)
    message = str(refused.value)
    assert told in message and "\n" not in message
    if "? Say" in message:
        assert message.index("? Say") < message.index(told) + len(told) + 5  # it is the first explanation


def bare():
    """The sample without units in its headers: nothing but the numbers tells."""
    table = pd.read_csv(SAMPLES / "plunge_brackets.csv")
    return table.rename(columns=lambda header: header.split(" ")[0])


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"time": ("t", "ms")}, 'got 995: time in s, not ms? Say time=("t", "s")'),
        ({"time": ("t", "min")}, 'got 0.0166: time in s, not min? Say time=("t", "s")'),
        (
            {"command_rate": ("v", "mm/s")},
            'command_rate in mm/min, not mm/s? Say command_rate=("v", "mm/min")',
        ),
        (
            {"command_rate": ("v", "um/s")},
            'command_rate in mm/min, not um/s? Say command_rate=("v", "mm/min")',
        ),
        ({"size": ("X", "um", 2)}, "size without its factor of 2?"),
        (
            {"size": ("v", "um"), "command_rate": ("X", "mm/min")},
            'exchanged? Say size=("X", "um"), command_rate=("v", "mm/min")',
        ),
        (
            {"size": ("v", "um", -0.5), "command_rate": ("X", "mm/min", 0.5)},
            'exchanged? Say size=("X", "um", -0.5), command_rate=("v", "mm/min", 0.5)',
        ),
        ({"time": None, "period": 40.0}, "got 0.000995: period of 0.04 s? Say period=0.04"),
    ],
)
def test_numbers_alone_tell_the_most_probable_mistake_first(wrong, told):
    with pytest.raises(ValueError, match="must follow") as refused:
        hwsim.Log.read(bare(), **BRACKETS | wrong)
    message = str(refused.value)
    assert told in message
    assert told.startswith("exchanged") or message.index("? Say") >= message.index(told)


def test_milliseconds_that_are_read_as_seconds_are_a_mistake_of_time():
    table = bare()
    table["t"] = 1000 * table["t"]
    with pytest.raises(ValueError, match=r'got 0.000995: time in ms, not s\? Say time=\("t", "ms"\)'):
        hwsim.Log.read(table, **BRACKETS)


def test_two_parts_in_one_file_are_told():
    one = bare()
    two = one.assign(t=one["t"] + float(one["t"].iloc[-1]) + 0.04)
    short = one["t"] < 2.0
    again = pd.concat([one[short], two], ignore_index=True).assign(t=lambda x: 0.04 * np.arange(len(x)))
    with pytest.raises(ValueError, match=r"size goes back to its beginning: two parts\? Say part=") as told:
        hwsim.Log.read(again.assign(X=2 * again["X"]), **BRACKETS)
    assert "diameter" not in str(told.value)


def test_a_gap_is_no_other_unit():
    table = bare()
    table["t"] = table["t"].where(table["t"] < 4, table["t"] + 3600)
    with pytest.raises(ValueError, match=r"as time has a gap of 3600 s: two parts\? Say part=") as told:
        hwsim.Log.read(table, **BRACKETS)
    assert "diameter" not in str(told.value)
    assert "daylight saving? Take stamps in UTC" in str(told.value)


def test_an_hour_back_may_be_daylight_saving():
    table = bare()
    table["t"] = table["t"].where(table["t"] < 4, table["t"] - 3600)
    with pytest.raises(
        ValueError, match=r'on_restart="new part"; an hour: daylight saving\? Take stamps in UTC'
    ):
        hwsim.Log.read(table, **BRACKETS)


def test_a_gauge_may_show_the_whole_diameter():
    table = bare()
    table["X"] = 60.25 - 2e-3 * table["X"]  # mm of diameter
    log = hwsim.Log.read(table, **BRACKETS | {"size": ("X", "mm", -0.5)})
    moved = log["data"]["size"].values
    assert moved[-1] - moved[0] == pytest.approx(0.1822, abs=5e-4)
    with pytest.raises(ValueError, match=r"size must be 0.005 ... 20 mm.*size=\(\"X\", \"um\", -0.5\)"):
        hwsim.Log.read(table.assign(X=1000 * table["X"]), **BRACKETS | {"size": ("X", "mm", -0.5)})


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_a_ramp_of_the_feed_in_the_air_is_no_exchange(noise):
    rows = np.arange(400)
    size = 12.0 + noise * np.random.default_rng(3).standard_normal(400)
    table = {"t": 0.02 * rows, "X": size, "v": 1e-4 * rows}
    log = hwsim.Log.read(table, time=("t", "s"), command_rate=("v", "mm/s"), size=("X", "mm"))
    assert log["data"].sizes["row"] == 400


def test_a_clock_of_whole_seconds_warns():
    table = bare()
    coarse = table.assign(t=np.floor(table["t"]))
    with pytest.warns(UserWarning, match=r"duplicates='mean' leaves 10 of 24\d rows.*period=0.04 \(s\)"):
        hwsim.Log.read(coarse, **BRACKETS, duplicates="mean")


@pytest.mark.parametrize("unit", ["mm^3/s", "mm^3/min", "cm^3/s"])
def test_removal_rates_must_agree_with_power_depth_and_feed(unit):
    with (
        pytest.warns(UserWarning, match="the file says"),
        pytest.raises(
            ValueError, match=r'removal_rate must agree with power.*removal_rate=\("Q", "cm\^3/min"\)'
        ),
    ):
        hwsim.Log.read(SAMPLES / "bead_passes.csv", **BEAD | {"removal_rate": ("Q", unit)})


BEAD_UNITS = {"removal_rate": ("Q", "cm^3/min"), "feed_rate": ("feed", "m/min"), "cut_depth": ("a", "um"),
              "grinding_power": ("P", "kW")}  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*the file says")
@pytest.mark.parametrize("of_file", [True, False])
@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("removal_rate", "mm^3/min"),
        ("feed_rate", "m/s"),
        ("feed_rate", "mm/min"),
        ("cut_depth", "nm"),
        ("cut_depth", "mm"),
    ],
)
def test_the_one_of_rate_depth_and_feed_that_is_wrong_is_named(name, unit, of_file):
    table = pd.read_csv(SAMPLES / "bead_passes.csv", sep=";", decimal=",")
    if not of_file:
        table = table.rename(columns=lambda header: header.split(" ")[0])
    header, right = BEAD_UNITS[name]
    asked = {"period": 1.0} | BEAD_UNITS
    assert hwsim.Log.read(table, **asked) is not None
    with pytest.raises(ValueError, match="plausible=False") as refused:
        hwsim.Log.read(table, **asked | {name: (header, unit)})
    message = str(refused.value)
    call = f'{name}=("{header}", "{right}")'
    assert call in message
    if of_file and "must agree" in message:
        assert message.index(call) < (message + ", or ").index(", or ")  # the file's own unit first


def test_a_removal_rate_that_no_unit_explains_is_told_without_a_call():
    rows = {"Q": np.full(9, 0.02), "P": np.full(9, 2e5), "a": np.full(9, 1e-3), "f": np.full(9, 900.0)}
    units = {"removal_rate": ("Q", "mm^3/s"), "grinding_power": ("P", "W"), "cut_depth": ("a", "mm")}
    with pytest.raises(ValueError, match=r"energy 1e\+07 J/mm\^3 and bead width 0.0222 mm \(plausible=False"):
        hwsim.Log.read(rows, period=1.0, feed_rate=("f", "mm/s"), **units)


@pytest.mark.filterwarnings("ignore:.*the file says")
@pytest.mark.parametrize("unit", ["N", "kN"])
def test_forces_must_agree_with_power_by_the_speed_of_cutting(unit):
    forces = {"normal_force": ("Fn", unit), "tangential_force": ("Ft", unit)}
    with pytest.raises(
        ValueError, match=r"grinding_power must rise with .* 1 ... 300 m/s; got (401|0.401) m/s"
    ):
        hwsim.Log.read(SAMPLES / "bead_passes.csv", **BEAD | forces)


def test_power_that_does_not_follow_the_force_tells_no_speed():
    random = np.random.default_rng(5)
    table = {"F [N]": random.uniform(0.5, 1.5, 50), "P [W]": 900 + 30 * random.standard_normal(50)}
    assert hwsim.Log.read(table, period=1.0, tangential_force="F", grinding_power="P") is not None


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"feed_rate": ("feed", "mm/s")}, r"feed_rate in mm/s,.* imply .* bead width 212 mm; usual are .* 2 ... 200"),
        (
            {"feed_rate": ("feed", "mm/s"), "removal_rate": ("Q", "mm^3/s")},
            r"imply specific energy 270 J/mm\^3 and bead width 12.7 mm; usual are specific energy 2 ... 150",
        ),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore:.*the file says")
def test_what_is_unusual_in_a_removal_rate_warns(wrong, told):
    with pytest.warns(UserWarning, match=told):
        hwsim.Log.read(SAMPLES / "bead_passes.csv", **BEAD | wrong)


def read_without_rate(depth):
    """Log of passes of 10 J/mm^3 and 0.1 mm, whose depth is told as `depth` in mm."""
    table = {"a": np.full(9, depth), "f": np.full(9, 6.0), "w": np.full(9, 6.0), "P": np.full(9, 36.0)}
    units = {"cut_depth": ("a", "mm"), "bead_width": ("w", "mm"), "grinding_power": ("P", "W")}
    return hwsim.Log.read(table, period=1.0, feed_rate=("f", "mm/s"), **units)


def test_power_is_held_against_width_depth_and_feed_without_a_rate():
    assert read_without_rate(0.1) is not None
    with pytest.warns(UserWarning, match="imply specific energy 254 J/mm"):
        read_without_rate(0.1 / 25.4)
    with pytest.raises(
        ValueError, match=r"grinding_power must agree with width.* cut_depth in cm, not mm\? Say"
    ):
        read_without_rate(0.001)


@pytest.mark.parametrize(
    ("times", "told"),
    [
        ({"period": 40.0}, "time has 40 s from row to row; usual are up to 2 s"),
        ({"time": ("t", "ms")}, r"time has parts of 0.009\d+ s; usual are 0.3 s and more"),
        ({"time": ("t", "h")}, "time has 144 s from row to row"),
    ],
)
def test_a_size_alone_tells_a_time_that_no_machine_means(times, told):
    assert hwsim.Log.read(bare(), time=("t", "s"), size=("X", "um")) is not None
    with pytest.warns(UserWarning, match=told):
        hwsim.Log.read(bare(), size=("X", "um"), **times)


def test_a_step_of_instants_in_milliseconds_is_refused():
    options = BRACKETS | {"time": ("t", "s")}
    with pytest.raises(ValueError, match=r"50 s leaves 1 instant of 245 rows: resample=0.05 if it is in ms"):
        hwsim.Log.read(bare(), **options, resample=50.0)
    assert hwsim.Log.read(bare(), **options, resample=0.05).source.rows_read > 100
    assert hwsim.Log.read(bare(), **options, resample=5.0, plausible=False).source.rows_read == 2


@pytest.mark.parametrize("header", ["Ist um", "Ist_um", "Soll, um"])
def test_a_unit_at_the_end_of_a_header_is_offered(header):
    with pytest.raises(ValueError, match="as the header seems to say") as told:
        hwsim.Log.read({header: np.arange(9.0)}, period=1.0, size=header)
    assert f'size=("{header}", "um")' in str(told.value)


def test_a_bracket_is_taken_and_a_word_is_no_unit():
    assert hwsim.Log.read({"Soll [µm]": np.arange(9.0)}, period=1.0, size="Soll") is not None
    with pytest.raises(ValueError, match=r'say size=\("Ist kurz", "mm"\) or another'):
        hwsim.Log.read({"Ist kurz": np.arange(9.0)}, period=1.0, size="Ist kurz")


def test_a_ring_is_gone_round():
    with pytest.raises(ValueError, match=r"got 0.5 of a turn: is radius a diameter\? Say radius=40"):
        Profile.read(SAMPLES / "ring.x3p", radius=80.0)
    assert Profile.read(SAMPLES / "ring.x3p", radius=80.0, plausible=False).turns < 0.6
    half = {"angle": ("angle", "deg", 0.5), "deviation": "deviation", "radius": 40.0}
    with pytest.raises(
        ValueError, match=r"ring_degrees.csv: angles must go round the ring; got 0.5 of a turn"
    ):
        Profile.read(SAMPLES / "ring_degrees.csv", **half)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"radius": 40000.0}, r"radius must be 1 ... 3000 mm; got 40000 mm; .*radius=40 \(um\)"),
        ({"radius": 0.04}, r"radius must be 1 ... 3000 mm; got 0.04 mm; .*radius=40 \(m\)"),
        ({"radius": 40.0, "tip_radius": 500.0}, r"tip_radius must be 0.001 ... 50 mm; got 500 mm; .*tip_radius=0.5 \(um\)"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", ["ring.x3p", "ring_degrees.csv"])
def test_radii_are_in_millimetres(name, wrong, told):
    columns = {} if name.endswith("x3p") else {"angle": "angle", "deviation": "deviation"}
    with pytest.raises(ValueError, match=told + r".*plausible=False"):
        Profile.read(SAMPLES / name, **columns, **wrong)


def arc(path, reading, turns=1.0, noise=0.0):
    """X3P of a ring of 40 mm: deviation (mm) over the angle (rad)."""
    x3pio = pytest.importorskip("x3pio")
    angle = np.arange(int(1000 * turns)) * 2 * np.pi / 1000
    deviation = reading(angle) + noise * np.random.default_rng(4).standard_normal(angle.size)
    x3pio.write(path, 1e-3 * deviation, x_scale=2 * np.pi * 40e-3 / 1000)
    return path


def test_half_a_radius_goes_round_twice(tmp_path):
    with pytest.raises(
        ValueError, match=r"goes round 2 times, .* not alike .*: once at radius=40 \(plausible"
    ):
        Profile.read(SAMPLES / "ring.x3p", radius=20.0)
    assert Profile.read(SAMPLES / "ring.x3p", radius=20.0, plausible=False).turns > 1.9
    path = arc(tmp_path / "a.x3p", lambda angle: 0.02 * np.cos(angle) + 1e-3 * np.cos(3 * angle), noise=1e-3)
    for wrong in (20.0, 13.0):
        with pytest.raises(ValueError, match="once at radius=40 "):
            Profile.read(path, radius=wrong)


@pytest.mark.parametrize(
    "ring",
    [
        lambda angle: 0.02 * np.cos(angle),
        lambda angle: 1e-3 * np.cos(2 * angle) + 1e-3 * np.cos(5 * angle),
        lambda angle: 0.0 * angle,
    ],
)
@pytest.mark.parametrize("turns", [1.1, 2.0, 3.5])
def test_turns_of_one_ring_are_alike(tmp_path, ring, turns):
    path = arc(tmp_path / "a.x3p", ring, turns, noise=3e-4)
    assert Profile.read(path, radius=40.0).turns == pytest.approx(turns, abs=0.01)


def test_limits_of_roundness_are_in_millimetres():
    ring = Profile.read(SAMPLES / "ring.x3p", radius=40.0)
    with pytest.raises(
        ValueError, match=r"limits\['RONt'\] must be in mm, some 0.003; units.um\(...\) .* got 10"
    ):
        ring.report(limits={"RONt": 10})


def cycle():
    """Cycle of a size in um that lags its rate in um/s, with a power in W; and the position that was commanded, mm."""
    time = np.arange(0.0, 12.0, 0.05)
    rate = np.where(time < 6.0, 30.0, 0.0)
    position = np.minimum(30.0 * time, 180.0)
    size = position - 20.0 * np.where(time < 6.0, 1 - np.exp(-time), np.exp(6.0 - time))
    size += np.random.default_rng(0).normal(0.0, 0.3, time.size)
    power = 300.0 + 30.0 * rate + np.random.default_rng(1).normal(0.0, 5.0, time.size)
    return pd.DataFrame(
        {
            "t": time,
            "x": size,
            "v": rate,
            "P": power,
            "pos": position / 1000 + np.random.default_rng(2).normal(0.0, 2e-4, time.size),
        }
    )


def short_cycle(end):
    """Cycle of 0.2 mm behind a lag of 1 s that no hold lasts, exact to 0.1 um; retracted or paused at its end."""
    time = np.arange(0.0, 3.0, 0.01)
    rate = np.where(time < 0.6, 0.3, np.where(time < 1.2, 0.03, 0.0))
    away = np.zeros(time.size)  # from where the command is
    for k in range(1, time.size):
        away[k] = rate[k - 1] + (away[k - 1] - rate[k - 1]) * np.exp(-0.01)
    size = np.concatenate([[0.0], np.cumsum(0.01 * rate)[:-1]]) - away
    if end == "retracted":
        rate[250:], size[250:] = -0.5, size[250]
    if end == "paused":
        time[250:], size[250:] = time[250:] + 3600.0, 0.01 * rate.sum()
    return {"t": time, "x": np.round(size, 4), "v": rate}


@pytest.mark.parametrize("end", ["spark-out", "retracted", "paused"])
def test_a_cycle_shorter_than_its_lag_tells_a_radius_from_a_diameter(end):
    """Its slope was half of the command while it still rose: refused as it is, and taken for a diameter."""
    asked = {"time": ("t", "s"), "command_rate": ("v", "mm/s")}
    hwsim.Log.read(short_cycle(end), **asked, size=("x", "mm"))
    for factor, told in ((2, "without its factor of 2"), (0.5, "without its factor of 0.5")):
        with pytest.raises(ValueError, match=told):
            hwsim.Log.read(short_cycle(end), **asked, size=("x", "mm", factor))


CYCLE = {"time": ("t", "s"), "size": ("x", "um"), "command_rate": ("v", "um/s"), "grinding_power": ("P", "W")}


@pytest.mark.filterwarnings("ignore:.*the file says")
@pytest.mark.parametrize("of_file", [True, False])
def test_a_size_that_was_exchanged_with_another_quantity_is_told(of_file):
    table = cycle().rename(columns={"x": "x [um]", "P": "P [W]"} if of_file else {})
    assert hwsim.Log.read(table, **CYCLE) is not None
    with pytest.raises(ValueError, match=r'exchanged\? Say size=\("x", "um"\), grinding_power=\("P", "W"\)'):
        hwsim.Log.read(table, **CYCLE | {"size": ("P", "um"), "grinding_power": ("x", "W")})


def test_a_slide_that_follows_the_rate_is_not_taken_for_the_size():
    asked = CYCLE | {"slide": ("pos", "mm"), "size": ("x", "in")}
    with pytest.raises(ValueError, match="size") as told:
        hwsim.Log.read(cycle(), **asked)
    assert "exchanged" not in str(told.value)


@pytest.mark.parametrize(
    ("unit", "told"),
    [("mm", "like mm/s .* of a position its slope"), ("mm/s", "command_rate must be a rate; it rises")],
)
def test_a_position_in_place_of_the_rate_is_told(unit, told):
    with pytest.raises(ValueError, match=f"{told}.*numpy.gradient"):
        hwsim.Log.read(cycle(), **CYCLE | {"command_rate": ("pos", unit)})


def test_a_rate_that_rises_with_the_size_is_no_position():
    """Steps of a stand from 10 to 40 um/s, called mm/min."""
    rate = np.repeat([10.0, 20.0, 30.0, 40.0], 60)
    table = cycle().assign(v=rate, x=np.concatenate([[0.0], np.cumsum(0.05 * rate)[:-1]]))
    with pytest.raises(ValueError, match="size must follow command_rate"):
        hwsim.Log.read(table, **CYCLE | {"command_rate": ("v", "um/min")})


def test_a_decimal_comma_in_a_table_is_told():
    table = cycle().assign(t=lambda d: d["t"].map("{:.2f}".format).str.replace(".", ","))
    with pytest.raises(ValueError, match="got '0,00' in row 1 with a decimal comma: ") as told:
        hwsim.Log.read(table, **CYCLE)
    assert "missing=" not in str(told.value)


def test_deviations_in_place_of_radii_are_told_at_once():
    table = {"a": np.arange(360.0), "d [um]": 14 * np.cos(np.radians(np.arange(360.0)))}
    told = r'these are deviations: say deviation=\("d", "um"\), radius='
    with pytest.raises(ValueError, match=told):
        Profile.read(table, angle=("a", "deg"), reading="d")
    radii = {"a": np.arange(360.0), "d [um]": 14 + np.cos(np.radians(np.arange(360.0)))}
    with pytest.raises(ValueError, match=r'in another unit: reading=\("d", "mm"\)'):
        Profile.read(radii, angle=("a", "deg"), reading="d")
