"""Page of a reference cylinder: limits, parameters, axis, certificate, picture."""

import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from centering.roundness._cylinder import CYLINDERS, Cylinder
from centering.roundness._profile_sheet import limit_of
from centering.roundness._ront_verdict import without_interval
from sdpgrind.base.sheets import page
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Block, Heading, Picture, Sentences
from sdpgrind.base.sheets.origin import versions_table
from sdpgrind.base.sheets.record_page import SIGNATURE, arrays_digest
from sdpgrind.base.units import UM

CYL = {"CYLt": "cyl_t", "CYLp": "cyl_p", "CYLv": "cyl_v", "CYLq": "cyl_q"}  # source: ISO 12180-1
NO_INTERVAL = "No interval is measured for cylinders: their limits are not decided."


def report(
    cylinder: Cylinder, path: str | os.PathLike[str] | None, limits: Mapping[Any, float] | None
) -> str:
    """Write the page of a cylinder, or return its text."""
    given = {name: limit_of(name, each, CYL) for name, each in (limits or {}).items()}
    found = [
        verdict(f"{name} ({cylinder.kind})", getattr(cylinder, CYL[name]), each)
        for name, each in given.items()
    ]
    return page.report(f"Cylinder: {CYLINDERS[cylinder.kind]}", _blocks(cylinder, found), path)


def _blocks(cylinder: Cylinder, verdicts: list[str]) -> Iterator[Block]:
    size = f"CYLt ({cylinder.kind}) {UM * cylinder.cyl_t:.4g} µm as measured"
    yield Sentences(verdicts or [size], strong=True)
    rows = [Amounts.of(name, [f"{UM * getattr(cylinder, field):.4g}"]) for name, field in CYL.items()]
    yield AmountTable("Parameters (ISO 12180-1)", rows, ("parameter", "µm"))
    yield Sentences([NO_INTERVAL])
    yield AmountTable("Axis, radius and points", _axis(cylinder), ("what", "is"))
    yield Sentences([cylinder.certificate])
    yield Picture("Deviations of the sections, magnified, over the height", cylinder.plot)
    yield Heading("Origin")
    yield Sentences(["points of sections: the page of the sections tells files, steps and filter"])
    yield versions_table()
    yield Sentences([f"sha256 of the arrays: {arrays_digest(cylinder._written())}"])
    yield SIGNATURE


def _axis(cylinder: Cylinder) -> list[Amounts]:
    """Rows on the place of the cylinder, mm and µm/mm."""
    x, y = (f"{each:.6g}" for each in np.round(cylinder.axis[:2], 9) + 0.0)
    u, v = (f"{UM * each:.4g}" for each in np.round(cylinder.axis[2:], 12) + 0.0)
    tip = f"{abs(cylinder.tip_radius):g}" if cylinder.tip_radius else "not given"
    rows = {
        "cylinder": f"{cylinder.kind}, {CYLINDERS[cylinder.kind]}",
        "radius [mm]": f"{cylinder.radius:.8g}",
        "axis at height 0 [mm]": f"{x}, {y}",
        "tilt [µm/mm]": f"{u}, {v}",
        "taper, slope of the radius [µm/mm]": f"{UM * cylinder.taper:.4g}",
        "points": len(cylinder.points),
        "radius of the tip [mm]": tip,
    }
    return [Amounts.of(name, [each], heading=name) for name, each in rows.items()]


def verdict(name: str, value: float, limit: float) -> str:
    """Sentence on a value (mm) without an interval, and its limit (mm)."""
    return f"{name} {UM * value:.4g} µm, limit {UM * limit:.4g} µm: {without_interval(value, limit)}"
