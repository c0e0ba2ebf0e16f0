"""TDMS, HDF5 and X3P as sheets: a group each, in natural order; a file that is cut off is refused whole."""

import io
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from sdpgrind.base.columns.sheet import Column, ColumnHead, Sheet, Wave, as_column, heading, too_long, unit_of
from sdpgrind.base.extras import need
from sdpgrind.base.unit_text import factor

_UNITS = ("unit_string", "units", "unit")
_PACKED = ("scale_factor", "add_offset", "_FillValue", "missing_value")
"""Attributes of packed numbers; source: conventions of netCDF, which h5py leaves to its callers."""
_WORDS = 160  # chosen: letters of a reader's own words; some hold the bytes of the file
_TOGETHER = 0.01  # chosen: steps; channels that begin so much apart are told to begin together


def sheets(file: str, raw: bytes, ending: str) -> list[Sheet]:
    """Return the groups of a file as sheets; faults of the readers become one sentence."""
    reader, module = READERS[ending]
    library = need(module, "io")
    with _one_sentence(file, ending):
        found = reader(file, raw, library)
    if not found:
        raise ValueError(f"{file} must hold columns of one dimension; it holds none")
    for sheet in found:
        if sheet.rows is not None:
            too_long(file, sheet.rows)
    found = [replace(sheet, take=_guarded(sheet.take, file, ending)) for sheet in found]
    return sorted(found, key=lambda sheet: natural(sheet.label or ""))


@contextmanager
def _one_sentence(file: str, ending: str) -> Iterator[None]:
    """Faults of a damaged file, which raises nearly anything in the readers, as a ValueError."""
    try:
        yield
    except ImportError:
        raise
    except Exception as error:
        words = re.sub(r"\s+", " ", str(error))[:_WORDS] or type(error).__name__
        raise ValueError(f"{file} must be a whole {ending} file; it cannot be read: {words}") from None


def _guarded(
    take: Callable[[Sequence[int]], list[Column]], file: str, ending: str
) -> Callable[[Sequence[int]], list[Column]]:
    def guarded(wanted: Sequence[int]) -> list[Column]:
        with _one_sentence(file, ending):
            return take(wanted)

    return guarded


def natural(text: str) -> list[tuple[int, int, str]]:
    """Key of an order in which run10 comes after run9."""
    return [
        (0, int(piece), "") if piece.isdigit() else (1, 0, piece)
        for piece in re.split(r"(\d+)", text)
        if piece
    ]


def _unit(attributes: Any) -> str | None:
    """Unit among the attributes of a channel."""
    names = {str(name).lower(): name for name in attributes}
    for name in filter(names.__contains__, _UNITS):
        value = attributes[names[name]]
        value = value.item() if isinstance(value, np.ndarray) and value.size == 1 else value
        if isinstance(value, bytes):
            value = value.decode("utf-8", "replace")
        if isinstance(value, str) and value.strip():
            return unit_of(value)
    return None


def _taken(columns: Sequence[Any]) -> Callable[[Sequence[int]], list[Column]]:
    """Read columns when they are wanted: arrays, or channels whose slice reads them."""
    return lambda wanted: [as_column(columns[k][:]) for k in wanted]


def _tdms(file: str, raw: bytes, nptdms: Any) -> list[Sheet]:
    _refuse_short_tdms(raw)
    data = nptdms.TdmsFile.read(io.BytesIO(raw))
    return [_group(file, group) for group in data.groups() if any(len(each) for each in group.channels())]


def _refuse_short_tdms(raw: bytes) -> None:
    """Refuse a file whose segments do not end where it ends."""
    place = 0
    while place < len(raw):
        lead = raw[place : place + 28]
        if len(lead) < 28 or lead[:4] != b"TDSm":
            raise ValueError(f"no segment begins at byte {place}")
        place += 28 + int.from_bytes(lead[12:20], "little")
    if place != len(raw):
        raise ValueError(f"its segments need {place} bytes, {len(raw)} are there")


def _group(file: str, group: Any) -> Sheet:
    channels = [each for each in group.channels() if len(each)]
    headings = [heading(each.name, _unit(each.properties), "unit_string") for each in channels]
    begins = [each.properties.get("wf_start_time") for each in channels]
    first = None if None in begins else min(begins)
    waves = {
        k: wave
        for k, (each, begin) in enumerate(zip(channels, begins, strict=True))
        if (wave := _wave(each.properties, 0.0 if first is None else _seconds(begin - first))) is not None
    }
    take = _taken(channels)
    rows = max(len(each) for each in channels)
    return Sheet(file, headings, take, label=str(group.name), waves=waves, rows=rows)


def _wave(properties: Any, after: float) -> Wave | None:
    """Times of a waveform that begins `after` (s) the first of its group; None: it is over no time."""
    step = float(properties.get("wf_increment", 0.0))
    try:
        unit = factor(str(properties.get("wf_xunit_string") or "s"), "s")
    except ValueError:
        return None
    if not step:
        return None
    after = 0.0 if after < _TOGETHER * step * unit else after
    return Wave(float(properties.get("wf_start_offset", 0.0)) * unit + after, step * unit)


def _seconds(span: Any) -> float:
    return float(span / np.timedelta64(1, "us")) / 1e6


def _hdf5(file: str, raw: bytes, h5py: Any) -> list[Sheet]:
    with h5py.File(io.BytesIO(raw), "r") as data:
        return [sheet for group in _groups(data, h5py) for sheet in _of_hdf5(file, group, h5py)]


def _groups(group: Any, h5py: Any) -> list[Any]:
    """A group and all groups in it."""
    below = [each for each in group.values() if isinstance(each, h5py.Group) and not _is_signal(each, h5py)]
    return [group, *(inner for each in below for inner in _groups(each, h5py))]


def _is_signal(group: Any, h5py: Any) -> bool:
    """Whether a group is one column with its times."""
    return {"time", "value"} <= set(group) and all(
        isinstance(group[k], h5py.Dataset) for k in ("time", "value")
    )


def _of_hdf5(file: str, group: Any, h5py: Any) -> list[Sheet]:
    """Columns of a group: its datasets of one dimension, and groups ``name/{time, value}``."""
    sets = [
        (name, each)
        for name, each in group.items()
        if isinstance(each, h5py.Dataset) and _is_column(each) and _is_read(each, h5py)
    ]
    simple = [(name, each) for name, each in sets if not each.dtype.names]
    fields = [(name, each) for _, each in sets for name in _fields(each)]
    signals = [
        name for name, each in group.items() if isinstance(each, h5py.Group) and _is_signal(each, h5py)
    ]
    if not simple and not fields and not signals:
        return []
    headings = [_heading(name, each.attrs) for name, each in simple] + [heading(name) for name, _ in fields]
    headings += [_heading(name, group[name].attrs, group[name]["value"].attrs) for name in signals]
    values = [_read(each) for _, each in simple] + [each[name] for name, each in fields]
    values += [_read(group[name]["value"]) for name in signals]
    times = {
        k: (_unit(group[name]["time"].attrs) or "", as_column(_read(group[name]["time"])))
        for k, name in enumerate(signals, len(simple) + len(fields))
    }
    take = _taken(values)
    label = group.name.strip("/") or None
    return [Sheet(file, headings, take, label=label, own_times=times, rows=max(map(len, values)))]


def _heading(name: str, *attributes: Any) -> ColumnHead:
    unit = next((found for each in attributes if (found := _unit(each)) is not None), None)
    return heading(name, unit, "attribute")


def _is_column(dataset: Any) -> bool:
    """Whether a dataset has one dimension, or a second one of length 1 as the vectors of MATLAB."""
    if dataset.ndim == 2 and not dataset.dtype.names:
        return bool(min(dataset.shape) == 1 < max(dataset.shape))
    return bool(dataset.ndim == 1 and dataset.size)


def _is_read(dataset: Any, h5py: Any) -> bool:
    """Whether a dataset holds numbers, texts or a table, and no references."""
    return dataset.dtype.kind != "O" or h5py.check_string_dtype(dataset.dtype) is not None


def _fields(dataset: Any) -> list[str]:
    """Columns of a table in one dataset."""
    return [name for name in dataset.dtype.names or () if not dataset.dtype[name].shape]


def _read(dataset: Any) -> Any:
    """Values of a dataset in one line: texts, or numbers with scale, offset and fill values of netCDF."""
    values, told = np.ravel(dataset[()]), dataset.attrs
    if values.dtype.kind == "O":
        return np.ravel(dataset.asstr()[()])
    if values.dtype.kind not in "iuf" or not set(told) & set(_PACKED):
        return values
    nothing = [np.ravel(told[name]) for name in _PACKED[2:] if name in told]
    known = ~np.isin(values, np.concatenate(nothing)) if nothing else True
    scale, offset = (np.ravel(told.get(name, k))[0] for name, k in zip(_PACKED, (1.0, 0.0), strict=False))
    return np.where(known, values * float(scale) + float(offset), np.nan)


def _x3p(file: str, raw: bytes, x3pio: Any) -> list[Sheet]:
    layers = x3pio.read(io.BytesIO(raw)).layers
    if len(layers) != 1 or layers[0].z.ndim != 1 or not hasattr(layers[0], "x_values"):
        raise ValueError(f"it must hold one profile; it holds {', '.join(map(repr, layers))}")
    layer = layers[0]
    headings = [ColumnHead("x", "x", "m", "format"), ColumnHead("z", "z", "m", "format")]
    take = _taken([np.ravel(layer.x_values), layer.z])
    return [Sheet(file, headings, take, rows=layer.z.size)]


READERS: dict[str, tuple[Callable[[str, bytes, Any], list[Sheet]], str]] = {
    ".tdms": (_tdms, "nptdms"),
    ".h5": (_hdf5, "h5py"),
    ".hdf5": (_hdf5, "h5py"),
    ".x3p": (_x3p, "x3pio"),
}
"""Ending -> reader of a file's bytes and the library that it needs."""
