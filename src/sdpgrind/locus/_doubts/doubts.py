"""Doubts about the model of a locus: each of its fields against the measured responses."""

from typing import Any

import numpy as np

from sdpgrind.base.doubts import gauge
from sdpgrind.base.doubts.advice import to_plan_with
from sdpgrind.base.doubts.assumed import reader_of
from sdpgrind.base.doubts.record import Doubts
from sdpgrind.base.doubts.rows import Doubt, compared, numbers, untold
from sdpgrind.base.doubts.words import amount
from sdpgrind.base.tables import command_in, table_of
from sdpgrind.identify import Estimate, Status
from sdpgrind.locus._doubts import cost
from sdpgrind.locus._identify import identify
from sdpgrind.locus._problem.problem import Problem

_FACTS = ("wheel_diameter", "work_diameter", "width", "wheel_speed")
_FACT = "the drawing or the machine; responses show it only mixed with the coefficients"
_UNMOVED = "another response: those that were measured do not depend on it"


def doubts(problem: Problem, data: Any) -> Doubts:
    """Compare a problem with measured responses; see `Problem.doubts`."""
    table, _ = table_of(data, "controller")
    measured = [name for name in problem.responses if name in table]
    if not measured:
        known, held = ", ".join(problem.responses), ", ".join(map(str, table)) or "nothing"
        raise ValueError(f"data must hold a response, {known}; they hold {held}")
    found = [_row(problem, data, *each) for each in numbers(problem.model)]
    rows = [row for row, _ in found]
    reader = reader_of(data, table)
    figure, stakes = cost.of_plan(problem, rows)
    sentences = [
        *_best(problem, found, measured),
        *_readings(problem, table, measured),
        *_ranges(problem, table),
    ]
    subject = f"optimal locus, {np.size(table[measured[0]])} rows of {' and '.join(measured)}"
    return Doubts(subject, (*rows, *reader.rows), sentences, None, figure, stakes)


def _row(problem: Problem, data: Any, name: str, unit: str, believed: float) -> tuple[Doubt, Estimate | None]:
    """Row of one field, all others as believed, and its estimate."""
    if name in _FACTS:
        return untold(name, unit, believed, _FACT), None
    try:
        estimate = identify(data, name, problem=problem, throw=False)
    except ValueError as error:
        return untold(name, unit, believed, str(error)), None
    row = compared(estimate, name, believed, note="all others as believed")
    loose = estimate.status is Status.UNDETERMINED
    return (row._replace(note=_UNMOVED) if loose else row), estimate


def _best(problem: Problem, found: list[tuple[Doubt, Estimate | None]], measured: list[str]) -> list[str]:
    """Sentences on what the intervals rest on, and on the field that explains the readings best."""
    told = [(row, estimate) for row, estimate in found if row.measured and estimate is not None]
    if not told:
        return []
    words = [
        "Each value is told with all others as believed, so one wrong value makes several differ: take over"
        " one, not all."
    ]
    differ = [each for each in told if each[0].verdict == "differs"]
    if not differ or len(measured) != 1:
        return words
    row, estimate = min(differ, key=lambda each: each[1].noise_sd)
    left = amount(estimate.noise_sd, problem.unit(measured[0]))
    words.append(
        f"Of those that differ, {row.name} alone explains {measured[0]} best (sd of the rest {left})."
    )
    return words + to_plan_with([f'locus.identify(log, "{row.name}", problem=problem)'])


def _readings(problem: Problem, table: Any, measured: list[str]) -> list[str]:
    """Sentences on clipped readings and the step of each response."""
    found = []
    for name in measured:
        values, unit = np.asarray(table[name], dtype=float), problem.unit(name)
        found.append(gauge.clipped_sentence(name, unit, values))
        if step := gauge.step_of(values):
            found.append(f"{name} was read in steps of {amount(step, unit)}.")
    return [sentence for sentence in found if sentence]


def _ranges(problem: Problem, table: Any) -> list[str]:
    """Sentences on controls and hidden states beyond their ranges, and on those that never changed."""
    found, still = [], []
    for name, (low, high) in {**problem.controls, **problem.hidden}.items():
        if command_in(table, name) not in table:
            continue
        values = np.asarray(table[command_in(table, name)], dtype=float)
        least, most = float(np.nanmin(values)), float(np.nanmax(values))
        if least < low or most > high:
            unit = problem.unit(name)
            found.append(
                f"{name} was {least:.4g} to {most:.4g} {unit}; the problem allows {low:.4g} to {high:.4g}."
            )
        if most - least <= 1e-9 * abs(most):
            still.append(name)
    if still:
        found.append(f"{' and '.join(still)} never changed: a second level would tell apart what acts alike.")
    return found
