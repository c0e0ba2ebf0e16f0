"""Angles and readings of a ring from files of form testers and tables."""

import dataclasses
import os
from collections.abc import Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from centering.roundness._gone_round import (
    refuse_part_of_a_turn,
    refuse_unlike_turns,
    refuse_unnamed_angle,
    warn_of_sections,
)
from centering.roundness._part_readings import TIP
from centering.roundness._sampling import even_turn
from centering.roundness._turn import UNKNOWN_RADIUS, assumed_radius, refuse_rough
from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.columns.plausible import refuse_other_length, refuse_other_units
from sdpgrind.base.columns.read import Recorded, opened, read
from sdpgrind.base.columns.request import Bound, bound, request_of
from sdpgrind.base.columns.sheet import Column
from sdpgrind.base.columns.source import ColumnNote, Source
from sdpgrind.base.columns.table import quantity_of
from sdpgrind.base.columns.taken import Rules
from sdpgrind.base.units import m

_ARC_LENGTH = ".x3p"
_LEAST = 4  # derived: readings of a section that determine its circle, as of a profile
_APART = 0.5  # chosen: of the distance of two sections; readings of one that scatter farther are a helix
_OTHER_ANGLE = "angle in another unit, or factor 2?"


class ReadSection(NamedTuple):
    """Points of one section, its height (mm), and its name in the file, if it has one there."""

    turned: "Turned"
    height: float
    name: str


class Turned(NamedTuple):
    """Angles (rad) and readings (mm) in the order of a file, and their origin."""

    angle: Floats
    reading: Floats
    source: Source
    height: Floats | None = None  # mm, of each point; None: one section
    section: Column | None = None  # words of the section of each point
    radius_known: bool = True

    def only(self, kept: Bools) -> "Turned":
        """Return some of the points."""
        height, section = (None if each is None else each[kept] for each in (self.height, self.section))
        return self._replace(
            angle=self.angle[kept], reading=self.reading[kept], height=height, section=section
        )

    def known(self) -> "Turned":
        """Return the points with an angle and a reading; the others are counted."""
        height = np.zeros(self.angle.size) if self.height is None else self.height
        kept = np.isfinite(self.angle) & np.isfinite(self.reading) & np.isfinite(height)
        left_out = self.source.rows_left_out + int(np.sum(~kept))
        return self.only(kept)._replace(source=dataclasses.replace(self.source, rows_left_out=left_out))

    def sections(self, plausible: bool) -> list[ReadSection]:
        """Return the sections, from the lowest on."""
        file = self.source.files[0].name
        found = []
        for level, kept in _levels(self, file):
            own = self.only(kept)
            name = "" if own.section is None else str(own.section[0])
            if plausible:
                refuse_part_of_a_turn(own.angle, f"{file}, height {level:g} mm", _OTHER_ANGLE)
            found.append(ReadSection(own._replace(height=None, section=None), level, name))
        return found


def _levels(turned: Turned, file: str) -> list[tuple[float, Bools]]:
    """Height (mm) of each section, and which points are its own; heights that are no sections are refused."""
    heights = turned.height
    assert heights is not None
    keys = heights if turned.section is None else turned.section
    _, of_point, counts = np.unique(keys, return_inverse=True, return_counts=True)
    pieces = [of_point == k for k in range(counts.size)]
    levels = np.array([heights[piece].mean() for piece in pieces])
    scatter = max((float(np.ptp(heights[piece])) for piece in pieces), default=0.0)
    apart = float(np.diff(np.sort(levels)).min(initial=np.inf))
    if counts.min(initial=_LEAST) < _LEAST or scatter > _APART * apart:
        got = (
            f"{counts.size} heights in {heights.size} rows"
            if turned.section is None
            else f"up to {scatter:.4g} mm within one of {counts.size} sections, {apart:.4g} mm apart"
        )
        raise ValueError(
            f"{file}: height must be the same for all readings of a section; got {got}:"
            " Sections.from_points takes readings along a helix or a line"
        )
    return sorted(zip(levels.tolist(), pieces, strict=True), key=itemgetter(0))


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
    *,
    height: Any = None,
    section: Any = None,
    centred: bool = False,
) -> Turned:
    """Return angles (rad) and readings (mm) of a file or a table, without those that are missing.

    With a column of heights (mm) they are of several sections, each with its own words in the column
    `section` where that is given. Without heights `section` is header and word of the one to be read.
    """
    rules = Rules(period=1.0, group=group, missing=missing, plausible=plausible)
    nominal = None if radius is None else checks.positive("radius", radius, "mm")
    tip = checks.nonnegative("tip_radius", tip_radius, "mm")
    if plausible:
        refuse_other_length("radius", nominal or 0.0, quantity_of("reading"))
        refuse_other_length("tip_radius", tip, TIP)
    if isinstance(data, str | os.PathLike) and Path(data).suffix.lower() == _ARC_LENGTH:
        if height is not None or section is not None:
            raise ValueError(
                f"data must be a table with a column of sections; {Path(data).name} holds one section"
            )
        ring = _of_arc(data, angle, reading, deviation, nominal, rules).known()
        if plausible and nominal is not None:
            refuse_part_of_a_turn(
                ring.angle, Path(data).name, f"is radius a diameter? Say radius={nominal / 2:g}"
            )
            refuse_unlike_turns(ring.angle, ring.reading, nominal, Path(data).name)
        return ring
    asked = _asked(angle, reading, deviation, nominal, centred)
    if angle is None:
        refuse_unnamed_angle(data, rules)
    if height is not None:
        asked |= {"height": height} | ({} if section is None else {"section": section})
    elif section is not None:
        asked |= {"section": _pair(section)[0]}
    found = read(data, asked, rules=rules)
    wanted = None if height is not None or section is None else _pair(section)[1]
    ring = _of_columns(found, nominal, wanted, plausible)
    _refuse_lost_angles(ring, missing)
    ring = ring.known()
    if plausible and height is None and section is None:
        warn_of_sections(data, rules, found.columns.get("angle", np.zeros(1)))
    if plausible and height is None:
        refuse_part_of_a_turn(ring.angle, ring.source.files[0].name, _OTHER_ANGLE)
    return ring


def _refuse_lost_angles(ring: Turned, missing: Sequence[str]) -> None:
    """Refuse a word for no reading that takes angles away from readings, as 0 does that of the first row."""
    lost = int(np.sum(~np.isfinite(ring.angle) & np.isfinite(ring.reading)))
    if missing and lost:
        raise ValueError(
            f"{ring.source.files[0].name}: angle must be told where a reading is; it is not in {lost} rows,"
            f" as missing={list(missing)} is for all columns: make none of it in a table (pandas: .mask)"
        )


def _pair(section: Any) -> tuple[str, str]:
    """Header of the sections, and the word of one of them."""
    if not isinstance(section, tuple) or len(section) != 2 or not isinstance(section[0], str):
        raise TypeError(f'section must be header and section, as ("section", 3); got {checks.shown(section)}')
    header, wanted = section
    whole = isinstance(wanted, float) and wanted.is_integer()
    return header, str(int(wanted) if whole else wanted).strip()


def _asked(angle: Any, reading: Any, deviation: Any, nominal: float | None, centred: bool) -> dict[str, Any]:
    """Columns to read: the angle if named, and the reading or its deviation from a nominal radius (mm)."""
    wanted = {"reading": reading, "deviation": deviation}
    asked = {name: value for name, value in wanted.items() if value is not None}
    if len(asked) != 1:
        got = ", ".join(["angle"] * (angle is not None) + list(asked)) or "none"
        raise ValueError(
            'angle must be named, and either reading or deviation, as angle=("angle", "deg"),'
            f' deviation=("dev", "um"); got {got}'
        )
    if (deviation is None) != (nominal is None) and not (centred and reading is None):
        rule = "the nominal radius of deviations" if nominal is None else "left out where readings are radii"
        raise checks.refuse("radius", rule, nominal, "mm")
    return ({} if angle is None else {"angle": angle}) | asked


def _of_columns(found: Recorded, nominal: float | None, wanted: str | None, plausible: bool) -> Turned:
    """Angles and readings of columns, of the section that is `wanted`; times of their rows mean nothing."""
    columns, told = dict(found.columns), list(found.source.notes)
    if wanted is not None:
        kept = _rows_of(columns.pop("section"), wanted, found.source.files[0].name)
        columns = {name: values[kept] for name, values in columns.items()}
        told.append(f"section {wanted}: {int(kept.sum())} of {kept.size} rows")
    if "deviation" in columns:
        radius, known = _nominal(columns["deviation"], nominal, plausible)
        readings = columns["deviation"] + radius
        told.append(f"reading = {radius:g} mm + deviation" if known else UNKNOWN_RADIUS)
    else:
        readings, known = columns["reading"], True
    if "angle" not in columns:
        columns["angle"] = _even(found, columns.get("section", columns.get("height")), readings.size)
        told.append("angle = an even turn that begins at 0")
    notes = tuple(note for note in found.source.columns if note.name != "time")
    source = dataclasses.replace(found.source, columns=notes, commands_at="", gaps=(), notes=tuple(told))
    return Turned(columns["angle"], readings, source, columns.get("height"), columns.get("section"), known)


def _nominal(deviation: Floats, radius: float | None, plausible: bool) -> tuple[float, bool]:
    """Nominal radius (mm), and whether it is known."""
    height = deviation[np.isfinite(deviation)]
    if plausible and radius is not None and height.size:
        refuse_rough(float(np.ptp(height)), radius)
    return (assumed_radius(height), False) if radius is None else (radius, True)


def _rows_of(sections: Column, wanted: str, file: str) -> Bools:
    """Rows of one section."""
    kept = np.array([str(word) == wanted for word in sections.tolist()])
    if not np.any(kept):
        held = ", ".join(repr(word) for word in dict.fromkeys(sections.tolist()))
        raise ValueError(f"{file}: section must be one of {held}; got {wanted!r}")
    return kept


def _even(found: Recorded, of_section: Column | None, size: int) -> Floats:
    """Angles of even turns: of all rows, or of those of each section."""
    if found.source.rows_left_out:
        raise ValueError(
            f"{found.source.files[0].name}: angle must be named where rows were left out, of which an even"
            f" turn would have a gap; got {found.source.rows_left_out} rows left out"
        )
    angle = even_turn(size)
    for key in () if of_section is None else np.unique(of_section):
        own = of_section == key
        angle[own] = even_turn(int(np.sum(own)))
    return angle


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
