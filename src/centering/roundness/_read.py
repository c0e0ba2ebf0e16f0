"""Angles and readings of a ring from files of form testers and tables."""

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from centering.roundness._gone_round import refuse_part_of_a_turn, refuse_unlike_turns
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.plausible import refuse_other_length, refuse_other_units
from sdpgrind.base.columns.read import Recorded, opened, read
from sdpgrind.base.columns.request import Bound, bound, request_of
from sdpgrind.base.columns.sheet import Column
from sdpgrind.base.columns.source import ColumnNote, Source
from sdpgrind.base.columns.table import Meant, quantity_of
from sdpgrind.base.columns.taken import Rules
from sdpgrind.base.units import m

_ARC_LENGTH = ".x3p"
_LEAST = 4  # derived: readings of a section that determine its circle, as of a profile
_OTHER_ANGLE = "angle in another unit, or factor 2?"
_TIP = Meant("mm", 1e-3, 50.0)  # chosen: from a stylus to the roller of a follower


class Turned(NamedTuple):
    """Angles (rad) and readings (mm) in the order of a file, and their origin."""

    angle: Floats
    reading: Floats
    source: Source
    height: Floats | None = None  # mm, of each point; None: one section

    def known(self) -> "Turned":
        """Return the points with an angle and a reading; the others are counted."""
        height = np.zeros(self.angle.size) if self.height is None else self.height
        kept = np.isfinite(self.angle) & np.isfinite(self.reading) & np.isfinite(height)
        left_out = self.source.rows_left_out + int(np.sum(~kept))
        source = dataclasses.replace(self.source, rows_left_out=left_out)
        return Turned(
            self.angle[kept], self.reading[kept], source, None if self.height is None else height[kept]
        )

    def sections(self, plausible: bool) -> list[tuple[float, "Turned"]]:
        """Return the points of each height (mm), from the lowest on."""
        assert self.height is not None
        heights, of_point, counts = np.unique(self.height, return_inverse=True, return_counts=True)
        file = self.source.files[0].name
        if counts.min(initial=_LEAST) < _LEAST:
            raise ValueError(
                f"{file}: height must be the same for all readings of a section; got {heights.size} heights"
                f" in {self.height.size} rows: Sections.from_points takes readings along a helix or a line"
            )
        found = []
        for k, height in enumerate(heights.tolist()):
            angle, reading = self.angle[of_point == k], self.reading[of_point == k]
            if plausible:
                refuse_part_of_a_turn(angle, f"{file}, height {height:g} mm", _OTHER_ANGLE)
            found.append((height, Turned(angle, reading, self.source)))
        return found


def samples(
    data: Any,
    angle: Any,
    reading: Any,
    deviation: Any,
    radius: float | None,
    tip_radius: float,
    group: str | None,
    missing: Sequence[str],
    plausible: bool,
    height: Any = None,
) -> Turned:
    """Return angles (rad) and readings (mm) of a file or a table, without those that are missing.

    With a column of heights (mm) they are of several sections.
    """
    rules = Rules(period=1.0, group=group, missing=missing, plausible=plausible)
    nominal = None if radius is None else checks.positive("radius", radius, "mm")
    tip = checks.nonnegative("tip_radius", tip_radius, "mm")
    if plausible:
        refuse_other_length("radius", nominal or 0.0, quantity_of("reading"))
        refuse_other_length("tip_radius", tip, _TIP)
    if isinstance(data, str | os.PathLike) and Path(data).suffix.lower() == _ARC_LENGTH:
        if height is not None:
            raise ValueError(
                f"data must be a table with a column of heights; {Path(data).name} holds one section"
            )
        ring = _of_arc(data, angle, reading, deviation, nominal, rules).known()
        if plausible and nominal is not None:
            refuse_part_of_a_turn(
                ring.angle, Path(data).name, f"is radius a diameter? Say radius={nominal / 2:g}"
            )
            refuse_unlike_turns(ring.angle, ring.reading, nominal, Path(data).name)
        return ring
    asked = _asked(angle, reading, deviation, nominal) | ({} if height is None else {"height": height})
    ring = _of_columns(read(data, asked, rules=rules), nominal).known()
    if plausible and height is None:
        refuse_part_of_a_turn(ring.angle, ring.source.files[0].name, _OTHER_ANGLE)
    return ring


def _asked(angle: Any, reading: Any, deviation: Any, nominal: float | None) -> dict[str, Any]:
    """Columns to read: the angle, and the reading or its deviation from a nominal radius (mm)."""
    wanted = {"reading": reading, "deviation": deviation}
    asked = {name: value for name, value in wanted.items() if value is not None}
    if angle is None or len(asked) != 1:
        got = ", ".join(["angle"] * (angle is not None) + list(asked)) or "none"
        raise ValueError(
            'angle must be named, and either reading or deviation, as angle=("angle", "deg"),'
            f' deviation=("dev", "um"); got {got}'
        )
    if (deviation is None) != (nominal is None):
        rule = "the nominal radius of deviations" if nominal is None else "left out where readings are radii"
        raise checks.refuse("radius", rule, nominal, "mm")
    return {"angle": angle, **asked}


def _of_columns(found: Recorded, nominal: float | None) -> Turned:
    """Angles and readings of columns; the times of their rows mean nothing."""
    columns, origin = found.columns, found.source
    notes = tuple(note for note in origin.columns if note.name != "time")
    more = () if nominal is None else (f"reading = {nominal:g} mm + deviation",)
    source = dataclasses.replace(origin, columns=notes, commands_at="", gaps=(), notes=(*origin.notes, *more))
    readings = columns["reading"] if nominal is None else columns["deviation"] + nominal
    return Turned(columns["angle"], readings, source, columns.get("height"))


def _of_arc(
    data: Any, angle: Any, reading: Any, deviation: Any, radius: float | None, rules: Rules
) -> Turned:
    """Angles (rad) and readings (mm) of X3P: x is the length of arc, z the deviation, both in m."""
    if radius is None:
        raise ValueError(
            "radius must be the nominal radius of the ring in .x3p (mm): x / radius is the angle; got None"
        )
    if angle is not None or reading is not None:
        raise ValueError(
            "angle and reading must be left out of .x3p: x / radius is the angle, z the deviation"
        )
    files, (sheet,) = opened(data, rules)
    asked = bound(request_of("deviation", "z" if deviation is None else deviation), sheet)
    arc, heights = sheet.take((0, asked.place))
    found = heights * asked.factor
    if rules.plausible:
        bounds: dict[str, Bound] = {"deviation": asked}
        refuse_other_units({"deviation": found}, bounds, sheet.file)
    header, height = sheet.headings[0].header, asked.heading.header
    notes = (
        ColumnNote("angle", "rad", header, "m", "x / radius", m(1.0) / radius, _missing(arc)),
        ColumnNote("deviation", "mm", height, asked.unit, asked.origin, asked.factor, _missing(found)),
    )
    told = f"angle = x / {radius:g} mm, reading = {radius:g} mm + deviation"
    source = Source(tuple(files), notes, 1, found.size, commands_at="", notes=(told,))
    return Turned(m(arc) / radius, found + radius, source)


def _missing(values: Column) -> int:
    return int(np.sum(np.isnan(values)))
