"""Words of a file for its parts: on the page, in messages, in what is written, in what is asked for."""

import re

import numpy as np
import pandas
import pytest

import hwsim
import sdpgrind
from hwsim._report.every_part import outcomes
from sdpgrind import identify, plunge

TIME = np.arange(6) * 0.1
TABLE = {
    "t [s]": np.tile(TIME, 2),
    "X [um]": np.concatenate([10.0 * TIME, 20.0 * TIME]),
    "Teil-Nr.": np.repeat(["W-1042", "W-1041"], 6),
}


def read(table=TABLE, **options):
    return hwsim.Log.read(table, time="t", part="Teil-Nr.", size="X", **options)


ROWS = "bore;t [s];X [um]\n" + "".join(
    f"{bore};{0.1 * k:.1f};{10 * step * k}\n"
    for step, bore in enumerate(("0017", "0018", "17", "00A9", "12.10", "12.1", "0018 b"), 1)
    for k in range(6)
)
BORES = ["0017", "0018", "17", "00A9", "12.10", "12.1", "0018 b"]


def test_part_numbers_are_those_of_the_file_to_the_zero(tmp_path):
    (tmp_path / "bores.csv").write_text("n;" + ROWS.replace("\n", "\n1;").removesuffix("1;"))
    log = hwsim.Log.read(tmp_path / "bores.csv", time="t", part="bore", size="X")
    assert log["data"].attrs["labels"] == BORES == log.outcome.attrs["labels"]
    assert log.outcome.rows.values.tolist() == [6.0] * 7
    assert "\nparts: 0017, 0018, 17, 00A9, 12.10, 12.1, 0018 b" in str(log.source)
    assert all(re.search(rf"^{re.escape(bore)} +0\.5000 +6 ", log.report(), re.M) for bore in BORES)
    assert re.search("<caption>.*parts: 0017, 0018, 17, ", log.source._repr_html_())
    for bore, step in zip(BORES, range(1, 8), strict=True):
        (only,) = identify.series(log, {"size": "mm"}, tier="data", part=bore)
        assert only.label == f"part {bore}" and only["size"][-1] == pytest.approx(0.05 * step)
    log.to_csv(tmp_path / "again.csv")
    again = hwsim.Log.read(tmp_path / "again.csv", time="time", part="part", size="size")
    assert again["data"].attrs["labels"] == BORES and again["data"].equals(log["data"])
    log.save(tmp_path / "log.nc")
    assert sdpgrind.load(tmp_path / "log.nc").source == log.source


@pytest.mark.parametrize("rows", [2, 6])
def test_rows_that_may_be_a_foot_are_no_silent_loss_of_a_part(tmp_path, rows):
    numbered = ROWS[: ROWS.index("00A9")]
    foot = "".join(f"A-9;{0.1 * k:.1f};{k}\n" for k in range(rows))
    path = tmp_path / "bores.csv"
    path.write_text(numbered + foot)
    asked = {"time": "t", "part": "bore", "size": "X"}
    with pytest.raises(
        ValueError, match=r"line \d+ begins with 'A-9', .* dtype=\{'bore': str\}\), \.\.\.\)$"
    ):
        hwsim.Log.read(path, **asked)
    frame = pandas.read_csv(path, sep=";", decimal=".", dtype={"bore": str})  # the call of the message
    log = hwsim.Log.read(frame, **asked)
    assert log.source.labels == ("0017", "0018", "17", "A-9") and log.outcome.rows.values[-1] == rows
    for plain in ("", "\nMittel;0.2;3\n", "Ende;;\n"):
        path.write_text(numbered + plain)
        assert hwsim.Log.read(path, **asked).source.labels == ("0017", "0018", "17")


def test_patterns_are_those_of_the_file_to_the_zero(tmp_path):
    (tmp_path / "passes.csv").write_text("t [s],pattern,F [N]\n0,007,30\n1,7,31\n2,010,32\n")
    log = hwsim.Log.read(tmp_path / "passes.csv", time="t", pattern="pattern", normal_force="F")
    assert log["data"].pattern.values.tolist() == ["007", "7", "010"]


def test_the_source_counts_parts_that_do_not_fit_in_a_line_and_lists_no_mere_order():
    many = {"t": np.zeros(30), "bore": [f"{k:04d}" for k in range(30)], "X": np.arange(30.0)}
    source = hwsim.Log.read(many, time=("t", "s"), part="bore", size=("X", "um")).source
    assert "\nparts: 0000, 0001, " in str(source) and ", 0011 and 18 more" in str(source)
    assert source.labels[-1] == "0029"
    again = {"t": np.tile(TIME, 2), "X": np.tile(TIME, 2)}
    order = hwsim.Log.read(again, time=("t", "s"), size=("X", "mm"), on_restart="new part")
    assert order.source.labels == () and "parts:" not in str(order.source)


def test_serial_numbers_that_floats_do_not_tell_apart_are_refused():
    table = TABLE | {"Teil-Nr.": np.repeat([2**53, 2**53 + 1], 6)}
    with pytest.raises(ValueError, match=r"part must be texts from 2\^53 on, .*; got 9007199254740992$"):
        read(table)
    read(TABLE | {"Teil-Nr.": np.repeat([2**53 - 1, 2**53 - 2], 6)})


def test_the_page_names_each_part_with_its_duration_and_ranges():
    told = read().report()
    heads = r"^part +duration \[s\] +rows +size, least \[µm\] +size, greatest \[µm\]$"
    assert re.search(heads, told, re.M)
    assert re.search(r"^W-1042 +0\.5000 +6 +0 +5\.00$", told, re.M)
    assert re.search(r"^W-1041 +0\.5000 +6 +0 +10\.00$", told, re.M)


def test_what_is_written_reads_back_with_the_same_words(tmp_path):
    log = read()
    log.to_csv(tmp_path / "log.csv")
    again = hwsim.Log.read(tmp_path / "log.csv", time="time", part="part", size="size")
    assert again["data"].attrs["labels"] == ["W-1042", "W-1041"] == again.outcome.attrs["labels"]
    assert again.outcome.equals(log.outcome) and again["data"].equals(log["data"])
    log.to_csv(tmp_path / "parts.csv", table="outcome")
    lines = (tmp_path / "parts.csv").read_text().splitlines()
    assert lines == ["part,duration [s],rows [1]", "W-1042,0.5,6.0", "W-1041,0.5,6.0"]


def test_the_words_are_kept_in_a_saved_log(tmp_path):
    read().save(tmp_path / "log.nc")
    assert sdpgrind.load(tmp_path / "log.nc").outcome.attrs["labels"] == ["W-1042", "W-1041"]


def test_a_part_is_asked_for_by_its_words():
    log = read()
    by_name, by_number = (
        identify.readings(log, {"size": "mm"}, tier="data", each="rows", part=part) for part in ("W-1041", 1)
    )
    assert by_name["size"].tolist() == by_number["size"].tolist() == (0.02 * TIME).tolist()
    both = identify.readings(log, {"size": "mm"}, tier="data", each="rows", part=["W-1041", 0])
    assert both["size"].size == 12
    with pytest.raises(ValueError, match=r"part must be one of W-1042, W-1041; got 'W-1040'"):
        identify.readings(log, {"size": "mm"}, tier="data", each="rows", part="W-1040")
    with pytest.raises(ValueError, match="part must be one of 0, 1; got 2"):
        identify.readings(log, {"size": "mm"}, tier="data", each="rows", part=2)


def test_a_message_and_a_gap_name_the_part():
    log = read()
    labels = [one.label for one in identify.series(log, {"size": "mm"}, tier="data")]
    assert labels == ["part W-1042", "part W-1041"]
    late = TABLE | {"t [s]": np.concatenate([TIME, [0.0, 0.1, 0.2, 0.3, 0.4, 1.4]])}
    source = read(late).source
    assert source.gaps == (("W-1041", 0.4, pytest.approx(1.0)),) and "1 s at 0.4 s of part W-1041" in str(
        source
    )


def test_files_of_one_name_are_told_apart(tmp_path):
    paths = []
    for folder in ("monday", "tuesday"):
        (tmp_path / folder).mkdir()
        paths.append(tmp_path / folder / "run.csv")
        paths[-1].write_text("t [s],X [um]\n0,0\n1,10\n")
    log = hwsim.Log.read(paths, time="t", size="X")
    assert log["data"].attrs["labels"] == ["run", "run (2)"]


def test_every_part_shows_time_and_flags_and_no_copy_of_a_column():
    problem = plunge.preset("simulation")
    log = hwsim.run(hwsim.PlungeGrinder(problem), plunge.CycleController(problem), parts=3, rng=0)
    log.outcome["time"][:] = 12.0
    log.outcome["burned"][:] = 1.0
    log.outcome["copy"] = log.outcome["roundness"]
    log.outcome["constant"] = ("part", np.ones(3), {"units": "1"})
    columns = {each.name: each.values for each in outcomes(log, 3)}
    assert columns["time"] == (12.0, 12.0, 12.0) and columns["burned"] == (1.0, 1.0, 1.0)
    assert "roundness" in columns and "copy" not in columns and "constant" not in columns


def test_a_column_of_parts_is_not_dropped_where_columns_are_brought_to_common_instants():
    table = {"t [s]": TIME, "X [um]": 10.0 * TIME, "Teil-Nr.": ["W-1042"]}
    with pytest.raises(ValueError, match=r"part must be left out where columns have lengths .* 'Teil-Nr\.'$"):
        read(table, resample=0.1)
