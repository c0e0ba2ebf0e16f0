"""Rows: equal ones, two at one time, restarts, gaps, alignment of commands, common instants, parts."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

import hwsim


def read(time, size=None, **options):
    """Log of a table in memory."""
    table = {"t [s]": time, "X [mm]": np.linspace(0.0, 0.1, len(time)) if size is None else size}
    table |= {name: options.pop(name) for name in list(options) if " [" in name}
    return hwsim.Log.read(table, time="t", size="X", **options)


def test_equal_rows_are_left_out_and_counted():
    log = read([0.0, 1.0, 1.0, 2.0], [0.0, 0.1, 0.1, 0.2])
    assert log["data"].time.values.tolist() == [0.0, 1.0, 2.0]
    assert log.source.rows_left_out == 1 and "4 rows read, 1 left out, 3 kept" in str(log.source)
    with pytest.warns(UserWarning, match="size has no reading"):
        assert read([0.0, 1.0, 1.0], [0.0, np.nan, np.nan]).source.rows_left_out == 1


@pytest.mark.parametrize(("rule", "kept"), [("first", 0.1), ("last", 0.4), ("mean", 0.25)])
def test_two_rows_at_one_time(rule, kept):
    time, size = [0.0, 1.0, 1.0, 1.0, 2.0], [0.0, 0.1, np.nan if rule == "mean" else 0.3, 0.4, 0.5]
    assert read(time, size, duplicates=rule)["data"]["size"].values.tolist() == [
        0.0,
        pytest.approx(kept),
        0.5,
    ]
    with pytest.raises(ValueError, match=r"1\.0 stands in row 2 and, with other values, in row 3"):
        read(time, size)


def test_restart():
    time = [0.0, 1.0, 2.0, 0.0, 1.0]
    with pytest.raises(ValueError, match=r"got 2\.0 and then 0\.0 in row 4: part=.* on_restart=\"new part\""):
        read(time)
    log = read(time, on_restart="new part")
    assert log["data"].part.values.tolist() == [0, 0, 0, 1, 1]
    assert log.outcome.duration.values.tolist() == [2.0, 1.0] and log.outcome.rows.values.tolist() == [3, 2]


@pytest.mark.parametrize(("full", "unit"), [(2**16, "ms"), (2**32, "us")])
def test_a_counter_that_is_full_begins_no_part(full, unit):
    time = (full - 1000 + 50 * np.arange(40)) % full
    size = np.linspace(0.0, 0.1, 40)
    told = r'on_restart="new part"; a counter that is full\? Add [\d.]+ s to the rows .*period='
    with pytest.raises(ValueError, match=told):
        hwsim.Log.read({"t": time, "x": size}, time=("t", unit), size=("x", "mm"))


def test_restart_within_a_named_part():
    """Of a comparison: each controller ground the same parts."""
    table = {"n": [0, 0, 1, 1] * 2, "t [s]": [0.0, 1.0] * 4, "X [mm]": np.linspace(0.0, 0.1, 8)}
    with pytest.raises(
        ValueError, match=r"within part '0' \(s\); got 1\.0 and then 0\.0 in row 5: another column"
    ):
        hwsim.Log.read(table, time="t", part="n", size="X")
    log = hwsim.Log.read(table, time="t", part="n", size="X", on_restart="new part")
    assert log["data"].part.values.tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    assert log["data"].attrs["labels"] == ["0", "0 (2)", "1", "1 (2)"]
    np.testing.assert_array_equal(log["data"]["size"], table["X [mm]"][[0, 1, 4, 5, 2, 3, 6, 7]])


def test_parts_by_words_keep_their_order_and_their_words():
    table = pd.DataFrame({"n": ["b", "b", "a", "a"], "t [s]": [0, 1, 0, 1], "X [um]": [0, 10.0, 0, 20]})
    log = hwsim.Log.read(table, time="t", part="n", size="X")
    assert log["data"].part.values.tolist() == [0, 0, 1, 1] and log["data"].attrs["labels"] == ["b", "a"]
    table.loc[1, "n"] = None
    with pytest.raises(ValueError, match="the table: part must be told in each row; none stands in row 2"):
        hwsim.Log.read(table, time="t", part="n", size="X")


def test_gap_is_noted():
    log = read([0.0, 0.1, 0.2, 0.3, 0.9, 1.0])
    assert log.source.gaps == (("0", 0.3, pytest.approx(0.6)),) and "1 gap: 0.6 s at 0.3 s of part 0" in str(
        log.source
    )


RATE = [0.4, 0.4, 0.2, 0.0]


@pytest.mark.parametrize(
    ("at", "expected"), [("begin", RATE), ("end", [0.4, 0.2, 0.0, 0.0]), ("centre", [0.4, 0.3, 0.1, 0.0])]
)
def test_alignment(at, expected):
    log = read([0.0, 0.1, 0.2, 0.3], **{"v [mm/s]": RATE}, command_rate="v", commands_at=at)
    np.testing.assert_allclose(log["data"].command_rate_command, expected, atol=1e-15)
    assert log.source.commands_at == at


@given(st.lists(st.floats(0, 1), min_size=2, max_size=20), st.floats(0.01, 10))
def test_alignment_finds_the_command_again(rates, step):
    """Recorded at the end of their interval or as its mean, commands integrate to the same way."""
    held = np.array(rates)
    time = step * np.arange(held.size + 1)
    way = np.concatenate([[0.0], np.cumsum(held * step)])
    recorded = np.concatenate([[0.0], held])  # what led to each row
    options = {"period": step, "command_rate": "v", "size": "X", "plausible": False}
    log = hwsim.Log.read({"v [mm/s]": recorded, "X [mm]": way}, commands_at="end", **options)
    found = log["data"].command_rate_command.values
    np.testing.assert_allclose(np.cumsum(found[:-1] * np.diff(time)), way[1:], rtol=1e-9, atol=1e-12)


def test_resampled_at_multiples_of_the_step():
    time = np.arange(0.05, 3.0, 0.1)
    rate = np.where(time < 1.4, 0.04, 0.01)
    log = read(time, 0.01 * time, **{"v [mm/s]": rate}, command_rate="v", resample=0.5, plausible=False)
    table = log["data"]
    np.testing.assert_allclose(table.time, [0.5, 1.0, 1.5, 2.0, 2.5])
    np.testing.assert_allclose(table["size"], 0.01 * table.time, rtol=1e-9)  # means about each instant
    np.testing.assert_allclose(table.command_rate_command, [0.04, 0.04, 0.01, 0.01, 0.01])
    slow = read([0.0, 1.0, 2.0, 4.0], [0.0, 0.1, 0.2, 0.6], resample=1.0)["data"]
    np.testing.assert_allclose(slow["size"], [0.0, 0.1, 0.2, 0.4, 0.6])
    with pytest.warns(UserWarning, match="size has no reading in 2 of 4 rows"):  # before and after, too
        late = read([0.0, 1.0, 2.0, 3.0], [np.nan, 0.1, 0.2, np.nan], resample=1.0)["data"]
    np.testing.assert_allclose(late["size"], [np.nan, 0.1, 0.2, np.nan])
    with pytest.raises(ValueError, match=r"resample must be >= the finest step, 0\.1 s of size; got 0\.05 s"):
        read(time, resample=0.05)


def test_period():
    log = hwsim.Log.read({"X [mm]": [0.0, 0.1, 0.2]}, period=0.5, size="X")
    assert log["data"].time.values.tolist() == [0.0, 0.5, 1.0]
    with pytest.raises(
        ValueError, match=r"period must be left out where time is a column; got 0\.5 s and 't'"
    ):
        hwsim.Log.read({"t [s]": [0.0], "X [mm]": [0.0]}, time="t", period=0.5, size="X")
    with pytest.raises(ValueError, match=r"time must be a column, time=.* or period= .*'X \[mm\]'"):
        hwsim.Log.read({"X [mm]": [0.0, 0.1, 0.2]}, size="X")


def test_tables_in_memory():
    size = np.array([0.0, 0.01, 0.02])
    data = xr.Dataset(
        {"X": ("n", 1e3 * size, {"units": "um"})}, {"t": ("n", [0.0, 1.0, 2.0], {"units": "s"})}
    )
    assert hwsim.Log.read(data, time="t", size="X")["data"]["size"].values.tolist() == pytest.approx(
        size.tolist()
    )
    frame = pd.DataFrame(
        {"X [um]": pd.array([0, 10, None], dtype="Int64")}, pd.Index([0.0, 1.0, 2.0], name="t [s]")
    )
    with pytest.warns(UserWarning, match="size has no reading in 1 of 3 rows"):
        assert hwsim.Log.read(frame, time="t", size="X")["data"]["size"].values[:2].tolist() == [0.0, 0.01]
    stamped = frame.set_index(pd.date_range("2026-03-02", periods=3, freq="250ms", name="at"))[:2]
    assert hwsim.Log.read(stamped, time="at", size="X")["data"].time.values.tolist() == [0.0, 0.25]
    for unit in ("s", None):  # spans were taken for numbers, in ns
        spans = frame.set_index(pd.to_timedelta([0, 250, 500], unit="ms").rename("for"))[:2]
        asked = "for" if unit is None else ("for", unit)
        assert hwsim.Log.read(spans, time=asked, size="X")["data"].time.values.tolist() == [0.0, 0.25]


class Interchange:
    """A table that only has ``__dataframe__``."""

    def __init__(self, frame):
        self.frame = frame

    def __dataframe__(self, *args, **options):
        return self.frame.__dataframe__(*args, **options)


@pytest.mark.filterwarnings("ignore")
def test_interchange():
    table = Interchange(pd.DataFrame({"t [s]": [0.0, 1.0], "X [um]": [0.0, 10.0]}))
    assert hwsim.Log.read(table, time="t", size="X")["data"]["size"].values.tolist() == [0.0, 0.01]


def test_files_of_a_list_are_parts(tmp_path):
    for k, unit in ((1, "um"), (2, "mm")):
        (tmp_path / f"p{k}.csv").write_text(f"t [s],X [{unit}]\n0,0\n1,{10 if k == 1 else 0.02}\n")
    log = hwsim.Log.read([tmp_path / "p1.csv", tmp_path / "p2.csv"], time="t", size="X")
    assert log["data"].part.values.tolist() == [0, 0, 1, 1] and log["data"].attrs["labels"] == ["p1", "p2"]
    assert log["data"]["size"].values.tolist() == [0.0, 0.01, 0.0, 0.02]
    assert [note.factor for note in log.source.columns if note.name == "size"] == [1e-3, 1.0]
    assert [note.name for note in log.source.files] == ["p1.csv", "p2.csv"]


@pytest.mark.parametrize(
    ("columns", "error", "message"),
    [
        ({}, ValueError, "columns must be named"),
        (
            {"sise": "X"},
            ValueError,
            "sise must be a quantity of the library or <quantity>_command; is size meant?",
        ),
        ({"size": 3}, TypeError, r"size must be \"header\", \(\"header\", \"unit\"\)"),
        ({"size": ("X", 3)}, TypeError, "its unit is 3"),
        ({"size": ("X", "mm", 0)}, ValueError, "factor of size must be other than 0"),
        ({"size": ("X", "N")}, ValueError, r"size must have a unit like mm \(nm"),
        (
            {"size": "Y"},
            ValueError,
            r"the mapping: size must be one of its columns; got 'Y', its headers are 't \[s\]'",
        ),
        ({"size": "X", "commands_at": "now"}, ValueError, "commands_at must be one of begin, centre, end"),
        ({"size": "X", "resample": -1.0}, ValueError, "resample must be > 0"),
        ({"size": "X", "missing": "off"}, TypeError, r"missing must be a sequence of words, \('off',\)"),
        ({"command_rate": "X", "command_rate_command": "X"}, ValueError, "columns must be without repeats"),
    ],
)
def test_refused_calls(columns, error, message):
    with pytest.raises(error, match=message):
        hwsim.Log.read({"t [s]": [0.0, 1.0], "X [mm]": [0.0, 0.1]}, time="t", **columns)


@pytest.mark.parametrize(
    ("data", "error", "message"),
    [
        (3, TypeError, "data must be a path, a list of paths, a pandas.DataFrame"),
        ([], ValueError, "data must hold at least one path"),
        ("x.xlsx", ValueError, r"x\.xlsx is a spreadsheet: read\(pandas\.read_excel.*pip install openpyxl"),
        ("x.doc", ValueError, r"data must end in one of \.csv"),
        ("none.csv", FileNotFoundError, "data must be an existing file; got 'none.csv'"),
        ({}, ValueError, "the mapping must hold columns"),
        (
            {"t [s]": [0.0, 1.0], "X [mm]": [0.0]},
            ValueError,
            "columns must be of one length and pace, or resample=",
        ),
        ({"t [s]": [[0.0]], "X [mm]": [[0.0]]}, ValueError, "must have one dimension"),
    ],
)
def test_refused_data(data, error, message):
    with pytest.raises(error, match=message):
        hwsim.Log.read(data, time="t", size="X")
