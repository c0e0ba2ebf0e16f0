"""Sheet of a roundness, to sign: decisions, parameters, how it was measured, budget, pictures, origin."""

import os
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from centering.roundness._budget import HEADS, Budget
from centering.roundness._circle_noise import amplitude_sd, even_noise, is_even_noise, waves_of
from centering.roundness._deviations_about import KINDS
from centering.roundness._form_change import FormChange
from centering.roundness._harmonic_limits import limits_of
from centering.roundness._harmonic_verdicts import harmonic_verdicts, split_limits
from centering.roundness._harmonics import Harmonics, above_noise
from centering.roundness._profile_sheet import FORM, limit_of
from centering.roundness._ront_verdict import told_ront, without_interval
from centering.roundness._roundness import Roundness
from centering.roundness._roundness_interval import RoundnessInterval
from centering.roundness._spindle_error import told_lost
from sdpgrind.base.columns.source import Source
from sdpgrind.base.sheets import page
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Block, Embedded, Heading, Listing, Picture, Sentences
from sdpgrind.base.sheets.origin import versions, versions_table
from sdpgrind.base.sheets.record_page import SIGNATURE, arrays_digest
from sdpgrind.base.units import UM

_LARGEST = 8  # undulations in a table; chosen: as on the page of a profile
_METHODS = {
    "calibrated": "noise drawn about the harmonics that stand out of it, factors by simulation",
    "guaranteed": "holds for every form, without an assumption on it",
}


class _Sheet(NamedTuple):
    """Limits of parameters (mm), harmonics after the filter and before it, budget or why none, and more."""

    limits: Mapping[str, float]
    after: Harmonics | None
    before: Harmonics | None
    budget: Budget | None
    why_no_budget: str
    change: FormChange | None
    source: Source | None


def report(
    circle: Roundness,
    path: str | os.PathLike[str] | None,
    limits: Mapping[Any, float] | None,
    budget: Budget | None,
    before: Harmonics | None = None,
    change: FormChange | None = None,
    why_no_budget: str = "",
) -> str:
    """Write the sheet of a circle, or return its text; `before`: harmonics before the filter."""
    named, waves = split_limits(limits)
    given = {name: limit_of(name, each, FORM) for name, each in named.items()}
    if before is not None and waves:
        which = next(iter(waves))
        raise ValueError(f"limits[{which!r}] must be one of harmonics=, which have limits of their own")
    source = Source.from_json(circle.origin.source) if circle.origin.source else None
    sheet = _Sheet(given, _harmonics(circle, waves), before, budget, why_no_budget, change, source)
    return page.report(_title(source), _blocks(circle, sheet), path)


def _title(source: Source | None) -> str:
    names = [] if source is None else [note.name for note in source.files if note.sha256]
    return f"Roundness: {', '.join(names)}" if names else "Roundness"


def _blocks(circle: Roundness, sheet: _Sheet) -> Iterator[Block]:
    ends = _ends(circle, sheet.budget)
    verdicts = [*_verdicts(circle, sheet), *_waves(circle, sheet)]
    yield Sentences(verdicts or [told_ront(circle.kind, circle.ron_t, ends)], strong=True)
    if remarks := (circle if sheet.budget is None else sheet.budget).remarks:
        yield Sentences(remarks)
    yield _parameters(circle, ends)
    yield Sentences([*_no_budget(sheet), _interval_sentence(circle, ends, sheet.budget)])
    yield Picture(f"Profile about the {KINDS[circle.kind]} ({circle.kind})", circle.plot)
    yield from _change(sheet.change)
    yield Heading("How it was measured")
    yield _circle_table(circle)
    yield Sentences([circle.certificate, *_corrections(circle)])
    yield from _undulations(sheet, " after the filter" if circle.filter else "")
    if sheet.budget is not None:
        yield from _budget_blocks(sheet.budget)
    yield Heading("Origin")
    yield Listing(str(sheet.source) if sheet.source else "not read from a file: arrays of a program")
    yield from _origin(circle)
    yield SIGNATURE


def _waves(circle: Roundness, sheet: _Sheet) -> list[str]:
    """Sentences on limits of harmonics; after a filter which side of it they are of."""
    pairs = ((sheet.after, "after"), (sheet.before, "before"))
    return [
        f"{told} ({side} the filter)" if circle.filter else told
        for found, side in pairs
        for told in harmonic_verdicts(found)
    ]


def _change(change: FormChange | None) -> Iterator[Block]:
    """What grinding changed."""
    if change is None:
        return
    yield Heading("Before and after")
    yield Sentences([change._told()])
    yield from change._figures()
    yield Picture("Forms before and after, and their amplitudes", change.plot)


def _ends(circle: Roundness, budget: Budget | None) -> RoundnessInterval | None:
    """Interval of RONt by all that is known; None where no method is."""
    if budget is not None:
        return budget.interval()
    return circle._usual


def _verdicts(circle: Roundness, sheet: _Sheet) -> list[str]:
    """Sentence on each limit; only RONt has an interval."""
    found = []
    for name, limit in sheet.limits.items():
        if name == "RONt":
            told = (sheet.budget or circle).verdict(limit)
            by = "(by noise alone)" if sheet.budget is None else "(ISO 14253-1)"
            found.append(told if circle.why_no_interval and sheet.budget is None else f"{told} {by}")
        else:
            value = getattr(circle, FORM[name])
            size = f"{name} ({circle.kind}) {UM * value:.4g} µm, limit {UM * limit:.4g} µm"
            found.append(f"{size}: {without_interval(value, limit)}")
    return found


def _no_budget(sheet: _Sheet) -> list[str]:
    """Sentence on why the budget of a tester was left out."""
    return [f"uncertainty budget left out: {sheet.why_no_budget}"] if sheet.why_no_budget else []


def _parameters(circle: Roundness, ends: RoundnessInterval | None) -> AmountTable:
    rows = [(name, f"{UM * getattr(circle, field):.4g}") for name, field in FORM.items()]
    if ends is not None:
        rows.append(("RONt without the lift of noise", ends.middle))
        rows.append(("95 % interval of RONt", ends.ends))
    return AmountTable(
        "Parameters (ISO 12181-1)", [Amounts.of(name, [value]) for name, value in rows], ("parameter", "µm")
    )


def _interval_sentence(circle: Roundness, ends: RoundnessInterval | None, budget: Budget | None) -> str:
    """How the interval was found."""
    if ends is None:
        return circle.why_no_interval
    of_what = (
        "noise, form and tester"
        if budget is not None
        else "noise and form; the tester's errors are not in it"
    )
    return f"95 % interval by {of_what}. Method {ends.method}: {_METHODS[ends.method]}."


def _circle_table(circle: Roundness) -> AmountTable:
    contacts = ", ".join(sorted(map(_degrees, circle.contact_angles), key=float))
    tip = f"{abs(circle.tip_radius):g}" if circle.tip_radius else "not given"
    radius = f"{circle.radius:.8g}" if circle.origin.radius_known else "not known"
    noise = f"{UM * np.sqrt(np.mean(circle.noise_sd**2)):.3g}" if circle.noise_sd.size else "not known"
    rows = [
        Amounts.of("circle", [f"{circle.kind}, {KINDS[circle.kind]}"]),
        Amounts.of("radius", [radius], heading="radius [mm]"),
        Amounts.of("offset", [f"{UM * circle.offset:.4g}"], heading="centre from the spindle's axis [µm]"),
        Amounts.of("direction", [_degrees(circle.offset_angle)], heading="direction of the centre [degrees]"),
        *([Amounts.of("contacts", [contacts], heading="contacts [degrees]")] if contacts else []),
        Amounts.of("filter", [circle.filter or "none: all undulations"]),
        Amounts.of("points", [len(circle.points)]),
        Amounts.of("tip", [tip], heading="radius of the tip [mm]"),
        Amounts.of("noise", [noise], heading="standard deviation of a deviation by noise [µm]"),
    ]
    return AmountTable("Circle, filter and points", rows, ("what", "is"))


def _degrees(angle: float) -> str:
    """An angle (rad) within a turn, from 0 on, to a tenth of a degree."""
    return f"{round(np.degrees(angle) % 360, 1) % 360:.1f}"


def _corrections(circle: Roundness) -> list[str]:
    """Steps of the profile, and what a separation has lost."""
    lost = told_lost(np.array(circle.origin.lost, dtype=int))
    separated = circle.origin.separated or circle.origin.spindle_sd
    spindle = f"spindle's error separated, {lost}" if separated else "spindle's error not separated"
    return [*(f"step: {step}" for step in circle.origin.steps), f"corrections: {spindle}"]


def _harmonics(circle: Roundness, limits: Mapping[Any, float]) -> Harmonics | None:
    """Harmonics that the filter leaves, held against limits (mm), where the filtered turn is even."""
    if not (circle.noise_sd.size and is_even_noise(circle)):
        if limits:
            raise ValueError(
                f"limits[{next(iter(limits))!r}]: harmonics are told of a filtered even turn alone"
            )
        return None
    upr = np.arange(2, even_noise(circle, 0).most + 1)  # that the filter leaves
    waves = waves_of(circle)[upr - 2]
    sd = amplitude_sd(circle)[upr]
    return Harmonics(
        upr.astype(float), np.abs(waves), -np.angle(waves), sd, limits=limits_of("limits", limits)
    )


def _undulations(sheet: _Sheet, after: str) -> Iterator[Block]:
    """The largest undulations that the filter leaves; pictures of both sides of it."""
    if sheet.after is None and sheet.before is None:
        return
    yield Heading("Undulations")
    if sheet.after is not None:
        largest = above_noise(sheet.after, _LARGEST)
        yield AmountTable(
            f"Largest amplitudes{after}, above the noise (half of the height from valley to peak)",
            [
                Amounts.of("upr", [int(upr) for upr, _ in largest], heading="undulations per revolution"),
                Amounts.of("amplitude", [size for _, size in largest], "mm"),
            ],
        )
        yield Picture(f"Amplitudes{after}; grey: what noise alone exceeds in one of 20", sheet.after.plot)
    if sheet.before is not None:
        yield Picture("Amplitudes before the filter; red: their limits", sheet.before.plot)


def _budget_blocks(budget: Budget) -> Iterator[Block]:
    """Table of the sources, totals of both laws, worst case of the spindle."""
    yield Heading("Uncertainty budget (GUM)")
    columns = zip(*budget.cells, strict=True)
    yield AmountTable(
        "Contributions to the standard uncertainty of RONt; half width of a normal law: that of 95 %",
        [Amounts.of(head, column) for head, column in zip(HEADS, columns, strict=True)],
    )
    yield Sentences(
        [
            f"standard uncertainty: {UM * budget.sd:.3g} µm by Monte Carlo (Supplement 1),"
            f" {UM * budget.linear_sd:.3g} µm by the linear law",
            *_worst(budget),
        ]
    )


def _worst(budget: Budget) -> list[str]:
    """Sentence on the worst case of a spindle whose error was not taken off."""
    if not (most := budget.spindle_bound):
        return []
    worst = budget.worst_case().ends
    return [
        f"the spindle changes RONt by {UM * most:.3g} µm at most, up or down: {worst} µm in the worst case"
    ]


def _origin(circle: Roundness) -> Iterator[Block]:
    """Versions, digest of the points, and both for a program."""
    digest = arrays_digest(circle._written())
    yield versions_table()
    yield Sentences([f"sha256 of the arrays: {digest}"])
    yield Embedded("plan", {"kind": circle._file_kind(), "arrays": digest, "options": None, **versions()})
