"""``hwsim roundness ring.csv --deviation dev:um --radius 30``: a tester's file, its RONt, a sheet to sign."""

import argparse
from pathlib import Path
from typing import Any

from hwsim.command._roundness import options
from hwsim.command._roundness.facts import Facts
from hwsim.command._roundness.terms import spoken
from hwsim.command._statuses import FAILED, OK
from hwsim.command._times import Outlook

_UNFILTERED, _UPR = "none", 50
_FILTERS = ("gaussian", "spline", "2rc", "robust", _UNFILTERED)
_CIRCLES = ("LSC", "MZC", "MCC", "MIC")
_TABLE = "instrument"  # of a file of errors of the tester
_LENGTHS = ("radius", "limit", "height", "tip-radius", "noise-sd")  # mm, or with a unit behind them


def add_roundness(subparsers: Any) -> None:
    """Add the command to the subparsers."""
    about = "roundness of a ring from a tester's file, with an interval and a sheet to sign"
    parser = subparsers.add_parser(
        "roundness",
        help=about,
        description="Read a turn of a form tester, filter it, fit a reference circle, and decide on a limit.",
        epilog="Columns are given as NAME:UNIT, or as NAME where the file has the unit; lengths in mm, or "
        "with a unit, which limits and noise must have: 2.5um. Exit status: 0 done, 1 a limit is rejected or "
        "not decided, 2 wrong input.",
    )
    _add_data(parser)
    _add_evaluation(parser)
    _add_decision(parser)
    parser.set_defaults(work=work)


def _add_data(parser: Any) -> None:
    """What is read: the file, its columns, and what they are of."""
    parser.add_argument("file", type=Path, metavar="ring.csv", help="text, .tdms, .h5 or .x3p")
    parser.add_argument("--angle", metavar="NAME:UNIT", help="column of the spindle angle (the only one)")
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument("--deviation", metavar="NAME:UNIT", help="column of deviations from the radius")
    shown.add_argument("--reading", metavar="NAME:UNIT", help="column of radial positions")
    parser.add_argument("--section", metavar="NAME=WORD", help="column of sections, and which of them")
    parser.add_argument("--radius", metavar="R", help="nominal radius of deviations")
    parser.add_argument(
        "--centred", action="store_true", help="deviations from the tester's own circle, of unknown radius"
    )
    parser.add_argument("--tip-radius", metavar="R", help="radius of the probe's tip (0)")
    parser.add_argument("--internal", action="store_true", help="a bore, read from within")
    parser.add_argument(
        "--noise-sd", metavar="SD", help="standard deviation of a reading (found in the readings)"
    )
    parser.add_argument(
        "--remove-asperities", action="store_true", help="take dust and burrs out, and say so"
    )


def _add_evaluation(parser: Any) -> None:
    """How it is evaluated: filter and circle."""
    parser.add_argument("--filter", choices=_FILTERS, default="gaussian", help="filter (gaussian)")
    parser.add_argument(
        "--upr",
        metavar="UPR",
        help="cut-off in undulations per revolution: the filter keeps longer waves, with fewer a turn; or a "
        "band LOW-HIGH: 15-150 keeps waves of 15 to 150 a turn, 15- those from 15 on (50)",
    )
    parser.add_argument("--circle", choices=_CIRCLES, default="LSC", help="reference circle (LSC)")


def _add_decision(parser: Any) -> None:
    """What is decided and compared, by which tester, and the sheet."""
    parser.add_argument("--limit", metavar="RONT", help="limit of RONt: accepted, rejected or not decided")
    parser.add_argument(
        "--harmonic-limit",
        metavar="UPR=LENGTH",
        action="append",
        default=[],
        help="largest amplitude before the filter of one harmonic, 42=0.05um: that of 42 waves a turn; or of "
        "each in a band LOW-HIGH, 2-15=0.5um: those of 2 to 15; repeatable",
    )
    parser.add_argument(
        "--before",
        type=Path,
        metavar="before.csv",
        help="the same ring before grinding, with the same columns",
    )
    parser.add_argument("--rotation", metavar="ANGLE", help="turn of the part since --before (found)")
    parser.add_argument("--instrument", type=Path, metavar="t.toml", help="errors of the tester")
    parser.add_argument(
        "--height", metavar="H", help="height of the section above the table, for --instrument"
    )
    parser.add_argument("--report", type=Path, metavar="ring.html", help="write the sheet to sign")


def work(arguments: argparse.Namespace) -> int:
    """Carry out the command and return the exit status: 0, or 1 where a limit is not known to be kept."""
    Outlook.alone("roundness").foretell()
    with spoken():
        return _carried_out(arguments)


def _carried_out(arguments: argparse.Namespace) -> int:
    """Find the facts, print them and write the sheet."""
    lengths = {name: options.length(name, getattr(arguments, name.replace("-", "_"))) for name in _LENGTHS}
    facts = _facts(arguments, lengths)
    print("\n".join(facts.lines()))
    if arguments.report is not None:
        print(f"sheet   {facts.report(arguments.report)}")
    return OK if facts.accepted else FAILED


def _facts(arguments: argparse.Namespace, lengths: dict[str, float | None]) -> Facts:
    if arguments.centred and arguments.radius is not None:
        rule = "--centred must be left out with --radius, as the radius is known then"
        raise ValueError(f"{rule}; got {arguments.radius!r}")
    limits, rotation = options.harmonic_limits(arguments.harmonic_limit), options.rotation(arguments.rotation)
    if rotation is not None and arguments.before is None:
        raise ValueError(f"--rotation must be given with --before; got {arguments.rotation!r}")
    if arguments.height is not None and arguments.instrument is None:
        needed = "--height must be given with --instrument, whose spindle may err with it"
        raise ValueError(f"{needed}; got {arguments.height!r}")
    profile = _profile(arguments.file, arguments, lengths)
    harmonics = profile.harmonics(_highest(limits), limits=limits) if limits else None
    form = _filtered(profile, arguments)
    change = None
    if arguments.before is not None:
        earlier = _filtered(_profile(arguments.before, arguments, lengths), arguments)
        change = form.compare(earlier, rotation=rotation)
    circle = form.roundness(arguments.circle)
    tester = None if arguments.instrument is None else _instrument(arguments.instrument)
    without = tester is None or circle.why_no_budget
    budget = None if without else circle.budget(tester, height=lengths["height"])
    return Facts(profile, circle, lengths["limit"], budget, tester, lengths["height"], harmonics, change)


def _profile(file: Path, arguments: argparse.Namespace, lengths: dict[str, float | None]) -> Any:
    """A turn with its given noise, without asperities if that is asked for."""
    from centering.roundness import Profile

    columns = {name: options.column(getattr(arguments, name)) for name in ("angle", "deviation", "reading")}
    columns["angle"] = columns["angle"] or options.only_angle(file)
    shape = {"tip_radius": lengths["tip-radius"] or 0.0, "internal": arguments.internal}
    if arguments.section is not None:
        columns["section"] = options.section(arguments.section)
    radius = {"radius": lengths["radius"], "centred": arguments.centred}
    profile = Profile.read(file, **radius, **columns, **shape)
    if lengths["noise-sd"] is not None:
        profile = profile.with_noise_sd(lengths["noise-sd"])
    return profile.remove_asperities() if arguments.remove_asperities else profile


def _highest(limits: dict[int | tuple[int, int], float]) -> int:
    return max(key if isinstance(key, int) else max(key) for key in limits)


def _filtered(profile: Any, arguments: argparse.Namespace) -> Any:
    if arguments.filter == _UNFILTERED:
        if arguments.upr is not None:
            raise ValueError(f"--upr must be left out with --filter none; got {arguments.upr!r}")
        return profile
    upr = _UPR if arguments.upr is None else options.passed(arguments.upr)
    return profile.filter(arguments.filter, upr=upr)


def _instrument(path: Path) -> Any:
    """The instrument of a file: its keys, or those of its table [instrument]."""
    from centering.roundness import Instrument
    from hwsim.command._toml import read

    return read(path, lambda table: (table.table(_TABLE) if table.has(_TABLE) else table).one(Instrument))
