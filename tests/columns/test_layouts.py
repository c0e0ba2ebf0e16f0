"""Texts as controls, gauges and office programs write them: read rightly, or refused with the place."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import hwsim

TIME, SIZE = [0.0, 0.5, 1.0, 1.5], [0.0, 0.0125, 0.025, 0.0375]  # s, mm


@pytest.fixture
def read(tmp_path):
    """Write a text and read its size over time."""

    def _read(text, name="a.csv", encoding="utf-8", **options):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
        return hwsim.Log.read(path, **({"time": "t", "size": "X"} | options))

    return _read


STYLES = {
    "plain": "t [s],X [um]\n0,0\n0.5,12.5\n1,25\n1.5,37.5\n",
    "parentheses": "t (s),X (um)\n0,0\n0.5,12.5\n1,25\n1.5,37.5\n",
    "semicolons and commas": "t [s];X [um]\n0;0\n0,5;12,5\n1,0;25\n1,5;37,5\n",
    "tabs": "t [s]\tX [um]\n0\t0\n0.5\t12.5\n1\t25\n1.5\t37.5\n",
    "tabs and decimal commas": "t [s]\tX [um]\n0\t0\n0,5\t12,5\n1\t25\n1,5\t37,5\n",
    "bars": "t [s] | X [um]\n0 | 0\n0.5 | 12.5\n1 | 25\n1.5 | 37.5\n",
    "blanks": "t [s]  X [um]\n 0.0   0.0\n 0.5  12.5\n 1.0  25.0\n 1.5  37.5\n",
    "blanks in names": "t [s] X [um]\n0.0 0.0\n0.5 12.5\n1.0 25.0\n1.5 37.5\n",
    "blanks and decimal commas": "t [s]  X [um]\n 0,0   0,0\n 0,5  12,5\n 1,0  25,0\n 1,5  37,5\n",
    "told separator": "sep=;\nt [s];X [um]\n0;0\n0.5;12.5\n1;25\n1.5;37.5\n",
    "comment sign": "# rig 7\n# t [s], X [um]\n0,0\n0.5,12.5\n1,25\n1.5,37.5\n",
    "quotes": '"t [s]","X [um]"\n"0","0"\n"0.5","12.5"\n"1","25"\n"1.5","37.5"\n',
    "quoted decimal commas": '"t [s]","X [um]"\n"0","0"\n"0,5","12,5"\n"1","25"\n"1,5","37,5"\n',
    "unit row": "t;X\ns;um\n0;0\n0,5;12,5\n1;25\n1,5;37,5\n",
    "unit row in words": "t;X\nSekunden;Mikrometer\n0;0\n0,5;12,5\n1;25\n1,5;37,5\n",
    "unit row with unknown ones": "t;X;p;U\ns;um;bar;V\n0;0;1;1\n0,5;12,5;1;1\n1;25;1;1\n1,5;37,5;1;1\n",
    "unit row with brackets": "t,X\n[s],[um]\n0,0\n0.5,12.5\n1,25\n1.5,37.5\n",
    "index without a name": ",t [s],X [um]\n0,0,0\n1,0.5,12.5\n2,1,25\n3,1.5,37.5\n",
    "index without a cell": "t [s],X [um]\n0,0,0\n1,0.5,12.5\n2,1,25\n3,1.5,37.5\n",
    "trailing separators": "t [s];X [um];\n0;0;\n0,5;12,5;\n1;25;\n1,5;37,5;\n",
    "trailing separators below names": "t [s];X [um]\n0;0;\n0,5;12,5;\n1;25;\n1,5;37,5;\n",
    "preamble and foot": "Report;\nBorn;2026-03-02\nn;4;5\n\nt [s];X [um]\n0;0\n0,5;12,5\n1;25\n1,5;37,5\n\nend of report\n",
    "foot of one word": "t [s];X [um];n\n0;0;1\n0,5;12,5;1\n1;25;1\n1,5;37,5;1\nEnd;;\n",
    "foot of one word, no last end": "t [Sek.];X [um];n\n0;0;1\n0,5;12,5;1\n1;25;1\n1,5;37,5;1\nEnd;;",
    "foot of the same width": "t [s];X [um]\n0;0\n0,5;12,5\n1;25\n1,5;37,5\n\nmean;18,75\nmax;37,5\n",
    "padded rows": "t [s];X [um]\n0;0\n0,5;12,5\n1;25\n1,5;37,5\n;\n;\n",
    "no last end": "t [s],X [um]\n0,0\n0.5,12.5\n1,25\n1.5,37.5",
    "blank lines": "t [s],X [um]\n\n0,0\n0.5,12.5\n\n1,25\n1.5,37.5\n\n",
    "Windows ends": "t [s],X [um]\r\n0,0\r\n0.5,12.5\r\n1,25\r\n1.5,37.5\r\n",
    "old Mac ends": "t [s],X [um]\r0,0\r0.5,12.5\r1,25\r1.5,37.5\r",
    "exponents and signs": "t [s],X [um]\n+0.0E+00,-0\n5e-1,+1.25E1\n1E0,.25e2\n15.e-1,37.5\n",
    "blanks, decimal commas and words": "t [s] X [um] state\n0,0 000,0 ok\n0,5 12,5 ok\n1,0 25,0 ok\n1,5 37,5 ok\n",
    "blanks, decimal commas and hundreds": "t [s] X [nm]\n0,0 0\n0,5 12500,0\n1,0 25000,0\n1,5 37500,0\n",
    "groups of three between tabs": "t [ms]\tX [nm]\n0\t0\n500\t12 500\n1 000\t25 000\n1 500\t37 500\n",
    "milliseconds": "t [ms],X [nm]\n0,0\n500,12500\n1000,25000\n1500,37500\n",
    "groups of three": "t [ms];X [nm]\n0;0\n500;12.500,0\n1.000;25.000,0\n1.500;37.500,0\n",
    "English groups": 't [ms],X [nm]\n0,0\n500.0,"12,500.0"\n"1,000.0","25,000.0"\n"1,500.0","37,500.0"\n',
    "no-break spaces": "t [ms];X [nm]\n0,0;0\n500,0;12\u00a0500\n1\u00a0000,0;25\u202f000\n1\u00a0500,0;37\u00a0500\n",
    "micro sign": "t [s];X [µm]\n0;0\n0,5;12,5\n1;25\n1,5;37,5\n",
    "Greek mu": "t [s];X [μm]\n0;0\n0,5;12,5\n1;25\n1,5;37,5\n",
    "more columns": "t [s],P,X [um],P\n0,1,0,2\n0.5,1,12.5,x\n1,1,25,2\n1.5,1,37.5,2\n",
    "words beside": "state,t [s],X [um]\nrough,0,0\nrough,0.5,12.5\nfine,1,25\nfine,1.5,37.5\n",
    "numbers above": "2026;3;2\n5;1;2\n\nname;t [s];X [um]\na;0;0\nb;0,5;12,5\nc;1;25\nd;1,5;37,5\n",
    "dates beside": "day,t [s],X [um]\n2026-03-02,0,0\n2026-03-02,0.5,12.5\n2026-03-02,1,25\n2026-03-02,1.5,37.5\n",
    "ISO": "t,X [um]\n2026-03-02T10:00:00,0\n2026-03-02T10:00:00.5,12.5\n2026-03-02T10:00:01,25\n2026-03-02T10:00:01.500,37.5\n",
    "ISO with zone": "t,X [um]\n2026-03-02 10:00:00+01:00,0\n2026-03-02 10:00:00.5+01:00,12.5\n2026-03-02 10:00:01+01:00,25\n2026-03-02 10:00:01.5+01:00,37.5\n",
    "German stamps": "t;X [um]\n02.03.2026 10:00:00,000;0\n02.03.2026 10:00:00,500;12,5\n02.03.2026 10:00:01,000;25\n02.03.2026 10:00:01,500;37,5\n",
    "stamps with their form": "t [hh:mm:ss];X [um]\n9:59:59,5;0\n10:00:00;12,5\n10:00:00,5;25\n10:00:01;37,5\n",
    "short German stamps": "t;X [um]\n2.3.2026 9:59:59,5;0\n2.3.2026 10:00:00;12,5\n2.3.2026 10:00:00,5;25\n2.3.2026 10:00:01;37,5\n",
    "time of day over midnight": "t;X [um]\n23:59:59,0;0\n23:59:59,5;12,5\n00:00:00,0;25\n00:00:00,5;37,5\n",
    "tabs and stamps with a blank": "t\tX [um]\n2026-03-02 10:00:00\t0\n2026-03-02 10:00:00.5\t12.5\n2026-03-02 10:00:01\t25\n2026-03-02 10:00:01.5\t37.5\n",
    "lvm": (
        "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\n***End_of_Header***\t\n\nChannels\t1\t\n"
        "Samples\t4\t\nX_Value\t0.0\t\nDelta_X\t0.5\t\n***End_of_Header***\t\t\nt [s]\tX [um]\tComment\n"
        "0.000000\t0.000000\n0.500000\t12.500000\n1.000000\t25.000000\n1.500000\t37.500000\n"
    ),
}  # fmt: skip


NAMES = {"lvm": "a.lvm", "tabs": "a.tsv", "blanks": "a.prn", "comment sign": "A.LOG"}


@pytest.mark.parametrize("style", STYLES)
def test_styles(read, style):
    log = read(STYLES[style], NAMES.get(style, "a.csv"))
    np.testing.assert_allclose(log["data"].time, TIME, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(log["data"]["size"], SIZE, rtol=1e-12)
    assert log["data"]["size"].units == "mm" and log.source.rows_left_out == 0


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
def test_encodings(read, encoding):
    mark = {"utf-16-le": "\ufeff", "utf-16-be": "\ufeff"}.get(encoding, "")
    log = read(mark + "t [s];Aufmaß [µm]\n0;0\n0,5;12,5\n1;25\n1,5;37,5\n", encoding=encoding, size="Aufmaß")
    np.testing.assert_allclose(log["data"]["size"], SIZE, rtol=1e-12)


@given(
    separator=st.sampled_from([";", "\t", "|", " ", ","]),
    decimal=st.sampled_from(".,"),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
    rows=st.lists(st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)), min_size=3, max_size=8),
    above=st.integers(0, 4),
)
@example(" ", ",", "utf-8", [(0.0, 100.0)] * 3, 0)  # 0,0 100,0 between commas: 0, 0 100, 0
@example(" ", ",", "utf-8", [(1.5, 100.0), (2.5, 250.0), (12.25, 500.0)], 2)  # 1, 5 100, 0
@example(" ", ",", "utf-8", [(0.0, 0.0), (1.5, 100.0), (0.5, 100.0)], 0)  # 0 0 as a name of 5 100 and 5 100
@example(" ", ",", "utf-8", [(1.5, 100.0), (2.5, 250.0), (3.0, 0.5)], 1)  # a word in one row between commas
def test_any_layout_gives_the_same_bits(tmp_path_factory, separator, decimal, encoding, rows, above):
    if separator == decimal == ",":
        return
    lines = ["µ-rig", *["of 3"] * above, separator.join(["height[mm]", "offset[mm]"])]
    lines += [separator.join(repr(value).replace(".", decimal) for value in row) for row in rows]
    path = tmp_path_factory.getbasetemp() / "layout.csv"
    path.write_bytes(
        "\n".join(lines).encode(encoding) + ("\n".encode("utf-16")[2:] if encoding == "utf-16" else b"\n")
    )
    table = hwsim.Log.read(path, period=0.1, height="height", offset="offset", plausible=False)["data"]
    assert list(zip(table.height.values.tolist(), table.offset.values.tolist(), strict=True)) == rows


def test_groups_of_three_beside_a_count_are_not_columns(read):
    log = read("t [s]\tX [um]\n1\t1 500\n2\t2 700\n3\t3 100\n")
    assert log["data"].time.values.tolist() == [1.0, 2.0, 3.0]
    np.testing.assert_allclose(log["data"]["size"], [1.5, 2.7, 3.1], rtol=1e-12)


GOOD = "t [s],X [um]\n0,0\n0.5,12.5\n1,25\n1.5,37.5\n"
REFUSED = {
    "empty": ("", r"a\.csv must hold a table; it is empty"),
    "blank": (" \n\n", r"a\.csv must hold a table; it is empty"),
    "prose": ("Dear colleague\nthe rig broke\n", r"a\.csv must hold rows of at least two cells with numbers"),
    "no names": ("0,0\n0.5,1\n1,2\n", r"a\.csv must have a line of 2 names above its data, which begin in line 1: .* names="),
    "binary": (b"PK\x03\x04\0\0\0\0", r"a\.csv must be a text; got binary bytes"),
    "decimal commas between commas": ("t [s],X [um]\n0,00,5\n0,04,6\n0,08,7\n", r"a\.csv must have a line of 3 names above its data"),
    "no unit": (GOOD.replace(" [um]", ""), r"a\.csv, column 'X': size must have a unit; say size=\(\"X\", \"mm\"\)"),
    "no unit of time": (GOOD.replace(" [s]", ""), r"column 't': time must have a unit; say time=\(\"t\", \"s\"\)"),
    "unknown unit": (GOOD.replace("um", "furlong"), r"column 'X \[furlong\]': size must have a unit like mm \(nm, um.*'furlong' is no unit"),
    "another kind": (GOOD.replace("um", "N"), r"column 'X \[N\]': size must have a unit like mm \(nm, um, cm, m, in\); got 'N'"),
    "doubled header": ("t [s],X [um],X [um]\n0,1,2\n1,2,3\n", r"size must be one column; the header 'X' stands 2 times among"),
    "word": (GOOD.replace("12.5", "oops"), r"column 'X \[um\]': size must be numbers; got 'oops' in line 3 \(missing=\('oops',\)"),
    "unit in the cells": (GOOD.replace("0,0", "0,0 mm").replace("12.5", "12.5 mm"), r"size must be numbers; got '0 mm' in line 2 with its unit; say size=\(\"X \[um\]\", \"mm\"\) of a table with '0' instead"),
    "word in the first row": (GOOD.replace("0,0", "0,init"), r"size must be numbers; got 'init' in line 2"),
    "word in the last row": (GOOD.replace("37.5", "fault"), r"got 'fault' in line 5"),
    "repeated header": (GOOD + GOOD, r"must be numbers; got '.*' in line 6 \(the header again: make each table"),
    "short row": (GOOD.replace("0.5,12.5", "0.5"), r"a\.csv must have 2 cells in each row; line 3 has 1: '0.5'"),
    "long row": (GOOD.replace("0.5,12.5", "0.5,12.5,1"), r"a\.csv must have 2 cells in each row; line 3 has 3"),
    "cut off": ("t [s],X [um],P\n0,0,1\n1,1,1\n1.5,37", r"a\.csv must be whole; line 4, its last, has 2 cells instead of 3"),
    "types below the names": (GOOD.replace("\n", "\nREAL,REAL\n", 1), r"its headers are 'REAL', 'REAL'; line 1 has it: .*skiprows=\[k for k in range\(2\) if k != 0\]\), \.\.\.\)$"),
    "zero before a group": ("t [s];X [um]\n0,5;12,5\n1,5;0 250\n2,5;25,5\n", r"size must be numbers; got '0 250' in line 3"),
    "a word in each row": ("1,2,x\n3,x,4\nx,5,6\n", r"must have a line of 3 names above its data, which begin in line 1"),
    "two layouts": ("a,b c,X [um]\n1,5 100,0\n2,5 200,0\n3,5 300,0\n", r"'1,5 100,0' may be 3 cells or 2: .*sep=',', decimal='\.'\), .* or .*sep='\[ \]\+', decimal=','\)"),
    "two meanings": ("t [s]\tX [um]\n1,000\t0\n1,500\t5\n2,000\t7\n", r"must show its decimal sign; '1,000' may be 1\.000 or 1000"),
    "wrong group": ("t [s];X [um]\n0,0;0\n0,5;12.5\n1,0;25\n", r"got '12\.5' in line 3"),
    "falling time": (GOOD + "0.2,40\n", r"time must rise within a part \(s\); got 1\.5 and then 0\.2 in line 6: part="),
    "two at one time": (GOOD + "1.5,40\n", r"1\.5 stands in line 5 and, with other values, in line 6: duplicates="),
    "missing time": (GOOD.replace("0.5,", ","), r"column 't \[s\]': time must be told in each row \(s\); none stands in line 3"),
    "ambiguous date": ("t,X [um]\n03/02/2026 10:00:00,0\n03/02/2026 10:00:01,1\n", r"'03/02/2026 10:00:00' in line 2 may be either: time_format="),
    "broken stamp": ("t,X [um]\n2026-03-02T10:00:00,0\n2026-03-02T10:xx,1\n2026-03-02T10:00:02,1\n", r"in each row; got '2026-03-02T10:xx' in line 3"),
}  # fmt: skip


@pytest.mark.parametrize("fault", REFUSED)
def test_refused_texts(read, fault):
    text, message = REFUSED[fault]
    with pytest.raises(ValueError, match=message) as told:
        read(text)
    assert "\n" not in str(told.value)


def test_too_many_rows_are_refused_before_they_are_read(read, monkeypatch):
    monkeypatch.setattr("sdpgrind.base.columns.sheet.ROWS_MAX", 4)
    with pytest.raises(
        ValueError, match=r"a\.csv must have at most 4e\+00 rows; got 5: read a piece of it, .*nrows="
    ):
        read(GOOD)


def test_lines_count_blank_ones(read):
    with pytest.raises(ValueError, match="got 'x' in line 7"):
        read("about\n\nt [s],X [um]\n0,0\n\n1,1\n2,x\n3,4\n")


def test_words_for_nothing(read):
    words = [
        "",
        "NaN",
        "nan",
        "NA",
        "N/A",
        "#N/A",
        "null",
        "none",
        "-",
        "--",
        "---",
        "inf",
        "-inf",
        "1.#QNAN",
        "#DIV/0!",
        "off",
    ]
    rows = "".join(f"{k},{word}\n{k}.5,12.5\n" for k, word in enumerate(reversed(words)))
    with pytest.warns(UserWarning, match=r"size has no reading in 16 of 32 rows, 50%"):
        log = read("t [s],X [um]\n" + rows, missing=("off",))
    assert np.isnan(log["data"]["size"]).values.tolist() == [True, False] * len(words)
    size = next(note for note in log.source.columns if note.name == "size")
    assert size.missing == len(words)


def test_truths(read):
    log = read("t [s],X [um],sat\n0,0,TRUE\n1,10,FALSE\n2,20,true\n", power_saturated="sat")
    assert log["data"].power_saturated.values.tolist() == [1.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("first", "second", "words", "form"),
    [
        ("30.11.26 23:59:59,500", "01.12.26 00:00:00,000", "a year of two digits", "%d.%m.%y %H:%M:%S,%f"),
        ("30.11.26 23:59:59.500", "01.12.26 00:00:00.000", "a year of two digits", "%d.%m.%y %H:%M:%S.%f"),
        ("11/30/2026 23:59:59.5", "12/01/2026 00:00:00.0", "it is the first", "%m/%d/%Y %H:%M:%S.%f"),
        ("30/11/26 23:59:59.5", "01/12/26 00:00:00.0", "it is the second", "%d/%m/%y %H:%M:%S.%f"),
        ("02/03/2026 10:00:59.5", "02/13/2026 10:01", "in line 3 shows that it is the first", "%m/%d/%Y"),
        ("02/03/2026 10:00:59.5", "02/03/2026 10:01:00.0", "may be either", "%d/%m/%Y %H:%M:%S.%f"),
    ],
)
def test_the_format_that_is_offered_reads_the_stamps(read, first, second, words, form):
    text = f"t;X [um]\n{first};0\n{second};10\n"
    with pytest.raises(ValueError, match=words) as refused:
        read(text)
    assert f'time_format="{form}' in str(refused.value)
    if "%f" in form:
        assert read(text, time_format=form)["data"].time.values.tolist() == [0.0, 0.5]


def test_time_format(read):
    text = "t,X [um]\n03/02/2026 10-00-00,0\n03/02/2026 10-00-01,10\n"
    assert read(text, time_format="%d/%m/%Y %H-%M-%S")["data"].time.values.tolist() == [0.0, 1.0]
    with pytest.raises(ValueError, match="time must be of the format '%H' in each row; got"):
        read(text, time_format="%H")


def test_numbers_are_kept_and_stamps_begin_at_0(read):
    assert read("t [s],X [um]\n7,0\n8,10\n")["data"].time.values.tolist() == [7.0, 8.0]
    parts = read("n,t,X [um]\na,10:00:05,0\na,10:00:06,10\nb,10:07:00,0\nb,10:07:01,10\n", part="n")
    assert parts["data"].time.values.tolist() == [0.0, 1.0, 0.0, 1.0]
    assert parts["data"].part.values.tolist() == [0, 0, 1, 1] and parts["data"].attrs["labels"] == ["a", "b"]


@given(st.integers(0, 60), st.text(alphabet="0,;.\t\r\n\"'#x-[]µ \0", max_size=4), st.integers(0, 5))
@pytest.mark.filterwarnings("ignore")
def test_damaged_texts_are_read_or_refused_in_one_sentence(tmp_path_factory, place, more, less):
    path = tmp_path_factory.getbasetemp() / "damaged.csv"
    text = "t [s];X [um]\n0,0;0\n0,5;12,5\n1,0;25\n1,5;37,5\nend\n"
    path.write_text(text[:place] + more + text[place + less :], encoding="utf-8", newline="")
    try:
        assert hwsim.Log.read(path, time="t", size="X").source.rows_read >= 1
    except ValueError as refused:
        assert "\n" not in str(refused) and "damaged.csv" in str(refused)


@pytest.mark.parametrize("mark", [",", ";"])
@pytest.mark.parametrize("separator", ["\t", " "])
def test_a_separator_at_the_end_of_a_name_is_none_of_it(mark, separator, tmp_path):
    """A script that joins names with commas above data with tabs; its units were lost with the bracket."""
    rows = [f"{0.05 * k:.2f}{separator}{1.5 * k:.1f}{separator}{900 + k}" for k in range(20)]
    path = tmp_path / "a.txt"
    path.write_text("\n".join([f"% t [s]{mark} x [um]{mark} P [W]", *rows]) + "\n")
    log = hwsim.Log.read(path, time="t", size="x [um]", grinding_power="P")
    assert [(note.header, note.recorded) for note in log.source.columns] == [
        ("t [s]", "s"),
        ("x [um]", "um"),
        ("P [W]", "W"),
    ]
