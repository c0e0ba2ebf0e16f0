"""Columns that are asked for, taken from a sheet: in our units, in parts, at their times."""

import dataclasses
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.cells import number, numbers
from sdpgrind.base.columns.commands import ALIGNMENTS
from sdpgrind.base.columns.request import Bound, Request, bound, place_of, unit_of_name
from sdpgrind.base.columns.resample import Series, resampled
from sdpgrind.base.columns.rows import PartRows, aligned, one_a_time, restarts, without_equal
from sdpgrind.base.columns.sheet import Column, Sheet, Wave, is_unit
from sdpgrind.base.columns.source import ColumnNote
from sdpgrind.base.columns.stamps import stamps, unrolled
from sdpgrind.base.columns.table import TEXT
from sdpgrind.base.unit_text import factor, near

_WITH_UNIT = re.compile(r"([+-]?[\d.,]+(?:[eE][+-]?\d+)?) *([^\d\s].*)")
"""A number and what may be its unit."""

_EXACT = 2.0**53  # derived: above it, floats skip whole numbers


@dataclasses.dataclass(frozen=True)
class Rules:
    """How rows become parts and instants; see `hwsim.Log.read`."""

    period: float | None = None
    group: str | Sequence[str] | None = None
    commands_at: str = "begin"
    duplicates: str = "refuse"
    on_restart: str = "refuse"
    resample: float | None = None
    missing: Sequence[str] = ()
    time_format: str | None = None
    plausible: bool = True

    def __post_init__(self) -> None:
        checks.one_of("commands_at", self.commands_at, ALIGNMENTS)
        checks.one_of("duplicates", self.duplicates, ("refuse", "first", "last", "mean", "keep"))
        checks.one_of("on_restart", self.on_restart, ("refuse", "new part"))
        checks.kind("plausible", self.plausible, bool)
        for name in ("period", "resample"):
            if getattr(self, name) is not None:
                checks.positive(name, getattr(self, name), "s")
        if self.duplicates == "keep" and (self.commands_at != "begin" or self.resample is not None):
            raise ValueError(
                'duplicates="keep" leaves rows at one time as they stand: commands_at must be "begin" and'
                f" resample None; got {self.commands_at!r} and {self.resample!r}"
            )
        if isinstance(self.missing, str):
            raise TypeError(f"missing must be a sequence of words, ({self.missing!r},); got {self.missing!r}")


class Taken(NamedTuple):
    """What a sheet gave: blocks of rows, and each quantity's column in it."""

    blocks: list[PartRows]
    bounds: Mapping[str, Bound]
    rows: int
    time: ColumnNote


def taken(
    sheet: Sheet, asked: list[Request], when: Request | None, of_part: Request | None, rules: Rules
) -> Taken:
    """Columns of a sheet as blocks of one part each."""
    bounds = {each.column: bound(each, sheet) for each in asked}
    others = [each for each in (when, of_part) if each is not None and not (each is when and sheet.own_times)]
    places = [each.place for each in bounds.values()] + [place_of(each, sheet) for each in others]
    raw = _read(sheet, places, _of_words(sheet, bounds, of_part))
    each_raw = zip(bounds.items(), raw[: len(bounds)], strict=True)
    values = {name: _in_our_unit(each, column, sheet, rules) for (name, each), column in each_raw}
    lengths = {sheet.headings[place].header: column.size for place, column in zip(places, raw, strict=True)}
    rows = max(lengths.values())
    if not rows:
        raise ValueError(f"{sheet.where} must hold rows; it has none")
    if len(set(lengths.values())) > 1 or _at_own_times(sheet, bounds, when, rules):
        if of_part is not None:
            raise ValueError(
                f"{sheet.where}: part must be left out where columns have lengths or times of their own;"
                f" got {of_part.header!r}"
            )
        joined = _joined(sheet, values, bounds, lengths, when, rules)
        return Taken([joined], bounds, rows, ColumnNote("time", "s", "-", "", "each column's own", 1.0))
    rest = dict(zip((each.name for each in others), raw[len(bounds) :], strict=True))
    labels = [str(sheet.label or "")] * rows if of_part is None else _labels(rest["part"], sheet)
    if when is None:
        times, note = _even(sheet, bounds, rows, rules)
    else:
        times, note = _times(sheet, when, rest["time"], rules)
    return Taken(_blocks(sheet, values, labels, of_part, times, rules), bounds, rows, note)


def _of_words(sheet: Sheet, bounds: Mapping[str, Bound], of_part: Request | None) -> set[int]:
    """Places of columns of words: of the parts, and of quantities that are texts."""
    parts = set() if of_part is None else {place_of(of_part, sheet)}
    return parts | {each.place for each in bounds.values() if unit_of_name(each.request.name) == TEXT}


def _read(sheet: Sheet, places: Sequence[int], words: set[int]) -> list[Column]:
    """Columns at their places; as numbers, 0017 would be 17."""
    plain = [place for place in places if place not in words]
    found = dict(zip(plain, sheet.take(plain), strict=True)) if plain else {}
    return [sheet.words(place) if place in words else found[place] for place in places]


def _at_own_times(sheet: Sheet, bounds: Mapping[str, Bound], when: Request | None, rules: Rules) -> bool:
    """Whether columns have times of their own that are not those of one another."""
    if any(each.place in sheet.own_times for each in bounds.values()):
        return True
    waves = {sheet.waves.get(each.place) for each in bounds.values()}
    return when is None and rules.period is None and None not in waves and len(waves) > 1


def _in_our_unit(each: Bound, column: Column, sheet: Sheet, rules: Rules) -> Column:
    """A column in our unit, or as texts."""
    if unit_of_name(each.request.name) == TEXT:
        return np.array([_word(value) for value in column], dtype=object)
    values = _numbers(column, each.request, each.heading.header, sheet, rules)
    return values if each.factor == 1.0 else values * each.factor


def _numbers(column: Column, request: Request, header: str, sheet: Sheet, rules: Rules) -> Floats:
    if column.dtype.kind == "f":
        return _without(column, rules.missing)
    found, bad = numbers(column, sheet.decimal, rules.missing)
    if bad is not None or column.dtype.kind == "M":
        word = str(column[bad or 0])
        raise ValueError(
            f"{sheet.where}, column {header!r}: {request.name} must be numbers; got {word!r} in"
            f" {sheet.place(bad or 0)} {_instead(word, request, header, sheet.decimal)}"
        )
    return found


def _without(values: Floats, missing: Sequence[str]) -> Floats:
    """Numbers without those that are words for no reading, as -9999."""
    codes = [
        code for code in (number(str(word), ".") for word in missing) if code is not None and code == code
    ]
    return np.where(np.isin(values, codes), np.nan, values) if codes else values


def _instead(word: str, request: Request, header: str, decimal: str) -> str:
    """What a word among numbers may be: a number with a comma or with its unit, or no reading."""
    if decimal == "." and "," in word and number(word, ",") is not None:
        return (
            f"with a decimal comma: read the table with decimal=',' (pandas), or turn the column into"
            f" numbers, table[{header!r}].str.replace(',', '.').astype(float)"
        )
    if word.strip() == header:
        return "(the header again: make each table below another a file of its own; a list of files is parts)"
    found = _WITH_UNIT.fullmatch(word.strip())
    if found is None or numbers([found[1]], decimal)[1] is not None or not is_unit(found[2]):
        return f"(missing=({word!r},) makes it no reading)"
    call = f'{request.name}=("{header}", "{found[2]}")'
    return f"with its unit; say {call} of a table with {found[1]!r} instead (pandas: .str.removesuffix)"


def _word(value: Any) -> str:
    """Text of a cell; a whole number without its point."""
    if value is None or value != value:
        return ""
    return str(int(value)) if isinstance(value, float) and value == int(value) else str(value).strip()


def _labels(column: Column, sheet: Sheet) -> list[str]:
    """Words of the column of parts in each row."""
    values = column.tolist()
    known = {value: _word(value) for value in dict.fromkeys(values)}
    labels = [known[value] for value in values]
    if column.dtype.kind == "f" and np.any(alike := np.abs(column) >= _EXACT):
        raise ValueError(
            f"{sheet.where}: part must be texts from 2^53 on, where numbers are rounded to each other;"
            f" got {column[alike][0]:.17g}"
        )
    if "" in known.values():
        raise ValueError(
            f"{sheet.where}: part must be told in each row; none stands in {sheet.place(labels.index(''))}"
        )
    return labels


def _times(sheet: Sheet, when: Request, column: Column, rules: Rules) -> tuple[Any, ColumnNote]:
    """Times of the rows: seconds, or stamps that count from the first row of a part; and their origin."""
    heading = sheet.headings[place_of(when, sheet)]
    if rules.time_format is None and (when.unit is not None or _are_numbers(column, sheet.decimal)):
        each = bound(when, sheet)
        seconds = _numbers(column, when, heading.header, sheet, rules)
        seconds = _known(seconds if each.factor == 1.0 else seconds * each.factor, heading.header, sheet)
        return seconds, ColumnNote("time", "s", heading.header, each.unit, each.origin, each.factor)
    if column.dtype.kind == "f":
        column = np.array([_word(value) for value in column], dtype=object)
    found = stamps(column, rules.time_format, f"{sheet.where}, column {heading.header!r}", sheet.place)
    return found, ColumnNote("time", "s", heading.header, "", "stamps", 1.0)


def _are_numbers(column: Column, decimal: str) -> bool:
    if column.dtype.kind == "O":
        return numbers([next((cell for cell in column if cell is not None), None)], decimal)[1] is None
    return column.dtype.kind == "f"


def _known(seconds: Floats, header: str, sheet: Sheet) -> Floats:
    bad = np.flatnonzero(np.isnan(seconds))
    if bad.size:
        where = f"{sheet.where}, column {header!r}"
        raise ValueError(
            f"{where}: time must be told in each row (s); none stands in {sheet.place(int(bad[0]))}"
        )
    return seconds


def _even(
    sheet: Sheet, bounds: Mapping[str, Bound], rows: int, rules: Rules
) -> tuple[Floats | float, ColumnNote]:
    """Times of a waveform, or the period (s) from row to row in each part; and their origin."""
    if rules.period is not None:
        told = f"period of {rules.period:g} s"
        return float(rules.period), ColumnNote("time", "s", "-", "", told, 1.0)
    wave = sheet.waves.get(next(iter(bounds.values())).place)
    if wave is None:
        raise ValueError(
            f'{sheet.where}: time must be a column, time="header" or ("header", "s"), or period= the step'
            f" from row to row (s); its headers are {sheet.listed()}"
        )
    return _of_wave(wave, rows), ColumnNote("time", "s", "-", "", "waveform", 1.0)


def _of_wave(wave: Wave, rows: int) -> Floats:
    return np.asarray(wave.start + wave.step * np.arange(rows), dtype=float)


def _blocks(
    sheet: Sheet,
    values: Mapping[str, Column],
    labels: list[str],
    of_part: Request | None,
    times: Any,
    rules: Rules,
) -> list[PartRows]:
    """Rows of each part, in order of appearance."""
    rows = len(labels)
    row = np.arange(rows)
    block = PartRows(labels[0], sheet.where, np.zeros(rows), values, row, sheet.place)
    if of_part is None:
        parts = [block]
    else:
        codes = {label: k for k, label in enumerate(dict.fromkeys(labels))}
        code = np.fromiter((codes[label] for label in labels), np.int64, rows)
        order = np.argsort(code, kind="stable")
        edges = np.searchsorted(code[order], np.arange(len(codes) + 1))
        pieces = zip(codes, edges[:-1].tolist(), edges[1:].tolist(), strict=True)
        parts = [block.only(order[a:b], label) for label, a, b in pieces]
    timed = [_timed(each, times) for each in parts]
    named = of_part is not None
    if rules.duplicates != "keep":
        timed = [without_equal(one) for one in timed]
    return [each for one in timed for each in restarts(one, rules.on_restart, named)]


def _timed(block: PartRows, times: Any) -> PartRows:
    if isinstance(times, float):
        return block._replace(time=np.asarray(times * np.arange(block.row.size), dtype=float))
    if isinstance(times, np.ndarray):
        return block._replace(time=times[block.row])
    return block._replace(time=unrolled(times._replace(time=times.time[block.row])))


def _joined(
    sheet: Sheet,
    values: Mapping[str, Column],
    bounds: Mapping[str, Bound],
    lengths: Mapping[str, int],
    when: Request | None,
    rules: Rules,
) -> PartRows:
    """Columns with times of their own, at common instants."""
    told = ", ".join(f"{header!r} {count}" for header, count in lengths.items())
    if rules.resample is None:
        raise ValueError(
            f"{sheet.where}: columns must be of one length and pace, or resample= a step (s) brings them to"
            f" common instants; got {told} rows"
        )
    series = {
        name: (_own(sheet, bounds[name], column, when, told), column) for name, column in values.items()
    }
    time, columns = resampled(_shifted(series, rules, sheet), rules.resample, sheet.where)
    row = np.arange(time.size)
    return PartRows(str(sheet.label or ""), sheet.where, time, columns, row, sheet.place, ready=True)


def _shifted(series: Mapping[str, Series], rules: Rules, sheet: Sheet) -> dict[str, Series]:
    """Columns with commands aligned, and times that rise."""
    found = {}
    for name, (time, column) in series.items():
        block = PartRows(
            "", f"{sheet.where}, {name}", time, {name: column}, np.arange(time.size), sheet.place
        )
        (block,) = restarts(without_equal(block), "refuse")
        block = aligned(one_a_time(block, rules.duplicates), rules.commands_at)
        found[name] = block.time, block.columns[name]
    return found


def _own(sheet: Sheet, each: Bound, column: Column, when: Request | None, told: str) -> Floats:
    """Times of a column that has its own, s."""
    if each.place in sheet.own_times:
        written, time = sheet.own_times[each.place]
        unit = when.unit if when is not None and when.unit is not None else written
        if not unit:
            raise ValueError(
                f"{sheet.where}, {each.heading.header!r}: its time must have a unit; say"
                f' time=("time", "s") or another such as {", ".join(near("s"))}'
            )
        return np.asarray(time * factor(unit, "s"))
    wave = sheet.waves.get(each.place)
    if wave is None:
        raise ValueError(
            f"{sheet.where}: columns must be of one length or have times of their own; got {told} rows, and"
            f" {each.heading.header!r} has no wf_increment"
        )
    return _of_wave(wave, column.size)
