"""TDMS, HDF5 and X3P: groups, attributes, lengths; a file that is cut off is refused whole."""

import sys

import h5py
import nptdms
import numpy as np
import pytest
import x3pio

import hwsim
from centering import Profile

TIME = np.arange(0.0, 2.0, 0.1)  # s
SIZE = 0.02 * TIME  # mm


@pytest.fixture
def tdms(tmp_path):
    """Write channels, (group, name) -> (values, properties), and return the path."""

    def _tdms(channels, name="a.tdms"):
        with nptdms.TdmsWriter(tmp_path / name) as writer:
            writer.write_segment(
                [nptdms.ChannelObject(*place, values, told) for place, (values, told) in channels.items()]
            )
        return tmp_path / name

    return _tdms


@pytest.fixture
def hdf5(tmp_path):
    """Write datasets, path -> (values, attributes), and return the path of the file."""

    def _hdf5(columns, name="a.h5"):
        with h5py.File(tmp_path / name, "w") as file:
            for place, (values, attributes) in columns.items():
                dataset = file.create_dataset(place, data=values)
                dataset.attrs.update(attributes)
        return tmp_path / name

    return _hdf5


def wave(step, unit, start=0.0):
    return {"wf_increment": step, "wf_start_offset": start, "unit_string": unit}


def test_groups_are_parts_in_natural_order(tdms):
    channels = {(f"run{k}", "X"): (1e3 * SIZE + k, wave(0.1, "um")) for k in (10, 9, 1)}
    channels[("setup", "comment")] = (np.array([1.0]), {})
    log = hwsim.Log.read(tdms(channels), size="X")
    assert log["data"].attrs["labels"] == ["run1", "run9", "run10"]
    np.testing.assert_allclose(log["data"]["size"].values[::20], [0.001, 0.009, 0.010])
    np.testing.assert_allclose(log["data"].time.values[:20], TIME)
    assert "left out, as none of the columns is there: a.tdms, group 'setup'" in str(log.source)
    assert hwsim.Log.read(tdms(channels), size="X", group="run9")["data"].attrs["labels"] == ["run9"]
    with pytest.raises(
        ValueError, match=r"a\.tdms: group must be one of its groups; got 'run2', it holds 'run1', 'run9'"
    ):
        hwsim.Log.read(tdms(channels), size="X", group="run2")


def test_a_group_that_lacks_a_column_is_refused(tdms):
    channels = {
        ("a", "X"): (SIZE, wave(0.1, "mm")),
        ("a", "v"): (SIZE, wave(0.1, "mm/s")),
        ("b", "X"): (SIZE, wave(0.1, "mm")),
    }
    with pytest.raises(
        ValueError,
        match=r"a\.tdms, group 'b': infeed_rate must be one of its columns; got 'v', .*; a\.tdms, group 'a' has it",
    ):
        hwsim.Log.read(tdms(channels), size="X", infeed_rate="v")


def test_time_channels_and_stamps(tdms):
    stamps = np.datetime64("2026-03-02T10:00:00") + (1e3 * TIME).astype("timedelta64[ms]")
    channels = {
        ("a", "at"): (stamps, {}),
        ("a", "t"): (1e3 * TIME, {"unit_string": "ms"}),
        ("a", "X"): (SIZE, {"unit_string": "mm"}),
    }
    for time in ("at", "t"):
        log = hwsim.Log.read(tdms(channels), time=time, size="X")
        np.testing.assert_allclose(log["data"].time, TIME, atol=1e-9)
    with pytest.raises(ValueError, match="time must be a column"):
        hwsim.Log.read(tdms(channels), size="X")


def test_channels_of_unequal_lengths_need_common_instants(tdms):
    fast = np.arange(0.0, 2.0, 0.01)
    channels = {("a", "X"): (SIZE, wave(0.1, "mm")), ("a", "P"): (100 + fast, wave(0.01, "W"))}
    path = tdms(channels)
    with pytest.raises(
        ValueError, match=r"columns must be of one length and pace, or resample= .* got 'X' 20, 'P' 200 rows"
    ):
        hwsim.Log.read(path, size="X", grinding_power="P")
    log = hwsim.Log.read(path, size="X", grinding_power="P", resample=0.1)
    np.testing.assert_allclose(log["data"]["size"], SIZE[: len(log["data"].time)], atol=1e-12)
    np.testing.assert_allclose(log["data"].grinding_power[1:-1], 100 + log["data"].time[1:-1], atol=1e-9)
    assert "resampled to a step of 0.1 s" in str(log.source)


def test_signals_with_their_own_times(hdf5):
    slow, fast = np.arange(0, 2.01, 0.5), np.arange(0, 2.0, 0.01)
    columns = {
        "X/time": (1e3 * fast, {"units": "ms"}), "X/value": (20 * fast, {"units": "um"}),
        "v/time": (slow, {"units": "s"}), "v/value": (np.full(5, 1.2), {"units": "mm/min"}),
    }  # fmt: skip
    path = hdf5(columns)
    with pytest.raises(ValueError, match="columns must be of one length and pace, or resample="):
        hwsim.Log.read(path, size="X", command_rate="v")
    table = hwsim.Log.read(path, size="X", command_rate="v", resample=0.1)["data"]
    np.testing.assert_allclose(table["size"][1:-1], 0.02 * table.time[1:-1], rtol=1e-6)
    np.testing.assert_allclose(table.command_rate_command, 0.02)
    bare = hdf5(
        {name: (values, {}) if "time" in name else (values, told) for name, (values, told) in columns.items()}
    )
    told = hwsim.Log.read(bare, time=("time", "s"), size="X", command_rate="v", resample=0.5, plausible=False)
    assert told["data"].time.values[-1] == 2.0
    with pytest.raises(ValueError, match=r"'X': its time must have a unit; say time=\(\"time\", \"s\"\)"):
        hwsim.Log.read(bare, size="X", command_rate="v", resample=0.1)


@pytest.mark.parametrize("name", ["units", "unit", "unit_string"])
@pytest.mark.parametrize("unit", ["um", np.bytes_("um")])
def test_attributes_of_datasets(hdf5, name, unit):
    log = hwsim.Log.read(
        hdf5({"X": (1e3 * SIZE, {name: unit}), "t": (TIME, {name: "s"})}), time="t", size="X"
    )
    np.testing.assert_allclose(log["data"]["size"], SIZE)


def test_groups_of_groups(hdf5):
    columns = {
        f"day/run {k}/{name}": (values, {"units": unit})
        for k in (2, 10)
        for name, values, unit in (("t", TIME, "s"), ("X", SIZE, "mm"))
    }
    log = hwsim.Log.read(hdf5(columns), time="t", size="X")
    assert log["data"].attrs["labels"] == ["day/run 2", "day/run 10"]


def test_files_that_are_cut_off_are_refused_whole(tdms, hdf5, tmp_path):
    whole = {
        "a.tdms": tdms({("a", "X"): (SIZE, wave(0.1, "mm"))}).read_bytes(),
        "a.h5": hdf5({"X": (SIZE, {"units": "mm"})}).read_bytes(),
    }
    for name, raw in whole.items():
        path = tmp_path / f"cut {name}"
        for end in [*range(1, len(raw), 37), len(raw) - 1]:
            path.write_bytes(raw[:end])
            with pytest.raises(
                ValueError, match=rf"cut {name} must be a whole .* file; it cannot be read"
            ) as told:
                hwsim.Log.read(path, period=0.1, size="X")
            assert "\n" not in str(told.value)


def test_x3p_that_is_damaged_or_no_profile(tmp_path):
    path = tmp_path / "a.x3p"
    x3pio.write(path, np.zeros((2, 3)), x_scale=1e-6, y_scale=1e-6)
    with pytest.raises(
        ValueError, match=r"a\.x3p must be a whole \.x3p file; it cannot be read: it must hold one profile"
    ):
        Profile.read(path, radius=40.0)
    raw = path.read_bytes()
    for end in (10, len(raw) // 2, len(raw) - 5):
        path.write_bytes(raw[:end])
        with pytest.raises(ValueError, match=r"a\.x3p must be a whole \.x3p file; it cannot be read"):
            Profile.read(path, radius=40.0)


@pytest.mark.parametrize(("name", "module"), [("a.tdms", "nptdms"), ("a.h5", "h5py"), ("a.x3p", "x3pio")])
def test_missing_libraries_are_named(tmp_path, monkeypatch, name, module):
    (tmp_path / name).write_bytes(b"x")
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ImportError, match=rf"{module} is not installed: pip install 'sdpgrind\[io\]'"):
        hwsim.Log.read(tmp_path / name, size="X")
