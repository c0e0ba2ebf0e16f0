"""What a caller asks for: header, unit and factor of each quantity, bound to the headings of a sheet."""

import math
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from sdpgrind.base import checks
from sdpgrind.base.columns.sheet import UNNAMED, ColumnHead, Sheet, is_unit
from sdpgrind.base.columns.table import COMMAND, COMMANDED, TEXT, quantity_of
from sdpgrind.base.unit_text import factor, near
from sdpgrind.base.warned import warn

_DIAMETER = "Øø⌀∅"  # signs of a diameter; source: drawings and headers of gauges
POSITION = "of a position its slope is the rate, numpy.gradient(position, time)"
"""What to do with a column of positions where a rate is asked for."""
_FORMS = '"header", ("header", "unit") or ("header", "unit", factor)'


class Request(NamedTuple):
    """A quantity by the name of the argument, as the file calls it; unit None: that of the file."""

    name: str
    header: str
    unit: str | None = None
    factor: float = 1.0

    @property
    def column(self) -> str:
        """Name of the column: a command ends so."""
        return self.name + COMMAND if self.name == COMMANDED else self.name


class Bound(NamedTuple):
    """A request with its column in a sheet, and the factor from what is recorded to what is meant."""

    request: Request
    place: int
    heading: ColumnHead
    unit: str  # as in the call or the file
    origin: str  # where the unit came from
    factor: float

    def call(self, unit: str | None = None, times: float = 1.0) -> str:
        """Argument that would read this column in another unit, or `times` another factor."""
        other = self.request.factor * times
        unit = unit or self.unit
        more = f", {other:.6g}" if not math.isclose(other, 1.0) else ""
        header = self.heading.name or self.heading.header
        return f'{self.request.name}=("{header}", "{unit}"{more})'


def request_of(name: str, asked: Any) -> Request:
    """Return the request of an argument."""
    values = (asked,) if isinstance(asked, str) else tuple(asked) if isinstance(asked, tuple | list) else ()
    if not 1 <= len(values) <= 3 or not isinstance(values[0], str):
        raise TypeError(f"{name} must be {_FORMS}; got {checks.shown(asked)}")
    unit = values[1] if len(values) > 1 else None
    if unit is not None and not isinstance(unit, str):
        raise TypeError(f"{name} must be {_FORMS}; its unit is {checks.shown(unit)}")
    scale = checks.number(f"factor of {name}", values[2]) if len(values) > 2 else 1.0
    if scale == 0:
        raise ValueError(f"factor of {name} must be other than 0; got 0")
    if unit is not None and unit_of_name(name) != TEXT:
        if name == "time" and not is_unit(unit):
            raise ValueError(
                f'time must be one column, ("header", "s") with its unit; got {values!r}: {unit!r} is no unit'
                f' of time; of a date and a time of day in two columns the second is enough, time="{unit}"'
            )
        _factor(name, unit, "")
    return Request(name, values[0].strip(), unit, scale)


def requests_of(columns: Mapping[str, Any]) -> list[Request]:
    """Requests of all columns; two for one quantity are refused."""
    found = [request_of(name, asked) for name, asked in columns.items()]
    checks.unique("columns", [each.column for each in found])
    return found


def unit_of_name(name: str) -> str:
    """Unit of a quantity; of time s, of a part text."""
    return {"time": "s", "part": TEXT}.get(name) or quantity_of(name).unit


def _factor(name: str, written: str, where: str) -> float:
    try:
        return factor(written, unit_of_name(name))
    except ValueError as error:
        raise ValueError(f"{where}{name} must {error}{_of_position(name, written)}") from None


def _of_position(name: str, written: str) -> str:
    """What makes a rate of a position, if a rate is asked for in the unit of one; else nothing."""
    try:
        factor(written, "mm")
    except ValueError:
        return ""
    return f": {POSITION}" if unit_of_name(name) == "mm/s" else ""


def place_of(request: Request, sheet: Sheet) -> int:
    """Place of the heading that a request means."""
    places = [k for k, each in enumerate(sheet.headings) if each.header == request.header]
    places = places or [k for k, each in enumerate(sheet.headings) if each.name == request.header]
    if not places or not request.header:
        held = f"its headers are {sheet.listed()}{_of_preamble(sheet)}{sheet.named_above(request.header)}"
        raise ValueError(
            f"{sheet.where}: {request.name} must be one of its columns; got {request.header!r}, {held}"
        )
    if len(places) > 1:
        raise ValueError(
            f"{sheet.where}: {request.name} must be one column; the header {request.header!r} stands"
            f" {len(places)} times among {sheet.listed()}"
        )
    return places[0]


def _of_preamble(sheet: Sheet) -> str:
    """What to say where pandas took a title, or no row at all, for the names of a spreadsheet."""
    headers = [each.header for each in sheet.headings]
    if any(header.startswith(UNNAMED) for header in headers) or all(map(str.isdigit, headers)):
        return ": of names in the third row of a spreadsheet say pandas.read_excel(..., header=2)"
    return ""


def bound(request: Request, sheet: Sheet) -> Bound:
    """Bind a request to a sheet; a unit is that of the call, else that of the file, never a guess."""
    place = place_of(request, sheet)
    heading, ours = sheet.headings[place], unit_of_name(request.name)
    if ours == TEXT:
        return Bound(request, place, heading, "", "", 1.0)
    where = f"{sheet.where}, column {heading.header!r}: "
    if request.unit is not None:
        _warn_of_two(request, heading, where, ours)
        scale = _factor(request.name, request.unit, where)
        return Bound(request, place, heading, request.unit, "call", scale * request.factor)
    if heading.unit is None:
        if not ours:
            return Bound(request, place, heading, "1", "quantity", request.factor)
        raise ValueError(no_unit(request, heading, where))
    _refuse_diameter(request, heading, where)
    scale = _factor(request.name, heading.unit, where)
    return Bound(request, place, heading, heading.unit, heading.origin, scale * request.factor)


def _refuse_diameter(request: Request, heading: ColumnHead, where: str) -> None:
    """Refuse a unit with the sign of a diameter: what share of it is meant stands in the call."""
    written = heading.unit or ""
    unit = re.sub(f"[{_DIAMETER}]", "", written).strip()
    if unit != written and is_unit(unit):
        call = f'{request.name}=("{heading.name}", "{unit}"'
        raise ValueError(
            f"{where}{request.name} must have its factor in the call where the file says a diameter,"
            f" {written!r}: {call}, 0.5) for half of it, {call}, -0.5) for half of what is left on it,"
            f" {call}) for all of it"
        )


def no_unit(request: Request, heading: ColumnHead, where: str) -> str:
    """Refusal of a column without unit, with the call that would do."""
    ours = unit_of_name(request.name)
    more = "" if request.factor == 1.0 else f", {request.factor:g}"
    told = _unit_at_the_end(heading.header, ours)
    others = ", ".join(unit for unit in (ours, *near(ours)) if unit != (told or ours))
    call = f'{request.name}=("{heading.header}", "{told or ours}"{more})'
    return (
        f"{where}{request.name} must have a unit; say {call}"
        + (", as the header seems to say," if told else "")
        + f" or another such as {others}"
    )


def _unit_at_the_end(header: str, ours: str) -> str | None:
    """Unit of the right kind that a header ends with, as "Ist um" or "x_um" does; None: none."""
    last = re.split(r"[\s_,;:]+", header)[-1]
    try:
        factor(last, ours)
    except ValueError:
        return None
    return last if last != header else None


def _warn_of_two(request: Request, heading: ColumnHead, where: str, ours: str) -> None:
    """Warn where the call gives another unit than the file."""
    if heading.unit is None or request.unit is None:
        return
    try:
        same = math.isclose(factor(heading.unit, ours), factor(request.unit, ours))
    except ValueError:
        same = False
    if not same:
        warn(
            f"{where}{request.name} is taken in {request.unit} as the call says; the file says {heading.unit}"
        )
