"""Users' files and tables as columns in our units: nothing guessed, every row that is left out counted."""

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.columns import binary, memory, text
from sdpgrind.base.columns.codes import codes
from sdpgrind.base.columns.exchanged import exchanged, follower, is_position
from sdpgrind.base.columns.mistakes import DeclaredTimes, mistakes, sentence
from sdpgrind.base.columns.pairs import contradictions
from sdpgrind.base.columns.plausible import refuse_other_units
from sdpgrind.base.columns.removal import removal_doubt, removal_fault
from sdpgrind.base.columns.request import (
    POSITION,
    Bound,
    Request,
    place_of,
    request_of,
    requests_of,
    unit_of_name,
)
from sdpgrind.base.columns.resample import resampled
from sdpgrind.base.columns.rows import PartRows, aligned, gaps, one_a_time, warn_of_most
from sdpgrind.base.columns.sheet import Column, Sheet, too_long
from sdpgrind.base.columns.source import ColumnNote, FileNote, Source, file_note
from sdpgrind.base.columns.steps import refuse_other_resample, warn_of_other_time
from sdpgrind.base.columns.table import TEXT
from sdpgrind.base.columns.taken import Rules, Taken, taken
from sdpgrind.base.warned import warn

_MISSING = 0.05  # chosen: share of missing readings above which a user should look at the file
ENDINGS = (*text.ENDINGS, *binary.READERS)
_SPREADSHEETS = (".xls", ".xlsx", ".xlsm", ".ods")


class Recorded(NamedTuple):
    """Columns in our units over the rows of all parts, with their origin."""

    time: Floats
    part: npt.NDArray[np.int64]
    columns: Mapping[str, Column]
    units: Mapping[str, str]
    labels: tuple[str, ...]
    source: Source


def read(
    data: Any, columns: Mapping[str, Any], *, time: Any = None, part: Any = None, rules: Rules | None = None
) -> Recorded:
    """Read `columns` (our name -> header, unit, factor) of a file, files or a table."""
    rules = rules or Rules()
    if not columns:
        raise ValueError('columns must be named, as size="header" or size=("header", "um"); got none')
    asked = requests_of(columns)
    when = None if time is None else request_of("time", time)
    of_part = None if part is None else request_of("part", part)
    if when is not None and rules.period is not None:
        raise ValueError(
            f"period must be left out where time is a column; got {rules.period:g} s and {when.header!r}"
        )
    files, sheets = opened(data, rules)
    kept, notes = _with_columns(sheets, asked, rules)
    found = [taken(sheet, asked, when, of_part, rules) for sheet in kept]
    whole = _whole(files, found, asked, rules, notes)
    unread = _unread(kept, [each for each in (*asked, when, of_part) if each is not None])
    return whole._replace(source=dataclasses.replace(whole.source, unread=unread))


def opened(data: Any, rules: Rules) -> tuple[list[FileNote], list[Sheet]]:
    """Sheets of a path, of a list of paths, or of a table in memory, and notes of the files."""
    if isinstance(data, str | os.PathLike):
        data = [data]
    if not isinstance(data, list | tuple):
        sheet = memory.sheet(data)
        return [FileNote(sheet.file)], [sheet]
    if not data:
        raise ValueError("data must hold at least one path; got an empty list")
    notes, sheets = [], []
    for path in data:
        raw, found = _of_file(checks.path("data", path), rules)
        notes.append(file_note(found[0].file, raw, found[0].layout))
        label = Path(path).stem if len(data) > 1 else None
        sheets += [dataclasses.replace(each, label=each.label or label) for each in found]
    return notes, sheets


def _of_file(path: Path, rules: Rules) -> tuple[bytes, list[Sheet]]:
    ending = path.suffix.lower()
    if ending in _SPREADSHEETS:
        raise ValueError(
            f"{path.name} is a spreadsheet: read(pandas.read_excel({str(path)!r}), ...), which openpyxl opens"
            " (pip install openpyxl); names in row 3 and units in row 4 are header=[2, 3]"
        )
    if ending not in ENDINGS:
        raise ValueError(f"data must end in one of {', '.join(ENDINGS)}; got {str(path)!r}")
    if not path.is_file():
        raise FileNotFoundError(f"data must be an existing file; got {str(path)!r}")
    if ending in text.ENDINGS:
        too_long(path.name, text.count_of_lines(path))
    raw = path.read_bytes()
    if not raw:
        raise ValueError(f"{path.name} must hold a table; it is empty")
    if ending in binary.READERS:
        return raw, binary.sheets(path.name, raw, ending)
    return raw, text.sheets(path.name, raw, rules.missing)


def _with_columns(sheets: list[Sheet], asked: list[Request], rules: Rules) -> tuple[list[Sheet], list[str]]:
    """Sheets that hold what is asked for, of the groups that are asked for; what is left out is noted."""
    if rules.group is not None:
        wanted = [rules.group] if isinstance(rules.group, str) else list(rules.group)
        labels = [sheet.label for sheet in sheets]
        for name in wanted:
            if name not in labels:
                held = ", ".join(repr(each) for each in labels if each) or "no groups"
                raise ValueError(
                    f"{sheets[0].file}: group must be one of its groups; got {name!r}, it holds {held}"
                )
        return [sheet for sheet in sheets if sheet.label in wanted], [f"groups read: {', '.join(wanted)}"]
    holding = [sheet for sheet in sheets if any(_holds(sheet, each) for each in asked)]
    if not holding:
        place_of(asked[0], sheets[0])
    for each in asked:
        _refuse_elsewhere(each, holding)
    others = [sheet.where for sheet in sheets if sheet not in holding]
    return holding, [f"left out, as none of the columns is there: {', '.join(others)}"] if others else []


def _refuse_elsewhere(request: Request, sheets: list[Sheet]) -> None:
    """Refuse a column that one group or file lacks and another has, as channels of two paces."""
    lacking = [sheet for sheet in sheets if not _holds(sheet, request)]
    if not lacking or len(lacking) == len(sheets):
        return
    try:
        place_of(request, lacking[0])
    except ValueError as error:
        having = next(sheet.where for sheet in sheets if _holds(sheet, request))
        raise ValueError(
            f"{error}; {having} has it, and each is read as a part: name groups by group=, or join what is of"
            " one part in a table (pandas.merge_asof)"
        ) from None


def _holds(sheet: Sheet, request: Request) -> bool:
    return any(request.header in (each.header, each.name) for each in sheet.headings)


def _unread(sheets: list[Sheet], asked: list[Request]) -> tuple[str, ...]:
    """Headers that nobody asked for: a column of part numbers among them is soon seen."""
    wanted = {request.header for request in asked}
    heads = {each.header: each.name for sheet in sheets for each in sheet.headings if each.header}
    return tuple(header for header, name in heads.items() if not wanted & {header, name})


def _whole(
    files: list[FileNote], found: list[Taken], asked: list[Request], rules: Rules, notes: list[str]
) -> Recorded:
    """Clean the rows of all parts, check their units, join them."""
    raw = [block for one in found for block in one.blocks]
    blocks = [_clean(block, rules) for block in raw]
    warn_of_most(raw, rules.duplicates)
    columns = {each.column: np.concatenate([b.columns[each.column] for b in blocks]) for each in asked}
    where = files[0].name if len(files) == 1 else f"{files[0].name} ... {files[-1].name}"
    if rules.plausible:
        rising = [one_a_time(block, "last") for block in blocks]  # rates need steps > 0
        refuse_other_resample(rules.resample, sum(one.rows for one in found), rising, where)
        _refuse_or_warn(columns, rising, found[0], rules, where)
    else:
        notes = [*notes, "plausible=False: units are not held against what a machine can mean"]
    sizes, names = [block.time.size for block in blocks], _names(blocks)
    source = _source(files, found, columns, blocks, names, rules, notes)
    _warn_of_missing(source, sum(sizes), where)
    return Recorded(
        np.concatenate([block.time for block in blocks]),
        np.repeat(np.arange(len(blocks)), sizes),
        columns,
        {each.column: unit_of_name(each.name) for each in asked},
        names,
        source,
    )


def _names(blocks: list[PartRows]) -> tuple[str, ...]:
    """Words of each part, else its number; words that return, as of files of one name, are counted."""
    names: dict[str, None] = {}
    for k, block in enumerate(blocks):
        name, again = block.label or str(k), 2
        while name in names:
            name, again = f"{block.label or k} ({again})", again + 1
        names[name] = None
    return tuple(names)


def _refuse_or_warn(
    columns: Mapping[str, Column], blocks: list[PartRows], first: Taken, rules: Rules, where: str
) -> None:
    """Refuse mistakes, and warn of what is unusual; a code for no reading may be why."""
    odd = codes(blocks, first.bounds)
    try:
        _refuse_mistakes(columns, blocks, first, rules, where)
    except ValueError as error:
        raise ValueError("; ".join([str(error), *odd])) from None
    warn_of_other_time(blocks, where)
    for told in odd:
        warn(f"{where}, {told}")


def _refuse_mistakes(
    columns: Mapping[str, Column], blocks: list[PartRows], first: Taken, rules: Rules, where: str
) -> None:
    """Refuse columns that were exchanged, that no machine means, or that contradict each other."""
    parts, bounds = [(block.time, block.columns) for block in blocks], dict(first.bounds)
    factors = {name: each.factor for name, each in bounds.items()}
    if (pair := exchanged(parts, factors)) is not None:
        way, rate = (bounds[name] for name in pair)
        raise ValueError(
            f"{where}: {_of_exchanged(way, rate, f'follow {rate.request.name}, and not the other way')}"
        )
    faults = contradictions(parts)
    if (pair := follower(parts, factors, faults)) is not None:
        way, other = (bounds[name] for name in pair)
        raise ValueError(
            f"{where}: {_of_exchanged(way, other, f'follow its rate, as {other.request.name} does')}"
        )
    refuse_other_units(columns, bounds, where)
    if (odd := removal_fault(columns, bounds)) is not None:
        raise ValueError(f"{where}: {odd}")
    if (doubt := removal_doubt(columns, bounds)) is not None:
        warn(f"{where}: {doubt}")
    for fault in faults:
        if is_position(fault, parts, factors):
            raise ValueError(
                f"{where}: {bounds[fault.second].request.name} must be a rate; it rises with {fault.first} as"
                f" a position does: {POSITION} (plausible=False takes it as it is)"
            )
        told = fault.times == fault.times
        found = mistakes(fault, parts, bounds, DeclaredTimes(first.time, rules.period)) if told else []
        raise ValueError(f"{where}: {sentence(fault, found, bounds)}")


def _of_exchanged(one: Bound, other: Bound, rule: str) -> str:
    """Words on two columns that are exchanged, with the call that puts them right."""
    return (
        f"{one.request.name} must {rule}; exchanged?"
        f" Say {_as(one, other)}, {_as(other, one)} (plausible=False takes it as it is)"
    )


def _as(each: Bound, other: Bound) -> str:
    """Argument that reads the column of another one, in the unit of its file, or else that of the call.

    Its factor stays: it is said of the quantity.
    """
    return each._replace(heading=other.heading).call(unit=other.heading.unit)


def _source(
    files: list[FileNote],
    found: list[Taken],
    columns: Mapping[str, Column],
    blocks: list[PartRows],
    names: tuple[str, ...],
    rules: Rules,
    notes: list[str],
) -> Source:
    rows, kept = sum(one.rows for one in found), sum(block.time.size for block in blocks)
    if rules.resample is not None:
        told = f"resampled to a step of {rules.resample:g} s: {kept} instants from {rows} rows"
        rows, notes = kept, [*notes, told]
    return Source(
        tuple(files),
        tuple(_notes(found, columns)),
        len(blocks),
        rows,
        rows - kept,
        tuple((name, *gap) for name, block in zip(names, blocks, strict=True) for gap in gaps(block)),
        rules.commands_at,
        tuple(notes),
        names if any(block.label for block in blocks) else (),
    )


def _clean(block: PartRows, rules: Rules) -> PartRows:
    """Rows of a part as asked: one at a time, commands aligned, resampled."""
    if block.ready:
        return block
    block = aligned(one_a_time(block, rules.duplicates), rules.commands_at)
    if rules.resample is None:
        return block
    series = {name: (block.time, values) for name, values in block.columns.items()}
    time, columns = resampled(series, rules.resample, block.where)
    return block._replace(time=time, columns=columns, row=np.arange(time.size))


def _notes(found: list[Taken], columns: Mapping[str, Column]) -> list[ColumnNote]:
    """A note of each column, more where files record it otherwise."""
    notes: dict[tuple[Any, ...], ColumnNote] = {}
    for one in found:
        notes.setdefault(("time", one.time.header, one.time.recorded), one.time)
        for name, each in one.bounds.items():
            unit, header = unit_of_name(each.request.name), each.heading.header
            missing = int(np.sum(_missing(columns[name])))
            ours = "1" if unit in ("", TEXT) else unit
            note = ColumnNote(name, ours, header, each.unit, each.origin, each.factor, missing)
            notes.setdefault((name, header, each.unit, each.factor), note)
    return list(notes.values())


def _missing(values: Column) -> Any:
    return np.isnan(values) if values.dtype.kind == "f" else values == ""


def _warn_of_missing(source: Source, rows: int, where: str) -> None:
    for note in source.columns:
        if note.missing > _MISSING * rows:
            share = note.missing / rows
            warn(f"{where}: {note.name} has no reading in {note.missing} of {rows} rows, {share:.0%}")
