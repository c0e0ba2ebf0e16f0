"""Refusals that a first user meets: each says the call that would do."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import hwsim
from sdpgrind import weldbead
from sdpgrind.base.columns.table import KNOWN
from sdpgrind.base.doubts.assumed import reader_of

DOCS = Path(__file__).parents[2] / "docs"

WORN = np.round(3.0 * np.arange(400) / 400, 2)  # um


def stamped(tmp_path, parts=1):
    """Rows at 50 Hz whose stamps count whole seconds, two of them equal to the ones before."""
    size = WORN.copy()
    size[[101, 261]] = size[[100, 260]]
    rows = [
        f"{p};08:00:{k // 50:02d};{x:.5f}" for p in range(parts) for k, x in enumerate(size + np.arange(400))
    ]
    rows[101] = rows[100]
    path = tmp_path / "seconds.csv"
    path.write_text("\n".join(["Teil;Zeit;X [um]", *rows]) + "\n")
    return path


def test_stamps_of_whole_seconds_are_offered_the_period(tmp_path):
    """Not one row for each second: a time constant of 1.0 s was 0.49 +- 0.10 of the means."""
    told = r'period=0\.02 \(s\) instead of time=.* or duplicates="keep" for the rows of motions$'
    with pytest.raises(ValueError, match=told) as refused:
        hwsim.Log.read(stamped(tmp_path), time="Zeit", size="X")
    assert "mean" not in str(refused.value) and "last" not in str(refused.value)
    log = hwsim.Log.read(stamped(tmp_path), period=0.02, size="X")
    assert log["data"].time.values[-1] == pytest.approx(7.98) and log.source.rows_left_out == 0


def test_two_rows_at_one_time_of_a_fine_clock_have_no_period():
    with pytest.raises(ValueError, match='duplicates="first", "last" or "mean"') as told:
        hwsim.Log.read({"t [s]": [0.0, 0.1, 0.1, 0.2], "X [um]": [1.0, 2.0, 3.0, 4.0]}, time="t", size="X")
    assert "period" not in str(told.value)


def test_the_warning_of_a_coarse_clock_comes_once_for_all_parts(tmp_path):
    with pytest.warns(UserWarning) as told:
        hwsim.Log.read(stamped(tmp_path, 3), time="Zeit", part="Teil", size="X", duplicates="first")
    (one,) = [str(each.message) for each in told if "leaves" in str(each.message)]
    assert "leaves 24 of 1199 rows" in one and "known to 1 s alone" in one and "period=0.02 (s)" in one


@pytest.mark.parametrize(
    ("columns", "told"),
    [
        ({"time": ("Datum", "Uhrzeit"), "size": "D"}, 'the second is enough, time="Uhrzeit"'),
        (
            {"size": "D"},
            'size=("D", "µm", 0.5) for half of it, size=("D", "µm", -0.5) for half of what is left',
        ),
        ({"groesse": "D"}, "groesse must be a quantity of the library or <quantity>_command; known are "),
        ({"szie": "D"}, "is size meant?"),
        ({"height_after": "D"}, "cut_depth is the height before a pass less the height after it"),
        ({"height_charges": "D"}, "is height_charge meant?"),
        ({"power": "P"}, "is burning_power or grinding_power or idle_power meant?"),
        ({"time": ("t", "ticks"), "size": "D"}, "'ticks' is no unit of time"),
        ({"grinding_power": ("P", "W")}, 'in another unit: grinding_power=("P", "kW") (plausible'),
    ],
)
@pytest.mark.filterwarnings("ignore:.*is taken in W")
def test_a_refusal_says_the_call_that_would_do(columns, told):
    table = {"t [s]": np.arange(3.0), "D [µm Ø]": [300.0, 290.0, 280.0], "P [kW]": [2.0, 2.1, 2.2]}
    with pytest.raises(ValueError, match=re.escape(told)):
        hwsim.Log.read(table, **{"time": "t", **columns})


def test_date_and_time_of_day_in_two_columns_are_read_by_the_second():
    table = {
        "Datum": ["19.11.2026"] * 3,
        "Uhrzeit": ["23:59:59,9", "00:00:00,1", "00:00:00,3"],
        "X [um]": 10 * WORN[-3:],
    }
    log = hwsim.Log.read(pd.DataFrame(table), time="Uhrzeit", size="X")
    assert log["data"].time.values == pytest.approx([0.0, 0.2, 0.4])


def test_a_unit_that_the_header_says_too_is_not_assumed():
    table = {"t [s]": np.arange(3.0), "D [µm]": [300.0, 290.0, 280.0], "X": [0.0, 1.0, 2.0]}
    log = hwsim.Log.read(table, time="t", size=("D", "um", -0.5), reading=("X", "um"), plausible=False)
    names = [row.name for row in reader_of(log).rows]
    assert "unit of size" not in names and {"factor of size", "unit of reading"} <= {*names}


def test_a_refusal_of_a_name_has_few_others():
    with pytest.raises(ValueError, match="known are size, command_rate") as told:
        hwsim.Log.read({"t [s]": [0.0, 1.0], "x": [1.0, 2.0]}, time="t", groesse="x")
    names = set(re.findall(r"[a-z]+_[a-z_]+", str(told.value))) & KNOWN.keys()
    assert 5 < len(names) < 15 and f"and {len(KNOWN) - 12} more" in str(told.value)


def test_passes_without_a_depth_are_told_of_what_it_is_made():
    bead = weldbead.preset("P1").model
    with pytest.raises(
        ValueError, match=r"must hold cut_depth .*; cut_depth is the height before a pass less"
    ):
        weldbead.identify({"normal_force": [1.0], "feed_rate": [1.0], "height": [1.0]}, "scatter", model=bead)


def test_the_page_of_names_is_that_of_the_reader():
    """Each name of the table, made of it, is read; the page on data says where it is."""
    spec = importlib.util.spec_from_file_location("column_names", DOCS / "column_names.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    names = re.findall(r"   \* - ``(\w+)``\n     - (.+)", module.page())
    assert dict(names) == {name: meant.unit or "1" for name, meant in KNOWN.items()}
    units, data = ((DOCS / f"{page}.rst").read_text(encoding="utf-8") for page in ("units", "data"))
    assert (
        ".. _column-names:" in units
        and units.endswith(".. column-names::\n")
        and ":ref:`column-names`" in data
    )


UNITS = ["s", "um", None]
CELLS = [[0.0, 0.0, "a"], [0.05, 250.0, "b"], [0.1, "OVL", "c"]]


@pytest.mark.filterwarnings("ignore:.*no reading in 1 of 3")
@pytest.mark.parametrize("form", ["rows", "levels"])
def test_units_below_the_names_of_a_spreadsheet_are_found(form):
    """As of pandas.read_excel(header=2), whose first row they are, and of header=[2, 3]."""
    if form == "rows":
        table = pd.DataFrame([UNITS, *CELLS], columns=["t", "Weg", "note"])
    else:
        names = [("t", "s"), ("Weg", "um"), ("note", "Unnamed: 2_level_1")]
        table = pd.DataFrame(CELLS, columns=pd.MultiIndex.from_tuples(names))
    log = hwsim.Log.read(table, time="t", size="Weg", missing=["OVL"])
    assert log["data"]["size"].values == pytest.approx([0.0, 0.25, np.nan], nan_ok=True)
    assert [(note.recorded, note.origin) for note in log.source.columns] == [
        ("s", "unit row"),
        ("um", "unit row"),
    ]
    assert (log.source.rows_read, log.source.rows_left_out) == (3, 0)
    with pytest.raises(ValueError, match="got 'OVL' in row " + ("4" if form == "rows" else "3")):
        hwsim.Log.read(table, time="t", size="Weg")


def test_a_first_row_of_words_is_no_row_of_units():
    table = pd.DataFrame({"pattern": ["zigzag", "s"], "section": ["mm", "1"]})
    log = hwsim.Log.read(table, period=1.0, pattern="pattern", section="section")
    assert log.source.rows_read == 2
    ones = pd.DataFrame({"a": ["1", "2"], "b": ["1", "2"]})
    assert hwsim.Log.read(ones, period=1.0, step="a", phase="b").source.rows_read == 2


def test_rows_at_one_time_alone_have_no_step():
    with pytest.warns(UserWarning, match="leaves 1 of 4 rows, as the others stand at the same times$"):
        hwsim.Log.read(
            {"t [s]": [1.0] * 4, "P [W]": [91.0, 92.0, 93.0, 94.0]},
            time="t",
            grinding_power="P",
            duplicates="mean",
        )


@pytest.mark.parametrize(
    ("names", "told"), [(["Messung", "Unnamed: 1"], True), ([0, 1], True), (["a", "b"], False)]
)
def test_a_title_that_was_taken_for_names_is_told(names, told):
    table = pd.DataFrame([["t", "Weg"], [0.0, 1.0], [1.0, 2.0]], columns=names)
    with pytest.raises(ValueError, match="must be one of its columns") as refused:
        hwsim.Log.read(table, time="t", size="Weg")
    assert ("pandas.read_excel(..., header=2)" in str(refused.value)) is told
