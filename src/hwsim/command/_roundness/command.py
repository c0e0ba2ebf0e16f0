"""``hwsim roundness ring.csv --deviation dev:um --radius 30``: a tester's file, its RONt, a sheet to sign."""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hwsim.command._times import TIMES
from hwsim.command._work import announce

NOT_ACCEPTED = 1  # exit status where a limit is not known to be kept; chosen: 2 is wrong input
_ARC_LENGTH = ".x3p"  # a profile over the length of arc, without angles
_UNFILTERED, _UPR = "none", 50
_FILTERS = ("gaussian", "spline", "2rc", "robust", _UNFILTERED)
_CIRCLES = ("LSC", "MZC", "MCC", "MIC")
_TABLE = "instrument"  # of a file of errors of the tester
_LENGTHS = ("radius", "limit", "height", "tip_radius")  # mm, with a unit behind them if it is another


def add_roundness(subparsers: Any) -> None:
    """Add the command to the subparsers."""
    about = "roundness of a ring from a tester's file, with an interval and a sheet to sign"
    parser = subparsers.add_parser(
        "roundness",
        help=about,
        description="Read a turn of a form tester, filter it, fit a reference circle, and decide on a limit.",
        epilog="Columns are given as NAME:UNIT, or as NAME where the file has the unit; lengths in mm, or "
        "with a unit, which a limit must have: 2.5um. Exit status: 0 done, 1 the limit is exceeded or not "
        "decided, 2 wrong input.",
    )
    parser.add_argument("file", type=Path, metavar="ring.csv", help="text, .tdms, .h5 or .x3p")
    parser.add_argument("--angle", metavar="NAME:UNIT", help="column of the spindle angle (the only one)")
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument("--deviation", metavar="NAME:UNIT", help="column of deviations from the radius")
    shown.add_argument("--reading", metavar="NAME:UNIT", help="column of radial positions")
    parser.add_argument("--section", metavar="NAME=WORD", help="column of sections, and which of them")
    parser.add_argument("--radius", metavar="R", help="nominal radius of deviations")
    parser.add_argument("--tip-radius", metavar="R", default="0", help="radius of the probe's tip (0)")
    parser.add_argument("--internal", action="store_true", help="a bore, read from within")
    parser.add_argument(
        "--remove-asperities", action="store_true", help="take dust and burrs out, and say so"
    )
    parser.add_argument("--filter", choices=_FILTERS, default="gaussian", help="filter (gaussian)")
    parser.add_argument("--upr", help="cut-off, or a band as 15-150 (50)")
    parser.add_argument("--circle", choices=_CIRCLES, default="LSC", help="reference circle (LSC)")
    parser.add_argument("--limit", metavar="RONT", help="limit of RONt: accepted, rejected or not decided")
    parser.add_argument("--instrument", type=Path, metavar="t.toml", help="errors of the tester")
    parser.add_argument("--height", metavar="H", help="height of the section above the table")
    parser.add_argument("--report", type=Path, metavar="ring.html", help="write the sheet to sign")
    parser.set_defaults(work=work)


def work(arguments: argparse.Namespace) -> int:
    """Carry out the command and return the exit status: 0, or 1 where the limit is not known to be kept."""
    times = TIMES["roundness"]
    first = "" if times.on_disk else f", first time on this machine + {times.compiling:.0f} s to compile"
    announce(f"about {times.rest:.0f} s{first}")
    lengths = {name: _length(name, getattr(arguments, name)) for name in _LENGTHS}
    profile = _profile(arguments, lengths)
    profile = profile.remove_asperities() if arguments.remove_asperities else profile
    circle = _filtered(profile, arguments).roundness(arguments.circle)
    instrument = None if arguments.instrument is None else _instrument(arguments.instrument)
    budget = None if instrument is None else circle.budget(instrument, height=lengths["height"])
    limit = lengths["limit"]
    found = None if limit is None else (budget or circle).conforms(limit)
    for line in _lines(profile, circle, budget, limit, found):
        print(line)
    if arguments.report is not None:
        limits = None if limit is None else {"RONt": limit}
        print(f"sheet   {circle.report(arguments.report, limits=limits, **_tester(instrument, lengths))}")
    return 0 if found in (None, "accepted") else NOT_ACCEPTED


def _tester(instrument: Any, lengths: dict[str, float | None]) -> dict[str, Any]:
    return {} if instrument is None else {"instrument": instrument, "height": lengths["height"]}


def _length(name: str, given: str | None) -> float | None:
    """A length in mm; a number alone is in mm, but of a limit, which is told in micrometres."""
    if given is None:
        return None
    from sdpgrind.base.unit_text import quantity

    option = f"--{name.replace('_', '-')}"
    try:
        number = float(given)
    except ValueError:
        return quantity(option, given, "mm")
    if name == "limit":
        raise ValueError(f"{option} must have its unit, as 2.5um or 0.0025mm; got {given!r}")
    return number


def _profile(arguments: argparse.Namespace, lengths: dict[str, float | None]) -> Any:
    from centering.roundness import Profile

    columns = {name: _column(getattr(arguments, name)) for name in ("angle", "deviation", "reading")}
    columns["angle"] = columns["angle"] or _only_angle(arguments.file)
    shape = {"tip_radius": lengths["tip_radius"] or 0.0, "internal": arguments.internal}
    if arguments.section is not None:
        columns["section"] = _section(arguments.section)
    return Profile.read(arguments.file, radius=lengths["radius"], **columns, **shape)


def _only_angle(path: Path) -> str | None:
    """The column of angles where a table has one, with its unit; None: an even turn."""
    from sdpgrind.base.columns.angles import angle_headings
    from sdpgrind.base.columns.taken import Rules

    if path.suffix.lower() == _ARC_LENGTH:
        return None
    heads = [head for _, head in angle_headings(path, Rules(period=1.0))]
    if len(heads) > 1 or (heads and not heads[0].unit):
        told = ", ".join(repr(head.header) for head in heads)
        raise ValueError(f"--angle must name one column with its unit, as phi:deg; {path.name} has {told}")
    return heads[0].name if heads else None


def _section(given: str) -> tuple[str, str]:
    name, sign, word = given.partition("=")
    if not sign:
        raise ValueError(f"--section must be a column and one of its words, as nr=1; got {given!r}")
    return name, word


def _column(given: str | None) -> Any:
    """Header of a column, with its unit if one is given behind a colon."""
    if given is None or ":" not in given:
        return given
    name, _, unit = given.rpartition(":")
    return name, unit


def _filtered(profile: Any, arguments: argparse.Namespace) -> Any:
    if arguments.filter == _UNFILTERED:
        if arguments.upr is not None:
            raise ValueError(f"--upr must be left out with --filter none; got {arguments.upr!r}")
        return profile
    try:
        upr: Any = float(arguments.upr or _UPR)
    except ValueError:
        upr = arguments.upr  # the name of a band
    return profile.filter(arguments.filter, upr=upr)


def _instrument(path: Path) -> Any:
    """The instrument of a file: its keys, or those of its table [instrument]."""
    from centering.roundness import Instrument
    from hwsim.command._toml import read

    return read(path, lambda table: (table.table(_TABLE) if table.has(_TABLE) else table).one(Instrument))


def _lines(profile: Any, circle: Any, budget: Any, limit: float | None, found: str | None) -> Iterator[str]:
    """A fact a line."""
    yield f"file    {profile.source.files[0].name}: {len(profile.angle)} points"
    yield from (f"step    {step}" for step in profile.steps)
    yield f"filter  {circle.filter or 'none: all undulations'}"
    yield f"circle  {circle!r}"
    if budget is not None:
        yield f"budget  {budget!r}"
    if limit is not None:
        yield f"limit   {1e3 * limit:g} µm: {found}"
