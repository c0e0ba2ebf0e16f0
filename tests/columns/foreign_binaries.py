"""TDMS, HDF5 and X3P of other styles, made by npTDMS, h5py and x3pio."""

import h5py
import numpy as np
import x3pio
from foreign_truth import CALL, POWER, RATE, SIZE, TIME, TRUTH, Foreign
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

BINARIES = {}
"""Style -> function of a folder that writes the file."""
STEP = 0.05  # s
COLUMNS = {"X": (1e3 * SIZE, "um"), "v": (60 * RATE, "mm/min"), "P": (POWER, "W")}
TIMED = {"t": (TIME, "s"), **COLUMNS}
UNTIMED = {name: header for name, header in CALL.items() if name != "time"}
TOLD = {"size": ("X", "um"), "command_rate": ("v", "mm/min"), "grinding_power": ("P", "W")}


def tdms(channels, call=CALL, truth=TRUTH, segments=1):
    """Function that writes channels, (group, name) -> (values, properties), in segments."""

    def write(folder):
        with TdmsWriter(folder / "a.tdms") as writer:
            for part in range(segments):
                writer.write_segment(
                    [RootObject({"author": "rig"})]
                    + [GroupObject(group) for group in dict.fromkeys(group for group, _ in channels)]
                    + [
                        ChannelObject(*place, np.array_split(values, segments)[part], told)
                        for place, (values, told) in channels.items()
                    ]
                )
        return Foreign(folder / "a.tdms", dict(call), truth)

    return write


def waves(step=STEP, group="run", **more):
    return {
        (group, name): (values, {"unit_string": unit, "wf_increment": step, "wf_start_offset": 0.0} | more)
        for name, (values, unit) in COLUMNS.items()
    }


def timed(unit="unit_string", group="run"):
    return {(group, name): (values, {unit: u}) for name, (values, u) in TIMED.items()}


def bare(group="run"):
    return {(group, name): (values, {}) for name, (values, _) in TIMED.items()}


FINE = np.repeat(POWER, 10)
TWO = {name: np.concatenate([values, values]) for name, values in TRUTH.items()}
STAMPS = np.datetime64("2026-03-02T23:59:58") + (1e6 * TIME).astype("timedelta64[us]")
START = np.datetime64("2026-03-02T10:00:00", "us")
LINEAR = {
    "unit_string": "um", "NI_Scaling_Status": "unscaled", "NI_Number_Of_Scales": 1,
    "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 0.1,
    "NI_Scale[0]_Linear_Y_Intercept": -50.0, "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
}  # fmt: skip
BINARIES |= {
    "TDMS, waveforms": tdms(waves(), UNTIMED),
    "TDMS, time channel": tdms(timed()),
    "TDMS, two segments": tdms(timed(), segments=2),
    "TDMS, milliseconds": tdms(timed() | {("run", "t"): (1e3 * TIME, {"unit_string": "ms"})}),
    "TDMS, stamps": tdms(timed() | {("run", "t"): (STAMPS, {})}),
    "TDMS, units in names": tdms({("run", f"{name} [{u}]"): (values, {}) for name, (values, u) in TIMED.items()}),
    "TDMS, units missing": tdms(bare(), CALL, r"group 'run', column 'X': size must have a unit; say size=\(\"X\", \"mm\"\)"),
    "TDMS, units missing, told": tdms(bare(), TOLD | {"time": ("t", "s")}),
    "TDMS, no times": tdms(bare(), TOLD, r"time must be a column, time=\"header\" .* or period="),
    "TDMS, no times, period told": tdms(bare(), TOLD | {"period": STEP}),
    "TDMS, run10 before run9": tdms(
        waves(group="run10") | waves(group="run9") | {("run9", "X"): (2e3 * SIZE[:100], waves()[("run", "X")][1])},
        {"size": "X"}, {"size": np.concatenate([2 * SIZE[:100], SIZE]), "part": np.repeat([0, 1], [100, 120])},
    ),
    "TDMS, waveforms of two paces": tdms(
        waves() | {("run", "P"): (FINE, {"unit_string": "W", "wf_increment": STEP / 10})}, UNTIMED,
        r"columns must be of one length and pace, or resample=",
    ),
    "TDMS, waveforms of two paces, resampled": tdms(
        waves() | {("run", "P"): (np.interp(np.arange(1191) * STEP / 10, TIME, POWER), {"unit_string": "W", "wf_increment": STEP / 10})},
        {"size": "X", "command_rate": "v", "resample": STEP}, {name: TRUTH[name] for name in ("time", "size", "command_rate_command")},
    ),
    "TDMS, counts with a scale": tdms(
        waves() | {("run", "X"): (np.round(1e4 * SIZE).astype(np.int16), waves()[("run", "X")][1] | LINEAR)}, UNTIMED,
        TRUTH | {"size": SIZE - 0.05},
    ),
    "TDMS, waveform in ms": tdms(waves(1e3 * STEP, wf_xunit_string="ms"), UNTIMED),
    "TDMS, spectrum": tdms(waves(wf_xname="Frequency", wf_xunit_string="Hz"), UNTIMED, r"time must be a column, .* or period="),
    "TDMS, a channel that begins later": tdms(
        {place: (values, told | {"wf_start_time": START + (place[1] == "P") * np.timedelta64(2, "s")}) for place, (values, told) in waves().items()},
        UNTIMED, "columns must be of one length and pace, or resample=",
    ),
    "TDMS, channels that begin together": tdms(waves(wf_start_time=START), UNTIMED),
    "TDMS, times in floats of 4 bytes": tdms(
        {place: (values.astype(np.float32), told) for place, (values, told) in timed().items()}
    ),
    "TDMS, parts by words": tdms(
        {("run", name): (np.concatenate([values, values]), {"unit_string": u}) for name, (values, u) in TIMED.items()}
        | {("run", "bore"): (["left"] * 120 + ["right"] * 120, {})},
        CALL | {"part": "bore"}, TWO | {"part": np.repeat([0, 1], 120)},
    ),
}  # fmt: skip


def hdf5(datasets, call=CALL, truth=TRUTH, **options):
    """Function that writes datasets, path -> (values, attributes)."""

    def write(folder):
        with h5py.File(folder / "a.h5", "w") as file:
            for place, (values, told) in datasets.items():
                if isinstance(values, h5py.SoftLink | h5py.ExternalLink):
                    file[place] = values
                else:
                    file.create_dataset(place, data=values, **options).attrs.update(told)
        return Foreign(folder / "a.h5", dict(call), truth)

    return write


def flat(unit="units", form=str, group=""):
    return {group + name: (values, {unit: form(u)}) for name, (values, u) in TIMED.items()}


SIGNALS = {
    f"{name}/{what}": (TIME if what == "time" else values, {"units": "s" if what == "time" else unit})
    for name, (values, unit) in COLUMNS.items()
    for what in ("time", "value")
}
COUNTS = np.round(1e4 * SIZE).astype(np.int32)
LAID = {"units": "um", "scale_factor": 0.1, "add_offset": -50.0}
COMPOUND = np.zeros(120, [(name, float) for name in TIMED])
for name, (values, _) in TIMED.items():
    COMPOUND[name] = values
BINARIES |= {
    "HDF5, units": hdf5(flat()),
    "HDF5, unit in bytes": hdf5(flat("unit", np.bytes_)),
    "HDF5, Units": hdf5(flat("Units"), CALL, TRUTH),
    "HDF5, columns of MATLAB": hdf5(
        {name: (values[:, None] if name == "t" else values[None, :], told) for name, (values, told) in flat().items()}
        | {"n": (np.array([[120.0]]), {})}
    ),
    "HDF5, compressed": hdf5(flat(), compression="gzip", chunks=(16,)),
    "HDF5, big endian": hdf5({name: (values.astype(">f8"), told) for name, (values, told) in flat().items()}),
    "HDF5, integers": hdf5(flat() | {"X": (COUNTS * 100, {"units": "nm"}), "t": (np.round(1e3 * TIME).astype(np.uint16), {"units": "ms"})}),
    "HDF5, counts with a scale": hdf5(flat() | {"X": (COUNTS, LAID)}, CALL, TRUTH | {"size": SIZE - 0.05}),
    "HDF5, a value for nothing": hdf5(
        flat() | {"X": (np.where(TIME == 2.0, -9999.0, 1e3 * SIZE), {"units": "um", "_FillValue": -9999.0})}, CALL,
        TRUTH | {"size": np.where(TIME == 2.0, np.nan, SIZE)},
    ),
    "HDF5, no units": hdf5({name: (values, {}) for name, (values, _) in TIMED.items()}, CALL, r"column 'X': size must have a unit"),
    "HDF5, runs": hdf5(flat(group="run 10/") | flat(group="run 9/"), CALL, TWO | {"part": np.repeat([0, 1], 120)}),
    "HDF5, runs below runs": hdf5(flat(group="day/run 10/") | flat(group="day/run 9/"), CALL | {"group": "day/run 10"}),
    "HDF5, signals": hdf5(SIGNALS, UNTIMED | {"resample": STEP}),
    "HDF5, signals, no step": hdf5(SIGNALS, UNTIMED, r"or resample= a step"),
    "HDF5, two dimensions": hdf5({"data": (np.column_stack([v for v, _ in TIMED.values()]), {})}, CALL, "must hold columns of one dimension"),
    "HDF5, compound": hdf5({"data": (COMPOUND, {})}, TOLD | {"time": ("t", "s")}),
    "HDF5, complex": hdf5(flat() | {"X": (1e3 * SIZE + 0j, {"units": "um"})}, CALL, "size must be numbers"),
    "HDF5, references beside": hdf5(flat() | {"refs": (np.array([h5py.Reference()] * 3, dtype=h5py.ref_dtype), {})}),
    "HDF5, a link to nothing": hdf5(flat() | {"old": (h5py.SoftLink("/gone"), {})}),
    "HDF5, parts by words": hdf5(
        {name: (np.concatenate([v, v]), {"units": u}) for name, (v, u) in TIMED.items()} | {"bore": (["left"] * 120 + ["right"] * 120, {})},
        CALL | {"part": "bore"}, TWO | {"part": np.repeat([0, 1], 120)},
    ),
    "HDF5, truths": hdf5(flat() | {"sat": (TIME > 3, {})}, CALL | {"power_saturated": "sat"}, TRUTH | {"power_saturated": TIME > 3}),
    "HDF5 with a name of text": lambda folder: Foreign(
        hdf5(flat())(folder).data.rename(folder / "a.csv"), CALL, "must be a text; got binary bytes"
    ),
}  # fmt: skip

TURN = np.linspace(0.0, 2 * np.pi, 400, endpoint=False)
DEVIATION = np.round(0.05 * np.cos(TURN - 0.7) + 0.003 * np.cos(3 * TURN), 6)  # mm
RING = {"angle": TURN, "reading": 40.0 + DEVIATION}
HOLES = np.where((TURN > 1.0) & (TURN < 1.1), np.nan, DEVIATION)
KNOWN = np.isfinite(HOLES)
ARC = 40e-3 * TURN[1]  # m
PROFILES = {}
"""Style of a profile -> function of a folder that writes the file."""


def x3p(heights, truth=RING, radius=40.0, more=None, y_scale=None, **options):
    def write(folder):
        x3pio.write(folder / "a.x3p", heights, x_scale=ARC, y_scale=y_scale, **options)
        return Foreign(folder / "a.x3p", {"radius": radius} | (more or {}), truth)

    return write


def form(lines, call, truth=RING, encoding="utf-8"):
    def write(folder):
        (folder / "a.txt").write_bytes("\r\n".join([*lines, ""]).encode(encoding))
        return Foreign(folder / "a.txt", call, truth)

    return write


def polar(separator, decimal, turns=1, factor=1e3, digits=4, of_degree=1.0):
    lines = [
        f"{a:.6f}{separator}{d:.{digits}f}"
        for a, d in zip(of_degree * np.degrees(TURN), factor * DEVIATION, strict=True)
    ]
    return [line.replace(".", decimal) for line in lines * turns]


ANGLED = {"angle": "Winkel", "deviation": "Abweichung", "radius": 40.0}


def _points(folder):
    x3pio.write_points(folder / "a.x3p", np.column_stack([40e-3 * TURN, 0 * TURN, 1e-3 * DEVIATION]))
    return Foreign(folder / "a.x3p", {"radius": 40.0}, "must hold one profile")


PROFILES |= {
    "X3P": x3p(1e-3 * DEVIATION),
    "X3P, floats of 4 bytes": x3p(1e-3 * DEVIATION, z_type="F"),
    "X3P, whole numbers": x3p(1e-3 * DEVIATION, z_type="L"),
    "X3P, as XML": x3p(1e-3 * DEVIATION, storage=x3pio.DataStorage.XML),
    "X3P, a cloud of points": lambda folder: _points(folder),
    "X3P, points not measured": x3p(1e-3 * HOLES, {name: values[KNOWN] for name, values in RING.items()}),
    "X3P, three rows": x3p(1e-3 * np.array([DEVIATION] * 3), "must hold one profile", y_scale=1e-3),
    "X3P, two layers": x3p(1e-3 * np.array([[DEVIATION]] * 2), "must hold one profile", y_scale=1e-3),
    "X3P, no radius": x3p(1e-3 * DEVIATION, "radius must be the nominal radius of the ring", radius=None),
    "X3P, deviation in um": x3p(1e-3 * DEVIATION, r"deviation must be 1e-06 \.\.\. 2 mm; got .*: deviation=\(\"z\", \"mm\"\)", more={"deviation": ("z", "um")}),
    "form tester, degrees and commas": form(
        ["Formtester MMQ;V2;", "Radius;40,0;mm", "", "Winkel [°];Abweichung [µm]", *polar(";", ",")], ANGLED, encoding="cp1252"
    ),
    "form tester, Grad": form(["Winkel;Abweichung", "Grad;µm", *polar(";", ",")], ANGLED),
    "form tester, two turns": form(
        ["Winkel [deg]\tAbweichung [um]", *polar("\t", ".", 2)], ANGLED,
        {"angle": np.concatenate([TURN, TURN + 2 * np.pi]), "reading": np.tile(RING["reading"], 2)},
    ),
    "form tester, no units": form(["Winkel;Abweichung", *polar(";", ",")], ANGLED, r"column 'Winkel': angle must have a unit; say angle=\(\"Winkel\", \"rad\"\) or another such as deg"),
    "form tester, gon": form(["Winkel [gon];Abweichung [um]", *polar(";", ",", of_degree=10 / 9)], ANGLED),
    "form tester, Strich": form(["Winkel [Strich];Abweichung [um]", *polar(";", ",")], ANGLED, "angle must have a unit like rad"),
    "form tester, inch": form(["Winkel [deg];Abweichung [in]", *polar(";", ".", 1, 1 / 25.4, 12)], ANGLED),
}  # fmt: skip
