"""Texts of other styles: encodings, separators, numbers, headers, feet."""

import numpy as np
from foreign_truth import CALL, HEADERS, POWER, RATE, SIZE, TIME, TRUTH, Foreign, columns, digits, rows, table

TEXTS = {}
"""Style -> function of a folder that writes the file."""


def text(lines, call=CALL, truth=TRUTH, encoding="utf-8", end="\n", mark=b"", name="a.csv"):
    """Function that writes lines as bytes."""

    def write(folder):
        path = folder / name
        path.write_bytes(mark + "".join(line + end for line in lines).encode(encoding))
        return Foreign(path, dict(call), truth)

    return write


def call(**more):
    return CALL | more


GERMAN = ("Zeit [s]", "Maß [µm]", "Zustellung [mm/min]", "Leistung [W]")
IN_GERMAN = {"time": "Zeit", "size": "Maß", "command_rate": "Zustellung", "grinding_power": "Leistung"}
LE, BE = b"\xff\xfe", b"\xfe\xff"
ENCODED = {
    "UTF-8": ("utf-8", b"", "\n"),
    "UTF-8 with mark": ("utf-8", b"\xef\xbb\xbf", "\r\n"),
    "UTF-16 LE with mark, CRLF": ("utf-16-le", LE, "\r\n"),
    "UTF-16 BE with mark": ("utf-16-be", BE, "\n"),
    "UTF-16 LE without mark": ("utf-16-le", b"", "\r\n"),
    "UTF-16 BE without mark": ("utf-16-be", b"", "\n"),
    "cp1252": ("cp1252", b"", "\r\n"),
    "latin-1, CR": ("latin-1", b"", "\r"),
}
for name, (encoding, mark, end) in ENCODED.items():
    TEXTS[name] = text(
        ["Prüfstand 2", *table(";", ",", GERMAN)], IN_GERMAN, encoding=encoding, mark=mark, end=end
    )
TEXTS["cp850 of DOS"] = text(
    table(";", ",", GERMAN),
    IN_GERMAN,
    r"size must be one of its columns; got 'Maß', its headers are",
    "cp850",
)
TEXTS["UTF-16 cut in half a letter"] = lambda folder: Foreign(
    written(folder, LE + "\n".join(table()).encode("utf-16-le")[:-1]), CALL, "must be text in utf-16; byte"
)


def written(folder, raw, name="a.csv"):
    path = folder / name
    path.write_bytes(raw)
    return path


SEPARATED = {
    "semicolons, decimal points": table(";"),
    "semicolons, decimal commas": table(";", ","),
    "tabs, decimal commas": table("\t", ","),
    "bars": table(" | "),
    "commas and blanks": table(", "),
    "quoted decimal commas": table(",", ",", texts=[[f'"{cell}"' for cell in c] for c in columns(",")]),
    "blanks of any width": ["  ".join(HEADERS), *(f"{a:>9}{b:>12}{c:>8}   {d}" for a, b, c, d in zip(*columns(), strict=True))],
    "blanks, decimal commas": ["   ".join(HEADERS), *(f"{a:>9}{b:>12}{c:>8}   {d}" for a, b, c, d in zip(*columns(","), strict=True))],
    "sep=": ["sep=|", *table("|")],
    "quoted sep=": ['"sep=;"', *table(";", ",")],
    "trailing separator": table(";", end=";"),
    "trailing separator below names": [";".join(HEADERS), *rows(columns(), ";", ";")],
    "padded for a spreadsheet": [*table(";", end=";;;"), *[";;;;;;"] * 40],
    "empty lines between": [line for each in table() for line in (each, "")],
    "very long rows": table(",", headers=(*HEADERS, *(f"n{k}" for k in range(400))), texts=[*columns(), *[["0.125"] * TIME.size] * 400]),
}  # fmt: skip
TEXTS |= {name: text(lines) for name, lines in SEPARATED.items()}
TEXTS["CR CR LF of a doubled conversion"] = text(table(";"), end="\r\r\n")
TEXTS["foot of a Ctrl-Z"] = text([*table(";"), "\x1a"], end="\r\n")
TEXTS["a colon between"] = text(table(":"), CALL, "must hold rows of at least two cells")
TEXTS["one row"] = text(
    table(";", ",")[:2] , {"time": "t", "size": ("X", "um")}, {"time": TIME[:1], "size": SIZE[:1]}
)  # fmt: skip
TEXTS["names alone"] = text(table()[:1], CALL, "must hold rows of at least two cells")

NANOMETRES = ("t [ms]", "X [nm]", "v [um/min]", "P [mW]")
GREAT = [1e3 * TIME, 1e6 * SIZE, 6e4 * RATE, 1e3 * POWER]


def great(decimal, group, places=(1, 2, 1, 2), quoted=False):
    each = [digits(values, n, decimal, group) for values, n in zip(GREAT, places, strict=True)]
    return [[f'"{cell}"' for cell in c] for c in each] if quoted else each


NUMBERS = {
    "1.234,56": table(";", headers=NANOMETRES, texts=great(",", ".")),
    "1,234.56": table(",", headers=NANOMETRES, texts=great(".", ",", quoted=True)),
    "1,234.56 between semicolons": table(";", headers=NANOMETRES, texts=great(".", ",")),
    "1 234,56 with no-break spaces": table(";", headers=NANOMETRES, texts=great(",", "\u00a0")),
    "1 234,56 with narrow no-break spaces": table("\t", headers=NANOMETRES, texts=great(",", "\u202f")),
    "1 234,56 with common blanks": table(";", headers=NANOMETRES, texts=great(",", " ")),
    "1'234.56": table(";", headers=NANOMETRES, texts=great(".", "'")),
    "1,5E-03": table(";", texts=[[f"{x:.6E}".replace(".", ",") for x in c] for c in (TIME, 1e3 * SIZE, 60 * RATE, POWER)]),
    "minus signs of print": table(
        ";", texts=[*columns()[:3], [f"\u2212{x:.1f}" for x in POWER]], headers=(*HEADERS[:3], "P [W]")
    ),
    "plus signs": table(texts=[[f"{x:+.4f}" for x in c] for c in (TIME, 1e3 * SIZE, 60 * RATE, POWER)]),
    "leading zeros": table(texts=[[f"{x:012.4f}" for x in c] for c in (TIME, 1e3 * SIZE, 60 * RATE, POWER)]),
    "shortest": table(texts=[[np.format_float_positional(x, trim="-").lstrip("0") or "0" for x in c] for c in (TIME, 1e3 * SIZE, np.round(60 * RATE, 2), POWER)]),
}  # fmt: skip
TEXTS |= {name: text(lines) for name, lines in NUMBERS.items()}
TEXTS["minus signs of print"] = text(
    NUMBERS["minus signs of print"], CALL, TRUTH | {"grinding_power": -POWER}
)
for name, sign, told in (
    ("1.5D-03 of Fortran", "D", r"got '0\.000000D\+00' in line 2"),
    ("12.5 um in each cell", " um", r"got '0\.0 um' in line 2"),
):
    cells = (
        [f"{x:.6E}".replace("E", sign) for x in 1e3 * SIZE]
        if sign == "D"
        else [c + sign for c in columns()[1]]
    )
    TEXTS[name] = text(table(";", texts=[columns()[0], cells, *columns()[2:]]), CALL, told)
TEXTS["1,234 that may be 1.234"] = text(
    table(
        "\t",
        texts=[digits(1e3 * (TIME + 1), 0, group=","), *[digits(x, 0) for x in (1e3 * SIZE, RATE, POWER)]],
    ),
    CALL,
    "must show its decimal sign; '1,000' may be 1.000 or 1000",
)
TEXTS["decimal commas after 250 whole numbers"] = text(
    ["t [s];X [mm]", *(f"{k};0" for k in range(250)), *(f"{250 + k};1,{k:03d}" for k in range(50))],
    {"time": "t", "size": "X"},
    {"time": np.arange(300.0), "size": np.concatenate([np.zeros(250), 1 + 1e-3 * np.arange(50)])},
)
TEXTS["1,234 after 250 whole numbers"] = text(
    ["t [s]\tX [um]", *(f"{k}\t0" for k in range(250)), *(f"{250 + k}\t1,{k:03d}" for k in range(50))],
    {"time": "t", "size": "X"}, "must show its decimal sign; '1,000' may be",
)  # fmt: skip
for name, line in (("1,050 beside 950", "{},{:03d}"), ("1.050 beside 950", "{}.{:03d}")):
    powers = [line.format(*divmod(w, 1000)) if w >= 1000 else str(w) for w in range(900, 1200, 10)]
    TEXTS[name] = text(
        ["t [s];P [W]", *(f"{k};{w}" for k, w in enumerate(powers))],
        {"time": "t", "grinding_power": "P"},
        "must show its decimal sign; '1.000' may be 1.000 or 1000",
    )
TEXTS["decimal commas that separate"] = text(
    table(",", ","), CALL, r"must have a line of \d names above its data|must have . cells in each row"
)
TEXTS["a minus behind"] = text(
    table(";", texts=[columns()[0], [f"{c}-" for c in columns()[1]], *columns()[2:]]),
    CALL,
    r"got '0\.0-' in line 2",
)
TEXTS["words for nothing"] = text(
    [HEADERS[0] + ";X [um]", "0;NaN", "1;-", "2;#NV", "3;12,5", "4;n.def.", "5;1.#QNAN", "6;NULL"],
    {"time": "t", "size": "X", "missing": ("#NV", "n.def.")},
    {"time": np.arange(7.0), "size": np.array([np.nan] * 3 + [0.0125] + [np.nan] * 3)},
)
TEXTS["TRUE and FALSE"] = text(
    ["t [s],X [um],sat", "0,1,TRUE", "1,2,false", "2,9,True"], {"time": "t", "size": "X", "power_saturated": "sat"},
    {"size": np.array([0.001, 0.002, 0.009]), "power_saturated": np.array([1.0, 0.0, 1.0])},
)  # fmt: skip
TEXTS["ja and nein"] = text(
    ["t [s],X [um],sat", "0,1,ja", "1,2,nein"], {"time": "t", "size": "X", "power_saturated": "sat"},
    "power_saturated must be numbers; got 'ja' in line 2",
)  # fmt: skip


def headed(*names):
    return table(";", headers=names)


HEADS = {
    "per cent sign": ["% " + table(",")[0], *table(",")[1:]],
    "two slashes": ["// " + table(";")[0], *table(";")[1:]],
    "no blank before the bracket": headed("t[s]", "X[um]", "v[mm/min]", "P[W]"),
    "parentheses": headed("t (s)", "X (µm)", "v (mm/min)", "P (W)"),
    "superscripts and middle dots": headed("t [s]", "X [μm]", "v [mm·min⁻¹]", "P [N·m·s⁻¹]"),
    "exponents without a sign": headed("t [s]", "X [10 um]".replace("10 ", ""), "v [mm min-1]", "P [J s^-1]"),
    "units in capitals": headed("t [S]", "X [UM]", "v [MM/MIN]", "P [W]"),
    "units in words": headed("t [seconds]", "X [Micrometers]", "v [Millimeter/Minute]", "P [watts]"),
    "quoted names": headed('"t [s]"', '"X [um]"', '"v [mm/min]"', '"P [W]"'),
    "a comma in a quoted name": table(",", headers=('"time, all [s]"', '"X [um]"', '"v [mm/min]"', '"P [W]"')),
    "number sign": ["# rig 7", "#t [s];X [um];v [mm/min];P [W]", *table(";")[1:]],
    "number signs between blanks": ["# t [s]  X [um]  v [mm/min]  P [W]", *(" ".join(r) for r in zip(*columns(), strict=True))],
    "row of units": ["t;X;v;P", "s;um;mm/min;W", *table(";")[1:]],
    "row of units in brackets": ["t;X;v;P", "[s];[µm];[mm/min];[W]", *table(";")[1:]],
    "row of units with dashes": ["n;t;X;v;P;mode", "-;s;um;mm/min;W;-", *("1;" + line + ";rough" for line in table(";")[1:])],
    "index without a name": ["," + ",".join(HEADERS), *(f"{k},{line}" for k, line in enumerate(table(",")[1:]))],
    "a name fewer": [",".join(HEADERS), *(f"{k},{line}" for k, line in enumerate(table(",")[1:]))],
    "numbers above": ["Program;4711;2", "Tool;12;3", "Speed;1450;4", "", *table(";")],
    "pairs above": ["Program;4711", "Tool;12", "Speed;1450,5", "", *table(";", ",")],
    "a no-break space in a name": headed("t\u00a0[s]", "X\u00a0[um]", "v\u00a0[mm/min]", "P\u00a0[W]"),
}  # fmt: skip
TEXTS |= {name: text(lines) for name, lines in HEADS.items()}
TEXTS["a comma in a quoted name"] = text(HEADS["a comma in a quoted name"], call(time="time, all"))
NO_UNITS = {
    "no names": (table()[1:], r"must have a line of 4 names above its data, which begin in line 1: .*pandas\.read_csv"),
    "in um": (headed("t in s", "X in um", "v in mm/min", "P in W"), r"must be one of its columns; got '.', its headers are 't in s'"),
    "X/um": (headed("t/s", "X/um", "v/(mm/min)", "P/W"), r"must be one of its columns; got '.', its headers are 't/s'"),
    "no units": (headed("t", "X", "v", "P"), r"column 'X': size must have a unit; say size=\(\"X\", \"mm\"\)"),
    "a unit with three meanings": (headed("t [s]", "X [NM]", "v [mm/min]", "P [W]"), r"column 'X \[NM\]': size must have a unit like mm"),
    "a name twice": (headed("t [s]", "X [um]", "X [um]", "P [W]"), "the header 'X' stands 2 times among"),
    "another dimension": (headed("t [s]", "X [N]", "v [mm/min]", "P [W]"), r"size must have a unit like mm .*got 'N'"),
    "200 lines above": ([f"note {k}" for k in range(210)] + headed(*HEADERS), "must have 2 cells in each row; line 211 has 5"),
    "a name of two lines": (["t [s];\"X", "[um]\";v [mm/min];P [W]", *table(";")[1:]], r"must have a line of 4 names above its data, which begin in line 3"),
}  # fmt: skip
TEXTS |= {name: text(lines, CALL, told) for name, (lines, told) in NO_UNITS.items()}
UNITS = {
    "time": ("t", "s"),
    "size": ("X", "um"),
    "command_rate": ("v", "mm/min"),
    "grinding_power": ("P", "W"),
}
TEXTS["bracket and unit row that differ"] = text(
    [*table(";")[:1], "s;mm;mm/min;W", *table(";")[1:]],
    CALL,
    r"column 'X \[um\]': size must have a unit like mm .*; got 'um or mm'",
)
TEXTS["bracket and unit row that agree"] = text([*table(";")[:1], "-;µm;mm/min;W", *table(";")[1:]])
TEXTS["a quote that is not closed in its line"] = text(
    [
        ";".join((*HEADERS, "disc")),
        *(f'{row};"5 in' if k in (7, 9) else f'{row};5" in' for k, row in enumerate(table(";")[1:])),
    ],
    CALL,
    "must close each quote in its line; its 120 lines of data are 118 rows",
)
TEXTS["no units, told in the call"] = text(headed("t", "X", "v", "P"), UNITS)

FEET = {
    "foot of a sum": [*table(";"), "Sum;1;2;3"],
    "foot of sums below a blank": [*table(";"), "", "Summe;1;2;3", "Mittel;1;2;3"],
    "foot of a signature": [*table(";"), "", "Checked: K. Meier, 2026-03-02", "OK"],
    "foot of other widths": [*table(";"), "max;1234,5", "end;of;file;at;last"],
}
TEXTS |= {name: text(lines) for name, lines in FEET.items()}
TEXTS["a word below a word"] = text(
    [*table(";")[:60], "pause;;;", *table(";")[60:]], CALL, r"got 'pause' in line 61"
)
TEXTS["names again, as of two runs"] = text([*table(), *table()], CALL, r"got 'X \[um\]' in line 122")
TEXTS["two runs without names"] = text(
    [*table(), *table()[1:]], CALL, r"time must rise within a part .* on_restart="
)
TEXTS["cut off in a row"] = lambda folder: Foreign(
    written(folder, "\n".join(table())[:-9].encode()), CALL, "must be whole; line 121, its last"
)
