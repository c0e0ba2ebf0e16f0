"""Doubts about the model of a locus: each of its fields against the measured responses."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.doubts import gauge
from sdpgrind.base.doubts.assumed import reader_of
from sdpgrind.base.doubts.record import Doubts
from sdpgrind.base.doubts.rows import compared, numbers, untold
from sdpgrind.base.doubts.words import amount
from sdpgrind.base.tables import command_in, table_of
from sdpgrind.identify import Estimate
from sdpgrind.locus._doubts import cost, sets
from sdpgrind.locus._doubts.sets import FieldRow
from sdpgrind.locus._identify import identify, moved
from sdpgrind.locus._problem.problem import Problem

_FACTS = ("wheel_diameter", "work_diameter", "width", "wheel_speed")
_FACT = "the drawing or the machine; responses show it only mixed with the coefficients"
_SAME = 1e-9  # chosen: relative; less is rounding
_EXACT = 1e-9  # chosen: rest of a response over its size; less is rounding
_UNMOVED = "another response: those that were measured do not depend on it"


def doubts(problem: Problem, data: Any) -> Doubts:
    """Compare a problem with measured responses; see `Problem.doubts`."""
    table, _ = table_of(data, "controller")
    measured = [name for name in problem.responses if name in table]
    if not measured:
        known, held = ", ".join(problem.responses), ", ".join(map(str, table)) or "nothing"
        raise ValueError(f"data must hold a response, {known}; they hold {held}")
    fields = numbers(problem.model)
    alone = {each[0]: _row(problem, data, *each) for each in fields}
    each = [
        _explained(problem, data, table, name, [alone[field] for field in of])
        for name, of in _by_response(problem, fields, measured).items()
    ]
    found = alone | {one.row.name: one for explained in each for one in explained.rows}
    reader = reader_of(data, table)
    pairs = [pair for explained in each for pair in explained.pairs]
    figure, stakes, planned = cost.of_plan(problem, list(found.values()), pairs)
    sentences = [
        *dict.fromkeys(words for explained in each for words in explained.sentences),
        *_readings(problem, table, measured),
        *_ranges(problem, table, planned),
    ]
    rows = [one.row for one in found.values()]
    subject = f"optimal locus, {np.size(table[measured[0]])} rows of {' and '.join(measured)}"
    return Doubts(subject, (*rows, *reader.rows), sentences, None, figure, stakes)


def _row(problem: Problem, data: Any, name: str, unit: str, believed: float) -> FieldRow:
    """Row of one field, all others as believed, and its estimate."""
    if name in _FACTS:
        return FieldRow(untold(name, unit, believed, _FACT))
    try:
        estimate = _identified(problem, data, (name,))
    except ValueError as error:
        return FieldRow(untold(name, unit, believed, str(error)))
    row = compared(estimate, name, believed, note="all others as believed")
    return FieldRow(row._replace(note=_UNMOVED) if sets.unmoved(estimate) else row, estimate)


def _identified(problem: Problem, data: Any, names: Sequence[str]) -> Estimate:
    return identify(data, names, problem=problem, throw=False)


class _Explained(NamedTuple):
    """Rows of the fields that one response tells, pairs that explain it, and sentences."""

    rows: list[FieldRow]
    pairs: list[Estimate]
    sentences: list[str]


def _by_response(problem: Problem, fields: Sequence[Any], measured: Sequence[str]) -> dict[str, list[str]]:
    """Names of the fields that move one measured response alone, by its name."""
    found: dict[str, list[str]] = {name: [] for name in measured}
    for name, *_ in fields:
        of = [each for each in moved(problem, name) if each in found]
        if len(of) == 1 and name not in _FACTS:
            found[of[0]].append(name)
    return found


def _explained(
    problem: Problem, data: Any, table: Any, response: str, alone: Sequence[FieldRow]
) -> _Explained:
    """What explains a response of the fields that move no other one."""
    read, fit = np.asarray(table[response], dtype=float), partial(_identified, problem, data)
    least = _EXACT * float(np.nanmax(np.abs(read), initial=0.0))
    by = sets.explaining(alone, fit, least, int(np.isfinite(read).sum()))
    rows = [sets.told_along(each, by, fit) for each in alone]
    pairs = by if by and len(by[0].names) > 1 else []
    return _Explained(rows, pairs, sets.sentences(alone, by, response, problem.unit(response)))


def _readings(problem: Problem, table: Any, measured: list[str]) -> list[str]:
    """Sentences on clipped readings and the step of each response."""
    found = []
    for name in measured:
        values, unit = np.asarray(table[name], dtype=float), problem.unit(name)
        found.append(gauge.clipped_sentence(name, unit, values))
        if step := gauge.step_of(values):
            found.append(f"{name} was read in steps of {amount(step, unit)}.")
    return [sentence for sentence in found if sentence]


def _ranges(problem: Problem, table: Any, planned: Mapping[str, float]) -> list[str]:
    """Sentences on controls and hidden states beyond their ranges, or the plan beyond them; on those held."""
    found, still, beyond = [], [], []
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
        if most - least <= _SAME * abs(most):
            still.append(name)
        if name in planned and not least * (1 - _SAME) <= planned[name] <= most * (1 + _SAME):
            span = " to ".join(dict.fromkeys(f"{end:.3g}" for end in (least, most)))
            at, read = (f"{words} {problem.unit(name)}".rstrip() for words in (f"{planned[name]:.3g}", span))
            beyond.append(f"{name} of the plan, {at}, is beyond the readings, {read}")
    if still:
        found.append(f"{' and '.join(still)} never changed: a second level would tell apart what acts alike.")
    if beyond:
        found.append(f"{'; '.join(beyond)}: there its responses rest on the law alone.")
    return found
