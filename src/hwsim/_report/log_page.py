"""The page of a log: verdict, worst parts, planned and realised, pictures, all parts, problem, origin."""

import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from hwsim._report.charged import (
    FAULTS,
    FLAGS,
    Charges,
    charges_of,
    events_of,
    least_of,
    likeness,
    meanings_of,
    ranked_by,
    values_of,
    worst_parts,
)
from hwsim._report.comparison import comparison
from hwsim._report.every_part import every_part, outcomes
from hwsim._report.file_page import each_part, of_file
from hwsim._report.job import JOB, digests_table, job_of
from hwsim._report.releases import missed_releases
from hwsim._report.statistics import Promise, counted_share, mean
from hwsim._report.worst import broken_off, ranked, worst_part
from hwsim._report.worst_drawn import worst_picture
from sdpgrind.base.brief import counted, listed
from sdpgrind.base.checks import Floats
from sdpgrind.base.sheets import page
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import (
    AmountTable,
    Block,
    Embedded,
    Heading,
    Listing,
    Picture,
    Sentences,
    scales_of,
)
from sdpgrind.base.sheets.origin import problem_blocks, versions_table
from sdpgrind.base.sheets.record_page import SIGNATURE

_WORST = 3  # parts with a picture of their own; chosen: they show whether the worst is alone


def report(
    log: Any,
    path: str | os.PathLike[str] | None,
    plan: Any = None,
    problem: Any = None,
    doubts: Any = None,
    *,
    title: str = "",
    command: Mapping[str, Any] | None = None,
    pictures: bool = True,
) -> str:
    """Write the page of a log, or return its text; `command`: the command line that ran it."""
    if problem is None and plan is not None:
        problem = plan.problem
    blocks = _blocks(log, plan, problem, command, doubts)
    kept = (block for block in blocks if pictures or not isinstance(block, Picture))
    return page.report(title or _title(log), kept, path)


def _title(log: Any) -> str:
    if "controller" in log.outcome.dims:
        return f"{listed([str(name) for name in log.outcome.controller.values])} compared: {_parts(log)}"
    return _parts(log)


def _parts(log: Any) -> str:
    return f"{counted(len(log), 'part')} on {log.outcome.attrs.get('plant', 'data')}"


def _blocks(
    log: Any, plan: Any, problem: Any, command: Mapping[str, Any] | None, doubts: Any
) -> Iterator[Block]:
    source = getattr(log, "source", None)
    if "controller" in log.outcome.dims:
        yield from comparison(log)
    elif source is not None:
        yield from of_file(log)
        yield from every_part(log, each_part) if len(log) > 1 else ()
    else:
        yield from _of_run(log, plan, burns=getattr(problem, "burn_limit", True) is not None)
    if problem is not None:
        stored = getattr(plan, "dataset", None)
        yield from problem_blocks(problem, None if stored is None else stored.attrs.get("problem"))
    if source is not None:
        yield Heading("Source of the data")
        yield Listing(str(source))
    if doubts is not None:
        yield Heading(f"Doubts: {doubts.subject}")
        yield from doubts._figures()
    job = job_of(log, plan, command)
    yield Heading("Origin")
    yield digests_table(job)
    yield versions_table()
    yield Embedded(JOB, job)
    yield SIGNATURE


def _of_run(log: Any, plan: Any, *, burns: bool) -> Iterator[Block]:
    """What stands on the page of a run with one controller, up to the problem; `burns`: it has a limit."""
    charges = charges_of(log, plan)
    compared = _compared(log, charges)
    yield Sentences(list(_verdict(log, charges, burns)), strong=True)
    yield Heading("Worst parts")
    yield _worst(log, charges)
    worst = worst_parts(log, charges.names, _WORST)
    if len(log) > len(worst):
        yield worst_picture(log, worst, ranked_by(log, charges.names))
    if compared.amounts:
        yield Heading("Planned and realised")
        yield compared
        yield from _explained(log, charges)
    yield Heading("Pictures")
    yield Picture(f"All {len(log)} parts" if len(log) > 1 else "The part", log.plot)
    if plan is not None and callable(getattr(plan, "plot", None)):
        yield Picture("The plan", plan.plot)
    yield from every_part(log, outcomes)
    if told := meanings_of(log):
        yield Sentences(told)


def _verdict(log: Any, charges: Charges, burns: bool) -> Iterator[str]:
    """What ran, what came of it against the limits, and the first charged figure."""
    outcome, why = log.outcome, broken_off(log.outcome)
    by = f" by {outcome.attrs['controller']}" if "controller" in outcome.attrs else ""
    broken = [each for each in why if each]
    told = ", ".join(f"{broken.count(each)} {each}" for each in dict.fromkeys(broken))
    state = f"{len(broken)} broken off ({told})" if broken else "all finished"
    yield f"{_parts(log)}{by}: {state}"
    if late := missed_releases(log):
        yield late
    yield from events_of(log)
    if faults := [f"{FAULTS[name]}: {_count(log, name, burns)}" for name in FAULTS if name in outcome]:
        yield "; ".join(faults)
    if charges.names and np.isfinite(values_of(log, charges.names[0])).any():
        yield _first_figure(log, charges)


def _count(log: Any, name: str, burns: bool) -> str:
    """Number of parts with a fault, in words."""
    if name == "burned" and not burns:
        return "not known, the problem has no burn limit"
    bad = int(np.sum(log.outcome[name].values > 0))
    known = log.outcome.attrs.get("burn_threshold") if name == "burned" else None
    told = f" (burn threshold {known})" if known else ""
    if name == "overground" and "overground_worst" in log.outcome:  # a bead that is not level
        told = f" (on average over the bead: {int(np.sum(log.outcome.height.values < 0)) or 'none'})"
    return (f"{bad} of {len(log)}" if bad else "none") + told


def _first_figure(log: Any, charges: Charges) -> str:
    name = charges.names[0]
    values, unit = values_of(log, name), str(log.outcome[name].attrs.get("units", ""))
    scale = scales_of([AmountTable("", [Amounts.of(name, values, unit)])])[name, unit]
    after = "" if scale[1] in ("", "1") else f" {scale[1]}"
    planned, worst = charges.planned.get(name), worst_part(name, values)
    cells = [mean(values, least_of(name)), planned.mean if planned else "", float(values[worst or 0])]
    shown = [_with_unit(cell, after) for cell in Amounts.of(name, cells, unit).cells(scale)]
    text = f"{name.replace('_', ' ')} {shown[0]}" + " a part" * (not shown[0].endswith("part"))
    if planned:
        text += f", planned {shown[1]}"
    return text if worst is None else f"{text}; worst {shown[2]}, part {worst}"


def _with_unit(shown: str, after: str) -> str:
    """A cell with its unit, which stands before words."""
    value, *known = shown.split(" ", 1)
    return f"{value}{after} {known[0]}" if known and not known[0].startswith("±") else shown + after


def _worst(log: Any, charges: Charges) -> AmountTable:
    """For each charged outcome the worst value, its part, median and mean."""
    faults = [name for name in FAULTS if name in log.outcome and np.any(log.outcome[name].values)]
    rows = []
    for name in (*charges.names, *faults):
        values, unit = values_of(log, name), str(log.outcome[name].attrs.get("units", ""))
        known, number = values[np.isfinite(values)], worst_part(name, values)
        if known.size:
            shown = float(known[0]) if number is None else float(values[number])
            part = "all alike" if number is None else ", ".join(map(str, ranked(name, values, _WORST)))
            cells = [shown, part, float(np.median(known)), mean(values, least_of(name))]
            flagged = ["yes", _flagged(values), "–", counted_share(values)]
            rows.append(Amounts.of(name, flagged if name in FLAGS else cells, unit))
    return AmountTable(
        "Each figure over all parts (interval of the mean: 95 %)",
        rows,
        ("figure", "worst", "worst parts", "median", "mean"),
    )


def _flagged(values: Floats) -> str:
    """Numbers of the first parts with a flag."""
    parts = np.flatnonzero(values > 0)
    return ", ".join(map(str, parts[:_WORST])) + (" …" if parts.size > _WORST else "")


def _compared(log: Any, charges: Charges) -> AmountTable:
    rows = []
    for name, planned in charges.planned.items():
        values, unit = values_of(log, name), str(log.outcome[name].attrs.get("units", ""))
        if np.isfinite(values).any():
            amounts = planned.mean, mean(values, least_of(name)), planned.difference(values)
            rows.append(Amounts.of(name, [*amounts, _judged(planned, values)], unit))
    heads = ("figure", "planned", "realised", "difference", "beyond the interval")
    return AmountTable("Mean over the parts, 95 % intervals", rows, heads)


def _judged(planned: Promise, values: Floats) -> str:
    """Verdict on a mean that was planned."""
    count = int(np.isfinite(values).sum())
    if count == 1:
        return "one value"
    if planned.differs(values):
        return "differs"
    return "as planned" if planned.told(values) else f"not told by {count} parts"


def _explained(log: Any, charges: Charges) -> Iterator[Block]:
    """A sentence for each figure that differs from the plan."""
    different = [n for n, planned in charges.planned.items() if planned.differs(values_of(log, n))]
    if not different:
        several = "Nothing differs from the plan by more than the 95 % interval."
        yield Sentences([several if len(log) > 1 else "One part does not tell a difference from chance."])
        return
    known = charges.reasons()
    lines = [
        f"{name.replace('_', ' ')}: {known.get(name) or likeness(log, name) or 'the log shows no reason'}."
        for name in different
    ]
    yield Sentences(lines)
