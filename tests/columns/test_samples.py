"""The sample files against their truth, and what stands on them."""

import json
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

import centering
import hwsim
import sdpgrind
from sdpgrind import plunge
from sdpgrind.base.columns.table import COMMAND

SAMPLES = Path(__file__).parents[1] / "data" / "samples"
CASES = json.loads((SAMPLES / "truth.json").read_text(encoding="utf-8"))


def keywords(case):
    return {name: tuple(value) if isinstance(value, list) else value for name, value in case["read"].items()}


def summed(values):
    """Number of values, of NaN, first, last, sum, sum of magnitudes."""
    return (
        values.size,
        np.isnan(values).sum(),
        values[0],
        values[-1],
        np.nansum(values),
        np.nansum(np.abs(values)),
    )


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["name"])
def test_every_file_gives_its_truth(case):
    path = SAMPLES / case["name"]
    if case["kind"] == "profile":
        profile = centering.Profile.read(path, **keywords(case))
        found = {"angle": np.mod(profile.angle, 2 * np.pi), "reading": profile.reading}
    else:
        table = hwsim.Log.read(path, **keywords(case))["data"]
        found = {name.removesuffix(COMMAND): table[name].values for name in table.variables}
    for name, truth in case["truth"].items():
        np.testing.assert_allclose(summed(found[name]), truth, rtol=1e-6, atol=1e-9, err_msg=name)


def test_source_tells_file_and_columns():
    path = SAMPLES / "plunge_deutsch.csv"
    log = hwsim.Log.read(
        path, time="Zeit", size=("Aufmaß Durchmesser", "um", -0.5), command_rate="Zustellung"
    )
    (file,) = log.source.files
    assert (file.name, file.size, file.sha256) == (
        path.name,
        path.stat().st_size,
        sha256(path.read_bytes()).hexdigest(),
    )
    assert (file.encoding, file.separator, file.decimal, file.first_line) == ("cp1252", ";", ",", 5)
    time, size, rate = log.source.columns
    assert (time.header, time.recorded, time.origin) == ("Zeit", "s", "unit row")
    assert (size.header, size.recorded, size.origin, size.factor) == (
        "Aufmaß Durchmesser",
        "um",
        "call",
        -0.5e-3,
    )
    assert (rate.name, rate.recorded, rate.factor) == (
        "command_rate_command",
        "mm/min",
        pytest.approx(1 / 60),
    )
    shown = str(log.source)
    assert (
        "plunge_deutsch.csv: 3407 bytes, sha256 f3d4" in shown
        and "245 rows read, 0 left out, 245 kept in 1 part" in shown
    )


def test_words_of_a_column_of_texts():
    log = hwsim.Log.read(SAMPLES / "finishing_runs.csv", period=1.0, pattern="pattern", tool_diameter="tool")
    assert log["data"].pattern.values[:3].tolist() == ["zigzag", "hilbert4", "hilbert5"]


@pytest.mark.parametrize(
    ("name", "call", "offset", "height", "third"),
    [
        ("ring.x3p", {"radius": 40.0}, (0.05001, 0.6999), 6.886, 2.992),
        ("ring_degrees.csv", {"angle": "angle", "deviation": "deviation", "radius": 40.0}, (0.299996, 0.69998), 6.993, 3.007),
    ],
)  # fmt: skip
def test_rings(name, call, offset, height, third):
    """Numbers of the specification, in its last digit."""
    profile = centering.Profile.read(SAMPLES / name, **call)
    assert (profile.circle.offset, profile.circle.offset_angle) == pytest.approx(offset, abs=1e-4, rel=1e-4)
    ((upr, amplitude),) = profile.harmonics(upr_max=60).largest(1)
    assert upr == 3 and 1e3 * amplitude == pytest.approx(third, abs=1.1e-3)
    assert 1e3 * np.ptp(profile.deviation) == pytest.approx(height, abs=1.1e-3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"angle": "angle", "deviation": "deviation"}, r"radius must be the nominal radius of deviations \(mm\); got None"),
        ({"angle": "angle", "reading": ("deviation", "mm"), "radius": 40.0}, "radius must be left out where readings are radii"),
        ({"angle": "angle", "radius": 40.0}, "angle must be named, and either reading or deviation"),
        ({"deviation": "deviation", "radius": 40.0}, "angle must be named, and either reading or deviation"),
        ({"angle": "angle", "deviation": "dev", "radius": 40.0}, r"deviation must be one of its columns; got 'dev'"),
    ],
)  # fmt: skip
def test_refused_profiles(call, message):
    with pytest.raises(ValueError, match=message):
        centering.Profile.read(SAMPLES / "ring_degrees.csv", **call)


def test_x3p_needs_its_radius_alone():
    with pytest.raises(ValueError, match=r"radius must be the nominal radius of the ring in \.x3p"):
        centering.Profile.read(SAMPLES / "ring.x3p")
    with pytest.raises(ValueError, match=r"angle and reading must be left out of \.x3p"):
        centering.Profile.read(SAMPLES / "ring.x3p", radius=40.0, angle="x")
    with pytest.raises(ValueError, match=r"deviation must be 1e-06 \.\.\. 2 mm"):
        centering.Profile.read(SAMPLES / "ring.x3p", radius=40.0, deviation=("z", "m", 1e3))


def test_points_without_a_reading_are_left_out():
    angle = np.arange(0.0, 360.0, 5.0)
    reading = np.where(angle == 10.0, np.nan, 40 + 0.1 * np.cos(np.radians(angle)))
    with_hole = centering.Profile.read({"a (deg)": angle, "r [mm]": reading}, angle="a", reading="r")
    assert with_hole.angle.size == 71 and with_hole.circle.offset == pytest.approx(0.1, rel=1e-3)


def test_a_log_of_a_run_is_read_as_in_the_readme(tmp_path):
    problem = plunge.preset("simulation")
    run = hwsim.run(hwsim.PlungeGrinder(problem), plunge.CycleController(problem), parts=2, rng=0)
    run.to_csv(tmp_path / "job.csv")
    log = hwsim.Log.read(
        tmp_path / "job.csv", time="time", part="part", size="size", command_rate="command_rate_command"
    )
    for name in ("size", "command_rate_command", "time", "part"):
        np.testing.assert_array_equal(log["data"][name], run["controller"][name])


def test_a_profile_tells_its_file_after_every_step(tmp_path):
    path = SAMPLES / "ring.x3p"
    profile = centering.Profile.read(path, radius=40.0)
    (file,), (angle, deviation) = profile.source.files, profile.source.columns
    assert (file.name, file.size, file.sha256) == (
        path.name,
        path.stat().st_size,
        sha256(path.read_bytes()).hexdigest(),
    )
    assert (angle.recorded, angle.factor, deviation.recorded, deviation.factor) == ("m", 25.0, "m", 1000.0)
    filtered = profile.filter("gaussian", upr=15)
    filtered.save(tmp_path / "ring.nc")
    assert sdpgrind.load(tmp_path / "ring.nc").source == profile.source
    assert str(profile.source) in filtered.report()


def test_points_without_a_reading_are_counted():
    table = {"angle [deg]": np.arange(0.0, 360.0, 10.0), "r [mm]": np.full(36, 40.0)}
    table["r [mm]"][3] = np.nan
    profile = centering.Profile.read(table, angle="angle", reading="r")
    assert profile.source.rows_left_out == 1 and "36 rows read, 1 left out, 35 kept" in str(profile.source)
    assert centering.Profile(profile.angle, profile.reading) == profile
    assert centering.Profile(profile.angle, profile.reading).source is None
