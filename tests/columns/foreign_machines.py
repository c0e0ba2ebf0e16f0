"""Texts of instruments, stamps and writers of others: traces, exports, tables of parameters."""

import csv
import datetime
import io

import numpy as np
import pandas as pd
from foreign_texts import UNITS, call, headed, text, written
from foreign_truth import CALL, HEADERS, POWER, RATE, SIZE, TIME, TRUTH, Foreign, columns, rows, table

MACHINES = {}
"""Style -> function of a folder that writes the file."""
LVM = ["LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", "Decimal_Separator\t,", "Multi_Headings\tYes", "X_Columns\tOne", "Time_Pref\tRelative", "Operator\trig", "Date\t2026/03/02", "Time\t10:15:33,041", "***End_of_Header***\t", "", "Channels\t3\t\t\t", "Samples\t120\t120\t120\t", "Date\t2026/03/02\t2026/03/02\t2026/03/02\t", "Time\t10:15:33,04\t10:15:33,04\t10:15:33,04\t", "X_Dimension\tTime\tTime\tTime\t", "X0\t0,0E+0\t0,0E+0\t0,0E+0\t", "Delta_X\t0,05\t0,05\t0,05\t", "***End_of_Header***\t\t\t\t", "X_Value\tX\tv\tP\tComment"]  # fmt: skip
MACHINES["LabVIEW .lvm"] = text(
    [*LVM, *rows(columns(","), "\t")], UNITS | {"time": ("X_Value", "s")}, end="\r\n", name="a.lvm"
)
MACHINES["LabVIEW .lvm, empty comments"] = text(
    [*LVM, *rows(columns(","), "\t", "\t")], UNITS | {"time": ("X_Value", "s")}, end="\r\n", name="a.lvm"
)
SCOPE = ["LECROYWR64Xs,12345,Waveform", "Segments,1,SegmentSize,120", "Segment,TrigTime,TimeSinceSegment1", "#1,02-Mar-2026 10:15:33,0"]  # fmt: skip
MACHINES["scope of LeCroy"] = text(
    [*SCOPE, "Time,Ampl", *rows([[f"{x:.6e}" for x in TIME], columns()[3]], ",")],
    {"time": ("Time", "s"), "grinding_power": ("Ampl", "W")}, {"time": TIME, "grinding_power": POWER}, end="\r\n",
)  # fmt: skip
MACHINES["trace of a control"] = text(
    ["HEADER;TNC 640 340594 11", "DATE;02.03.2026;TIME;10:15:33", "SAMPLE;50;ms", "CHANNELS;4", "CH1;Zeit;CH2;Ist",
     "BEGIN", "Zeit;Ist;Soll;Leistung", "s;µm;mm/min;W", *rows(columns(","), ";"), "END;120", "CHECKSUM;0x4F2A"],
    {"time": "Zeit", "size": "Ist", "command_rate": "Soll", "grinding_power": "Leistung"}, encoding="cp1252",
    end="\r\n", name="a.dat",
)  # fmt: skip
MACHINES["catman"] = text(
    ["HBM-Catman\t5.4.2", "Kanäle=4\t", "Zeit  1 - Standardmessrate [s]\tWeg [µm]\tRate [mm/min]\tP [W]",
     *rows(columns(","), "\t")],
    {"time": "Zeit  1 - Standardmessrate", "size": "Weg", "command_rate": "Rate", "grinding_power": "P"},
    encoding="cp1252", name="a.asc",
)  # fmt: skip

START = datetime.datetime(2026, 3, 2, 23, 59, 58)
MOMENTS = [START + datetime.timedelta(milliseconds=round(1e3 * t)) for t in TIME]


def stamped(form, decimal=".", separator=";", **more):
    stamps = [m.strftime(form).replace("%L", f"{m.microsecond // 1000:03d}") for m in MOMENTS]
    return text(table(separator, decimal, ("t", *HEADERS[1:]), [stamps, *columns(decimal)[1:]]), **more)


MACHINES |= {
    "ISO stamps": stamped("%Y-%m-%dT%H:%M:%S.%f"),
    "ISO stamps with a blank and a comma": stamped("%Y-%m-%d %H:%M:%S,%%L", ","),
    "ISO stamps in UTC": stamped("%Y-%m-%dT%H:%M:%S.%fZ", separator=","),
    "ISO stamps with a zone": stamped("%Y-%m-%d %H:%M:%S.%%L+01:00", separator="\t"),
    "stamps with slashes, year first": stamped("%Y/%m/%d %H:%M:%S.%%L"),
    "dd.mm.yyyy hh:mm:ss,fff": stamped("%d.%m.%Y %H:%M:%S,%%L", ","),
    "time of day over midnight": stamped("%H:%M:%S.%%L"),
    "time of day, comma": stamped("%H:%M:%S,%%L", ","),
    "dd/mm/yyyy": stamped("%d/%m/%Y %H:%M:%S.%%L", truth=r"'02/03/2026 23:59:58.000' in line 2 may be either: time_format="),
    "dd/mm/yyyy, told": stamped("%d/%m/%Y %H:%M:%S.%%L", call=call(time_format="%d/%m/%Y %H:%M:%S.%f")),
    "am and pm": stamped("%I:%M:%S.%%L %p", truth="time must be .*in line 2"),
    "dd.mm.yy": stamped("%d.%m.%y %H:%M:%S.%%L", truth="time must be .*time_format="),
    "milliseconds after a colon": stamped("%H:%M:%S:%%L", truth="time must be .*in line 2"),
    "stamps without separators": stamped("%Y%m%dT%H%M%S.%%L", truth="time must be .*time_format="),
    "minutes and seconds": stamped("%M:%S.%%L", truth="time must say what '59:58.000' in line 2 is: time_format="),
}  # fmt: skip
MACHINES["minutes and seconds, whole"] = text(
    ["t;X [um]", *(f"{k // 60:02d}:{k % 60:02d};{k}" for k in range(90))], {"time": "t", "size": "X"},
    "time must say what '00:00' in line 2 is: time_format=",
)  # fmt: skip
MACHINES["date and time of day in two columns"] = text(
    table(";", headers=("date", "t", *HEADERS[1:]),
          texts=[["02.03.2026"] * TIME.size, [m.strftime("%H:%M:%S.%f") for m in MOMENTS], *columns()[1:]])
)  # fmt: skip
EPOCH = 1772445600.0
MACHINES["milliseconds since 1970"] = text(
    table(";", headers=("t [ms]", *HEADERS[1:]), texts=[[f"{1e3 * (EPOCH + t):.0f}" for t in TIME], *columns()[1:]]),
    CALL, TRUTH | {"time": EPOCH + TIME},
)  # fmt: skip
MACHINES["serial days"] = text(
    table(";", headers=("t [d]", *HEADERS[1:]), texts=[[f"{46083 + t / 86400:.12f}" for t in TIME], *columns()[1:]]),
    CALL, r"time must have a unit like s \(.*h.*\)|time must have a unit like s",
)  # fmt: skip
MACHINES["bare numbers of time"] = text(
    headed("t", *HEADERS[1:]), CALL, r"time must have a unit; say time=\(\"t\", \"s\"\)"
)


def _by_pandas(folder):
    frame = pd.DataFrame({"t [s]": TIME, "X [um]": 1e3 * SIZE, "v [mm/min]": 60 * RATE, "P [W]": POWER})
    frame.to_csv(folder / "a.csv", sep=";", decimal=",", encoding="utf-16")
    return Foreign(folder / "a.csv", CALL, TRUTH)


def _by_numpy(folder):
    np.savetxt(
        folder / "a.txt", np.column_stack([TIME, 1e3 * SIZE, 60 * RATE, POWER]), header="  ".join(HEADERS)
    )
    return Foreign(folder / "a.txt", CALL, TRUTH)


def _by_csv(folder):
    buffer = io.StringIO()
    writer = csv.writer(buffer, dialect="excel-tab", quoting=csv.QUOTE_ALL)
    writer.writerow(HEADERS)
    writer.writerows(zip(*columns(), strict=True))
    return Foreign(written(folder, buffer.getvalue().encode(), "a.txt"), CALL, TRUTH)


MACHINES |= {"pandas in UTF-16": _by_pandas, "numpy.savetxt": _by_numpy, "csv, all quoted": _by_csv}
FIRST = (
    "workpiece_speed",
    "wheel_speed",
    "depth",
    "feed",
    "a",
    "b",
    "c",
    "d",
    "e",
    "f",
    "g",
    "h",
    "i",
    "roundness",
)
PUBLIC = ["," + ",".join(FIRST), *(f"{k},{20 + k},{30 + k},{0.01 * k + 0.01:.2f}," + "1.5," * 10 + f"{2.5 + k:.1f}" for k in range(30))]  # fmt: skip
DECLARED = {"period": 1.0, "work_rotation": ("workpiece_speed", "1/min"), "wheel_speed": ("wheel_speed", "m/s"),
            "cut_depth": ("depth", "mm"), "deviation": ("roundness", "um")}  # fmt: skip
MACHINES["13 parameters and a roundness"] = text(
    PUBLIC,
    DECLARED,
    {"wheel_speed": 1e3 * (30 + np.arange(30.0)), "deviation": 1e-3 * (2.5 + np.arange(30.0))},
)
for quantity, (header, _) in [(k, v) for k, v in DECLARED.items() if k != "period"]:
    MACHINES[f"13 parameters, {header} undeclared"] = text(
        PUBLIC,
        DECLARED | {quantity: header},
        rf"column '{header}': {quantity} must have a unit; say {quantity}=",
    )
