"""Time stamps of files as nanoseconds: ISO 8601, dd.mm.yyyy, time of day, or a format that is told."""

import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.columns.sheet import Column

Nanoseconds = npt.NDArray[np.int64]
DAY = 86_400_000_000_000  # ns; derived
_ISO = re.compile(r"\d{4}[-/]\d{1,2}[-/]\d{1,2}(?:[T ].*)?")
_DOTS = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})(.*)")
_SLASHES = re.compile(r"(\d{1,2})/(\d{1,2})/\d{2,4}.*")
_WRITTEN = re.compile(
    r"\d{1,2}([./])\d{1,2}\1(\d{2}|\d{4})(?:(T|\s+)\d{1,2}:\d{2}(:\d{2}(?:([.,])\d{1,6})?)?)?"
)
_MONTHS = 12  # source: the calendar
_OF_DAY = re.compile(r"(\d{1,2})(:\d{2}:\d{2}.*)")
_TWO = re.compile(r"\d{1,2}:\d{2}(?:[.,]\d*)?")


class Stamps(NamedTuple):
    """Times in ns; of a day: without a date, so that midnight makes them fall."""

    time: Nanoseconds
    of_day: bool


def stamps(values: Column, time_format: str | None, where: str, place: Callable[[int], str]) -> Stamps:
    """Return the stamps of a column; the error names the row."""
    if values.dtype.kind == "M":
        return Stamps(_checked(values, values, where, place, "a time"), False)
    texts = [str(each).strip() if each is not None else "" for each in values]
    first = next((each for each in texts if each), "")
    if time_format is not None:
        of_day = not re.search(r"%[djDxcsuU]", time_format)
        return Stamps(
            _parsed(texts, texts, time_format, where, place, f"of the format {time_format!r}"), of_day
        )
    _refuse_two_meanings(first, texts, where, place)
    for form, ready, rule in _FORMS:
        if form.fullmatch(first):
            times = _parsed(texts, [ready(each) for each in texts], "ISO8601", where, place, rule)
            return Stamps(times, form is _OF_DAY)
    raise ValueError(
        f"{where}: time must be numbers with a unit, ISO 8601, dd.mm.yyyy hh:mm:ss or hh:mm:ss; got"
        f" {first!r} in {place(0)}: {_read_by(first)}"
    )


def _read_by(first: str) -> str:
    """Words on the format that reads a stamp: of a year of two digits its own, of others any."""
    if _WRITTEN.fullmatch(first):
        return f'time_format="{_format_of(first, "%d", "%m")}" reads a year of two digits'
    return 'time_format="%H-%M-%S" or the like reads others'


def _format_of(first: str, *order: str) -> str:
    """Format of a stamp whose date has day and month in an order."""
    found = _WRITTEN.fullmatch(first)
    if found is None:
        return "/".join([*order, "%Y"]) + " ..."
    mark, year, space, seconds, comma = found.groups()
    date = mark.join([*order, "%Y" if len(year) > 2 else "%y"])
    return date + (f"{space}%H:%M{':%S' if seconds else ''}{f'{comma}%f' if comma else ''}" if space else "")


def _refuse_two_meanings(first: str, texts: list[str], where: str, place: Callable[[int], str]) -> None:
    """Refuse 1/2/2026, of which either may be the month, and 10:30, which may be hours or minutes."""
    if _SLASHES.fullmatch(first):
        day, month = (f'"{_format_of(first, *order)}"' for order in (("%d", "%m"), ("%m", "%d")))
        for k, text in enumerate(texts):
            found = _SLASHES.fullmatch(text)
            if found and (over := [int(found[j]) > _MONTHS for j in (1, 2)]) != [False, False]:
                said = day if over[0] else month
                raise ValueError(
                    f"{where}: time must say which is the month; {text!r} in {place(k)} shows that it is the"
                    f" {'second' if over[0] else 'first'}: time_format={said}"
                )
        raise ValueError(
            f"{where}: time must say which is the month; {first!r} in {place(0)} may be either:"
            f" time_format={day} or {month}"
        )
    if _TWO.fullmatch(first):
        raise ValueError(
            f'{where}: time must say what {first!r} in {place(0)} is: time_format="%H:%M" or "%M:%S"'
        )


def _dated(text: str) -> str:
    """A time of day with a date, which ISO 8601 requires."""
    found = _OF_DAY.fullmatch(text)
    return f"1970-01-01T{int(found[1]):02d}{found[2]}" if found else text


def _year_first(text: str) -> str:
    return _DOTS.sub(r"\3-\2-\1\4", text)


def _with_dashes(text: str) -> str:
    return text.replace("/", "-")


_FORMS: tuple[tuple[re.Pattern[str], Callable[[str], str], str], ...] = (
    (_OF_DAY, _dated, "a time of day"),
    (_DOTS, _year_first, "a time such as 31.12.2026 23:59:59,123"),
    (_ISO, _with_dashes, "a time such as 2026-12-31T23:59:59.123"),
)
"""How stamps are written, how each becomes ISO 8601, and what a row must be."""


def _padded(text: str) -> str:
    """Month, day and hour with two digits, and a point for the comma of seconds."""
    text = re.sub(r"(?<![\d.,])(\d)(?=[-:T ]|$)", r"0\1", text.replace(",", "."))
    return re.sub(r"\s+", " ", text)


def _parsed(
    told: list[str], texts: list[str], form: str, where: str, place: Callable[[int], str], rule: str
) -> Nanoseconds:
    import pandas as pd

    def parsed(ready: list[str]) -> Column:
        found = pd.to_datetime(pd.Series(ready, dtype=object), format=form, errors="coerce", utc=True)
        return np.array(found.dt.tz_localize(None).to_numpy("datetime64[ns]"))

    times = parsed(texts)
    lost = np.flatnonzero(np.isnat(times))
    if lost.size and form == "ISO8601":
        times[lost] = parsed([_padded(texts[k]) for k in lost])
    return _checked(times, told, where, place, rule)


def _checked(
    times: Column, told: Column | list[str], where: str, place: Callable[[int], str], rule: str
) -> Nanoseconds:
    bad = np.flatnonzero(np.isnat(times))
    if bad.size:
        raise ValueError(
            f"{where}: time must be {rule} in each row; got {str(told[bad[0]])!r} in {place(int(bad[0]))}"
            " (time_format= reads others)"
        )
    return times.astype("datetime64[ns]").astype(np.int64)


def unrolled(found: Stamps) -> npt.NDArray[np.float64]:
    """Seconds from the first row of a part; of a day, a fall by more than 12 h is midnight."""
    time = found.time
    if found.of_day and time.size:
        days = np.concatenate([[0], np.cumsum(np.diff(time) < -DAY // 2)])
        time = time + days * DAY
    return (time - time[0]) / 1e9 if time.size else time.astype(float)
