"""Page of sections: limits, four reference cylinders, run-out and median line, each section, its origin."""

import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from centering.roundness._cylinder import CYLINDERS, Cylinder
from centering.roundness._cylinder_sheet import CYL, NO_INTERVAL, verdict
from centering.roundness._origin import remarks_on
from centering.roundness._profile_sheet import limit_of
from sdpgrind.base.by_name import called
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Block, Heading, Listing, Picture, Sentences

_SHAPE = {"total run-out": "total_runout", "straightness": "straightness", "coaxiality": "coaxiality"}
_TO_DATUM = ("total run-out", "coaxiality")
_SPINDLE, _OWN = ", to the spindle's axis", ", to the part's own (LSC cylinder)"
_OF_SECTIONS = ("straightness", "coaxiality")
_NAMES = {f"{name} ({kind})": (name, kind) for kind in CYLINDERS for name in CYL}
_NAMES |= {name: (name, "LSC") for name in CYL}  # as on the page of a profile


def report(sections: Any, path: str | os.PathLike[str] | None, limits: Mapping[Any, float] | None) -> str:
    """Write the page of sections, or return its text."""
    given = {name: limit_of(name, each, _NAMES | _SHAPE) for name, each in (limits or {}).items()}
    found = _cylinders(sections)
    verdicts = [verdict(name, _value(sections, found, name), each) for name, each in given.items()]
    more = (*_blocks(sections, found, verdicts), *_origin(sections))
    return str(called("sdpgrind.base.sheets.record_page:report", sections, path, more))


def _cylinders(sections: Any) -> dict[str, Cylinder]:
    """Cylinders that the readings have."""
    found = {}
    for kind in CYLINDERS:
        try:
            found[kind] = sections.cylinder(kind)
        except ValueError:  # nothing holds such a cylinder
            continue
    return found


def _value(sections: Any, found: Mapping[str, Cylinder], asked: str) -> float:
    """What a limit is of, mm."""
    if asked in _SHAPE:
        return float(getattr(sections, _SHAPE[asked])())
    name, kind = _NAMES[asked]
    if kind not in found:
        sections.cylinder(kind)  # raises, and says why
    return float(getattr(found[kind], CYL[name]))


def _blocks(sections: Any, found: Mapping[str, Cylinder], verdicts: list[str]) -> Iterator[Block]:
    yield Sentences([*verdicts, NO_INTERVAL], strong=bool(verdicts))
    columns = {name: [getattr(each, field) for each in found.values()] for name, field in CYL.items()}
    radii = [f"{each.radius:.8g}" for each in found.values()]
    yield AmountTable(
        "Cylindricity about each reference cylinder (ISO 12180-1)",
        [
            Amounts.of("cylinder", found),
            *(Amounts.of(name, values, "mm") for name, values in columns.items()),
            Amounts.of("radius", radii, heading="radius [mm]"),
        ],
    )
    yield AmountTable("Run-out, coaxiality and median line", [*_shape(sections, found)], ("what", "value"))
    if sections.profiles:
        yield _each(sections, found)
    if (zone := found.get("MZC")) is not None:
        yield Sentences([zone.certificate])
        yield Picture("Deviations from the minimum zone, magnified, over the height", zone.plot)


def _shape(sections: Any, found: Mapping[str, Cylinder]) -> Iterator[Amounts]:
    """Run-out and coaxiality to the spindle's axis and to the part's own, whose tilt is not in them."""
    for name, field in _SHAPE.items():
        if not sections.profiles and name in _OF_SECTIONS:
            continue
        measure = getattr(sections, field)
        yield Amounts.of(name, [measure()], "mm", name if name not in _TO_DATUM else f"{name}{_SPINDLE}")
        if name in _TO_DATUM and (own := found.get("LSC")) is not None:
            yield Amounts.of(f"{name}{_OWN}", [measure(own)], "mm")


def _each(sections: Any, found: Mapping[str, Cylinder]) -> AmountTable:
    """A row for each section; intervals of RONt where they are known; run-out about both axes."""
    circles = [profile.roundness() for profile in sections.profiles]
    ends = [None if each.why_no_interval else each.interval() for each in circles]
    columns = [Amounts.of("section", sections.names)] if sections.names else []
    columns += [
        Amounts.of("height", [f"{each:g}" for each in sections.heights], heading="height [mm]"),
        Amounts.of("radius", [f"{each.radius:.8g}" for each in circles], heading="radius [mm]"),
        Amounts.of("offset", [each.offset for each in circles], "mm"),
        Amounts.of("RONt", [each.ron_t for each in circles], "mm"),
    ]
    told = "no interval is measured"
    if any(each is not None for each in ends):
        told = "from, to: 95 % interval"
        columns += [
            Amounts.of(head, [np.nan if each is None else getattr(each, name) for each in ends], "mm", head)
            for head, name in (("from", "low"), ("to", "high"))
        ]
    columns.append(
        Amounts.of("runout", [each.radial_runout() for each in sections.profiles], "mm", "run-out")
    )
    if (own := found.get("LSC")) is not None:
        pairs = zip(sections.profiles, sections.heights, strict=True)
        runouts = [profile.radial_runout(own, heights=float(height)) for profile, height in pairs]
        columns.append(Amounts.of("own_runout", runouts, "mm", "run-out about own axis"))
    told += "; circular run-out about the axes of the spindle and of the least squares cylinder"
    return AmountTable(f"Roundness of each section about its least squares circle ({told})", columns)


def _origin(sections: Any) -> Iterator[Block]:
    """Filter, steps, remarks and files of all sections, each once."""
    profiles = sections.profiles
    filters = dict.fromkeys(profile._origin.filter or "none: all undulations" for profile in profiles)
    lines = [f"filter: {told}" for told in filters] or ["filter: none: all undulations"]
    names = sections.names or [""] * len(profiles)
    for profile, height, name in zip(profiles, sections.heights, names, strict=True):
        told = [f"step: {each}" for each in profile.steps]
        told += remarks_on(profile.roundness().origin)
        place = f"section {name}, height {height:g} mm" if name else f"height {height:g} mm"
        lines += [f"{place}, {each}" for each in told]
    yield Heading("How it was measured")
    yield Sentences(lines)
    yield Heading("Source of the data")
    sources = dict.fromkeys(str(each.source) for each in profiles if each.source is not None)
    yield Listing("\n".join(sources) or "not read from a file: arrays of a program")
